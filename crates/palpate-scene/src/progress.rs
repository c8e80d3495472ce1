//! Progress of recording, for callers that show it.

use palpate_fem::Progress;

/// Progress without remarks: for recordings whose coarse elements are intended.
pub struct WithoutRemarks<'a>(pub &'a mut dyn Progress);

impl Progress for WithoutRemarks<'_> {
    fn begin(&mut self, stage: &str, total: u64) {
        self.0.begin(stage, total);
    }
    fn advance(&mut self, units: u64) {
        self.0.advance(units);
    }
    fn warn(&mut self, _text: &str) {}
    fn is_interrupted(&self) -> bool {
        self.0.is_interrupted()
    }
}

/// Progress as calls of a function with the stage and its completed share, at most a hundred times a stage.
pub struct ProgressFn<F> {
    report: F,
    stage: String,
    total: u64,
    done: u64,
    /// Hundredths that were reported.
    reported: u64,
}

impl<F: FnMut(&str, Option<f64>)> ProgressFn<F> {
    /// Progress for a function; its share is none where the amount of work is unknown.
    pub fn new(report: F) -> Self {
        Self { report, stage: String::new(), total: 0, done: 0, reported: 0 }
    }
}

impl<F: FnMut(&str, Option<f64>)> Progress for ProgressFn<F> {
    fn begin(&mut self, stage: &str, total: u64) {
        (self.stage, self.total, self.done, self.reported) = (stage.into(), total, 0, 0);
        (self.report)(stage, (total > 0).then_some(0.0));
    }

    fn advance(&mut self, units: u64) {
        self.done += units;
        let share = self.done as f64 / self.total.max(1) as f64;
        let hundredths = (100.0 * share) as u64;
        if hundredths > self.reported {
            self.reported = hundredths;
            (self.report)(&self.stage, Some(share.min(1.0)));
        }
    }

    fn warn(&mut self, _text: &str) {}
}
