//! Between a haptic update and a thread that drives a device: the newest reading one way, the newest force the other, without
//! locks. What one end has not renewed for [`SILENCE`] does not count at the other.

use super::Reading;
use glam::DVec3;
use std::time::{Duration, Instant};
use triple_buffer::{Input, Output, triple_buffer};

/// A reading, or a force, that has not been renewed for so long is none.
pub(super) const SILENCE: Duration = Duration::from_millis(20);

/// What the driving thread tells.
#[derive(Debug, Clone, Copy)]
pub(super) struct Told {
    sequence: u64,
    /// The newest reading.
    pub reading: Reading,
    /// The vendor's code for what went wrong with it; 0 for nothing.
    pub fault: u32,
}

#[derive(Debug, Clone, Copy)]
struct Wanted {
    sequence: u64,
    force: DVec3,
}

/// The haptic update's end.
pub(super) struct UpdateEnd {
    told: Output<Told>,
    wanted: Input<Wanted>,
    pushes: u64,
    seen: u64,
    seen_s: f64,
}

/// The driving thread's end.
pub(super) struct DriverEnd {
    told: Input<Told>,
    wanted: Output<Wanted>,
    tells: u64,
    seen: u64,
    seen_at: Instant,
}

/// Both ends.
pub(super) fn exchange() -> (UpdateEnd, DriverEnd) {
    let reading = Reading { position: DVec3::ZERO, orientation: None, buttons: 0 };
    let (told_in, told_out) = triple_buffer(&Told { sequence: 0, reading, fault: 0 });
    let (wanted_in, wanted_out) = triple_buffer(&Wanted { sequence: 0, force: DVec3::ZERO });
    let update =
        UpdateEnd { told: told_out, wanted: wanted_in, pushes: 0, seen: 0, seen_s: f64::NEG_INFINITY };
    let driver = DriverEnd { told: told_in, wanted: wanted_out, tells: 0, seen: 0, seen_at: Instant::now() };
    (update, driver)
}

impl UpdateEnd {
    /// The newest that was told; none if that was too long before a time [s].
    ///
    /// # Real time
    pub fn newest(&mut self, now_s: f64) -> Option<Told> {
        let told = *self.told.read();
        if told.sequence != self.seen {
            (self.seen, self.seen_s) = (told.sequence, now_s);
        }
        (now_s - self.seen_s <= SILENCE.as_secs_f64()).then_some(told)
    }

    /// Want a force [N] from now on.
    ///
    /// # Real time
    pub fn push(&mut self, force: DVec3) {
        self.pushes += 1;
        self.wanted.write(Wanted { sequence: self.pushes, force });
    }
}

impl DriverEnd {
    /// Tell a reading, with the vendor's code for what went wrong.
    ///
    /// # Real time
    pub fn tell(&mut self, reading: Reading, fault: u32) {
        self.tells += 1;
        self.told.write(Told { sequence: self.tells, reading, fault });
    }

    /// The force [N] that is wanted now: none if nobody has wanted one for too long, or if it is no number.
    ///
    /// # Real time
    pub fn wanted(&mut self) -> DVec3 {
        let wanted = *self.wanted.read();
        if wanted.sequence != self.seen {
            (self.seen, self.seen_at) = (wanted.sequence, Instant::now());
        }
        if wanted.force.is_finite() && self.seen_at.elapsed() <= SILENCE { wanted.force } else { DVec3::ZERO }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_renewed_does_not_count() {
        let (mut update, mut driver) = exchange();
        assert!(update.newest(0.0).is_none(), "nothing was told yet");
        let reading = Reading { position: DVec3::X, orientation: None, buttons: 1 };
        driver.tell(reading, 7);
        let told = update.newest(1.0).expect("it was told");
        assert_eq!((told.reading, told.fault), (reading, 7));
        assert!(update.newest(1.019).is_some() && update.newest(1.021).is_none());

        assert_eq!(driver.wanted(), DVec3::ZERO);
        update.push(DVec3::Y);
        assert_eq!(driver.wanted(), DVec3::Y);
        std::thread::sleep(SILENCE + Duration::from_millis(1));
        assert_eq!(driver.wanted(), DVec3::ZERO, "whoever pushed has gone");
        update.push(DVec3::NAN);
        assert_eq!(driver.wanted(), DVec3::ZERO);
    }
}
