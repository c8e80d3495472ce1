//! How a run goes on while it is looked at: paused, slowly, step by step.

use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};

/// What somebody who watches asks of a force process; shared with it.
#[derive(Debug)]
pub struct Playback {
    paused: AtomicBool,
    /// Ticks of the clock to a step.
    slowness: AtomicU32,
    /// Steps that a paused run shall still make.
    single: AtomicU32,
}

impl Default for Playback {
    /// By the clock.
    fn default() -> Self {
        Self { paused: AtomicBool::new(false), slowness: AtomicU32::new(1), single: AtomicU32::new(0) }
    }
}

impl Playback {
    /// Pause, or go on.
    pub fn pause(&self, paused: bool) {
        self.single.store(0, Ordering::Relaxed);
        self.paused.store(paused, Ordering::Relaxed);
    }

    /// Whether it is paused.
    pub fn is_paused(&self) -> bool {
        self.paused.load(Ordering::Relaxed)
    }

    /// Make a step while paused.
    pub fn step(&self) {
        self.single.fetch_add(1, Ordering::Relaxed);
    }

    /// So many times as slow as the clock, at least 1.
    pub fn slow(&self, slowness: u32) {
        self.slowness.store(slowness.max(1), Ordering::Relaxed);
    }

    /// How many times as slow as the clock it is.
    pub fn slowness(&self) -> u32 {
        self.slowness.load(Ordering::Relaxed)
    }

    /// Whether a step is to be made at a tick.
    ///
    /// # Real time
    pub(crate) fn goes(&self, tick: u64) -> bool {
        if self.is_paused() {
            let less = |left: u32| left.checked_sub(1);
            return self.single.fetch_update(Ordering::Relaxed, Ordering::Relaxed, less).is_ok();
        }
        tick.is_multiple_of(u64::from(self.slowness()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_paused_run_makes_the_steps_it_is_asked_for_and_a_slow_one_every_few_ticks() {
        let playback = Playback::default();
        assert!((0..10).all(|tick| playback.goes(tick)));
        playback.slow(4);
        assert_eq!((0..100).filter(|&tick| playback.goes(tick)).count(), 25);
        playback.pause(true);
        playback.step();
        playback.step();
        assert_eq!((0..100).filter(|&tick| playback.goes(tick)).count(), 2);
        playback.step();
        playback.pause(false);
        playback.pause(true);
        assert!(!playback.goes(0), "what was asked for before is forgotten");
        playback.slow(0);
        assert_eq!(playback.slowness(), 1);
    }
}
