//! Progress of the measurements.

use palpate_fem::{Progress, SilentProgress};

/// Progress whose stages end, and whose units are counted from other threads.
pub trait StageProgress: Progress {
    /// Ends the present stage.
    fn finish(&mut self);
    /// A counter of the present stage's units for any thread.
    fn counter(&self) -> Box<dyn Fn(usize) + Sync>;
}

impl StageProgress for SilentProgress {
    fn finish(&mut self) {}

    fn counter(&self) -> Box<dyn Fn(usize) + Sync> {
        Box::new(|_| {})
    }
}
