//! `palpate scenes`: the built-in scenes as files.

use crate::failure::Failure;
use crate::progress::Bars;
use crate::terminal::print;
use clap::Args;
use palpate_export::write_atomically;
use palpate_scene::{BUILT_IN_SCENES, SceneLibrary};
use serde_json::{Value, json};
use std::path::PathBuf;

/// Write the built-in scenes to a folder, with their recordings and paths
///
/// Each scene gets a folder with scene.toml and what it names: to start your own scene from, or to be served to a browser that runs palpate
/// itself (docs/web.md). index.json lists the scenes. Recordings are compact, and small by fewer modes.
#[derive(Args)]
pub struct Arguments {
    /// Scenes; all without one
    #[arg(value_name = "NAME", value_parser = BUILT_IN_SCENES.map(|scene| scene.id))]
    names: Vec<String>,
    /// Folder of the scenes
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Most modes of a recording
    #[arg(long, default_value_t = MODES, value_name = "N")]
    modes: usize,
    /// Cache folder of recordings
    #[arg(long, value_name = "DIR")]
    cache: Option<PathBuf>,
}

/// Most modes of a recording: those of all built-in scenes are then below 3 MB.
const MODES: usize = 100;

/// Runs the command.
pub fn scenes(arguments: &Arguments) -> Result<(), Failure> {
    let Arguments { names, output, modes, cache } = arguments;
    let library = SceneLibrary::new(cache.as_deref())?;
    let mut list: Vec<Value> = Vec::new();
    for scene in
        BUILT_IN_SCENES.iter().filter(|scene| names.is_empty() || names.iter().any(|name| name == scene.id))
    {
        let folder = output.join(scene.id);
        library.write_built_in(scene.id, *modes, &folder, &mut Bars::new())?;
        list.push(json!({ "id": scene.id, "title": scene.title, "about": scene.about }));
        print(&format!("{}: {}\n", folder.display(), scene.title))?;
    }
    let index = format!("{:#}\n", Value::Array(list));
    write_atomically(&output.join("index.json"), index.as_bytes())?;
    Ok(())
}
