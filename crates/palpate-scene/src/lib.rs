//! Scenes for palpate: files, logs and libraries of scenes, for programs of every kind.
//!
//! ```text
//! scene file (TOML) → read_scene → Scene { model, names, devices, obstacles } → State, Input, step
//! log (MCAP)        → LogReplay  → the same scene, its steps computed again and compared bit for bit
//! SceneLibrary      → built-in scenes, scene files and uploaded meshes, with changes of their settings
//! ```
//!
//! Without the feature `native` there are scene files whose parts are in memory, and no files, recording, tables and library: WebAssembly
//! uses that. The feature `logs` has logs of such scenes.
//!
//! Errors are values: a [`SceneError`] has its kind, file, line, key and message. Nothing here prints or ends the process.

#![deny(missing_docs)]
// Keys of tables, meshes and probes are read everywhere.
#![cfg_attr(not(feature = "native"), allow(dead_code, unused_imports))]

#[cfg(feature = "native")]
mod attach;
mod devices;
mod error;
mod file;
mod files;
#[cfg(feature = "native")]
mod growing_log;
mod initial_checks;
mod library;
#[cfg(feature = "logs")]
mod log_facts;
#[cfg(feature = "logs")]
mod log_maker;
#[cfg(feature = "recording")]
mod material_choice;
#[cfg(feature = "recording")]
mod mesh_source;
mod motion;
#[cfg(feature = "recording")]
mod node_selection;
mod object_bounds;
#[cfg(feature = "recording")]
mod progress;
#[cfg(feature = "native")]
mod recipe;
#[cfg(feature = "recording")]
mod record_options;
mod recording_file;
#[cfg(feature = "logs")]
mod replay;
mod rows;
mod run_check;
mod scene;
#[cfg(feature = "native")]
mod scene_log;
#[cfg(feature = "native")]
mod session;
mod step_check;
#[cfg(feature = "recording")]
mod supports;
mod tables;
mod unit_check;
mod warning;

#[cfg(feature = "native")]
pub use attach::{attach_path, attach_real};
pub use devices::{ANY_HAND, MAX_FORCE_N, RealDevice, find_device_traits, find_driver, find_grip};
pub use error::{SceneError, SceneErrorKind};
pub use file::{
    PartsInMemory, Relocated, RunMode, named_files, read_driven_scene, read_path, read_piped_scene,
    read_relocated_scene, read_scene, read_scene_text,
};
#[cfg(feature = "native")]
pub use growing_log::{Failures, GrowingLog, Teller, create_part};
#[cfg(feature = "recording")]
pub use library::MeshUpload;
#[cfg(feature = "native")]
pub use library::{BUILT_IN_SCENES, BuiltInScene, OpenedScene, SceneLibrary, paper_cube_recipe};
pub use library::{SettingsChange, TouchableScene, falling_scene, read_touchable_scene};
#[cfg(feature = "logs")]
pub use log_maker::LogMaker;
#[cfg(feature = "recording")]
pub use material_choice::MaterialChoice;
#[cfg(feature = "recording")]
pub use mesh_source::{read_body, read_surface, source_name};
pub use motion::MotionSource;
#[cfg(feature = "recording")]
pub use node_selection::{NodeSelection, select_nodes, union_of_nodes};
pub use object_bounds::ObjectBounds;
#[cfg(feature = "recording")]
pub use palpate_fem::{Progress, SilentProgress};
#[cfg(feature = "recording")]
pub use palpate_mesh::MeshingParameters;
#[cfg(feature = "recording")]
pub use progress::{ProgressFn, WithoutRemarks};
#[cfg(feature = "native")]
pub use recipe::{RecordingRecipe, cache_folder};
#[cfg(feature = "recording")]
pub use record_options::{BodySource, PreparedBody, RecordOptions};
pub use recording_file::{certificate_lines, certificate_table, read_recording};
#[cfg(feature = "logs")]
pub use replay::{Difference, LogReplay, ReplayCursor, ReplayError, Replayed};
pub use rows::{pose_of_row, pose_row, twist_row};
pub use run_check::RunCheck;
pub use scene::{Scene, SceneClamp, SceneDevice, SceneObstacle};
#[cfg(feature = "native")]
pub use scene_log::SceneLog;
#[cfg(feature = "recording")]
pub use supports::read_supports;
pub use warning::{Warning, WarningKind};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
