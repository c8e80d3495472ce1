//! Port between a haptic update and the force process: two values, motion and effort, of which only the newest counts.

use crate::motion_check::{Ball, CheckedMotion, MotionCheck};
use crate::safety_limits::{MotionLimits, RefusedMotions};
use glam::{DQuat, DVec3};
use palpate::DeviceMode;
use triple_buffer::{Input, Output, triple_buffer};

/// Motion of a device, sent by its haptic update.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion {
    /// Sequence number, from 1; 0 before the first motion.
    pub sequence: u64,
    /// Time of the reading [s].
    pub time_s: f64,
    /// Interface point [m, world].
    pub position: DVec3,
    /// Simulated time in which the interface point gets there in a straight line [s]; 0: in one step. Links do not transmit it.
    pub over_s: f64,
    /// Orientation of the handle: world from handle.
    pub orientation: DQuat,
    /// Pressed buttons, one bit each.
    pub buttons: u32,
    /// Mode of the device, where it differs from the scene's: a pointer becomes active or inactive, touches or holds. Links do not
    /// transmit it.
    pub mode: Option<DeviceMode>,
}

/// Effort for a device, sent by the force process.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effort {
    /// Sequence number, from 1, one per step; 0 before the first effort.
    pub sequence: u64,
    /// Sequence number of the motion that the effort replies to.
    pub in_reply_to: u64,
    /// Time of the step [s].
    pub time_s: f64,
    /// Force on the hand [N, world].
    pub force: DVec3,
    /// Energy that the scene has absorbed through this device since the start, stored energy of the virtual coupling included [J].
    /// The hand must have done that much work.
    pub absorbed_j: f64,
}

impl Default for Motion {
    fn default() -> Self {
        Self {
            sequence: 0,
            time_s: 0.0,
            position: DVec3::ZERO,
            over_s: 0.0,
            orientation: DQuat::IDENTITY,
            buttons: 0,
            mode: None,
        }
    }
}

impl Default for Effort {
    fn default() -> Self {
        Self { sequence: 0, in_reply_to: 0, time_s: 0.0, force: DVec3::ZERO, absorbed_j: 0.0 }
    }
}

/// Device side of a port.
pub struct DevicePort {
    pub(crate) motion: MotionSink,
    pub(crate) effort: Output<Effort>,
}

/// Destination of motions.
pub(crate) enum MotionSink {
    /// Force process in this process.
    Local(Input<Motion>),
    /// Force process elsewhere.
    Remote(Box<dyn FnMut(Motion) + Send>),
}

/// Force process's side of a port.
pub struct ForcePort {
    /// Check of the motions; without limits by default.
    check: MotionCheck,
    motion: Output<Motion>,
    effort: Input<Effort>,
}

/// Both sides of a port. Neither side waits for the other: the slower one misses values.
pub fn port() -> (DevicePort, ForcePort) {
    let (motion_in, motion_out) = triple_buffer(&Motion::default());
    let (effort_in, effort_out) = triple_buffer(&Effort::default());
    (
        DevicePort { motion: MotionSink::Local(motion_in), effort: effort_out },
        ForcePort { check: MotionCheck::default(), motion: motion_out, effort: effort_in },
    )
}

impl DevicePort {
    /// Device side of a port whose other side is elsewhere.
    pub(crate) fn remote(send: Box<dyn FnMut(Motion) + Send>, effort: Output<Effort>) -> Self {
        Self { motion: MotionSink::Remote(send), effort }
    }

    /// Sends a motion.
    ///
    /// # Real time
    /// No allocation, lock or system call; over a link a lock and a system call.
    pub fn send(&mut self, motion: Motion) {
        self.motion.send(motion);
    }

    /// Newest effort.
    ///
    /// # Real time
    /// No allocation, lock or system call.
    pub fn newest(&mut self) -> Effort {
        *self.effort.read()
    }
}

impl MotionSink {
    pub(crate) fn send(&mut self, motion: Motion) {
        match self {
            Self::Local(input) => input.write(motion),
            Self::Remote(send) => send(motion),
        }
    }
}

impl ForcePort {
    /// Port that refuses motions beyond limits: those of a device in another process, which may be in other units.
    #[must_use]
    pub fn with_limits(mut self, limits: MotionLimits) -> Self {
        self.check.limits = Some(limits);
        self
    }

    /// Newest motion.
    ///
    /// # Real time
    /// No allocation, lock or system call.
    pub fn newest(&mut self) -> Motion {
        *self.motion.read()
    }

    /// Whether a motion is finite and plausible, with objects as they are at the start.
    ///
    /// # Real time
    /// No allocation, lock or system call.
    pub(crate) fn accepts(&mut self, motion: &Motion, objects: Ball) -> bool {
        let Motion { sequence, time_s, position, .. } = *motion;
        position.is_finite() && self.check.accepts(&CheckedMotion { sequence, time_s, position }, objects)
    }

    /// Refused motions since the start.
    pub fn refused_motions(&self) -> RefusedMotions {
        self.check.refused()
    }

    /// Sends an effort.
    ///
    /// # Real time
    /// No allocation, lock or system call.
    pub fn send(&mut self, effort: Effort) {
        self.effort.write(effort);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_sides_read_the_newest_value() {
        let (mut device, mut force) = port();
        assert_eq!(force.newest().sequence, 0);
        for sequence in 1..=5 {
            device.send(Motion { sequence, ..Motion::default() });
        }
        assert_eq!((force.newest().sequence, force.newest().sequence), (5, 5));
        force.send(Effort { sequence: 1, in_reply_to: 5, ..Effort::default() });
        assert_eq!(device.newest().in_reply_to, 5);
    }
}
