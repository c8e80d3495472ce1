//! Scenes that pages touch: scene texts with pointers.

use super::pointers::with_pointers;
use crate::error::SceneError;
use crate::file::{PartsInMemory, RunMode, read_edited_scene};
use crate::scene::Scene;
use palpate::ModelObject;
use std::path::Path;

/// Scene with pointers.
pub struct TouchableScene {
    /// Scene.
    pub scene: Scene,
    /// Its text, with added pointers.
    pub text: String,
    /// Names of the pointers that were added now.
    pub added: Vec<String>,
}

/// Reads the text of a scene, with four pointers where it has none. Files are looked for beside `path`, which errors name, unless they are in
/// memory.
///
/// # Errors
/// As [`read_scene`](crate::read_scene).
pub fn read_touchable_scene(
    path: &Path,
    text: String,
    parts: &PartsInMemory,
) -> Result<TouchableScene, SceneError> {
    let mut added = Vec::new();
    let edit = |text: &str, objects: &[ModelObject]| {
        let edited = with_pointers(text, objects)?;
        added = edited.added;
        Some(edited.edited)
    };
    let (mut scene, text) = read_edited_scene(path, text, parts, RunMode::RealTime, edit)?;
    // Nobody has chosen the size of added pointers.
    scene.warnings.retain(|warning| !added.contains(&warning.part));
    Ok(TouchableScene { scene, text, added })
}
