//! Parts of scenes: obstacles, fingers, objects and their starts.

use glam::DVec3;
use palpate::{
    DeviceInput, DeviceParameters, Error, Grasp, Input, Model, ModelObject, ModelParameters, ObjectStart,
    Obstacle, Output, Pose, Recording, Shape, State, SurfacePoint, Twist,
};
use std::sync::Arc;

/// Gravitational acceleration [m/s²].
pub const GRAVITY_M_S2: f64 = 9.81;

/// The plane y = 0 with a friction coefficient; objects are above it.
pub fn floor(friction: f64) -> Obstacle {
    Obstacle { shape: Shape::Plane { normal: DVec3::Y }, pose: Pose::IDENTITY, friction }
}

/// A fingertip without coupling: tip radius [m], patch radius [m], friction coefficient.
pub const fn finger(tip_radius: f64, patch_radius: f64, friction: f64) -> DeviceParameters {
    DeviceParameters { tip_radius, patch_radius, friction, coupling: None }
}

/// Rest at a position [m], without rotation.
pub fn start_at(position: DVec3) -> ObjectStart {
    ObjectStart { pose: Pose { position, ..Pose::IDENTITY }, twist: Twist::ZERO }
}

/// An object at a position [m] with a linear velocity [m/s], without rotation.
pub fn object_at(recording: &Arc<Recording>, position: DVec3, velocity: DVec3) -> ModelObject {
    let twist = Twist { linear: velocity, angular: DVec3::ZERO };
    ModelObject::new(recording.clone(), ObjectStart { twist, ..start_at(position) })
}

/// A model with a step [s] and gravity [m/s²].
///
/// # Errors
/// As [`Model::new`].
pub fn scene(
    step_s: f64,
    gravity: DVec3,
    obstacles: Vec<Obstacle>,
    devices: Vec<DeviceParameters>,
    objects: Vec<ModelObject>,
) -> Result<Model, Error> {
    let parameters =
        ModelParameters { step_s, gravity, obstacles, devices, ..ModelParameters::for_reference() };
    Model::new(parameters, objects)
}

/// A model and its initial state.
///
/// # Panics
/// Where [`Model::new`] fails.
pub fn model_and_state(parameters: ModelParameters, objects: Vec<ModelObject>) -> (Model, State) {
    let model = Model::new(parameters, objects).expect("a good model");
    let state = State::new(&model);
    (model, state)
}

/// A grasp of an object at a point of a triangle, with barycentric weights [1].
pub const fn grasp(object: usize, triangle: u32, weights: [f64; 3]) -> Grasp {
    Grasp { object, point: SurfacePoint { triangle, weights } }
}

/// One device that holds a point, at an interface point [m].
pub fn holding(position: DVec3, grasp: Grasp) -> Input {
    Input { devices: vec![DeviceInput::held(position, grasp)], ..Input::default() }
}

/// Devices that touch, at interface points [m].
pub fn touching(positions: &[DVec3]) -> Input {
    Input { devices: positions.iter().map(|&p| DeviceInput::touching(p)).collect(), ..Input::default() }
}

/// Largest coordinate [m] of a body's surface along an axis (0, 1, 2), in its frame.
pub fn half_extent(recording: &Recording, axis: usize) -> f64 {
    recording.surface.positions.iter().map(|p| p[axis]).fold(f64::NEG_INFINITY, f64::max)
}

/// Imbalance of the energy ledger [J] since a stored energy at the start [J]: what is stored beyond work minus losses.
pub fn energy_imbalance(output: &Output, stored_at_start: f64) -> f64 {
    let energy = &output.energy;
    energy.stored() - stored_at_start - (energy.input - energy.lost())
}

/// 3s² − 2s³ with s clamped to [0, 1]: even at both ends.
pub fn smoothstep(s: f64) -> f64 {
    let s = s.clamp(0.0, 1.0);
    s * s * (3.0 - 2.0 * s)
}
