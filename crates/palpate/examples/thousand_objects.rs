//! A thousand blocks fall on floors of their own, on all cores: one immutable model, one state per scene, and the buffers of
//! steps once per thread.

use glam::{DQuat, DVec3};
use palpate::{
    Input, Model, ModelObject, ModelParameters, ObjectSnapshot, ObjectStart, Obstacle, Pose, Recording,
    Shape, State, Twist, Workspace, step_in,
};
use std::sync::Arc;

const OBJECTS: usize = 1000;
const STEPS: usize = 300;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let block = Arc::new(Recording::from_bytes(&std::fs::read("data/recordings/v1/free.palp")?)?);
    let floor = Obstacle { shape: Shape::Plane { normal: DVec3::Y }, pose: Pose::IDENTITY, friction: 0.5 };
    let parameters =
        ModelParameters { gravity: DVec3::Y * -9.81, obstacles: vec![floor], ..ModelParameters::default() };
    let pose = Pose { position: DVec3::Y * 0.2, orientation: DQuat::IDENTITY };
    let start = ObjectStart { pose, twist: Twist::ZERO };
    let model = Model::new(parameters, vec![ModelObject::new(block, start)])?;

    // Every scene starts with another orientation.
    let initial = |number: usize| -> Vec<ObjectSnapshot> {
        let mut snapshots = State::new(&model).snapshots();
        let angle = number as f64 * 0.01;
        snapshots[0].pose.orientation = DQuat::from_scaled_axis(DVec3::new(angle, 0.5 * angle, 0.0));
        snapshots
    };
    let run = |number: usize, workspace: &mut Workspace| {
        let mut state = State::resume(&model, &initial(number));
        for _ in 0..STEPS {
            step_in(&model, &mut state, workspace, &Input::default());
        }
        state.output().objects[0].pose.position.y
    };
    let threads = std::thread::available_parallelism()?.get();
    let before = std::time::Instant::now();
    let heights: Vec<f64> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..threads)
            .map(|worker| {
                let (model, run) = (&model, &run);
                scope.spawn(move || {
                    let mut workspace = Workspace::new(model);
                    (worker..OBJECTS).step_by(threads).map(|at| run(at, &mut workspace)).collect::<Vec<_>>()
                })
            })
            .collect();
        workers.into_iter().flat_map(|worker| worker.join().unwrap_or_default()).collect()
    });
    let mean = heights.iter().sum::<f64>() / heights.len() as f64;
    let rate = (OBJECTS * STEPS) as f64 / before.elapsed().as_secs_f64();
    println!(
        "{} blocks, mean height {mean:.4} m, {rate:.0} steps a second on {threads} threads",
        heights.len()
    );
    Ok(())
}
