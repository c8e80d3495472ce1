//! Errors of exports.

use std::io;
use std::path::{Path, PathBuf};

/// Reason that a file was not exported.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportError {
    /// The operating system refused to do something with a file or folder.
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        /// Action that failed, as in "write" or "make the folder".
        action: &'static str,
        /// File or folder.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The target cannot be replaced: it is an input, no regular file, or in a folder that is not there.
    #[error("cannot write {}: {reason}", path.display())]
    Target {
        /// Path of the output.
        path: PathBuf,
        /// Reason, in words.
        reason: String,
    },
    /// An unfinished file of the same name is there.
    #[error(
        "cannot write {}: {} is there, left by a run that was killed or had no room; keep what is in it (`palpate recover` makes a whole \
         log), or remove it",
        path.display(), part.display()
    )]
    Unfinished {
        /// Path of the output.
        path: PathBuf,
        /// Path of the unfinished file.
        part: PathBuf,
    },
    /// Two outputs name the same file.
    #[error("cannot write {}: {first} and {second} name the same file", path.display())]
    SameFile {
        /// Name of the first output, as the caller gave it.
        first: String,
        /// Name of the second output.
        second: String,
        /// Path of the second output.
        path: PathBuf,
    },
    /// The time window is empty, or its frame rate is not positive.
    #[error(transparent)]
    TimeWindow(#[from] TimeWindowError),
    /// A WAV file states its length in 32 bits.
    #[error("cannot write {}: it would have {:.0} s of sound, a WAV file has 44739 s (12 hours) of 48 kHz at most", path.display(), seconds)]
    SoundTooLong {
        /// Path of the output.
        path: PathBuf,
        /// Duration of the run [s].
        seconds: f64,
    },
    /// A GLB file states its length in 32 bits.
    #[error("{} would have {:.1} GB, a GLB file has 4.29 GB at most", path.display(), 1e-9 * *bytes as f64)]
    GlbTooLarge {
        /// Path of the output.
        path: PathBuf,
        /// Length that the file would have [bytes].
        bytes: u64,
    },
    /// The JSON part of a GLB file.
    #[error("JSON: {0}")]
    Json(#[from] serde_json::Error),
}

/// Number of a time window that is out of its range.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum TimeWindowError {
    /// Frames per second.
    #[error("fps is {0}, expected a positive number")]
    FrameRate(f64),
    /// Start [s].
    #[error("from is {0} s, expected a time from 0 on")]
    Start(f64),
    /// End [s].
    #[error("to is {to_s} s, expected a time after from, {from_s} s")]
    End {
        /// Start [s].
        from_s: f64,
        /// End [s].
        to_s: f64,
    },
}

impl ExportError {
    /// Error of the operating system with what was being done.
    pub(crate) fn io(action: &'static str, path: &Path, source: io::Error) -> Self {
        Self::Io { action, path: path.to_path_buf(), source }
    }

    /// Refusal of a target.
    pub(crate) fn target(path: &Path, reason: impl Into<String>) -> Self {
        Self::Target { path: path.to_path_buf(), reason: reason.into() }
    }
}
