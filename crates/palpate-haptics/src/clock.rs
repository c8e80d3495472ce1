//! Periodic absolute deadlines.
//!
//! ```text
//! t_k = t_0 + φ + k·T        k = 0, 1, 2, …
//! ```
//!
//! t_0 is the common start of all processes, T the period [s], φ the phase [s].

use spin_sleep::SpinSleeper;
use std::time::{Duration, Instant};

/// Wake-up latency that the operating system is trusted to keep; the rest of a wait is spent spinning.
const SPIN: Duration = Duration::from_micros(100);

/// Grid of deadlines of a periodic process.
#[derive(Debug, Clone, Copy)]
pub struct Clock {
    start: Instant,
    period_s: f64,
    phase_s: f64,
    sleeper: SpinSleeper,
}

impl Clock {
    /// Clock with a period [s] and phase 0. A wait spins for 100 µs or a third of the period, whichever is less.
    pub fn new(start: Instant, period_s: f64) -> Self {
        let spin = SPIN.min(Duration::from_secs_f64(period_s / 3.0));
        Self { start, period_s, phase_s: 0.0, sleeper: SpinSleeper::new(spin.subsec_nanos()) }
    }

    /// Clock that sleeps to the deadline without spinning: cheaper, and late by the system's wake-up latency.
    #[must_use]
    pub fn without_spinning(self) -> Self {
        Self { sleeper: SpinSleeper::new(0), ..self }
    }

    /// Clock with all deadlines later by a phase [s]. Times still count from the start.
    #[must_use]
    pub fn with_phase(self, phase_s: f64) -> Self {
        Self { phase_s, ..self }
    }

    /// Time since the start [s].
    pub fn now_s(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }

    /// Deadline of a tick.
    pub fn deadline(&self, tick: u64) -> Instant {
        self.start + Duration::from_secs_f64(self.phase_s + tick as f64 * self.period_s)
    }

    /// Waits for the deadline of a tick and returns the lateness.
    pub fn wait(&self, tick: u64) -> Duration {
        let deadline = self.deadline(tick);
        self.sleeper.sleep_until(deadline);
        Instant::now().saturating_duration_since(deadline)
    }

    /// First tick after `tick` whose deadline has not passed.
    pub fn next_after(&self, tick: u64) -> u64 {
        let passed = ((self.now_s() - self.phase_s) / self.period_s).ceil() as u64;
        passed.max(tick + 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_lie_on_the_grid_and_none_that_has_passed_is_waited_for() {
        let start = Instant::now() - Duration::from_millis(10);
        let clock = Clock::new(start, 1e-3);
        assert_eq!(clock.deadline(2500), start + Duration::from_secs_f64(2.5));
        let next = clock.next_after(3);
        assert!(next > 10 && clock.deadline(next) > start + Duration::from_millis(10), "{next}");
        assert_eq!(clock.with_phase(2e-4).deadline(2500), start + Duration::from_secs_f64(2.5002));
        // A deadline in the past is late by the time since.
        assert!(clock.wait(2) >= Duration::from_millis(8));
        let waited = clock.next_after(next);
        clock.wait(waited);
        assert!(Instant::now() >= clock.deadline(waited));
    }
}
