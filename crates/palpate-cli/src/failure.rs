//! Failure of a command: a message for the person at the terminal.

use palpate_export::{ExportError, TimeWindowError};
use palpate_render::RenderError;
use std::fmt;
use std::path::Path;

/// Message; the process ends with status 1.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Failure(pub String);

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Failure {}

impl Failure {
    /// File that cannot be read, written or made.
    pub fn file(action: &str, path: &Path, error: &std::io::Error) -> Self {
        Self(format!("cannot {action} {}: {error}", path.display()))
    }
}

/// Errors of the libraries whose own text is the message.
macro_rules! from_display {
    ($($error:ty),* $(,)?) => {
        $(impl From<$error> for Failure {
            fn from(error: $error) -> Self {
                Self(error.to_string())
            }
        })*
    };
}

from_display!(
    palpate::Error,
    palpate_mesh::MeshError,
    palpate_fem::RecordError,
    palpate_fem::table::TableError,
    palpate_haptics::Error,
    palpate_reproduce::ReproduceError,
    palpate_scene::ReplayError,
    palpate_scene::SceneError,
    palpate_store::StoreError,
    palpate_verify::UnknownCase,
    palpate_verify::VerifyError,
);

impl From<RenderError> for Failure {
    /// Names the option for another browser.
    fn from(error: RenderError) -> Self {
        Self(match error {
            RenderError::NoBrowser | RenderError::BrowserTimeout { .. } => format!("{error} with --browser"),
            RenderError::Export(error) => return error.into(),
            error => error.to_string(),
        })
    }
}

impl From<ExportError> for Failure {
    /// Names the options that the numbers and files are from.
    fn from(error: ExportError) -> Self {
        Self(match error {
            ExportError::TimeWindow(TimeWindowError::End { from_s, to_s }) => {
                format!("--to is {to_s} s, expected a time after --from, {from_s} s")
            }
            ExportError::TimeWindow(number) => format!("--{number}"),
            ExportError::SameFile { first, second, path } => {
                format!("cannot write {}: --{first} and --{second} name the same file", path.display())
            }
            error @ ExportError::GlbTooLarge { .. } => {
                format!("{error}: export fewer frames with --fps, or a part with --from and --to")
            }
            error => error.to_string(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_of_exports_name_their_options() {
        let text = |error: ExportError| Failure::from(error).0;
        let path = std::path::PathBuf::from("run.glb");
        assert_eq!(text(TimeWindowError::FrameRate(0.0).into()), "--fps is 0, expected a positive number");
        assert_eq!(text(TimeWindowError::Start(-1.0).into()), "--from is -1 s, expected a time from 0 on");
        assert_eq!(
            text(TimeWindowError::End { from_s: 2.0, to_s: 1.0 }.into()),
            "--to is 1 s, expected a time after --from, 2 s"
        );
        assert_eq!(
            text(ExportError::GlbTooLarge { path, bytes: 5_000_000_000 }),
            "run.glb would have 5.0 GB, a GLB file has 4.29 GB at most: export fewer frames with --fps, or a part \
             with --from and --to"
        );
    }
}
