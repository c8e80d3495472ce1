//! Scenes for palpate: files, logs and libraries of scenes, for programs of every kind.
//!
//! ```text
//! scene file (TOML) → read_scene → Scene { model, names, devices, obstacles } → State, Input, step
//! log (MCAP)        → LogReplay  → the same scene, its steps computed again and compared bit for bit
//! SceneLibrary      → built-in scenes, scene files and uploaded meshes, with changes of their settings
//! ```
//!
//! Errors are values: a [`SceneError`] has its kind, file, line, key and message. Nothing here prints or ends the process.

#![deny(missing_docs)]

mod attach;
mod devices;
mod error;
mod file;
mod initial_checks;
mod library;
mod material_choice;
mod mesh_source;
mod node_selection;
mod progress;
mod recipe;
mod record_options;
mod recording_file;
mod replay;
mod scene;
mod scene_log;
mod step_check;
mod supports;
mod tables;
mod warning;

pub use attach::{attach_path, attach_real};
pub use devices::{ANY_HAND, MAX_FORCE_N, RealDevice, find_device_traits, find_driver, find_grip};
pub use error::{SceneError, SceneErrorKind};
pub use file::{
    PartsInMemory, Relocated, RunMode, read_driven_scene, read_path, read_piped_scene, read_relocated_scene,
    read_scene, read_scene_text,
};
pub use library::{
    BUILT_IN_SCENES, BuiltInScene, MeshUpload, OpenedScene, SceneLibrary, SettingsChange, paper_cube_recipe,
};
pub use material_choice::MaterialChoice;
pub use mesh_source::{read_body, read_surface, source_name};
pub use node_selection::{NodeSelection, select_nodes, union_of_nodes};
pub use palpate_fem::{Progress, SilentProgress};
pub use progress::{ProgressFn, WithoutRemarks};
pub use recipe::{RecordingRecipe, cache_folder};
pub use record_options::{BodySource, PreparedBody, RecordOptions};
pub use recording_file::{certificate_lines, certificate_table, read_recording};
pub use replay::{Difference, LogReplay, ReplayError, Replayed};
pub use scene::{Scene, SceneClamp, SceneDevice, SceneObstacle};
pub use scene_log::SceneLog;
pub use supports::read_supports;
pub use warning::{Warning, WarningKind};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
