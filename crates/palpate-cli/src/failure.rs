//! Why a verb stopped, in words for the person at the terminal.

use std::fmt;
use std::path::Path;

/// A message; the process ends with status 1.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Failure(pub String);

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Failure {}

impl Failure {
    /// A file that can't be read, written or made.
    pub fn file(doing: &str, path: &Path, error: &std::io::Error) -> Self {
        Self(format!("cannot {doing} {}: {error}", path.display()))
    }
}

impl From<palpate::Error> for Failure {
    fn from(error: palpate::Error) -> Self {
        Self(error.to_string())
    }
}

impl From<palpate_fem::record::RecordError> for Failure {
    fn from(error: palpate_fem::record::RecordError) -> Self {
        Self(error.to_string())
    }
}

impl From<palpate_fem::mesh::MeshError> for Failure {
    fn from(error: palpate_fem::mesh::MeshError) -> Self {
        Self(error.to_string())
    }
}

impl From<palpate_haptics::Error> for Failure {
    fn from(error: palpate_haptics::Error) -> Self {
        Self(error.to_string())
    }
}
