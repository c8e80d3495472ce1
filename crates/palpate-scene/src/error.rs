//! Errors of scenes: kind, file, line, key and message.

#[cfg(feature = "native")]
use palpate_export::ExportError;
use std::fmt;
use std::io;
use std::path::{Path, PathBuf};

/// Reason that a scene, or something that it needs, is refused.
///
/// Displayed as `FILE: line N: MESSAGE` where the place in the scene file is known.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub struct SceneError {
    /// Kind, for programs.
    pub kind: SceneErrorKind,
    /// File that is at fault: the scene file where `line` is set.
    pub file: Option<PathBuf>,
    /// Line in the scene file, from 1.
    pub line: Option<usize>,
    /// Key of the scene file, without the table that it stands in.
    pub key: Option<String>,
    /// Message for people: lower case, no full stop.
    pub message: String,
    /// Number of the operating system's error, if it was the one that refused.
    pub os_error: Option<i32>,
}

/// Kind of a [`SceneError`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum SceneErrorKind {
    /// The operating system refused to read or write a file.
    Io,
    /// The file is no TOML, or has an unknown, missing or doubled key, or a value of a wrong type.
    Syntax,
    /// Something required is missing.
    Missing,
    /// A number is out of its range.
    OutOfRange,
    /// A word is none of those that are allowed, or names nothing in the scene.
    UnknownValue,
    /// A name is taken, or has characters that names cannot have.
    Name,
    /// Keys exclude one another.
    Conflict,
    /// A recording cannot be read.
    Recording,
    /// A table of impulse responses cannot be used.
    Table,
    /// A mesh cannot be read or used.
    Mesh,
    /// A motion path cannot be read.
    Path,
    /// A held point is off the surface, fixed, or held twice.
    Grasp,
    /// No virtual coupling is stable.
    Coupling,
    /// The runtime refuses the model.
    Model,
    /// A device cannot be opened.
    Device,
    /// An object cannot be recorded.
    Record,
    /// A log cannot be begun.
    Log,
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (&self.file, self.line, self.kind) {
            // The parser's message has the line.
            (Some(file), _, SceneErrorKind::Syntax) => write!(f, "{}: {}", file.display(), self.message),
            (Some(file), Some(line), _) => write!(f, "{}: line {line}: {}", file.display(), self.message),
            _ => f.write_str(&self.message),
        }
    }
}

impl SceneError {
    /// Error without a place.
    pub fn new(kind: SceneErrorKind, message: impl fmt::Display) -> Self {
        Self { kind, file: None, line: None, key: None, message: message.to_string(), os_error: None }
    }

    /// Error of a file, which the message names.
    pub(crate) fn of_file(kind: SceneErrorKind, file: &Path, message: impl fmt::Display) -> Self {
        Self { file: Some(file.to_path_buf()), ..Self::new(kind, message) }
    }

    /// Error of the operating system.
    pub(crate) fn io(action: &str, file: &Path, error: &io::Error) -> Self {
        let message = format!("cannot {action} {}: {error}", file.display());
        Self { os_error: error.raw_os_error(), ..Self::of_file(SceneErrorKind::Io, file, message) }
    }
}

#[cfg(feature = "native")]
impl From<ExportError> for SceneError {
    fn from(error: ExportError) -> Self {
        let (file, os_error) = match &error {
            ExportError::Io { path, source, .. } => (Some(path.clone()), source.raw_os_error()),
            _ => (None, None),
        };
        Self { file, os_error, ..Self::new(SceneErrorKind::Io, error) }
    }
}
