//! Progress and interruption of offline work.

/// Listener to the progress of offline work, which can also interrupt it.
pub trait Progress {
    /// A stage begins, with a total of this many units of work.
    fn begin(&mut self, stage: &str, total: u64);
    /// Units of work of the present stage are done.
    fn advance(&mut self, units: u64);
    /// A warning for the user, one sentence.
    fn warn(&mut self, text: &str);
    /// Whether the work is to stop at the next opportunity with an `Interrupted` error. Asked a few times a second.
    fn is_interrupted(&self) -> bool {
        false
    }
}

/// Listener that ignores everything.
#[derive(Debug, Clone, Copy, Default)]
pub struct SilentProgress;

impl Progress for SilentProgress {
    fn begin(&mut self, _stage: &str, _total: u64) {}
    fn advance(&mut self, _units: u64) {}
    fn warn(&mut self, _text: &str) {}
}
