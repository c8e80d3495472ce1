//! Safety limits between a computed force and a hand: arming, ramp, force limit, slew-rate limit, watchdog, speed limit.
//!
//! ```text
//! target = s·clamp(F, F_max)        |given⁺ − given| ≤ slew·Δt        ds/dt = 1/ramp_up while all is well, −1/ramp_down after a fault
//! ```
//!
//! Every update passes them, whatever the force process says.

use glam::DVec3;

/// Safety limits of a device.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SafetyLimits {
    /// Largest force [N].
    pub force_n: f64,
    /// Slew-rate limit of the force [N/s].
    pub slew_n_s: f64,
    /// Speed of the hand [m/s] beyond which the force is taken away.
    pub speed_m_s: f64,
    /// Watchdog: age of a force [s] beyond which it is taken away.
    pub watchdog_s: f64,
    /// Time over which the force ramps up, after arming and after a fault [s].
    pub ramp_up_s: f64,
    /// Time over which the force ramps down after a fault [s].
    pub ramp_down_s: f64,
    /// Time without faults before the force ramps up again [s].
    pub recovery_s: f64,
}

impl Default for SafetyLimits {
    fn default() -> Self {
        Self {
            force_n: 3.0,
            slew_n_s: 3000.0,
            speed_m_s: 3.0,
            watchdog_s: 0.02,
            ramp_up_s: 0.5,
            ramp_down_s: 0.02,
            recovery_s: 0.1,
        }
    }
}

/// Counters of the safety limits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SafetyCounts {
    /// Updates with a force above the limit.
    pub clamped: u64,
    /// Updates in which the slew-rate limit acted.
    pub slew_limited: u64,
    /// Updates in which the watchdog found the force too old.
    pub stale: u64,
    /// Updates in which the hand was too fast.
    pub overspeed: u64,
    /// Forces and positions that were not finite.
    pub not_finite: u64,
    /// Faults that took a force away.
    pub trips: u64,
}

/// Safety of one device.
#[derive(Debug, Clone)]
pub struct Safety {
    limits: SafetyLimits,
    armed: bool,
    /// Ramp s: share of the force that passes.
    ramp: f64,
    /// Time without a fault [s].
    fault_free_s: f64,
    tripped: bool,
    /// Last finite force, clamped [N].
    wanted: DVec3,
    /// Force of the last update [N].
    given: DVec3,
    counts: SafetyCounts,
}

impl Safety {
    /// Disarmed safety: no force passes until [`Self::arm`].
    pub fn new(limits: SafetyLimits) -> Self {
        Self {
            limits,
            armed: false,
            ramp: 0.0,
            fault_free_s: limits.recovery_s,
            tripped: false,
            wanted: DVec3::ZERO,
            given: DVec3::ZERO,
            counts: SafetyCounts::default(),
        }
    }

    /// Arms or disarms: force ramps up, or down.
    pub fn arm(&mut self, armed: bool) {
        self.armed = armed;
    }

    /// Whether the safety is armed.
    pub fn is_armed(&self) -> bool {
        self.armed
    }

    /// Counters since the start.
    pub fn counts(&self) -> SafetyCounts {
        self.counts
    }

