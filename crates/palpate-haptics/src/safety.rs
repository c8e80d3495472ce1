//! Safety limits between a computed force and a hand: arming, ramp, force limit, slew-rate limit, watchdog, speed limit.
//!
//! ```text
//! target = s·clamp(F, F_max)    |given⁺ − given| ≤ min(slew·Δt, step)    ds/dt = 1/ramp_up while all is well, −1/ramp_down after a fault
//! ```
//!
//! Every update passes them, whatever the force process and the clock say. After a gap between updates that is no time (negative, zero,
//! or beyond the watchdog) the force is gone at once.

use crate::safety_limits::SafetyLimits;
use glam::DVec3;

/// Counters of the safety limits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SafetyCounts {
    /// Updates with a force above the limit.
    pub clamped: u64,
    /// Updates in which the slew-rate limit acted.
    pub slew_limited: u64,
    /// Updates in which the watchdog found the force too old.
    pub stale: u64,
    /// Updates that came too late after the last one, or by the clock not after it.
    pub gaps: u64,
    /// Updates in which the force replied to a motion that was too old.
    pub old_motions: u64,
    /// Forces that replied to their motion too late.
    pub slow_replies: u64,
    /// Updates in which the hand was too fast.
    pub overspeed: u64,
    /// Updates in which the hand was too far from its start.
    pub out_of_range: u64,
    /// Forces and positions that were not finite.
    pub not_finite: u64,
    /// Faults that took a force away.
    pub trips: u64,
}

/// Reply of the force process, as old as it is in an update.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reply {
    /// Age of the force [s], from the time of its step.
    pub force_age_s: f64,
    /// Age of the motion that it replies to [s]; infinite for none.
    pub motion_age_s: f64,
    /// Whether no earlier force has replied to that motion or a later one: then the age of the motion is the round trip.
    pub is_new: bool,
}

/// Conditions of an update, against which the limits hold.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conditions {
    /// Time since the last update [s]; `None` in the first.
    pub since_update_s: Option<f64>,
    /// Newest reply; `None` before the first one.
    pub reply: Option<Reply>,
    /// Speed of the hand [m/s].
    pub speed_m_s: f64,
    /// Distance of the hand from its start [m].
    pub distance_m: f64,
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

    /// Limits.
    pub fn limits(&self) -> &SafetyLimits {
        &self.limits
    }

    /// Safe force [N] for a wanted force [N] in the conditions of an update. The result is finite for any input, at most `force_n`, and
    /// within `step_n` and the slew-rate limit of the last one, unless it goes to zero.
    ///
    /// # Real time
    /// No allocation, lock or system call.
    pub fn limit(&mut self, wanted: DVec3, conditions: &Conditions) -> DVec3 {
        let limits = self.limits;
        let well = self.check(wanted, conditions);
        let dt = match conditions.since_update_s {
            None => 0.0,
            Some(gap_s) if limits.is_regular(gap_s) => gap_s,
            // The device has held its force for a time that nobody knows: the whole ramp.
            Some(_) => limits.ramp_down_s,
        };
        self.fault_free_s = if well { self.fault_free_s + dt } else { 0.0 };
        if !well && !self.tripped {
            self.tripped = true;
            self.counts.trips += u64::from(self.armed && self.ramp > 0.0);
        }
        self.tripped &= self.fault_free_s < limits.recovery_s;
        let pass = well && self.armed && !self.tripped;
        let change = if pass { dt / limits.ramp_up_s.max(1e-9) } else { -dt / limits.ramp_down_s.max(1e-9) };
        self.ramp = (self.ramp + change).clamp(0.0, 1.0);

        let next = self.wanted * self.ramp;
        let max_change = (limits.slew_n_s * dt).min(limits.step_n);
        let change = next - self.given;
        // A ramp down to zero overrides the slew-rate limit.
        let slew_limited = change.length() > max_change && self.ramp > 0.0;
        if slew_limited {
            self.counts.slew_limited += u64::from(pass);
            self.given += change.clamp_length_max(max_change);
        } else {
            self.given = next;
        }
        self.given = self.given.clamp_length_max(limits.force_n);
        self.given
    }

    /// Takes over a wanted force [N], counts faults, and returns whether there was none.
    fn check(&mut self, wanted: DVec3, conditions: &Conditions) -> bool {
        let (limits, counts) = (self.limits, &mut self.counts);
        let Conditions { since_update_s, reply, speed_m_s, distance_m } = *conditions;
        let mut well = reply.is_some();
        let mut fault = |counter: &mut u64, is_met: bool| {
            *counter += u64::from(is_met);
            well &= !is_met;
        };
        fault(&mut counts.not_finite, !wanted.is_finite());
        if wanted.is_finite() {
            self.wanted = wanted.clamp_length_max(limits.force_n);
            counts.clamped += u64::from(wanted.length() > limits.force_n);
        }
        fault(&mut counts.gaps, since_update_s.is_some_and(|gap_s| !limits.is_regular(gap_s)));
        if let Some(Reply { force_age_s, motion_age_s, is_new }) = reply {
            // An age that is far below 0, or no number, is a clock's fault.
            let exceeds = |age_s: f64, limit_s: f64| !(-limit_s..=limit_s).contains(&age_s);
            fault(&mut counts.stale, exceeds(force_age_s, limits.watchdog_s));
            fault(&mut counts.old_motions, exceeds(motion_age_s, limits.motion_age_s));
            fault(&mut counts.slow_replies, is_new && exceeds(motion_age_s, limits.round_trip_s));
        }
        fault(&mut counts.not_finite, !speed_m_s.is_finite());
        fault(&mut counts.overspeed, speed_m_s.is_finite() && speed_m_s > limits.speed_m_s);
        fault(&mut counts.out_of_range, distance_m.is_finite() && distance_m > limits.range_m);
        well
    }
}

