//! Channel that carries the timing of a process's cycles to a monitor.

use crate::scheduling::GrantedScheduling;
use crate::timing::{Cycle, Timing};
use rtrb::{Consumer, Producer, RingBuffer};
use std::sync::{Arc, OnceLock};

/// Sending end of a channel of cycles, held by the process.
pub struct CycleSender {
    cycles: Producer<Cycle>,
    granted: Arc<OnceLock<GrantedScheduling>>,
}

/// Receiving end of a channel of cycles, held by a monitor.
pub struct CycleReceiver {
    cycles: Consumer<Cycle>,
    granted: Arc<OnceLock<GrantedScheduling>>,
}

/// Channel of cycles with a capacity. Cycles that find it full are not sent.
pub fn cycle_channel(capacity: usize) -> (CycleSender, CycleReceiver) {
    let (producer, consumer) = RingBuffer::new(capacity);
    let granted = Arc::default();
    let sender = CycleSender { cycles: producer, granted: Arc::clone(&granted) };
    (sender, CycleReceiver { cycles: consumer, granted })
}

impl CycleSender {
    /// Sends the granted scheduling, before the first cycle.
    pub(crate) fn send_granted(&mut self, granted: GrantedScheduling) {
        let _ = self.granted.set(granted);
    }

    /// Sends a cycle, if the channel has room.
    ///
    /// # Real time
    /// No allocation, lock or system call.
    pub(crate) fn send(&mut self, cycle: Cycle) {
        let _ = self.cycles.push(cycle);
    }
}

impl CycleReceiver {
    /// Granted scheduling of the process; `None` before its first cycle.
    pub fn granted(&self) -> Option<&GrantedScheduling> {
        self.granted.get()
    }

    /// Moves all cycles that have arrived into `timing`.
    pub fn drain_into(&mut self, timing: &mut Timing) {
        while let Ok(cycle) = self.cycles.pop() {
            timing.record(cycle);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::timing::Overrun;
    use std::time::Duration;

    #[test]
    fn percentiles_are_those_of_the_cycles_that_were_sent() {
        /// Resolution of three significant digits, at its coarsest.
        const RESOLUTION: f64 = 2e-3;
        let mut timing = Timing::default();
        let (mut sender, mut receiver) = cycle_channel(700);
        let overruns = [
            (3, Overrun { by_compute: true, skipped: 2 }),
            (1000, Overrun { by_compute: false, skipped: 0 }),
        ];
        for k in 1..=1000_u64 {
            let overrun = overruns.iter().find(|(at, _)| *at == k).map(|(_, overrun)| *overrun);
            let (lateness, compute) = (Duration::from_nanos(10 * k), Duration::from_micros(k));
            sender.send(Cycle { lateness, compute, overrun });
            if k.is_multiple_of(500) {
                receiver.drain_into(&mut timing);
            }
        }
        let (late, took) = (timing.lateness_us(), timing.compute_us());
        assert_eq!(timing.cycles(), 1000);
        for (got, expected) in
            [(took.p50, 500.0), (took.p99, 990.0), (took.p999, 999.0), (took.max, 1000.0), (late.max, 10.0)]
        {
            assert!((got / expected - 1.0).abs() < RESOLUTION, "{got} {expected}");
        }
        assert_eq!((timing.overruns, timing.own_overruns, timing.skipped), (2, 1, 2));
    }
}
