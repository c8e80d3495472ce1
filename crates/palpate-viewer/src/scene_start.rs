//! Start of a scene: its first input and snapshot, its force process, and whether it may go on from another state.

use crate::scene_provider::{SharedTrajectory, ViewerDevice, ViewerScene};
use palpate::{DeviceInput, Input, State};
use palpate_haptics::Snapshot;

/// Time without an input after which a device becomes inactive [s].
pub(crate) const DEVICE_TIMEOUT_S: f64 = 0.1;

/// Frame rate [Hz].
pub(crate) const FRAME_RATE_HZ: f64 = 60.0;

/// Whether a scene may resume from another state: no device follows a path, no obstacle moves, there is no clamp, and gravity does not
/// change.
pub(crate) fn is_resumable(scene: &ViewerScene) -> bool {
    let follows_path = |device: &ViewerDevice| matches!(device, ViewerDevice::Path(..));
    let moves = |pose: &SharedTrajectory| pose(0.0) != pose(1.0) || pose(0.0) != pose(0.37);
    let moves = scene.devices.iter().any(follows_path) || scene.obstacle_trajectories.iter().any(moves);
    let moves = moves || scene.base_paths.iter().any(Option::is_some);
    !moves && scene.gravity.is_none() && scene.model.parameters().clamps.is_empty()
}

/// Snapshot before the first step.
pub(crate) fn initial_snapshot(scene: &ViewerScene, state: &State) -> Snapshot {
    let input = Input {
        devices: vec![DeviceInput::inactive(); scene.devices.len()],
        obstacles: scene.obstacle_trajectories.iter().map(|pose| pose(0.0)).collect(),
        bases: vec![None; scene.model.recordings().count()],
        clamps: scene.model.parameters().clamps.iter().map(|clamp| clamp.frame).collect(),
        ..Input::default()
    };
    Snapshot::new(&scene.model, state, &input)
}