impl SafetyLimits {
    /// Whether a time from one update to the next [s] is one: the clock goes on, and the update is not late.
    pub(crate) fn is_regular(&self, gap_s: f64) -> bool {
        gap_s > 0.0 && gap_s <= self.watchdog_s
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

    /// Reply without an age.
    const FRESH: Reply = Reply { force_age_s: 0.0, motion_age_s: 0.0, is_new: true };

    /// Conditions in which all is well.
    const WELL: Conditions =
        Conditions { since_update_s: Some(DT), reply: Some(FRESH), speed_m_s: 0.0, distance_m: 0.0 };

    fn armed() -> Safety {
        let mut safety = Safety::new(SafetyLimits::default());
        safety.arm(true);
        safety
    }

    /// Armed safety through which the whole force passes.
    fn pressing() -> Safety {
        let mut safety = armed();
        let last = (0..1000).map(|_| safety.limit(DVec3::X, &WELL)).last();
        assert_eq!(last, Some(DVec3::X));
        safety
    }

    fn reply(force_age_s: f64, motion_age_s: f64, is_new: bool) -> Conditions {
        Conditions { reply: Some(Reply { force_age_s, motion_age_s, is_new }), ..WELL }
    }

    #[test]
    fn no_force_before_it_is_armed_and_a_ramp_after() {
        let mut safety = Safety::new(SafetyLimits::default());
        assert_eq!(safety.limit(DVec3::X, &WELL), DVec3::ZERO);
        safety.arm(true);
        let forces: Vec<f64> = (0..600).map(|_| safety.limit(DVec3::X, &WELL).x).collect();
        assert!((forces[249] - 0.5).abs() < RAMP_ROUND_OFF, "{}", forces[249]);
        assert_eq!(forces[599], 1.0);
        assert!(forces.windows(2).all(|f| f[1] >= f[0]));
        assert_eq!(safety.counts(), SafetyCounts::default());
    }

    #[test]
    fn before_the_first_reply_no_force_passes_and_nothing_is_counted() {
        // Also without limits, and without a time of recovery.
        for limits in [SafetyLimits::default(), SafetyLimits::NONE] {
            let mut safety = Safety::new(limits);
            safety.arm(true);
            let none = Conditions { reply: None, ..WELL };
            assert!((0..1000).all(|_| safety.limit(DVec3::X, &none) == DVec3::ZERO));
            assert_eq!(safety.counts(), SafetyCounts::default());
        }
    }

    #[test]
    fn every_fault_takes_the_force_away_in_the_stated_time_and_is_counted() {
        let none = SafetyCounts { trips: 1, ..SafetyCounts::default() };
        let faults = [
            (DVec3::X, reply(0.021, 0.0, false), SafetyCounts { stale: 100, ..none }),
            (DVec3::X, reply(-0.021, 0.0, false), SafetyCounts { stale: 100, ..none }),
            (DVec3::X, reply(f64::NAN, 0.0, false), SafetyCounts { stale: 100, ..none }),
            (DVec3::X, reply(0.0, 0.051, false), SafetyCounts { old_motions: 100, ..none }),
            (DVec3::X, reply(0.0, -3600.0, false), SafetyCounts { old_motions: 100, ..none }),
            (DVec3::X, reply(0.0, 0.6, true), SafetyCounts { old_motions: 100, slow_replies: 100, ..none }),
            (DVec3::X, Conditions { speed_m_s: 3.1, ..WELL }, SafetyCounts { overspeed: 100, ..none }),
            (DVec3::X, Conditions { distance_m: 55.2, ..WELL }, SafetyCounts { out_of_range: 100, ..none }),
            (DVec3::X * f64::NAN, WELL, SafetyCounts { not_finite: 100, ..none }),
            (
                DVec3::X,
                Conditions { speed_m_s: f64::INFINITY, ..WELL },
                SafetyCounts { not_finite: 100, ..none },
            ),
        ];
        for (force, conditions, expected) in faults {
            let mut safety = pressing();
            let after: Vec<f64> = (0..100).map(|_| safety.limit(force, &conditions).x).collect();
            assert!(after[9] > 0.0 && after[9] < 0.6, "ramping down: {}", after[9]);
            assert_eq!(after[20], 0.0, "in 20 ms");
            assert_eq!(safety.counts(), expected);
            // It ramps up again after the recovery time.
            let back: Vec<f64> = (0..700).map(|_| safety.limit(DVec3::X, &WELL).x).collect();
            assert_eq!(back[98], 0.0);
            assert!(back[120] > 0.0 && back[120] < 0.1 && back[699] == 1.0, "{} {}", back[120], back[699]);
        }
    }

    #[test]
    fn a_gap_between_updates_takes_the_force_away_at_once_and_ramps_it_up_again() {
        for gap_s in [0.5, 3600.0, 0.0, -3600.0, f64::NAN, f64::INFINITY] {
            let mut safety = pressing();
            // The force itself is fresh, the one that the device has held is not.
            let gap = Conditions { since_update_s: Some(gap_s), ..WELL };
            assert_eq!(safety.limit(-DVec3::X, &gap), DVec3::ZERO, "{gap_s} s");
            assert_eq!(safety.counts(), SafetyCounts { gaps: 1, trips: 1, ..SafetyCounts::default() });
            assert_eq!(safety.limit(-DVec3::X, &WELL), DVec3::ZERO);
            let last = (0..1000).map(|_| safety.limit(DVec3::X, &WELL)).last();
            assert_eq!(last, Some(DVec3::X));
        }
    }

    #[test]
    fn a_force_changes_by_no_more_than_the_step_however_long_the_update_took() {
        let limits = SafetyLimits { step_n: 0.5, watchdog_s: 1.0, ramp_up_s: 0.0, ..SafetyLimits::default() };
        let mut safety = Safety::new(limits);
        safety.arm(true);
        let late = Conditions { since_update_s: Some(0.9), ..WELL };
        let forces: Vec<f64> = (0..8).map(|_| safety.limit(DVec3::X * 3.0, &late).x).collect();
        assert_eq!(forces, [0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.0, 3.0]);
        assert_eq!(safety.counts().slew_limited, 5);
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
            let gap_s = number() * 0.001;
            let conditions = Conditions {
                since_update_s: Some(if gap_s.abs() < 1e-3 { DT } else { gap_s }),
                reply: Some(Reply {
                    force_age_s: number() * 0.001,
                    motion_age_s: number() * 0.003,
                    is_new: true,
                }),
                speed_m_s: number().abs() * 0.25,
                distance_m: number().abs() * 0.1,
            };
            let given = safety.limit(force, &conditions);
            assert!(given.is_finite() && given.length() <= limits.force_n * (1.0 + SCALED), "{given}");
            let change = (given - last).length();
            assert!(change <= limits.step_n + SCALED || given == DVec3::ZERO, "{given} {last}");
            last = given;
        }
        let counts = safety.counts();
        let all = [
            counts.clamped,
            counts.stale,
            counts.gaps,
            counts.old_motions,
            counts.slow_replies,
            counts.overspeed,
            counts.not_finite,
        ];
        assert!(all.into_iter().all(|count| count > 0), "{counts:?}");
    }
}
