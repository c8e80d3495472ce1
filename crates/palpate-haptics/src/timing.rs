//! Timing of periodic processes: duration histograms that record without allocating, lateness, compute time, overruns.

use hdrhistogram::Histogram;
use std::time::Duration;

/// Longest duration that is resolved [ns]: 10 s. Longer ones count as this.
const LONGEST_NS: u64 = 10_000_000_000;

/// Significant decimal digits of a recorded duration.
const DIGITS: u8 = 3;

/// Histogram of durations, from 1 ns to 10 s with 3 significant digits.
#[derive(Debug, Clone)]
pub struct DurationHistogram(Histogram<u64>);

/// Lateness, compute time and overruns of a periodic process.
#[derive(Debug, Clone, Default)]
pub struct Timing {
    lateness: DurationHistogram,
    compute: DurationHistogram,
    /// Cycles that ended after the next deadline.
    pub overruns: u64,
    /// Overruns whose compute time exceeded the period. The other overruns started late.
    pub own_overruns: u64,
    /// Ticks that were skipped to return to the grid of deadlines.
    pub skipped: u64,
}

/// Percentiles of durations [µs].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Percentiles {
    /// Median.
    pub p50: f64,
    /// 99th percentile.
    pub p99: f64,
    /// 99.9th percentile.
    pub p999: f64,
    /// Maximum.
    pub max: f64,
}

/// Timing of one cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cycle {
    /// Delay of the start after the deadline.
    pub lateness: Duration,
    /// Compute time.
    pub compute: Duration,
    /// Overrun, if the cycle ended after the next deadline.
    pub overrun: Option<Overrun>,
}

/// Overrun of a cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Overrun {
    /// Whether the compute time alone exceeded the period.
    pub by_compute: bool,
    /// Ticks that were skipped.
    pub skipped: u64,
}

impl Default for DurationHistogram {
    fn default() -> Self {
        let histogram = Histogram::new_with_bounds(1, LONGEST_NS, DIGITS);
        Self(histogram.unwrap_or_else(|_| unreachable!("constant bounds are good")))
    }
}

/// Quantile [µs] of sorted durations [ns]; 0 of none.
pub fn percentile_us(sorted_ns: &[u32], share: f64) -> f64 {
    let at = (share * sorted_ns.len() as f64).ceil() as usize;
    sorted_ns.get(at.clamp(1, sorted_ns.len().max(1)) - 1).map_or(0.0, |ns| f64::from(*ns) / 1000.0)
}

impl DurationHistogram {
    /// Records a duration.
    ///
    /// # Real time
    /// No allocation, lock or system call.
    pub fn record(&mut self, duration: Duration) {
        self.0.saturating_record(duration.as_nanos().min(u128::from(LONGEST_NS)) as u64);
    }

    /// Number of recorded durations.
    pub fn count(&self) -> u64 {
        self.0.len()
    }

    /// Percentiles [µs].
    pub fn percentiles_us(&self) -> Percentiles {
        let at = |quantile: f64| self.0.value_at_quantile(quantile) as f64 * 1e-3;
        Percentiles { p50: at(0.5), p99: at(0.99), p999: at(0.999), max: self.0.max() as f64 * 1e-3 }
    }
}

impl Timing {
    /// Records a cycle.
    ///
    /// # Real time
    /// No allocation, lock or system call.
    pub fn record(&mut self, Cycle { lateness, compute, overrun }: Cycle) {
        self.lateness.record(lateness);
        self.compute.record(compute);
        if let Some(Overrun { by_compute, skipped }) = overrun {
            self.overruns += 1;
            self.own_overruns += u64::from(by_compute);
            self.skipped += skipped;
        }
    }

    /// Number of recorded cycles.
    pub fn cycles(&self) -> u64 {
        self.compute.count()
    }

    /// Percentiles of the lateness [µs].
    pub fn lateness_us(&self) -> Percentiles {
        self.lateness.percentiles_us()
    }

    /// Percentiles of the compute time [µs].
    pub fn compute_us(&self) -> Percentiles {
        self.compute.percentiles_us()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentile_of_sorted_durations_is_one_of_them() {
        let durations = [1000, 2000, 3000, 4000];
        let expected = [(0.0, 1.0), (0.5, 2.0), (0.51, 3.0), (1.0, 4.0)];
        assert!(expected.iter().all(|(share, us)| percentile_us(&durations, *share) == *us));
        assert_eq!(percentile_us(&[], 0.5), 0.0);
    }
}
