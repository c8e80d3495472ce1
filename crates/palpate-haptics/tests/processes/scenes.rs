//! Small scenes for the tests.

use glam::DVec3;
use palpate::{
    Coupling, DeviceMode, DeviceParameters, Model, ModelObject, ModelParameters, Obstacle, Pose, State,
};
use palpate_haptics::{Columns, DevicePort, ForceProcess, MotionPath, PoseTrajectory, SceneMotion, port};
use palpate_testkit::{finger, floor, free_block, half_extent, start_at};
use std::sync::Arc;

/// Step of all scenes [s].
pub const STEP_S: f64 = 1e-3;

/// Half width of the recorded body along x [m].
pub fn half_width(model: &Model) -> f64 {
    half_extent(model.recordings().next().expect("a body"), 0)
}

/// A body at rest in the air, a floor far below, and fingers with a coupling.
pub fn model(fingers: usize, stiffness: f64) -> Arc<Model> {
    let below = Pose { position: DVec3::Y * -10.0, ..Pose::IDENTITY };
    let coupling = Some(Coupling { stiffness, damping: 0.2 });
    let parameters = ModelParameters {
        step_s: STEP_S,
        devices: vec![DeviceParameters { coupling, ..finger(0.004, 0.0, 0.5) }; fingers],
        obstacles: vec![Obstacle { pose: below, ..floor(0.5) }],
        ..ModelParameters::for_reference()
    };
    let body = ModelObject::new(free_block(), start_at(DVec3::ZERO));
    Arc::new(Model::new(parameters, vec![body]).expect("a good model"))
}

/// The force process of a model whose devices all touch, with the devices' ends of its ports.
pub fn process(model: &Arc<Model>) -> (ForceProcess, Vec<DevicePort>) {
    process_from(State::new(model), model)
}

/// Force process at a state of the model, with the devices' ends of its ports.
pub fn process_from(state: State, model: &Arc<Model>) -> (ForceProcess, Vec<DevicePort>) {
    let devices = model.parameters().devices.len();
    let (ends, slots): (Vec<_>, Vec<_>) = (0..devices)
        .map(|_| {
            let (device, force) = port();
            (device, (force, DeviceMode::Touch))
        })
        .unzip();
    let floor = model.parameters().obstacles[0].pose;
    let trajectory: PoseTrajectory = Box::new(move |_| floor);
    let motion = SceneMotion { obstacles: vec![trajectory], ..SceneMotion::default() };
    (ForceProcess::from_state(state, model.clone(), slots, motion, 0.05), ends)
}

/// A path from text.
pub fn path(text: &str) -> MotionPath {
    MotionPath::parse(text, Columns::Position).expect("a good path")
}
