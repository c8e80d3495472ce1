//! Frames of a log for the viewer: the log is replayed, and some of its steps become frames.

use crate::error::RenderError;
use palpate_scene::{LogReplay, Progress, ReplayError};
use palpate_viewer::{FrameSpacing, FrameSteps, LogFrames, LogPlayer};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Log whose frames are computed.
pub struct LogFramePlayer {
    player: LogPlayer,
    /// Frames, for the viewer's server.
    pub frames: Arc<LogFrames>,
}

impl LogFramePlayer {
    /// Reads a log, with a number among those shown together, at a frame rate [Hz] that is lowered for long logs.
    ///
    /// # Errors
    /// As [`LogReplay::read`].
    pub fn read(path: &Path, number: usize, rate_hz: f64) -> Result<Self, ReplayError> {
        Self::of(path, number, |log| FrameSteps::at_rate(log, rate_hz))
    }

    /// Reads a log of which given steps become frames, ascending; step 0 is the initial state.
    ///
    /// # Errors
    /// As [`LogReplay::read`].
    pub fn read_at(path: &Path, steps: Vec<u64>) -> Result<Self, ReplayError> {
        Self::of(path, 0, |_| FrameSteps::At(steps))
    }

    fn of(
        path: &Path,
        number: usize,
        choose: impl FnOnce(&LogReplay) -> FrameSteps,
    ) -> Result<Self, ReplayError> {
        let log = LogReplay::read(path)?;
        let steps = choose(&log);
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        let player = LogPlayer::new(log, name, number, steps)?;
        Ok(Self { frames: player.frames.clone(), player })
    }

    /// The log.
    pub fn log(&self) -> &LogReplay {
        self.player.log()
    }

    /// Number and interval of its frames.
    pub fn spacing(&self) -> FrameSpacing {
        self.player.spacing()
    }

    /// Computes all frames; progress counts steps.
    ///
    /// # Errors
    /// When the log cannot be replayed, or `stop` is set. The frames so far remain.
    pub fn compute(self, stop: &AtomicBool, progress: &mut dyn Progress) -> Result<(), RenderError> {
        let Self { mut player, .. } = self;
        progress.begin("steps", player.log().steps);
        let computed = compute_frames(&mut player, stop, progress);
        let replayed = player.finish(computed.as_ref().err().map(ToString::to_string));
        computed.and(replayed.map(drop).map_err(RenderError::from))
    }
}

fn compute_frames(
    player: &mut LogPlayer,
    stop: &AtomicBool,
    progress: &mut dyn Progress,
) -> Result<(), RenderError> {
    while player.advance()? {
        progress.advance(1);
        if stop.load(Ordering::Relaxed) {
            return Err(RenderError::ReplayInterrupted);
        }
    }
    Ok(())
}
