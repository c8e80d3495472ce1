//! Lock-free exchange between a haptic update and a driver's thread: newest reading one way, newest force the other.
//!
//! A value that its sender has not renewed for [`STALE_AFTER`] does not count (watchdog).

use super::Reading;
use glam::DVec3;
use std::time::{Duration, Instant};
use triple_buffer::{Input, Output, triple_buffer};

/// Age beyond which a reading or a force does not count.
pub(super) const STALE_AFTER: Duration = Duration::from_millis(20);

/// Reading of the driver's thread, with a fault code.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    sequence: u64,
    /// Reading.
    pub reading: Reading,
    /// Fault code of the vendor's library; 0 for none.
    pub fault: u32,
}

/// Force command of the haptic update.
#[derive(Debug, Clone, Copy)]
struct Command {
    sequence: u64,
    force: DVec3,
}

/// Haptic update's side.
pub(super) struct UpdateSide {
    samples: Output<Sample>,
    commands: Input<Command>,
    commands_sent: u64,
    seen: u64,
    seen_s: f64,
}

/// Driver's side.
pub(super) struct DriverSide {
    samples: Input<Sample>,
    commands: Output<Command>,
    samples_sent: u64,
    seen: u64,
    seen_at: Instant,
}

/// Both sides of an exchange.
pub(super) fn exchange() -> (UpdateSide, DriverSide) {
    let reading = Reading { position: DVec3::ZERO, orientation: None, buttons: 0 };
    let (samples_in, samples_out) = triple_buffer(&Sample { sequence: 0, reading, fault: 0 });
    let (commands_in, commands_out) = triple_buffer(&Command { sequence: 0, force: DVec3::ZERO });
    let update = UpdateSide {
        samples: samples_out,
        commands: commands_in,
        commands_sent: 0,
        seen: 0,
        seen_s: f64::NEG_INFINITY,
    };
    let driver = DriverSide {
        samples: samples_in,
        commands: commands_out,
        samples_sent: 0,
        seen: 0,
        seen_at: Instant::now(),
    };
    (update, driver)
}

impl UpdateSide {
    /// Newest sample at a time [s]; `None` if it is stale.
    ///
    /// # Real time
    /// No allocation, lock or system call.
    pub fn newest(&mut self, now_s: f64) -> Option<Sample> {
        let sample = *self.samples.read();
        if sample.sequence != self.seen {
            (self.seen, self.seen_s) = (sample.sequence, now_s);
        }
        (now_s - self.seen_s <= STALE_AFTER.as_secs_f64()).then_some(sample)
    }

    /// Commands a force [N].
    ///
    /// # Real time
    /// No allocation, lock or system call.
    pub fn set_force(&mut self, force: DVec3) {
        self.commands_sent += 1;
        self.commands.write(Command { sequence: self.commands_sent, force });
    }
}

impl DriverSide {
    /// Sends a reading with a fault code; 0 for none.
    ///
    /// # Real time
    /// No allocation, lock or system call.
    pub fn send(&mut self, reading: Reading, fault: u32) {
        self.samples_sent += 1;
        self.samples.write(Sample { sequence: self.samples_sent, reading, fault });
    }

    /// Commanded force at a time [N]; zero if it is stale or not finite.
    ///
    /// # Real time
    /// No allocation, lock or system call.
    pub fn commanded_force(&mut self, now: Instant) -> DVec3 {
        let command = *self.commands.read();
        if command.sequence != self.seen {
            (self.seen, self.seen_at) = (command.sequence, now);
        }
        let fresh = now.saturating_duration_since(self.seen_at) <= STALE_AFTER;
        if command.force.is_finite() && fresh { command.force } else { DVec3::ZERO }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stale_readings_and_forces_do_not_count() {
        let (mut update, mut driver) = exchange();
        assert!(update.newest(0.0).is_none(), "nothing was sent yet");
        let reading = Reading { position: DVec3::X, orientation: None, buttons: 1 };
        driver.send(reading, 7);
        let sample = update.newest(1.0).expect("it was sent");
        assert_eq!((sample.reading, sample.fault), (reading, 7));
        assert!(update.newest(1.019).is_some() && update.newest(1.021).is_none());

        let now = Instant::now();
        let later = |millis| now + Duration::from_millis(millis);
        assert_eq!(driver.commanded_force(now), DVec3::ZERO);
        update.set_force(DVec3::Y);
        assert_eq!(driver.commanded_force(now), DVec3::Y);
        assert_eq!(driver.commanded_force(later(20)), DVec3::Y);
        assert_eq!(driver.commanded_force(later(21)), DVec3::ZERO, "the haptic update has stopped");
        update.set_force(DVec3::NAN);
        assert_eq!(driver.commanded_force(later(21)), DVec3::ZERO);
    }
}
