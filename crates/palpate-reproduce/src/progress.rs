//! Progress of the measurements.

use palpate_fem::progress::{Progress, Silent};

/// Progress whose stages end, and whose units are counted from other threads.
pub trait StageProgress: Progress {
    /// Ends the present stage.
    fn finish(&mut self);
    /// A counter of the present stage's units for any thread.
    fn counter(&self) -> Box<dyn Fn(usize) + Sync>;
}

impl StageProgress for Silent {
    fn finish(&mut self) {}

    fn counter(&self) -> Box<dyn Fn(usize) + Sync> {
        Box::new(|_| {})
    }
}
