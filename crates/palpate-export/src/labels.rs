//! Names of the parts of a scene, which a [`Model`] does not have.

use glam::DVec3;
use palpate::{Grasp, Input, Model, Pose, State};
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
    /// Names of the clamps.
    pub clamps: Vec<String>,
    /// Displacement probes.
    pub probes: Vec<ProbeLabel>,
    /// Whether anything but held points can act on the objects: then frames have a file for contacts.
    pub can_touch: bool,
    /// Input files, which no output may replace.
    pub inputs: Vec<PathBuf>,
}

/// Displacement probe: a surface point of an object whose position and displacement are written in every step.
#[derive(Debug, Clone, PartialEq)]
pub struct ProbeLabel {
    /// Name.
    pub name: String,
    /// Object and material point.
    pub at: Grasp,
}

/// Reading of a probe at the end of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ProbeReading {
    /// Position of the point [m, world].
    pub position: DVec3,
    /// Elastic displacement [m, body].
    pub displacement: DVec3,
}

impl ProbeLabel {
    /// Reading at the end of the last step of a state.
    pub fn read(&self, model: &Model, state: &State) -> ProbeReading {
        let Grasp { object, point } = &self.at;
        let displacement = state.point_displacement(model, *object, point);
        let rest = model
            .recordings()
            .nth(*object)
            .map_or(DVec3::ZERO, |recording| recording.surface.rest_position(point));
        let position = state.output().objects[*object].pose.world_from_body(rest + displacement);
        ProbeReading { position, displacement }
    }
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
