//! Rows of numbers that programs give and take: poses x, y, z [m], qw, qx, qy, qz, and velocities.

use glam::{DQuat, DVec3};
use palpate::{Pose, Twist};

/// Deviation of a squared length from 1 that is round-off: such a quaternion keeps its bits.
const ROUND_OFF: f64 = 1e-12;

/// Row of a pose: x, y, z [m], qw, qx, qy, qz.
pub fn pose_row(pose: &Pose) -> [f64; 7] {
    let (p, q) = (pose.position, pose.orientation);
    [p.x, p.y, p.z, q.w, q.x, q.y, q.z]
}

/// Row of a velocity: linear [m/s], angular [rad/s].
pub fn twist_row(twist: &Twist) -> [f64; 6] {
    let (v, w) = (twist.linear, twist.angular);
    [v.x, v.y, v.z, w.x, w.y, w.z]
}

/// Pose of a row with its quaternion normalised, and the length that it had. A row of [`pose_row`] gives the same bits again.
///
/// # Real time
/// No allocation.
pub fn pose_of_row(&[x, y, z, qw, qx, qy, qz]: &[f64; 7]) -> (Pose, f64) {
    let given = DQuat::from_xyzw(qx, qy, qz, qw);
    let is_unit = (given.length_squared() - 1.0).abs() < ROUND_OFF;
    let orientation = if is_unit { given } else { given.normalize() };
    (Pose { position: DVec3::new(x, y, z), orientation }, given.length())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_comes_out_of_its_row_with_all_bits_and_other_quaternions_are_normalised() {
        /// Round-off of a normalised quaternion.
        const LENGTH: f64 = 1e-15;
        for angle in [0.0, 0.1, 1.0, 3.0] {
            let orientation = DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), angle);
            let pose = Pose { position: DVec3::new(0.1, -2.0, 3.0), orientation };
            let row = pose_row(&pose);
            assert_eq!(pose_of_row(&row).0, pose);
            let longer = [row[0], row[1], row[2], 2.0 * row[3], 2.0 * row[4], 2.0 * row[5], 2.0 * row[6]];
            let (read, length) = pose_of_row(&longer);
            assert!((length - 2.0).abs() < 4.0 * LENGTH, "{length}");
            assert!((read.orientation - orientation).length() < LENGTH && read.position == pose.position);
        }
        assert!(!pose_of_row(&[0.0; 7]).0.orientation.is_finite(), "refused by the step");
    }
}
