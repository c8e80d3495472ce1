//! Limits of a device by name, with their defaults and ranges.

use std::fmt;
use thiserror::Error;

/// Safety limits of a device.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SafetyLimits {
    /// Largest force [N].
    pub force_n: f64,
    /// Slew-rate limit of the force [N/s].
    pub slew_n_s: f64,
    /// Largest change of the force in one update [N], however long ago the last one was.
    pub step_n: f64,
    /// Speed of the hand [m/s] beyond which the force is taken away.
    pub speed_m_s: f64,
    /// Distance of the hand from its start [m] beyond which a position is not plausible.
    pub range_m: f64,
    /// Watchdog: age of a force, and time from one update to the next [s], beyond which the force is taken away.
    pub watchdog_s: f64,
    /// Age of the motion that a force replies to [s], beyond which the force is taken away.
    pub motion_age_s: f64,
    /// Round trip [s], from sending a motion to the first force that replies to it, beyond which the force is taken away.
    pub round_trip_s: f64,
    /// Time over which the force ramps up, after arming and after a fault [s].
    pub ramp_up_s: f64,
    /// Time over which the force ramps down after a fault [s].
    pub ramp_down_s: f64,
    /// Time without faults before the force ramps up again [s].
    pub recovery_s: f64,
    /// Pause between two updates of a real device [s] after which its guardian ends the process and takes the force away.
    pub hang_s: f64,
}

impl Default for SafetyLimits {
    fn default() -> Self {
        Self {
            force_n: 3.0,
            slew_n_s: 3000.0,
            // The slew-rate limit over the millisecond of an update.
            step_n: 3.0,
            speed_m_s: 3.0,
            // Devices for a desk reach half a metre; millimetres taken for metres are hundreds.
            range_m: 2.0,
            watchdog_s: 0.02,
            // A hand moves 5 mm meanwhile at 0.1 m/s. Links within a building take a few milliseconds.
            motion_age_s: 0.05,
            round_trip_s: 0.05,
            ramp_up_s: 0.5,
            ramp_down_s: 0.02,
            recovery_s: 0.1,
            // Longer than a busy system makes a thread wait, shorter than a hand bears a force that does not answer.
            hang_s: 0.5,
        }
    }
}

impl SafetyLimits {
    /// No limits but for numbers that are not finite: of devices whose force nobody feels.
    pub const NONE: Self = Self {
        force_n: f64::MAX,
        slew_n_s: f64::MAX,
        step_n: f64::MAX,
        speed_m_s: f64::MAX,
        range_m: f64::MAX,
        watchdog_s: f64::MAX,
        motion_age_s: f64::MAX,
        round_trip_s: f64::MAX,
        ramp_up_s: 0.0,
        ramp_down_s: 0.02,
        recovery_s: 0.0,
        hang_s: f64::MAX,
    };

    /// Sets a limit by its name. The force has a key, or an option, of its own.
    ///
    /// # Errors
    /// If there is no such limit, or the value is out of its range.
    pub fn set(&mut self, name: &str, value: f64) -> Result<(), LimitError> {
        let limits = [
            ("slew", "N/s", &mut self.slew_n_s, (0.0, 1e6)),
            ("step", "N", &mut self.step_n, (0.0, 100.0)),
            ("speed", "m/s", &mut self.speed_m_s, (0.0, 100.0)),
            ("range", "m", &mut self.range_m, (0.0, 1000.0)),
            ("watchdog", "s", &mut self.watchdog_s, (0.0, 1.0)),
            ("motion_age", "s", &mut self.motion_age_s, (0.0, 10.0)),
            ("round_trip", "s", &mut self.round_trip_s, (0.0, 10.0)),
            ("ramp_up", "s", &mut self.ramp_up_s, (0.0, 10.0)),
            ("ramp_down", "s", &mut self.ramp_down_s, (0.0, 1.0)),
            ("recovery", "s", &mut self.recovery_s, (0.0, 10.0)),
            ("hang", "s", &mut self.hang_s, (0.1, 1e4)),
        ];
        set_named(limits, name, value)
    }
}

/// Limits of the motions that come over a link, in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionLimits {
    /// Distance from the scene's objects as they are at its start [m].
    pub range_m: f64,
    /// Speed [m/s].
    pub speed_m_s: f64,
}

