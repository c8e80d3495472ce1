//! How a process keeps its time: histograms that record without allocating.

use hdrhistogram::Histogram;
use std::time::Duration;

/// The longest time [ns] that is told from longer ones: ten seconds.
const LONGEST_NS: u64 = 10_000_000_000;

/// How many digits of a time are kept.
const DIGITS: u8 = 3;

/// Times as they come: recorded without allocating, told as percentiles.
#[derive(Debug, Clone)]
pub struct Spread(Histogram<u64>);

/// Lateness, compute time and overruns of a periodic process.
#[derive(Debug, Clone, Default)]
pub struct Timing {
    lateness: Spread,
    compute: Spread,
    /// Cycles that ended after the next one was due.
    pub overruns: u64,
    /// Those of them that computed longer than a period: not for waking up late.
    pub own_overruns: u64,
    /// Ticks that were passed over to be on the grid again.
    pub skipped: u64,
}

/// Percentiles of a time [µs].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Percentiles {
    /// Half are below.
    pub p50: f64,
    /// 99 % are below.
    pub p99: f64,
    /// 99.9 % are below.
    pub p999: f64,
    /// All are.
    pub max: f64,
}

impl Default for Spread {
    fn default() -> Self {
        let histogram = Histogram::new_with_bounds(1, LONGEST_NS, DIGITS);
        Self(histogram.unwrap_or_else(|_| unreachable!("constant bounds are good")))
    }
}

impl Spread {
    /// Take in a time.
    ///
    /// # Real time
    pub fn record(&mut self, time: Duration) {
        self.0.saturating_record(time.as_nanos().min(u128::from(LONGEST_NS)) as u64);
    }

    /// How many there were.
    pub fn count(&self) -> u64 {
        self.0.len()
    }

    /// Their percentiles [µs].
    pub fn percentiles_us(&self) -> Percentiles {
        let at = |share: f64| self.0.value_at_quantile(share) as f64 * 1e-3;
        Percentiles { p50: at(0.5), p99: at(0.99), p999: at(0.999), max: self.0.max() as f64 * 1e-3 }
    }
}

impl Timing {
    /// Take in a cycle: how late it began, and how long it took.
    ///
    /// # Real time
    pub fn record(&mut self, late: Duration, took: Duration) {
        self.lateness.record(late);
        self.compute.record(took);
    }

    /// Take in a cycle that ended after the next was due, and how many ticks are passed over for it.
    ///
    /// # Real time
    pub fn record_overrun(&mut self, own: bool, skipped: u64) {
        self.overruns += 1;
        self.own_overruns += u64::from(own);
        self.skipped += skipped;
    }

    /// Cycles.
    pub fn cycles(&self) -> u64 {
        self.compute.count()
    }

    /// How late cycles began.
    pub fn lateness_us(&self) -> Percentiles {
        self.lateness.percentiles_us()
    }

    /// How long they took.
    pub fn compute_us(&self) -> Percentiles {
        self.compute.percentiles_us()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_those_of_what_was_recorded() {
        let mut timing = Timing::default();
        for k in 1..=1000_u64 {
            timing.record(Duration::from_nanos(10 * k), Duration::from_micros(k));
        }
        timing.record_overrun(true, 2);
        timing.record_overrun(false, 0);
        let (late, took) = (timing.lateness_us(), timing.compute_us());
        assert_eq!(timing.cycles(), 1000);
        for (got, expected) in
            [(took.p50, 500.0), (took.p99, 990.0), (took.p999, 999.0), (took.max, 1000.0), (late.max, 10.0)]
        {
            assert!((got / expected - 1.0).abs() < 2e-3, "{got} {expected}");
        }
        assert_eq!((timing.overruns, timing.own_overruns, timing.skipped), (2, 1, 2));
    }
}
