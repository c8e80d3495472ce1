//! Sources of files: a disk, or a few files in memory, as a browser or a fuzzer has them.

use crate::error::MeshError;
use crate::regular_file::read_regular_file;
use crate::scan::{Scanner, quoted};
use std::collections::BTreeMap;
use std::io;
use std::path::{Component, Path, PathBuf};

/// Source of mesh files and of those that they name.
#[derive(Debug, Clone, Copy)]
pub enum Files<'a> {
    /// Regular files on disk.
    Disk,
    /// Files in memory, by their path.
    Memory(&'a BTreeMap<PathBuf, Vec<u8>>),
}

impl Files<'_> {
    /// Content of a file.
    pub(crate) fn read(self, path: &Path) -> Result<Vec<u8>, MeshError> {
        let content = match self {
            Self::Disk => read_regular_file(path),
            Self::Memory(files) => {
                files.get(path).cloned().ok_or_else(|| io::Error::from(io::ErrorKind::NotFound))
            }
        };
        content.map_err(|source| MeshError::Read { path: path.to_path_buf(), source })
    }

    /// Content of a file that another needs.
    pub(crate) fn read_companion(self, path: &Path, companion: &Path) -> Result<Vec<u8>, MeshError> {
        self.read(companion).map_err(|error| match error {
            MeshError::Read { source, .. } => {
                MeshError::Companion { path: path.to_path_buf(), companion: companion.to_path_buf(), source }
            }
            other => other,
        })
    }
}

/// Upper limit of included files: they may include one another.
const MOST_INCLUDES: usize = 32;

/// Files that a mesh file includes.
pub(crate) struct Includes<'f> {
    files: Files<'f>,
    count: usize,
}

impl<'f> Includes<'f> {
    pub(crate) fn new(files: Files<'f>) -> Self {
        Self { files, count: 0 }
    }

    /// Content and path of a file that the file at `path` includes where the scanner stands.
    pub(crate) fn read(
        &mut self,
        scan: &Scanner,
        path: &Path,
        name: &[u8],
    ) -> Result<(Vec<u8>, PathBuf), MeshError> {
        self.count += 1;
        if self.count > MOST_INCLUDES {
            return scan.fail(format!("more than {MOST_INCLUDES} files are included"));
        }
        let Some(included) = beside(path, name) else {
            let name = quoted(name);
            return scan.fail(format!("the file includes {name}, expected a file beside it or below"));
        };
        Ok((self.files.read_companion(path, &included)?, included))
    }
}

/// Path of a file that another names, if it stands beside or below that one.
///
/// A mesh from elsewhere must not read what it likes.
pub(crate) fn beside(file: &Path, name: &[u8]) -> Option<PathBuf> {
    let name = Path::new(std::str::from_utf8(name).ok()?);
    let is_below = name.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    (is_below && name.file_name().is_some()).then(|| file.with_file_name("").join(name))
}
