//! Scene: a model with the names of its parts, and the paths of its devices and obstacles.

use crate::devices::RealDevice;
use crate::object_bounds::ObjectBounds;
use crate::warning::Warning;
use glam::DVec3;
use palpate::{AppliedForce, DeviceInput, DeviceMode, DeviceParameters, Input, Model, Pose, State};
#[cfg(feature = "native")]
use palpate_export::{DeviceLabel, ProbeLabel, SceneLabels};
use palpate_haptics::SceneNames;
use palpate_haptics::device::{DeviceSpec, Hand};
use palpate_haptics::{MotionLimits, MotionPath};
use std::path::PathBuf;
use std::sync::Arc;

/// Scene that is ready to run.
pub struct Scene {
    /// Objects, devices, obstacles and parameters.
    pub model: Arc<Model>,
    /// Names of the objects, in the model's order.
    pub object_names: Vec<String>,
    /// Devices, in the model's order.
    pub devices: Vec<SceneDevice>,
    /// Planes and obstacles, in the model's order.
    pub obstacles: Vec<SceneObstacle>,
    /// Clamps, in the model's order.
    pub clamps: Vec<SceneClamp>,
    /// Paths of the bases of objects with fixed nodes, in the order of the objects.
    pub bases: Vec<Option<MotionPath>>,
    /// Displacement probes.
    #[cfg(feature = "native")]
    pub probes: Vec<ProbeLabel>,
    /// Gravity over time, rows of t [s] and x, y, z [m/s²]; none if it is the model's.
    pub gravity: Option<MotionPath>,
    /// Bounding box of all objects at the start.
    pub object_bounds: ObjectBounds,
    /// Warnings for the author of the scene.
    pub warnings: Vec<Warning>,
    /// Values that were chosen automatically, a line each.
    pub choices: Vec<String>,
    /// Files that the scene was read from, the scene file first.
    pub inputs: Vec<PathBuf>,
}

/// Device of a scene: one that follows a path, a real one, one in another process, or a pointer of the viewer.
pub struct SceneDevice {
    /// Name.
    pub name: String,
    /// Initial mode: held point, touch or prescribed force.
    pub mode: DeviceMode,
    /// Parameters of the model.
    pub parameters: DeviceParameters,
    /// Path of its position, of the simulated hand, or course of its prescribed force [N]; none for real and linked devices and
    /// for pointers.
    pub path: Option<MotionPath>,
    /// Simulated device and hand, which follow the path as far as forces allow.
    pub simulated: Option<(DeviceSpec, Hand)>,
    /// Real device.
    pub real: Option<RealDevice>,
    /// Limits of the motions that come over a link.
    pub motion_limits: MotionLimits,
    /// Whether it is a pointer of the viewer's page.
    pub pointer: bool,
}

/// Plane or obstacle of a scene.
#[derive(Clone)]
pub struct SceneObstacle {
    /// Name.
    pub name: String,
    /// Path, if it moves.
    pub path: Option<MotionPath>,
    /// Initial pose; its orientation also holds for a path of positions.
    pub start: Pose,
}

/// Clamp of a scene.
#[derive(Clone)]
pub struct SceneClamp {
    /// Name.
    pub name: String,
    /// Number of its object.
    pub object: usize,
    /// Path of its frame, if it moves.
    pub path: Option<MotionPath>,
    /// Initial frame [m, world].
    pub start: Pose,
}

impl SceneClamp {
    /// Frame at a time [s].
    pub fn frame_at(&self, time_s: f64) -> Pose {
        self.path.as_ref().map_or(self.start, |path| path.at(time_s))
    }
}

impl SceneDevice {
    /// Position of its path at a time [s]; the origin without a path [m, world].
    pub fn position_at(&self, time_s: f64) -> DVec3 {
        self.motion().map_or(DVec3::ZERO, |path| path.at(time_s).position)
    }

    /// Path of its motion; none where it prescribes a force.
    pub fn motion(&self) -> Option<&MotionPath> {
        self.path.as_ref().filter(|_| !matches!(self.mode, DeviceMode::Force(_)))
    }

    /// Input of the step of `step_s` [s] that ends at a time [s].
    fn input_at(&self, time_s: f64, step_s: f64) -> DeviceInput {
        match (self.mode, &self.path) {
            (DeviceMode::Force(applied), Some(path)) => {
                let force = path.mid_step(time_s, step_s);
                DeviceInput::exerting(AppliedForce { force, ..applied })
            }
            (mode, _) => DeviceInput { position: self.position_at(time_s), mode },
        }
    }
}

impl SceneObstacle {
    /// Pose at a time [s].
    pub fn pose_at(&self, time_s: f64) -> Pose {
        match &self.path {
            None => self.start,
            Some(path) if path.has_orientations() => path.at(time_s),
            Some(path) => Pose { position: path.at(time_s).position, ..self.start },
        }
    }
}

