//! Logs as the viewer shows them: computed again, a picture every so often.

use crate::Failure;
use crate::logged_run::LoggedRun;
use crate::stages::describe;
use palpate::State;
use palpate_haptics::Moment;
use palpate_viewer::{LogMaker, LogShow};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Pictures of one log that are kept at once: ten minutes at 60 Hz, some 100 MB.
const MOST_FRAMES: u64 = 36_000;

/// A log whose pictures are to be made.
pub struct ShownLog {
    run: LoggedRun,
    every: u64,
    maker: LogMaker,
    /// What the viewer is given.
    pub show: Arc<LogShow>,
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
        let run = LoggedRun::read(path)?;
        let step_s = run.scene.model.parameters().step_s;
        let wanted = (1.0 / (per_s * step_s)).round().max(1.0) as u64;
        let every = wanted.max(run.steps.div_ceil(MOST_FRAMES));
        let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        let about = format!("{:.1} s at {:.0} Hz", run.steps as f64 * step_s, 1.0 / step_s);
        let description = describe(&run.scene, (None, name.clone(), about), |_, _| false);
        let (model, frames) = (run.scene.model.clone(), run.steps / every + 1);
        let (show, maker) = LogShow::new(number, name, model, description, frames, every as f64 * step_s);
        Ok(Self { run, every, maker, show })
    }

    /// Of what it will show.
    pub fn frames(&self) -> Frames {
        let step_s = self.run.scene.model.parameters().step_s;
        Frames { count: self.run.steps / self.every + 1, apart_s: self.every as f64 * step_s }
    }

    /// Compute it, until it is done or `stop` is set.
    pub fn make(self, stop: &AtomicBool) -> Result<(), Failure> {
        let Self { run, every, mut maker, .. } = self;
        let model = &run.scene.model;
        let made = run.input_at_start().and_then(|start| {
            let mut state = State::new(model);
            let mut moment = Moment::new(model, &state, &start);
            maker.take(&moment);
            let mut number = 0;
            run.repeat(&mut state, run.steps, |input, state, _| {
                number += 1;
                if number % every == 0 {
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
