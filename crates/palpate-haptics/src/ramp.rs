//! Linear interpolation between targets that come more slowly than steps: what moves gets there in equal parts.
//!
//! x ← x + (target − x)/n, n ← n − 1, with n steps left. The last part is the target itself, to the bit.

use crate::motion_path::PoseTrajectory;
use glam::DVec3;
use palpate::Pose;
use triple_buffer::{Input, triple_buffer};

/// Number of steps that are left to a target.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Ramp {
    steps: u32,
}

impl Ramp {
    /// Ramp over a time, in steps of another one [s]; of one step at least.
    pub(crate) fn over(time_s: f64, step_s: f64) -> Self {
        Self { steps: (time_s / step_s).round() as u32 }
    }

    /// Share of the way that is left which the next step makes; 1 in the last step, and at rest.
    fn next_share(&mut self) -> f64 {
        let share = 1.0 / f64::from(self.steps.max(1));
        self.steps = self.steps.saturating_sub(1);
        share
    }

    /// Position after the next step.
    pub(crate) fn advance(&mut self, position: DVec3, target: DVec3) -> DVec3 {
        match self.next_share() {
            1.0 => target,
            share => position.lerp(target, share),
        }
    }

    /// Pose after the next step: its orientation turns the shorter way, at a constant rate.
    fn advance_pose(&mut self, pose: Pose, target: Pose) -> Pose {
        match self.next_share() {
            1.0 => target,
            share => Pose {
                position: pose.position.lerp(target.position, share),
                orientation: pose.orientation.slerp(target.orientation, share).normalize(),
            },
        }
    }
}

/// Sender of the poses of an obstacle or a clamp.
pub struct PoseSender {
    target: Input<PoseTarget>,
    newest: PoseTarget,
}

#[derive(Clone, Copy)]
struct PoseTarget {
    /// Number, from 1; 0 before the first.
    sequence: u64,
    pose: Pose,
    over_s: f64,
}

impl PoseSender {
    /// Sends a pose, and the simulated time in which it is reached [s]; 0: in one step.
    ///
    /// # Real time
    /// No allocation, lock or system call.
    pub fn send(&mut self, pose: Pose, over_s: f64) {
        self.newest = PoseTarget { sequence: self.newest.sequence + 1, pose, over_s };
        self.target.write(self.newest);
    }
}

/// Sender of poses from another thread, and the trajectory through them in steps of a length [s]. Neither waits for the other.
pub fn pose_port(start: Pose, step_s: f64) -> (PoseSender, PoseTrajectory) {
    let newest = PoseTarget { sequence: 0, pose: start, over_s: 0.0 };
    let (target, mut received) = triple_buffer(&newest);
    let (mut pose, mut ramp, mut sequence) = (start, Ramp::default(), 0);
    let trajectory = move |_: f64| {
        let target = *received.read();
        if target.sequence > sequence {
            sequence = target.sequence;
            ramp = Ramp::over(target.over_s, step_s);
        }
        pose = ramp.advance_pose(pose, target.pose);
        pose
    };
    (PoseSender { target, newest }, Box::new(trajectory))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    #[test]
    fn a_ramp_has_equal_parts_and_ends_at_its_target() {
        let target = DVec3::new(0.1, 0.7, -0.3);
        let mut ramp = Ramp::over(0.004, 0.001);
        let mut position = DVec3::ZERO;
        for part in 1..=6 {
            position = ramp.advance(position, target);
            assert!(
                (position - target * (f64::from(part.min(4)) / 4.0)).length() < 1e-15,
                "{part}: {position}"
            );
        }
        assert_eq!(position, target);
        for at_once in [0.0, 0.0004, -1.0, f64::NAN] {
            assert_eq!(Ramp::over(at_once, 0.001).advance(DVec3::ZERO, target), target);
        }
        assert!(Ramp::over(f64::INFINITY, 0.001).advance(DVec3::ZERO, target).length() < 1e-9);
    }

    #[test]
    fn a_pose_turns_at_a_constant_rate_and_a_new_target_begins_where_it_is() {
        let (mut sender, mut trajectory) = pose_port(Pose::IDENTITY, 0.001);
        assert_eq!(trajectory(0.0), Pose::IDENTITY);
        let target = Pose { position: DVec3::X, orientation: DQuat::from_rotation_z(1.0) };
        sender.send(target, 0.01);
        for part in 1..=5 {
            let share = f64::from(part) / 10.0;
            let pose = trajectory(0.0);
            assert!((pose.position - DVec3::X * share).length() < 1e-15);
            assert!(pose.orientation.angle_between(DQuat::from_rotation_z(share)) < 1e-7);
        }
        sender.send(Pose::IDENTITY, 0.005);
        assert!((trajectory(0.0).position - DVec3::X * 0.4).length() < 1e-15);
        sender.send(target, 0.0);
        assert_eq!(trajectory(0.0), target);
        assert_eq!(trajectory(0.0), target);
    }
}
