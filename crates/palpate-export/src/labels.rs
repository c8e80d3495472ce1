//! Names of the parts of a scene, which a [`Model`] does not have.

use palpate::{Input, Model, Pose};
use std::path::{Path, PathBuf};

/// Names of a model's parts, in the model's order, and the files that must not be overwritten.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SceneLabels {
    /// Names of the objects.
    pub objects: Vec<String>,
    /// Devices.
    pub devices: Vec<DeviceLabel>,
    /// Names of planes and obstacles.
    pub obstacles: Vec<String>,
    /// Whether anything but held points can act on the objects: then frames have a file for contacts.
    pub can_touch: bool,
    /// Input files, which no output may replace.
    pub inputs: Vec<PathBuf>,
}

/// Name of a device, and whether it is always there.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct DeviceLabel {
    /// Name.
    pub name: String,
    /// Whether it is shown only while active, as a pointer of the viewer's page is.
    pub transient: bool,
}

impl SceneLabels {
    /// Input files by reference.
    pub(crate) fn input_paths(&self) -> Vec<&Path> {
        self.inputs.iter().map(PathBuf::as_path).collect()
    }
}

/// Pose of an obstacle; its initial pose where the input does not have it.
pub(crate) fn obstacle_pose(model: &Model, input: &Input, at: usize) -> Pose {
    input.obstacles.get(at).copied().unwrap_or(model.parameters().obstacles[at].pose)
}
