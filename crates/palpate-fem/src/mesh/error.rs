//! What can be wrong with a mesh.

use std::path::PathBuf;

/// Why a mesh can't be used. The text says where and, where it can, what to do.
#[derive(Debug, thiserror::Error)]
pub enum MeshError {
    /// The file could not be opened or read.
    #[error("cannot read mesh {path}: {source}", path = path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file's text or bytes are not what its format says.
    #[error("{path}: {place}: {message}", path = path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// Where: `line 17`, or `byte 1043` in a binary part.
        place: String,
        /// What was found and what was expected.
        message: String,
    },
    /// The mesh was read, and is not one body that can be computed.
    #[error("{0}")]
    Unusable(String),
}
