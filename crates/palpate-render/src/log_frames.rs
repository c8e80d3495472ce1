//! Frames of a log for the viewer: the log is replayed, and some of its steps become frames.

use crate::error::RenderError;
use palpate_haptics::Snapshot;
use palpate_scene::{LogReplay, Progress, ReplayError};
use palpate_viewer::{LogFrameBuilder, LogFrames, describe_scene};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Upper bound of the frames of a log: ten minutes at 60 Hz, some 100 MB.
const MAX_FRAMES: u64 = 36_000;

/// Log whose frames are computed.
pub struct LogFramePlayer {
    log: LogReplay,
    steps: FrameSteps,
    builder: LogFrameBuilder,
    /// Frames, for the viewer's server.
    pub frames: Arc<LogFrames>,
}

/// Steps that become frames; step 0 is the initial state.
enum FrameSteps {
    /// Every n-th.
    Every(u64),
    /// Given steps, ascending.
    At(Vec<u64>),
}

impl FrameSteps {
    fn contains(&self, step: u64) -> bool {
        match self {
            Self::Every(every) => step.is_multiple_of(*every),
            Self::At(steps) => steps.binary_search(&step).is_ok(),
        }
    }

    fn spacing(&self, steps: u64, step_s: f64) -> FrameSpacing {
        match self {
            Self::Every(every) => {
                FrameSpacing { count: steps / every + 1, interval_s: *every as f64 * step_s }
            }
            Self::At(chosen) => FrameSpacing { count: chosen.len() as u64, interval_s: step_s },
        }
    }
}

/// Number of frames and the interval between them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrameSpacing {
    /// Number.
    pub count: u64,
    /// Interval [s].
    pub interval_s: f64,
}

impl LogFramePlayer {
    /// Reads a log, with a number among those shown together, at a frame rate [Hz] that is lowered for long logs.
    ///
    /// # Errors
    /// As [`LogReplay::read`].
    pub fn read(path: &Path, number: usize, rate_hz: f64) -> Result<Self, ReplayError> {
        Self::of(path, number, |log| {
            let step_s = log.scene.model.parameters().step_s;
            let every = (1.0 / (rate_hz * step_s)).round().max(1.0) as u64;
            FrameSteps::Every(every.max(log.steps.div_ceil(MAX_FRAMES)))
        })
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
        let step_s = log.scene.model.parameters().step_s;
        let steps = choose(&log);
        let spacing = steps.spacing(log.steps, step_s);
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        let end = if log.is_cut() { "; the log was cut here" } else { "" };
        let about = format!("{:.1} s at {:.0} Hz{end}", log.steps as f64 * step_s, 1.0 / step_s);
        let description = describe_scene(&log.scene, (None, name.clone(), about), &[]);
        let model = log.scene.model.clone();
        let (frames, builder) =
            LogFrames::new(number, name, model, description, spacing.count, spacing.interval_s);
        Ok(Self { log, steps, builder, frames })
    }

    /// The log.
    pub fn log(&self) -> &LogReplay {
        &self.log
    }

    /// Number and interval of its frames.
    pub fn spacing(&self) -> FrameSpacing {
        self.steps.spacing(self.log.steps, self.log.scene.model.parameters().step_s)
    }

    /// Computes all frames; progress counts steps.
    ///
    /// # Errors
    /// When the log cannot be replayed, or `stop` is set. The frames so far remain.
    pub fn compute(self, stop: &AtomicBool, progress: &mut dyn Progress) -> Result<(), RenderError> {
        let Self { log, steps, mut builder, .. } = self;
        let computed = compute_frames(&log, &steps, &mut builder, stop, progress);
        builder.finish(computed.as_ref().err().map(ToString::to_string));
        computed
    }
}

fn compute_frames(
    log: &LogReplay,
    steps: &FrameSteps,
    builder: &mut LogFrameBuilder,
    stop: &AtomicBool,
    progress: &mut dyn Progress,
) -> Result<(), RenderError> {
    let (mut state, start) = (log.initial_state()?, log.initial_input()?);
    let mut snapshot = Snapshot::new(&log.scene.model, &state, &start);
    if steps.contains(0) {
        builder.push(&snapshot);
    }
    progress.begin("steps", log.steps);
    let mut number = 0;
    log.replay(&mut state, log.steps, |input, state, _| {
        number += 1;
        progress.advance(1);
        if steps.contains(number) {
            snapshot.capture(number, input, state);
            builder.push(&snapshot);
        }
        if stop.load(Ordering::Relaxed) { Err(RenderError::ReplayInterrupted) } else { Ok(()) }
    })?;
    Ok(())
}
