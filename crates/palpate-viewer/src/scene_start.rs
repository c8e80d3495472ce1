//! Start of a scene, whoever runs it: rates, and whether it may go on from another state.

use crate::scene_provider::{SharedTrajectory, ViewerDevice, ViewerScene};

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
