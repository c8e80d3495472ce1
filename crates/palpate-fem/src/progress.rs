//! How long work tells what it is doing.

/// Listener to the stages of offline work.
pub trait Progress {
    /// A stage begins: what is being done, and how many units of work it has.
    fn begin(&mut self, stage: &str, total: u64);
    /// Some units are done.
    fn advance(&mut self, units: u64);
    /// Something that the user should know.
    fn remark(&mut self, text: &str);
}

/// Tells nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl Progress for Silent {
    fn begin(&mut self, _stage: &str, _total: u64) {}
    fn advance(&mut self, _units: u64) {}
    fn remark(&mut self, _text: &str) {}
}
