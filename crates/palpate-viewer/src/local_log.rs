//! Record of a live scene of one page, from which its log is made afterwards.

use palpate::Input;
use palpate_haptics::InputRecord;

/// Longest record, in simulated time [s].
pub const LONGEST_RECORD_S: f64 = 60.0;

/// Upper limit of a record's length [bytes].
pub const LARGEST_RECORD_BYTES: usize = 64 << 20;

/// Record of the inputs of a live scene, up to its limits, or the next start of a scene.
#[derive(Debug, Clone)]
pub(crate) struct LocalRecord {
    pub inputs: InputRecord,
    pub has_ended: bool,
}

impl LocalRecord {
    /// Adds the input of a step, if there is room.
    pub fn push(&mut self, input: &Input, step_s: f64) {
        let is_full = self.inputs.steps() as f64 * step_s >= LONGEST_RECORD_S
            || self.inputs.bytes() >= LARGEST_RECORD_BYTES;
        self.has_ended |= is_full;
        if !self.has_ended {
            self.inputs.push(input);
        }
    }
}
