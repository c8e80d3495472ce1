//! Publication of the newest frame to the page sessions.

use crate::protocol::{FrameEncoder, FrameFormat};
use axum::body::Bytes;
use palpate_haptics::Snapshot;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use tokio::sync::watch;

/// Number of connected pages.
#[derive(Debug, Default)]
pub(crate) struct Viewers {
    /// All pages.
    pub all: AtomicUsize,
    /// Pages that stream vertex frames.
    pub vertices: AtomicUsize,
}

/// Sender of encoded frames.
#[derive(Clone)]
pub(super) struct FramePublisher {
    modal: watch::Sender<Bytes>,
    vertices: watch::Sender<Bytes>,
    viewers: Arc<Viewers>,
}

impl FramePublisher {
    /// Publisher into the channels of the two formats.
    pub fn new(modal: watch::Sender<Bytes>, vertices: watch::Sender<Bytes>, viewers: Arc<Viewers>) -> Self {
        Self { modal, vertices, viewers }
    }

    /// Number of connected pages.
    pub fn viewer_count(&self) -> usize {
        self.viewers.all.load(Ordering::Relaxed)
    }

    /// Publishes a snapshot in the formats that pages stream.
    pub fn publish(&self, encoder: &mut FrameEncoder, snapshot: &Snapshot) {
        if self.viewers.all.load(Ordering::Relaxed) > 0 {
            self.modal.send_replace(encoder.encode(snapshot, FrameFormat::Modal).into());
        }
        if self.viewers.vertices.load(Ordering::Relaxed) > 0 {
            self.vertices.send_replace(encoder.encode(snapshot, FrameFormat::Vertices).into());
        }
    }

    /// Publishes a snapshot in both formats, so that a new page has a frame.
    pub fn publish_all(&self, encoder: &mut FrameEncoder, snapshot: &Snapshot) {
        self.modal.send_replace(encoder.encode(snapshot, FrameFormat::Modal).into());
        self.vertices.send_replace(encoder.encode(snapshot, FrameFormat::Vertices).into());
    }
}
