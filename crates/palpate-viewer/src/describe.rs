//! Description of a scene for the viewer's pages.

use crate::protocol::{ObjectDescription, SceneDescription};
use palpate_scene::{Scene, certificate_lines};

/// Description of a scene, with its identifier, title and description, and whether its objects can be recorded again.
pub fn describe_scene(
    scene: &Scene,
    titles: (Option<String>, String, String),
    recordable: &[bool],
) -> SceneDescription {
    let recordings = scene.model.recordings().zip(&scene.object_names).enumerate();
    let objects = recordings.map(|(at, (recording, name))| {
        let again = recordable.get(at).copied().unwrap_or(false);
        ObjectDescription::new(name, recording, certificate_lines(recording), again)
    });
    let devices: Vec<(String, bool)> =
        scene.devices.iter().map(|device| (device.name.clone(), device.pointer)).collect();
    let obstacles = scene.names().obstacles;
    SceneDescription {
        warnings: scene.warnings.iter().map(ToString::to_string).collect(),
        ..SceneDescription::new(titles, &scene.model, objects.collect(), &obstacles, &devices)
    }
}
