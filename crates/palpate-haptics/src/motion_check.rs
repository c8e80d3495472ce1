//! Check of the motions that come from another process: range and speed.
//!
//! ```text
//! allowance⁺ = min(allowance + v·Δt, v·burst) − |x⁺ − x| ≥ 0        |x⁺ − c| ≤ r + range
//! ```
//!
//! v [m/s] is the largest speed, Δt [s] the time between two motions, which come in bursts over a network; c and r [m] are centre and
//! radius of the objects at the start. Refused motions are not used, nor are those that follow within [`REFUSAL_S`].

use crate::safety_limits::{ImplausibleMotion, MotionLimits, RefusedMotions};
use glam::DVec3;

/// Longest burst of motions [s]: what a late datagram and those after it may be apart.
const BURST_S: f64 = 0.05;

/// Time without implausible motions [s] before motions are used again.
const REFUSAL_S: f64 = 0.1;

/// Ball around objects.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ball {
    /// Centre [m, world].
    pub centre: DVec3,
    /// Radius [m].
    pub radius: f64,
}

/// Motion, as far as it is checked.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CheckedMotion {
    /// Sequence number, from 1; 0 before the first motion.
    pub sequence: u64,
    /// Time of the reading, or of the arrival [s].
    pub time_s: f64,
    /// Position [m, world].
    pub position: DVec3,
}

/// Check of one device's motions.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct MotionCheck {
    /// Limits; `None` accepts all.
    pub limits: Option<MotionLimits>,
    /// Newest motion.
    last: Option<CheckedMotion>,
    /// Way that the next motion may take [m].
    allowance_m: f64,
    /// Time of the last implausible motion [s].
    refused_s: Option<f64>,
    refused: RefusedMotions,
}

impl MotionCheck {
    /// Refused motions since the start.
    pub fn refused(&self) -> RefusedMotions {
        self.refused
    }

    /// Whether the newest motion may be used.
    ///
    /// # Real time
    /// No allocation, lock or system call.
    pub fn accepts(&mut self, motion: &CheckedMotion, objects: Ball) -> bool {
        let Some(limits) = self.limits else { return true };
        if motion.sequence == 0 || self.last.is_some_and(|last| last.sequence == motion.sequence) {
            return self.is_past_refusal(motion);
        }
        let implausible = self.implausible(motion, limits, objects);
        self.last = Some(*motion);
        if let Some(reason) = implausible {
            self.refused_s = Some(motion.time_s);
            self.refused.first.get_or_insert(reason);
        }
        let accepted = self.is_past_refusal(motion);
        self.refused.count += u64::from(!accepted);
        accepted
    }

    fn is_past_refusal(&self, motion: &CheckedMotion) -> bool {
        self.refused_s.is_none_or(|time| (motion.time_s - time).abs() > REFUSAL_S)
    }

    fn implausible(
        &mut self,
        motion: &CheckedMotion,
        limits: MotionLimits,
        objects: Ball,
    ) -> Option<ImplausibleMotion> {
        let MotionLimits { range_m, speed_m_s } = limits;
        let distance_m = (motion.position - objects.centre).length() - objects.radius;
        let (time_s, moved_m) = self.last.map_or((f64::INFINITY, 0.0), |last| {
            ((motion.time_s - last.time_s).max(0.0), (motion.position - last.position).length())
        });
        self.allowance_m = (self.allowance_m + speed_m_s * time_s).min(speed_m_s * BURST_S) - moved_m;
        let too_fast = self.allowance_m < 0.0;
        self.allowance_m = self.allowance_m.max(0.0);
        if distance_m > range_m {
            return Some(ImplausibleMotion::FarFromObjects { distance_m, range_m });
        }
        too_fast.then_some(ImplausibleMotion::TooFast { moved_m, time_s, speed_m_s })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const OBJECTS: Ball = Ball { centre: DVec3::ZERO, radius: 0.1 };

    fn motion(sequence: u64, x: f64, time_s: f64) -> CheckedMotion {
        CheckedMotion { sequence, position: DVec3::X * x, time_s }
    }

    fn check() -> MotionCheck {
        MotionCheck { limits: Some(MotionLimits::default()), ..MotionCheck::default() }
    }

    #[test]
    fn a_fast_hand_whose_motions_come_in_bursts_is_a_hand() {
        let mut check = check();
        for tick in 1..=2000_u64 {
            // 2 m/s to and fro; ten motions arrive at once.
            let (now, late) = (tick as f64 * 1e-3, (tick / 10 * 10) as f64 * 1e-3);
            let x = 0.1 * (20.0 * now).sin();
            assert!(check.accepts(&motion(tick, x, late), OBJECTS), "{tick}");
        }
        assert_eq!(check.refused(), RefusedMotions::default());
    }

    #[test]
    fn millimetres_are_refused_and_named_and_metres_are_accepted_again() {
        let mut check = check();
        assert!(!check.accepts(&motion(1, 55.2, 0.001), OBJECTS));
        assert_eq!(
            check.refused().to_string(),
            "1 motions refused: a position is 55.100 m from the scene's objects, expected within 2 m (limit range): is it in \
             millimetres?"
        );
        // Near enough, but a millimetre a step for a metre.
        let mut check = self::check();
        assert!(check.accepts(&motion(1, 0.0, 0.001), OBJECTS));
        assert!(check.accepts(&motion(2, 0.9, 0.002), OBJECTS), "a burst");
        assert!(!check.accepts(&motion(3, 1.8, 0.003), OBJECTS));
        assert_eq!(
            check.refused().to_string(),
            "1 motions refused: it moved 0.900 m in 0.001 s, expected at most 20 m/s (limit speed): is its position in \
             millimetres?"
        );
        assert!(!check.accepts(&motion(4, 1.8, 0.05), OBJECTS), "not yet");
        assert!(check.accepts(&motion(5, 1.8, 0.104), OBJECTS));
        assert_eq!(check.refused().count, 2);
    }
}
