//! Warnings of a run, offline or in real time.

use crate::failure::Failure;
use palpate::{DeviceMode, Recording};
use palpate_scene::{Scene, SceneDevice, Warning, WarningKind};
use serde_json::{Value, json};
use std::fmt::Write;

/// Penetration that gets a warning: this share of the object's diagonal, or this length [m] if it is larger.
const PENETRATION: f64 = 0.01;
const PENETRATION_M: f64 = 2e-4;

/// Warning about an object that was pressed into something by a depth [m].
pub(super) fn penetration(name: &str, recording: &Recording, depth: f64) -> Option<Warning> {
    let diagonal = recording.surface.diagonal();
    (depth > PENETRATION_M.max(PENETRATION * diagonal)).then(|| {
        let message = format!(
            "{name} was {:.2} mm inside something, {:.1} % of its size: use a shorter step, slower motion, or more contact \
             samples (max_contact_samples)",
            1000.0 * depth,
            100.0 * depth / diagonal
        );
        Warning::new(WarningKind::Penetration, name, message)
    })
}

/// Whether a device that touches nothing gets a warning: its path was meant to.
pub(super) fn should_touch(device: &SceneDevice) -> bool {
    device.mode == DeviceMode::Touch && device.path.is_some()
}

/// Warning about a tip that touched nothing; its least distance [m] from the objects, if it is known.
pub(super) fn no_contact(device: &SceneDevice, distance: Option<f64>) -> Warning {
    let nearest = distance.filter(|distance| distance.is_finite());
    let nearest = nearest.map_or(String::new(), |distance| {
        format!("; its centre stayed about {distance:.4} m or more from all objects")
    });
    let message = format!("{} touched nothing{nearest}", device.name);
    Warning::new(WarningKind::NoContact, &device.name, message)
}

/// Lines of a summary.
pub(super) fn text(warnings: &[Warning]) -> String {
    warnings.iter().fold(String::new(), |mut out, warning| {
        // Writing to a String can't fail.
        let _ = writeln!(out, "  warning      {warning}");
        out
    })
}

/// All warnings of a scene and its run as JSON.
pub(super) fn json(scene: &Scene, of_run: &[Warning]) -> Value {
    let all = scene.warnings.iter().chain(of_run);
    let one =
        |warning: &Warning| json!({ "kind": warning.kind, "part": warning.part, "message": warning.message });
    all.map(one).collect()
}

/// Failure for warnings where none are allowed.
pub(super) fn refuse(strict: bool, warnings: &[Warning]) -> Result<(), Failure> {
    match warnings {
        [first, ..] if strict => Err(Failure(format!("{first} (a warning; --strict makes it an error)"))),
        _ => Ok(()),
    }
}
