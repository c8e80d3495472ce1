//! Net forces of a step: the sums over the contacts of an object or obstacle.
//!
//! With the force F [N] on an object at the contact's point p at the end of the step [m], and the origin o of the body or obstacle frame [m],
//!
//! ```text
//! force = Σ F        torque = Σ (p − o) × F
//! ```
//!
//! on the object, and with −F at the same p on the other side, so that forces and moments balance to round-off.

use crate::collision::Collider;
use crate::io::{ContactOutput, ObjectOutput, ObstacleOutput, Output};
use crate::spatial::Pose;
use crate::state::Resting;
use glam::DVec3;

/// Add a force [N, world] at a point [m, world] to the net force of an object, whose pose is written.
pub(super) fn add(out: &mut ObjectOutput, force: DVec3, point: DVec3) {
    out.force += force;
    out.torque += (point - out.pose.position).cross(force);
}

/// Write the net forces on the obstacles, from the contacts in the output and the obstacle poses at the end of the step.
pub(super) fn write_obstacles(output: &mut Output, resting: &Resting, poses: &[Pose]) {
    output.obstacles.copy_from_slice(&resting.obstacles);
    add_contacts(&mut output.obstacles, &output.contacts[resting.outputs..], poses);
}

/// Sum up the net forces of sleeping objects on the obstacles, from their contacts in the output.
pub(super) fn update_resting(resting: &mut Resting, contacts: &[ContactOutput], poses: &[Pose]) {
    resting.obstacles.fill(ObstacleOutput::default());
    add_contacts(&mut resting.obstacles, &contacts[..resting.outputs], poses);
}

fn add_contacts(obstacles: &mut [ObstacleOutput], contacts: &[ContactOutput], poses: &[Pose]) {
    for contact in contacts {
        let Collider::Obstacle(number) = contact.against else { continue };
        let out = &mut obstacles[number];
        out.force -= contact.force;
        out.torque -= (contact.point - poses[number].position).cross(contact.force);
    }
}
