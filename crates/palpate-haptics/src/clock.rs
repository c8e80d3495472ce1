//! Absolute deadlines, a period apart.

use spin_sleep::SpinSleeper;
use std::time::{Duration, Instant};

/// The system is trusted to wake a thread within this of when it should; the rest is waited for awake.
const SPIN: Duration = Duration::from_micros(100);

/// A grid in time: tick k is k periods after the start, and a phase later.
#[derive(Debug, Clone, Copy)]
pub struct Clock {
    start: Instant,
    period_s: f64,
    phase_s: f64,
    sleeper: SpinSleeper,
}

impl Clock {
    /// From a common start, with a period [s]. Short periods leave a thread awake for at most a third of them.
    pub fn new(start: Instant, period_s: f64) -> Self {
        let awake = SPIN.min(Duration::from_secs_f64(period_s / 3.0));
        Self { start, period_s, phase_s: 0.0, sleeper: SpinSleeper::new(awake.subsec_nanos()) }
    }

    /// The same without being awake before a tick: later by what the system takes to wake a thread, and cheaper.
    pub fn asleep(self) -> Self {
        Self { sleeper: SpinSleeper::new(0), ..self }
    }

    /// The same with all ticks later by a phase [s]; times still count from the start.
    pub fn later(self, phase_s: f64) -> Self {
        Self { phase_s, ..self }
    }

    /// Seconds since the start.
    pub fn now_s(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }

    /// When a tick is due.
    pub fn deadline(&self, tick: u64) -> Instant {
        self.start + Duration::from_secs_f64(self.phase_s + tick as f64 * self.period_s)
    }

    /// Wait for a tick; gives how late it is then.
    pub fn wait(&self, tick: u64) -> Duration {
        let deadline = self.deadline(tick);
        self.sleeper.sleep_until(deadline);
        Instant::now().saturating_duration_since(deadline)
    }

    /// The first tick after `tick` that is not over yet.
    pub fn next_after(&self, tick: u64) -> u64 {
        let passed = ((self.now_s() - self.phase_s) / self.period_s).ceil() as u64;
        passed.max(tick + 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_lie_on_the_grid_and_none_that_is_over_is_waited_for() {
        let start = Instant::now() - Duration::from_millis(10);
        let clock = Clock::new(start, 1e-3);
        assert_eq!(clock.deadline(2500), start + Duration::from_secs_f64(2.5));
        let next = clock.next_after(3);
        assert!(next > 10 && clock.deadline(next) > start + Duration::from_millis(10), "{next}");
        assert_eq!(clock.later(2e-4).deadline(2500), start + Duration::from_secs_f64(2.5002));
        // A tick that lies behind is late by what has passed since.
        assert!(clock.wait(2) >= Duration::from_millis(8));
        let waited = clock.next_after(next);
        clock.wait(waited);
        assert!(Instant::now() >= clock.deadline(waited));
    }
}