impl Scene {
    /// Names of all parts, as logs have them.
    pub fn names(&self) -> SceneNames {
        SceneNames {
            objects: self.object_names.clone(),
            devices: self.devices.iter().map(|device| device.name.clone()).collect(),
            obstacles: self.obstacles.iter().map(|obstacle| obstacle.name.clone()).collect(),
            clamps: self.clamps.iter().map(|clamp| clamp.name.clone()).collect(),
        }
    }

    /// Names of all parts, as exports have them.
    #[cfg(feature = "native")]
    pub fn labels(&self) -> SceneLabels {
        let label =
            |device: &SceneDevice| DeviceLabel { name: device.name.clone(), transient: device.pointer };
        SceneLabels {
            objects: self.object_names.clone(),
            devices: self.devices.iter().map(label).collect(),
            obstacles: self.obstacles.iter().map(|obstacle| obstacle.name.clone()).collect(),
            clamps: self.clamps.iter().map(|clamp| clamp.name.clone()).collect(),
            probes: self.probes.clone(),
            can_touch: self.can_touch(),
            inputs: self.inputs.clone(),
        }
    }

    /// Input at a time of all paths [s]; parts without a path are where they start.
    pub fn input_at(&self, time_s: f64) -> Input {
        let at_start = |device: &SceneDevice| DeviceInput { position: DVec3::ZERO, mode: device.mode };
        let mut input = Input {
            devices: self.devices.iter().map(at_start).collect(),
            obstacles: self.obstacles.iter().map(|obstacle| obstacle.start).collect(),
            clamps: self.clamps.iter().map(|clamp| clamp.start).collect(),
            bases: vec![None; self.bases.len()],
            gravity: None,
        };
        self.follow_paths(time_s, &mut input);
        input
    }

    /// Move all parts that have a path to their place at a time [s], in an input of this scene; the others stay.
    ///
    /// # Real time
    /// No allocation.
    pub fn follow_paths(&self, time_s: f64, input: &mut Input) {
        let step_s = self.model.parameters().step_s;
        for (own, device) in input.devices.iter_mut().zip(&self.devices).filter(|(_, of)| of.path.is_some()) {
            *own = device.input_at(time_s, step_s);
        }
        for (own, obstacle) in
            input.obstacles.iter_mut().zip(&self.obstacles).filter(|(_, of)| of.path.is_some())
        {
            *own = obstacle.pose_at(time_s);
        }
        for (own, clamp) in input.clamps.iter_mut().zip(&self.clamps).filter(|(_, of)| of.path.is_some()) {
            *own = clamp.frame_at(time_s);
        }
        for (own, base) in input.bases.iter_mut().zip(&self.bases) {
            *own = base.as_ref().map(|path| path.of_base(time_s, step_s));
        }
        input.gravity = self.gravity_at(time_s).or(input.gravity);
    }

    /// Move all parts that have a path to their place at the end of the next step of a state, at the times of `palpate run`; the others stay.
    ///
    /// # Real time
    /// No allocation.
    pub fn follow_next_step(&self, state: &State, input: &mut Input) {
        self.follow_paths((state.step_count() + 1) as f64 * self.model.parameters().step_s, input);
    }

    /// Time of the last row of all paths [s]; 0 without paths.
    pub fn end_s(&self) -> f64 {
        let devices = self.devices.iter().filter_map(|device| device.path.as_ref());
        let paths = devices.chain(self.obstacles.iter().filter_map(|obstacle| obstacle.path.as_ref()));
        let paths = paths.chain(self.clamps.iter().filter_map(|clamp| clamp.path.as_ref()));
        let paths = paths.chain(self.bases.iter().flatten()).chain(&self.gravity);
        paths.map(MotionPath::end).fold(0.0, f64::max)
    }

    /// Gravity over the step that ends at a time [s]; none if it does not change [m/s², world].
    pub fn gravity_at(&self, time_s: f64) -> Option<DVec3> {
        self.gravity.as_ref().map(|gravity| gravity.mid_step(time_s, self.model.parameters().step_s))
    }

    /// Whether it may go on from the state of another scene: nothing follows a path, and there is no clamp.
    pub fn can_resume(&self) -> bool {
        let follows = self.devices.iter().any(|device| device.path.is_some())
            || self.obstacles.iter().any(|obstacle| obstacle.path.is_some())
            || self.bases.iter().any(Option::is_some)
            || self.gravity.is_some();
        !follows && self.clamps.is_empty()
    }

    /// Whether anything but held points can act on the objects.
    pub fn can_touch(&self) -> bool {
        let touching = self.devices.iter().any(|device| device.mode == DeviceMode::Touch);
        touching || !self.obstacles.is_empty() || self.object_names.len() > 1
    }
}
