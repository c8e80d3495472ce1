//! Logs as the viewer shows them: computed again, a picture every so often.

use crate::Failure;
use crate::logged_run::LoggedRun;
use crate::stages::describe;
use palpate_haptics::Snapshot;
use palpate_viewer::{LogFrameBuilder, LogFrames};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Pictures of one log that are kept at once: ten minutes at 60 Hz, some 100 MB.
const MOST_FRAMES: u64 = 36_000;

/// A log whose pictures are to be made.
pub struct ShownLog {
    run: LoggedRun,
    wanted: Wanted,
    maker: LogFrameBuilder,
    /// What the viewer is given.
    pub show: Arc<LogFrames>,
}

/// The steps, counted from the start at 0, that become pictures.
enum Wanted {
    /// Every so many.
    Every(u64),
    /// These, in rising order.
    At(Vec<u64>),
}

impl Wanted {
    fn has(&self, step: u64) -> bool {
        match self {
            Self::Every(every) => step.is_multiple_of(*every),
            Self::At(steps) => steps.binary_search(&step).is_ok(),
        }
    }

    fn frames(&self, steps: u64, step_s: f64) -> Frames {
        match self {
            Self::Every(every) => Frames { count: steps / every + 1, apart_s: *every as f64 * step_s },
            Self::At(chosen) => Frames { count: chosen.len() as u64, apart_s: step_s },
        }
    }
}

/// How pictures lie in time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frames {
    /// How many.
    pub count: u64,
    /// Time [s] between them.
    pub apart_s: f64,
}

impl ShownLog {
    /// A log, as one of those that are shown together, with so many pictures per second of it: fewer where it is long.
    pub fn read(path: &Path, number: usize, per_s: f64) -> Result<Self, Failure> {
        Self::of(path, number, |run| {
            let step_s = run.scene.model.parameters().step_s;
            let wanted = (1.0 / (per_s * step_s)).round().max(1.0) as u64;
            Wanted::Every(wanted.max(run.steps.div_ceil(MOST_FRAMES)))
        })
    }

    /// A log of which these steps become pictures, in rising order; 0 is the start.
    pub fn read_at(path: &Path, steps: Vec<u64>) -> Result<Self, Failure> {
        Self::of(path, 0, |_| Wanted::At(steps))
    }

    fn of(path: &Path, number: usize, wanted: impl FnOnce(&LoggedRun) -> Wanted) -> Result<Self, Failure> {
        let run = LoggedRun::read(path)?;
        let step_s = run.scene.model.parameters().step_s;
        let wanted = wanted(&run);
        let frames = wanted.frames(run.steps, step_s);
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        let about = format!("{:.1} s at {:.0} Hz", run.steps as f64 * step_s, 1.0 / step_s);
        let description = describe(&run.scene, (None, name.clone(), about), |_, _| false);
        let model = run.scene.model.clone();
        let (show, maker) = LogFrames::new(number, name, model, description, frames.count, frames.apart_s);
        Ok(Self { run, wanted, maker, show })
    }

    /// Of what it will show.
    pub fn frames(&self) -> Frames {
        self.wanted.frames(self.run.steps, self.run.scene.model.parameters().step_s)
    }

    /// Compute it, until it is done or `stop` is set.
    pub fn make(self, stop: &AtomicBool) -> Result<(), Failure> {
        let Self { run, wanted, mut maker, .. } = self;
        let model = &run.scene.model;
        let starts = run.state_at_start().and_then(|state| Ok((state, run.input_at_start()?)));
        let made = starts.and_then(|(mut state, start)| {
            let mut moment = Snapshot::new(model, &state, &start);
            if wanted.has(0) {
                maker.take(&moment);
            }
            let mut number = 0;
            run.repeat(&mut state, run.steps, |input, state, _| {
                number += 1;
                if wanted.has(number) {
                    moment.take(number, input, state);
                    maker.take(&moment);
                }
                if stop.load(Ordering::Relaxed) { Err(Failure("interrupted".into())) } else { Ok(()) }
            })
        });
        maker.finish(made.as_ref().err().map(|failure| failure.0.clone()));
        made.map(|_| ())
    }
}
