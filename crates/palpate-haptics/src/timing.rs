//! How a process keeps its time: histograms that record without allocating.

use crate::scheduling::GrantedScheduling;
use hdrhistogram::Histogram;
use rtrb::{Consumer, Producer, RingBuffer};
use std::sync::{Arc, OnceLock};
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

/// One cycle of a process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cycle {
    /// How late it began.
    pub late: Duration,
    /// How long it took.
    pub took: Duration,
    /// If it ended after the next was due: whether by itself, and how many ticks are passed over for it.
    pub overrun: Option<(bool, u64)>,
}

/// A process's end of a line over which it tells of its cycles while it runs.
pub struct CycleSender(Producer<Cycle>, Arc<OnceLock<GrantedScheduling>>);

/// The other end.
pub struct CycleReceiver(Consumer<Cycle>, Arc<OnceLock<GrantedScheduling>>);

/// A line for so many cycles that nobody has listened to yet; more are not told.
pub fn cycles(room: usize) -> (CycleSender, CycleReceiver) {
    let (producer, consumer) = RingBuffer::new(room);
    let granted = Arc::default();
    (CycleSender(producer, Arc::clone(&granted)), CycleReceiver(consumer, granted))
}

impl CycleSender {
    /// Tell what the system has granted, before the first cycle.
    pub(crate) fn begin(&mut self, granted: GrantedScheduling) {
        let _ = self.1.set(granted);
    }

    /// Tell of a cycle, if somebody listens.
    ///
    /// # Real time
    pub(crate) fn tell(&mut self, cycle: Cycle) {
        let _ = self.0.push(cycle);
    }
}

impl CycleReceiver {
    /// What the system granted the process; none before it has begun.
    pub fn granted(&self) -> Option<&GrantedScheduling> {
        self.1.get()
    }

    /// Take in all cycles that were told since the last time.
    pub fn listen(&mut self, timing: &mut Timing) {
        while let Ok(cycle) = self.0.pop() {
            timing.record(cycle);
        }
    }
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
    /// Take in a cycle.
    ///
    /// # Real time
    pub fn record(&mut self, Cycle { late, took, overrun }: Cycle) {
        self.lateness.record(late);
        self.compute.record(took);
        if let Some((own, skipped)) = overrun {
            self.overruns += 1;
            self.own_overruns += u64::from(own);
            self.skipped += skipped;
        }
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
    fn percentiles_are_those_of_what_was_told() {
        let mut timing = Timing::default();
        let (mut teller, mut listener) = cycles(700);
        for k in 1..=1000_u64 {
            let overrun = [(3, (true, 2)), (1000, (false, 0))].into_iter().find(|(at, _)| *at == k);
            let (late, took) = (Duration::from_nanos(10 * k), Duration::from_micros(k));
            teller.tell(Cycle { late, took, overrun: overrun.map(|(_, overrun)| overrun) });
            if k.is_multiple_of(500) {
                listener.listen(&mut timing);
            }
        }
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
