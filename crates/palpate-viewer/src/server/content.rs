//! Content of a server: a live scene, logs, or a rendering job.

use crate::log_frames::LogFrames;
use crate::protocol::RenderRequest;
use crate::scene_provider::{SceneProvider, ViewerScene};
use palpate_haptics::Scheduling;
use std::sync::Arc;
use std::sync::mpsc::Sender;

/// Live scene to serve.
pub struct Live {
    /// Provider of further scenes.
    pub provider: Arc<dyn SceneProvider>,
    /// Scene at the start.
    pub first: ViewerScene,
    /// Scheduling of the force process.
    pub scheduling: Scheduling,
}

/// Images to be drawn by a page.
pub struct RenderJob {
    /// Frames, size and view.
    pub request: RenderRequest,
    /// Receives each image by its index in the request, as PNG.
    pub images: Sender<(u64, Vec<u8>)>,
}

/// Content of a server.
pub enum ServedContent {
    /// Live scene.
    Live(Box<Live>),
    /// Logs, side by side.
    Logs(Vec<Arc<LogFrames>>),
    /// Log that a page in a headless browser draws as images.
    Render(Arc<LogFrames>, RenderJob),
}
