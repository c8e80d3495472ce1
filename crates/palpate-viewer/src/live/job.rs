//! Slot of the one job that runs at a time.

use std::sync::atomic::{AtomicBool, Ordering};

/// Exclusive right to run a job.
#[derive(Debug, Default)]
pub(super) struct JobSlot(AtomicBool);

impl JobSlot {
    /// Claims the slot; returns false if it is taken.
    pub fn claim(&self) -> bool {
        !self.0.swap(true, Ordering::AcqRel)
    }

    /// Frees the slot.
    pub fn release(&self) {
        self.0.store(false, Ordering::Release);
    }

    /// Whether the slot is taken.
    pub fn is_busy(&self) -> bool {
        self.0.load(Ordering::Acquire)
    }
}
