//! Modes of devices that the caller changes between steps: hands that take hold of a point, let go, or leave.

use crate::arrays::Numbers;
use crate::errors::{catch_panic, input_error, internal_error, scene_error};
use crate::scene::Scene;
use glam::DVec3;
use palpate::{DeviceMode, Grasp};
use palpate_scene::SceneErrorKind;
use pyo3::prelude::*;

/// Distance of a grasped point from the surface that is allowed, as a share of the diagonal: as in scene files.
const OFF_SURFACE: f64 = 0.05;

/// Change of a device's mode, checked against the scene.
#[derive(Clone, Copy)]
pub struct ModeChange {
    device: usize,
    mode: DeviceMode,
}

impl ModeChange {
    /// Device that takes hold of the material point of an object nearest to a point [m, body frame].
    pub fn grasp(
        scene: &palpate_scene::Scene,
        device: &Bound<'_, PyAny>,
        object: &Bound<'_, PyAny>,
        point: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        let py = device.py();
        let (number, at) = (Scene::device(scene, device)?, Scene::object(scene, object)?);
        let name = &scene.object_names[at];
        let point = DVec3::from_slice(Numbers::read(point, "point", &[Some(3)])?.as_slice()?);
        if !point.is_finite() {
            return Err(input_error(py, format!("point is {point}, expected finite numbers")));
        }
        let surface = scene.model.recordings().nth(at).map(|recording| &recording.surface);
        let Some((surface, (found, distance))) = surface.and_then(|own| Some((own, own.nearest(point)?)))
        else {
            return Err(input_error(py, format!("the object {name:?} has no surface")));
        };
        let allowed = OFF_SURFACE * surface.diagonal();
        if distance > allowed {
            let message = format!(
                "the point {point} is {distance:.4} m from the surface of {name:?}, at most {allowed:.4} m are allowed; it is given in the \
                 body frame, whose origin is the centre of mass"
            );
            return Err(input_error(py, message));
        }
        let grasp = Grasp { object: at, point: found };
        let refused = format!("the point {point} of {name:?} cannot be held: ");
        Self::of(scene, py, number, DeviceMode::Held(grasp), &refused)
    }

    /// Number of the device.
    pub fn device(&self) -> usize {
        self.device
    }

    /// Device that lets go, and touches with its tip from now on.
    pub fn release(scene: &palpate_scene::Scene, device: &Bound<'_, PyAny>) -> PyResult<Self> {
        Self::of(scene, device.py(), Scene::device(scene, device)?, DeviceMode::Touch, "")
    }

    /// Device that takes no part from now on.
    pub fn deactivate(scene: &palpate_scene::Scene, device: &Bound<'_, PyAny>) -> PyResult<Self> {
        Self::of(scene, device.py(), Scene::device(scene, device)?, DeviceMode::Inactive, "")
    }

    /// Mode that is checked, and whose tables are loaded; `refused` stands before the reason of a refusal.
    fn of(
        scene: &palpate_scene::Scene,
        py: Python<'_>,
        device: usize,
        mode: DeviceMode,
        refused: &str,
    ) -> PyResult<Self> {
        let own = &scene.devices[device];
        let is_course = matches!(own.mode, DeviceMode::Force(_)) && own.path.is_some();
        if is_course && mode != DeviceMode::Inactive {
            let message = format!(
                "device {:?} has a path of forces, so that nobody says where it is: it can be deactivated only",
                own.name
            );
            return Err(input_error(py, message));
        }
        match py.detach(|| catch_panic(|| scene.prepare_device(device, &mode))) {
            Ok(Ok(())) => Ok(Self { device, mode }),
            Ok(Err(error)) if error.kind == SceneErrorKind::Grasp => {
                Err(input_error(py, format!("{refused}{error}")))
            }
            Ok(Err(mut error)) => {
                error.message.insert_str(0, refused);
                Err(scene_error(py, &error))
            }
            Err(panic) => Err(internal_error(py, &panic)),
        }
    }

    /// Change the mode from the next step on.
    ///
    /// # Errors
    /// Text, if another device holds the same point: no force could satisfy both.
    pub fn apply(&self, scene: &palpate_scene::Scene, modes: &mut [DeviceMode]) -> Result<(), String> {
        let is_held = matches!(self.mode, DeviceMode::Held(_));
        let holds = |(at, mode): (usize, &DeviceMode)| at != self.device && is_held && *mode == self.mode;
        if let Some(other) = modes.iter().enumerate().position(holds) {
            return Err(format!("device {:?} holds the same point", scene.devices[other].name));
        }
        modes[self.device] = self.mode;
        Ok(())
    }
}

/// Word for a mode.
pub fn mode_name(mode: &DeviceMode) -> &'static str {
    match mode {
        DeviceMode::Touch => "touch",
        DeviceMode::Held(_) => "held",
        DeviceMode::Force(_) => "force",
        DeviceMode::Inactive | DeviceMode::Suspended => "inactive",
    }
}
