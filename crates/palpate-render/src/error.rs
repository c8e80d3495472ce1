//! Errors of rendering.

use palpate_export::ExportError;
use palpate_scene::ReplayError;
use palpate_viewer::ServerError;
use std::io;
use std::path::PathBuf;

/// Reason that a log was not rendered.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RenderError {
    /// The log cannot be replayed.
    #[error(transparent)]
    Replay(#[from] ReplayError),
    /// An image file cannot be written.
    #[error(transparent)]
    Export(#[from] ExportError),
    /// No browser was found.
    #[error(
        "pictures are drawn by a browser, and there is none: install chromium (apt install chromium), or name one"
    )]
    NoBrowser,
    /// A browser cannot be started.
    #[error("the browser {} can't be started{}", path.display(), reason.as_ref().map(|e| format!(": {e}")).unwrap_or_default())]
    BrowserStart {
        /// Program.
        path: PathBuf,
        /// Error of the operating system, where there is one.
        reason: Option<io::Error>,
    },
    /// The browser drew nothing for too long.
    #[error("the browser has drawn nothing for {seconds} s: it may lack WebGL 2; try another")]
    BrowserTimeout {
        /// Time that was waited [s].
        seconds: u64,
    },
    /// The browser stopped working.
    #[error("{0}")]
    Browser(String),
    /// The viewer's server.
    #[error(transparent)]
    Server(#[from] ServerError),
    /// The thread of the viewer's server panicked.
    #[error("the server has ended by a bug")]
    ServerPanic,
    /// There is no temporary folder for the browser.
    #[error("cannot make a folder for the browser: {0}")]
    TemporaryFolder(io::Error),
    /// The caller's flag was set before all images were drawn.
    #[error("interrupted: {0} pictures are drawn")]
    Interrupted(u64),
    /// The caller's flag was set while the log was computed.
    #[error("interrupted")]
    ReplayInterrupted,
    /// An image cannot be read, or is too large for a GIF.
    #[error("{0}")]
    Image(String),
}
