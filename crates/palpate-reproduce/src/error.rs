//! Reasons why the reproduction ended.

use palpate_export::ExportError;
use palpate_fem::RecordError;
use palpate_fem::table::TableError;
use palpate_mesh::MeshError;
use palpate_render::RenderError;
use palpate_scene::{ReplayError, SceneError};
use std::io;
use std::path::{Path, PathBuf};

/// A measurement that could not be made, or a file that could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReproduceError {
    /// A mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A recording.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// A table of impulse responses.
    #[error(transparent)]
    Table(#[from] TableError),
    /// A model or the bytes of a recording.
    #[error(transparent)]
    Model(#[from] palpate::Error),
    /// A scene.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A log of a run.
    #[error(transparent)]
    Replay(#[from] ReplayError),
    /// Images of a log, or the browser that was named.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// A file.
    #[error(transparent)]
    Export(#[from] ExportError),
    /// A folder.
    #[error("cannot make the folder {}: {source}", path.display())]
    Folder {
        /// Its path.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// A run in a process of its own.
    #[error("{0}")]
    Process(String),
    /// A measurement whose result can't be used.
    #[error("{0}")]
    Measurement(String),
}

impl ReproduceError {
    /// A folder that can't be made.
    pub(crate) fn folder(path: &Path, source: io::Error) -> Self {
        Self::Folder { path: path.into(), source }
    }
}
