//! Steps of a simulation as files: CSV for numbers, VTU for ParaView, glTF (GLB) for everything that shows animations, WAV for
//! the sound.
//!
//! A [`SceneExporter`] takes the state after each step and writes rows and frames; [`SceneLabels`] give the parts of the model
//! their names. Every file is an [`AtomicFile`]: it takes its name when it is complete, and until then nothing stands there.

#![deny(missing_docs)]

mod atomic_file;
mod claim;
mod csv;
mod error;
mod frame;
mod glb;
mod glb_parts;
mod glb_scene;
mod labels;
mod output_folder;
mod part_file;
mod rigid_surface;
mod scene_export;
mod sound_file;
mod standard_output;
mod temporary_folder;
mod unfinished;
mod vertex_normals;
mod vtu;
mod vtu_scene;

pub use atomic_file::{AtomicFile, check_distinct, check_target, check_writable, write_atomically};
pub use error::{ExportError, TimeWindowError};
pub use frame::TimeWindow;
pub use glb::{Content, Glb, check_glb_size};
pub use glb_parts::{DeformingSurface, GlbAnimation, NodeTrack, root_node};
pub use glb_scene::GlbWarning;
pub use labels::{DeviceLabel, ProbeLabel, ProbeReading, SceneLabels};
pub use output_folder::OutputFolder;
pub use part_file::{PART, PartFile, part_of};
pub use scene_export::{ExportOptions, SceneExporter, WrittenFile};
pub use standard_output::has_reader;
pub use temporary_folder::TemporaryFolder;
pub use unfinished::remove_unfinished;
pub use vtu::{Cells, Field, Grid, VtuSeries};
pub use vtu_scene::deformed_surface;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
