//! Playback of a live run: pause, slow motion, single steps.

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

/// Playback settings that a viewer shares with the force process.
#[derive(Debug)]
pub struct Playback {
    paused: AtomicBool,
    /// Ticks of the clock per step.
    slowdown: AtomicU32,
    /// Single steps that are still to be made while paused.
    requested_steps: AtomicU32,
}

impl Default for Playback {
    /// Running, at the speed of the clock.
    fn default() -> Self {
        Self {
            paused: AtomicBool::new(false),
            slowdown: AtomicU32::new(1),
            requested_steps: AtomicU32::new(0),
        }
    }
}

impl Playback {
    /// Pauses or resumes the run. Requested single steps are dropped.
    pub fn set_paused(&self, paused: bool) {
        self.requested_steps.store(0, Ordering::Relaxed);
        self.paused.store(paused, Ordering::Relaxed);
    }

    /// Whether the run is paused.
    pub fn is_paused(&self) -> bool {
        self.paused.load(Ordering::Relaxed)
    }

    /// Requests a single step of a paused run.
    pub fn request_step(&self) {
        self.requested_steps.fetch_add(1, Ordering::Relaxed);
    }

    /// Sets the slowdown: wall-clock time per simulated time, at least 1.
    pub fn set_slowdown(&self, slowdown: u32) {
        self.slowdown.store(slowdown.max(1), Ordering::Relaxed);
    }

    /// Slowdown: wall-clock time per simulated time.
    pub fn slowdown(&self) -> u32 {
        self.slowdown.load(Ordering::Relaxed)
    }

    /// Whether simulated time goes as fast as the clock: neither paused nor in slow motion.
    pub fn is_at_full_speed(&self) -> bool {
        self.slowdown() == 1 && !self.is_paused()
    }

    /// Whether a step is due at a tick. Consumes a requested step.
    ///
    /// # Real time
    /// No allocation, lock or system call.
    pub fn is_due(&self, tick: u64) -> bool {
        if self.is_paused() {
            let one_less = |left: u32| left.checked_sub(1);
            return self.requested_steps.fetch_update(Ordering::Relaxed, Ordering::Relaxed, one_less).is_ok();
        }
        tick.is_multiple_of(u64::from(self.slowdown()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_paused_run_makes_requested_steps_and_a_slow_one_every_few_ticks() {
        let playback = Playback::default();
        assert!((0..10).all(|tick| playback.is_due(tick)));
        playback.set_slowdown(4);
        assert_eq!((0..100).filter(|&tick| playback.is_due(tick)).count(), 25);
        playback.set_paused(true);
        playback.request_step();
        playback.request_step();
        assert_eq!((0..100).filter(|&tick| playback.is_due(tick)).count(), 2);
        playback.request_step();
        playback.set_paused(false);
        playback.set_paused(true);
        assert!(!playback.is_due(0), "resuming drops requested steps");
        playback.set_slowdown(0);
        assert_eq!(playback.slowdown(), 1);
    }
}
