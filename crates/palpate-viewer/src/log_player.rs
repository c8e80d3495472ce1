//! Log whose steps are computed again one by one, some of which become frames.

use crate::describe::describe_scene;
use crate::log_frames::{LogFrameBuilder, LogFrames};
use palpate::{State, step};
use palpate_haptics::{Snapshot, steps_per_frame};
use palpate_scene::{LogReplay, ReplayCursor, ReplayError, Replayed};
use std::sync::Arc;

/// Upper bound of the frames of a log: ten minutes at 60 Hz, some 100 MB.
const MAX_FRAMES: u64 = 36_000;

/// Steps that become frames; step 0 is the initial state.
#[derive(Debug, Clone, PartialEq)]
pub enum FrameSteps {
    /// Every n-th.
    Every(u64),
    /// Given steps, ascending.
    At(Vec<u64>),
}

impl FrameSteps {
    /// Steps at a frame rate [Hz], which is lowered for long logs.
    pub fn at_rate(log: &LogReplay, rate_hz: f64) -> Self {
        let every = steps_per_frame(rate_hz, log.scene.model.parameters().step_s);
        Self::Every(every.max(log.steps.div_ceil(MAX_FRAMES)))
    }

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

/// Log whose frames are computed.
pub struct LogPlayer {
    log: LogReplay,
    cursor: ReplayCursor,
    state: State,
    snapshot: Snapshot,
    steps: FrameSteps,
    builder: LogFrameBuilder,
    /// Frames so far.
    pub frames: Arc<LogFrames>,
}

impl LogPlayer {
    /// Log before its first step, by its name and its number among those shown together.
    ///
    /// # Errors
    /// [`ReplayError::Log`].
    pub fn new(log: LogReplay, name: String, number: usize, steps: FrameSteps) -> Result<Self, ReplayError> {
        let step_s = log.scene.model.parameters().step_s;
        let spacing = steps.spacing(log.steps, step_s);
        let end = if log.is_cut() { "; the log was cut here" } else { "" };
        let about = format!("{:.1} s at {:.0} Hz{end}", log.steps as f64 * step_s, 1.0 / step_s);
        let description = describe_scene(&log.scene, (None, name.clone(), about), &[]);
        let model = log.scene.model.clone();
        let (frames, mut builder) =
            LogFrames::new(number, name, model, description, spacing.count, spacing.interval_s);
        let (state, start) = (log.initial_state()?, log.initial_input()?);
        let snapshot = Snapshot::new(&log.scene.model, &state, &start);
        if steps.contains(0) {
            builder.push(&snapshot);
        }
        Ok(Self { cursor: log.cursor(), state, snapshot, log, steps, builder, frames })
    }

    /// The log.
    pub fn log(&self) -> &LogReplay {
        &self.log
    }

    /// Number and interval of its frames.
    pub fn spacing(&self) -> FrameSpacing {
        self.steps.spacing(self.log.steps, self.log.scene.model.parameters().step_s)
    }

    /// Computes the next step; false when there is none.
    ///
    /// # Errors
    /// When it cannot be read, or differs from the log.
    pub fn advance(&mut self) -> Result<bool, ReplayError> {
        let Some(next) = self.cursor.next(&self.log) else { return Ok(false) };
        let (logged, input) = next?;
        step(&self.log.scene.model, &mut self.state, &input);
        self.cursor.compare(&self.log, &logged, &self.state)?;
        if self.steps.contains(logged.step) {
            self.snapshot.capture(logged.step, &input, &self.state);
            self.builder.push(&self.snapshot);
        }
        Ok(true)
    }

    /// Ends the frames, with a text if they are incomplete.
    ///
    /// # Errors
    /// When the log has no steps.
    pub fn finish(self, failure: Option<String>) -> Result<Replayed, ReplayError> {
        let Self { log, cursor, builder, .. } = self;
        let replayed = cursor.finish(&log);
        builder.finish(failure.or_else(|| replayed.as_ref().err().map(ToString::to_string)));
        replayed
    }
}