impl Default for MotionLimits {
    /// Two metres, as for a device; a fast hand, 2 m/s, with a mount of scale 10.
    fn default() -> Self {
        Self { range_m: SafetyLimits::default().range_m, speed_m_s: 20.0 }
    }
}

impl MotionLimits {
    /// Sets a limit by its name.
    ///
    /// # Errors
    /// If there is no such limit, or the value is out of its range.
    pub fn set(&mut self, name: &str, value: f64) -> Result<(), LimitError> {
        let limits = [
            ("range", "m", &mut self.range_m, (0.0, 1e4)),
            ("speed", "m/s", &mut self.speed_m_s, (0.0, 1e4)),
        ];
        set_named(limits, name, value)
    }
}

/// Limit by name: its unit, its place, and its range, of which the lower end is excluded.
type Named<'l> = (&'static str, &'static str, &'l mut f64, (f64, f64));

fn set_named<const N: usize>(limits: [Named<'_>; N], name: &str, value: f64) -> Result<(), LimitError> {
    let names = limits.each_ref().map(|(name, ..)| *name).join(", ");
    let known = limits.into_iter().find(|(known, ..)| *known == name);
    let (name, unit, limit, (above, most)) =
        known.ok_or_else(|| LimitError::Unknown { name: name.to_string(), names })?;
    if !(value > above && value <= most) {
        return Err(LimitError::OutOfRange { name, unit, value, above, most });
    }
    *limit = value;
    Ok(())
}

/// Limit that can't be set.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum LimitError {
    /// No limit has this name.
    #[error("there is no limit {name:?}, only {names}")]
    Unknown {
        /// Requested name.
        name: String,
        /// Names of all limits.
        names: String,
    },
    /// Value out of range.
    #[error("{name} is {value} {unit}, expected above {above} and at most {most}")]
    OutOfRange {
        /// Limit.
        name: &'static str,
        /// Unit.
        unit: &'static str,
        /// Requested value.
        value: f64,
        /// Lower end of the range, excluded.
        above: f64,
        /// Upper end of the range.
        most: f64,
    },
}

/// Motion that can't be one of a hand.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum ImplausibleMotion {
    /// Position far from the device's first one.
    #[error(
        "a position is {distance_m:.3} m from the device's start, expected within {range_m} m (limit range): is it in \
         millimetres?"
    )]
    FarFromStart {
        /// Distance [m].
        distance_m: f64,
        /// Limit [m].
        range_m: f64,
    },
    /// Position far from all objects.
    #[error(
        "a position is {distance_m:.3} m from the scene's objects, expected within {range_m} m (limit range): is it in \
         millimetres?"
    )]
    FarFromObjects {
        /// Distance [m].
        distance_m: f64,
        /// Limit [m].
        range_m: f64,
    },
    /// Motion faster than a hand.
    #[error(
        "it moved {moved_m:.3} m in {time_s:.3} s, expected at most {speed_m_s} m/s (limit speed): is its position in \
         millimetres?"
    )]
    TooFast {
        /// Way [m].
        moved_m: f64,
        /// Time [s].
        time_s: f64,
        /// Limit [m/s].
        speed_m_s: f64,
    },
}

/// Refused motions of a device.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RefusedMotions {
    /// Number of motions.
    pub count: u64,
    /// First reason.
    pub first: Option<ImplausibleMotion>,
}

impl fmt::Display for RefusedMotions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { count, first } = self;
        write!(f, "{count} motions refused")?;
        first.iter().try_for_each(|first| write!(f, ": {first}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_set_by_name_within_their_ranges() {
        let mut limits = SafetyLimits::default();
        limits.set("motion_age", 0.2).expect("a limit");
        assert_eq!(limits, SafetyLimits { motion_age_s: 0.2, ..SafetyLimits::default() });
        let error = |name: &str, value| limits.clone().set(name, value).expect_err("refused").to_string();
        assert_eq!(error("speed", f64::NAN), "speed is NaN m/s, expected above 0 and at most 100");
        assert_eq!(error("hang", 0.1), "hang is 0.1 s, expected above 0.1 and at most 10000");
        assert_eq!(
            error("sped", 1.0),
            "there is no limit \"sped\", only slew, step, speed, range, watchdog, motion_age, round_trip, ramp_up, ramp_down, \
             recovery, hang"
        );
        let error = MotionLimits::default().set("slew", 1.0).expect_err("not of a link").to_string();
        assert_eq!(error, "there is no limit \"slew\", only range, speed");
    }
}
