//! What stands between a computed force and a hand, always on.

use glam::DVec3;

/// Limits of what a device may do to a hand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SafetyLimits {
    /// Largest force [N] that the device is meant to give for long.
    pub force_n: f64,
    /// Fastest change of force [N/s].
    pub slew_n_s: f64,
    /// Speed of the hand [m/s] beyond which something is wrong: the force is taken away.
    pub speed_m_s: f64,
    /// Age of a force [s] beyond which it does not count any more.
    pub stale_s: f64,
    /// Time [s] over which the force comes in, at the start and after anything went wrong.
    pub ramp_up_s: f64,
    /// Time [s] over which it is taken away when something goes wrong.
    pub ramp_down_s: f64,
    /// Time [s] that all must be well for, before the force comes in again.
    pub calm_s: f64,
}

impl Default for SafetyLimits {
    fn default() -> Self {
        Self {
            force_n: 3.0,
            slew_n_s: 3000.0,
            speed_m_s: 3.0,
            stale_s: 0.02,
            ramp_up_s: 0.5,
            ramp_down_s: 0.02,
            calm_s: 0.1,
        }
    }
}

/// How often each limit was met, in updates; the ramps in times.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SafetyCounts {
    /// Forces above the limit.
    pub clamped: u64,
    /// Changes that were too fast.
    pub slewed: u64,
    /// Updates without a fresh force.
    pub stale: u64,
    /// Updates with a hand that was too fast.
    pub too_fast: u64,
    /// Forces or positions that were no numbers.
    pub not_finite: u64,
    /// Times that the force was taken away.
    pub trips: u64,
}

/// The safety of one device.
#[derive(Debug, Clone)]
pub struct Safety {
    limits: SafetyLimits,
    armed: bool,
    /// Share of the force that passes.
    share: f64,
    /// How long all has been well [s].
    calm_s: f64,
    tripped: bool,
    /// The last force that was good, before the share and after it [N].
    wanted: DVec3,
    given: DVec3,
    counts: SafetyCounts,
}

impl Safety {
    /// Disarmed: no force passes until [`Self::arm`].
    pub fn new(limits: SafetyLimits) -> Self {
        Self {
            limits,
            armed: false,
            share: 0.0,
            calm_s: limits.calm_s,
            tripped: false,
            wanted: DVec3::ZERO,
            given: DVec3::ZERO,
            counts: SafetyCounts::default(),
        }
    }

    /// Let force through, by the ramp; or no more, by the other one.
    pub fn arm(&mut self, armed: bool) {
        self.armed = armed;
    }

    /// Whether force may pass.
    pub fn is_armed(&self) -> bool {
        self.armed
    }

    /// What was met.
    pub fn counts(&self) -> SafetyCounts {
        self.counts
    }

    /// The force [N] that may go to the hand for one that is wanted, of an age [s], while the hand goes at a speed [m/s] and
    /// `dt_s` [s] have passed since the last one. What comes out is finite, at most the nominal force, and no farther from
    /// the last one than the slew allows, whatever comes in.
    ///
    /// # Real time
    pub fn limit(&mut self, wanted: DVec3, age_s: f64, speed_m_s: f64, dt_s: f64) -> DVec3 {
        let SafetyLimits { force_n, slew_n_s, speed_m_s: fastest, stale_s, ramp_up_s, ramp_down_s, calm_s } =
            self.limits;
        let dt = if dt_s.is_finite() { dt_s.clamp(0.0, 0.1) } else { 0.0 };
        let mut well = true;
        if wanted.is_finite() {
            // A force that is old, or one of a hand that is too fast, is followed no longer.
            self.wanted = wanted.clamp_length_max(force_n);
            self.counts.clamped += u64::from(wanted.length() > force_n);
        } else {
            self.counts.not_finite += 1;
            well = false;
        }
        if age_s.is_nan() || age_s > stale_s {
            self.counts.stale += 1;
            well = false;
        }
        if !speed_m_s.is_finite() {
            self.counts.not_finite += 1;
            well = false;
        } else if speed_m_s > fastest {
            self.counts.too_fast += 1;
            well = false;
        }
        self.calm_s = if well { self.calm_s + dt } else { 0.0 };
        if !well && !self.tripped {
            self.tripped = true;
            self.counts.trips += u64::from(self.armed && self.share > 0.0);
        }
        self.tripped &= self.calm_s < calm_s;
        let pass = self.armed && !self.tripped;
        let change = if pass { dt / ramp_up_s.max(1e-9) } else { -dt / ramp_down_s.max(1e-9) };
        self.share = (self.share + change).clamp(0.0, 1.0);

        let next = self.wanted * self.share;
        let most = slew_n_s * dt;
        let change = next - self.given;
        // Taking force away must not take longer than it should: then the share leads.
        let slewed = change.length() > most && self.share > 0.0;
        if slewed {
            self.counts.slewed += u64::from(pass);
            self.given += change.clamp_length_max(most);
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

    const DT: f64 = 1e-3;

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
        assert!((forces[249] - 0.5).abs() < 1e-9, "{}", forces[249]);
        assert_eq!(forces[599], 1.0);
        assert!(forces.windows(2).all(|f| f[1] >= f[0]));
        assert_eq!(safety.counts(), SafetyCounts::default());
    }

    #[test]
    fn every_fault_takes_the_force_away_in_the_stated_time_and_is_counted() {
        let counts = |stale, too_fast, not_finite| SafetyCounts {
            stale,
            too_fast,
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
            assert!(after[9] > 0.0 && after[9] < 0.6, "by a ramp: {}", after[9]);
            assert_eq!(after[20], 0.0, "in 20 ms");
            assert_eq!(safety.counts(), expected);
            // It comes back by the ramp, after a while of calm.
            let back: Vec<f64> = (0..700).map(|_| safety.limit(DVec3::X, 0.0, 0.0, DT).x).collect();
            assert_eq!(back[98], 0.0);
            assert!(back[120] > 0.0 && back[120] < 0.1 && back[699] == 1.0, "{} {}", back[120], back[699]);
        }
    }

    #[test]
    fn whatever_comes_in_what_goes_out_is_finite_small_and_slow() {
        let mut safety = armed();
        let limits = SafetyLimits::default();
        let mut random = 12_345_u64;
        let mut last = DVec3::ZERO;
        let mut number = || {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            match random >> 60 {
                0 => f64::NAN,
                1 => f64::INFINITY,
                2 => -1e300,
                3 => 0.0,
                _ => ((random >> 11) as f64 / (1_u64 << 53) as f64 - 0.5) * 20.0,
            }
        };
        for _ in 0..200_000 {
            let force = DVec3::new(number(), number(), number());
            let given = safety.limit(force, number().abs() * 0.002, number().abs() * 0.25, DT);
            assert!(given.is_finite() && given.length() <= limits.force_n * (1.0 + 1e-12), "{given}");
            let fastest = limits.slew_n_s * DT;
            assert!((given - last).length() <= fastest + 1e-12 || given == DVec3::ZERO, "{given} {last}");
            last = given;
        }
        let counts = safety.counts();
        assert!(counts.clamped > 0 && counts.stale > 0 && counts.too_fast > 0 && counts.not_finite > 0);
    }
}