    /// Safe force [N] for a wanted force [N] of an age [s], at a speed of the hand [m/s], `dt_s` [s] after the last update.
    /// The result is finite for any input, at most `force_n`, and within the slew-rate limit of the last one, unless it goes to zero. An update that
    /// comes later after the last one than the watchdog allows is a fault: the device has held a force that was too old.
    ///
    /// # Real time
    /// No allocation, lock or system call.
    pub fn limit(&mut self, wanted: DVec3, age_s: f64, speed_m_s: f64, dt_s: f64) -> DVec3 {
        let SafetyLimits {
            force_n,
            slew_n_s,
            speed_m_s: max_speed,
            watchdog_s,
            ramp_up_s,
            ramp_down_s,
            recovery_s,
        } = self.limits;
        let dt = if dt_s.is_finite() { dt_s.clamp(0.0, watchdog_s) } else { 0.0 };
        let mut well = true;
        if wanted.is_finite() {
            self.wanted = wanted.clamp_length_max(force_n);
            self.counts.clamped += u64::from(wanted.length() > force_n);
        } else {
            self.counts.not_finite += 1;
            well = false;
        }
        if age_s.is_nan() || age_s.max(dt_s) > watchdog_s {
            self.counts.stale += 1;
            well = false;
        }
        if !speed_m_s.is_finite() {
            self.counts.not_finite += 1;
            well = false;
        } else if speed_m_s > max_speed {
            self.counts.overspeed += 1;
            well = false;
        }
        self.fault_free_s = if well { self.fault_free_s + dt } else { 0.0 };
        if !well && !self.tripped {
            self.tripped = true;
            self.counts.trips += u64::from(self.armed && self.ramp > 0.0);
        }
        self.tripped &= self.fault_free_s < recovery_s;
        let pass = self.armed && !self.tripped;
        let change = if pass { dt / ramp_up_s.max(1e-9) } else { -dt / ramp_down_s.max(1e-9) };
        self.ramp = (self.ramp + change).clamp(0.0, 1.0);

        let next = self.wanted * self.ramp;
        let max_change = slew_n_s * dt;
        let change = next - self.given;
        // A ramp down to zero overrides the slew-rate limit.
        let slew_limited = change.length() > max_change && self.ramp > 0.0;
        if slew_limited {
            self.counts.slew_limited += u64::from(pass);
            self.given += change.clamp_length_max(max_change);
        } else {
            self.given = next;
        }
        self.given = self.given.clamp_length_max(force_n);
        self.given
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_testkit::Random;

    const DT: f64 = 1e-3;

    /// Round-off of a ramp [1]: a few hundred sums of shares.
    const RAMP_ROUND_OFF: f64 = 1e-9;

    /// Round-off of a force that is scaled to a length [N], and relative to it [1].
    const SCALED: f64 = 1e-12;

    fn armed() -> Safety {
        let mut safety = Safety::new(SafetyLimits::default());
        safety.arm(true);
        safety
    }

    #[test]
    fn no_force_before_it_is_armed_and_a_ramp_after() {
        let mut safety = Safety::new(SafetyLimits::default());
        assert_eq!(safety.limit(DVec3::X, 0.0, 0.0, DT), DVec3::ZERO);
        safety.arm(true);
        let forces: Vec<f64> = (0..600).map(|_| safety.limit(DVec3::X, 0.0, 0.0, DT).x).collect();
        assert!((forces[249] - 0.5).abs() < RAMP_ROUND_OFF, "{}", forces[249]);
        assert_eq!(forces[599], 1.0);
        assert!(forces.windows(2).all(|f| f[1] >= f[0]));
        assert_eq!(safety.counts(), SafetyCounts::default());
    }

    #[test]
    fn every_fault_takes_the_force_away_in_the_stated_time_and_is_counted() {
        let counts = |stale, overspeed, not_finite| SafetyCounts {
            stale,
            overspeed,
            not_finite,
            trips: 1,
            ..SafetyCounts::default()
        };
        let faults = [
            (DVec3::X, 0.021, 0.0, counts(100, 0, 0)),
            (DVec3::X, 0.0, 3.1, counts(0, 100, 0)),
            (DVec3::X * f64::NAN, 0.0, 0.0, counts(0, 0, 100)),
            (DVec3::X, 0.0, f64::INFINITY, counts(0, 0, 100)),
        ];
        for (force, age, speed, expected) in faults {
            let mut safety = armed();
            for _ in 0..1000 {
                safety.limit(DVec3::X, 0.0, 0.0, DT);
            }
            let after: Vec<f64> = (0..100).map(|_| safety.limit(force, age, speed, DT).x).collect();
            assert!(after[9] > 0.0 && after[9] < 0.6, "ramping down: {}", after[9]);
            assert_eq!(after[20], 0.0, "in 20 ms");
            assert_eq!(safety.counts(), expected);
            // It ramps up again after the recovery time.
            let back: Vec<f64> = (0..700).map(|_| safety.limit(DVec3::X, 0.0, 0.0, DT).x).collect();
            assert_eq!(back[98], 0.0);
            assert!(back[120] > 0.0 && back[120] < 0.1 && back[699] == 1.0, "{} {}", back[120], back[699]);
        }
    }

    #[test]
    fn a_stall_of_its_own_takes_the_force_away_at_once_and_ramps_it_up_again() {
        let mut safety = armed();
        let full = |safety: &mut Safety| (0..1000).map(|_| safety.limit(DVec3::X, 0.0, 0.0, DT)).last();
        assert_eq!(full(&mut safety), Some(DVec3::X));
        // The force itself is fresh, the one that the device has held is not.
        assert_eq!(safety.limit(-DVec3::X, 0.0, 0.0, 0.5), DVec3::ZERO);
        assert_eq!(safety.counts(), SafetyCounts { stale: 1, trips: 1, ..SafetyCounts::default() });
        let next = safety.limit(-DVec3::X, 0.0, 0.0, DT);
        assert_eq!(next, DVec3::ZERO);
        assert_eq!(full(&mut safety), Some(DVec3::X));
    }

    #[test]
    fn whatever_comes_in_what_goes_out_is_finite_small_and_slow() {
        let mut safety = armed();
        let limits = SafetyLimits::default();
        let mut random = Random::new(12_345);
        let mut last = DVec3::ZERO;
        let mut number = || match (random.unit() * 16.0) as u32 {
            0 => f64::NAN,
            1 => f64::INFINITY,
            2 => -1e300,
            3 => 0.0,
            _ => random.within(-10.0, 10.0),
        };
        for _ in 0..200_000 {
            let force = DVec3::new(number(), number(), number());
            let given = safety.limit(force, number().abs() * 0.002, number().abs() * 0.25, DT);
            assert!(given.is_finite() && given.length() <= limits.force_n * (1.0 + SCALED), "{given}");
            let fastest = limits.slew_n_s * DT;
            assert!((given - last).length() <= fastest + SCALED || given == DVec3::ZERO, "{given} {last}");
            last = given;
        }
        let counts = safety.counts();
        assert!(counts.clamped > 0 && counts.stale > 0 && counts.overspeed > 0 && counts.not_finite > 0);
    }
}
