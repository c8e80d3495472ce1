//! Acceleration of Gauss-Seidel sweeps by nonsmooth nonlinear conjugate gradients (Silcowitz, Niebe & Erleben 2010, Vis.
//! Comput. 26, 893).
//!
//! ```text
//! Δ = f − f_before        β = |Δ|²/|Δ_last|² if that is below 1, else 0        d ← β·d + Δ        f ← f + β·d_last
//! ```
//!
//! All quantities that follow from the forces are linear in them and move along, so this costs no more than the contacts.

use super::problem::ContactProblem;
use crate::collision::OtherSide;
use crate::motion::RigidIncrement;
use crate::object::ObjectState;
use alloc::vec;
use alloc::vec::Vec;
use glam::DVec3;

/// Displacement and rotation of a rigid increment.
type Motion = [DVec3; 2];

/// Rigid increments of all objects before a sweep, and search directions; buffers are made once.
#[derive(Debug, Clone)]
pub(super) struct ConjugateGradients {
    before: Vec<Motion>,
    directions: Vec<Motion>,
    /// |Δ|² of the last sweep [N²].
    last_square: f64,
}

fn motion(increment: &RigidIncrement) -> Motion {
    [increment.displacement, increment.rotation]
}

/// Change the force on a point without its consequences.
fn shift_force(own: &mut ObjectState, slot: usize, change: DVec3) {
    let at = own.points.index(slot);
    own.points.points[at].force += change;
}

impl ConjugateGradients {
    pub(super) fn new(objects: usize) -> Self {
        let none = vec![[DVec3::ZERO; 2]; objects];
        Self { before: none.clone(), directions: none, last_square: 0.0 }
    }

    /// Start an object: no direction.
    pub(super) fn start_object(&mut self, at: usize) {
        self.directions[at] = [DVec3::ZERO; 2];
    }

    /// Restart: the next direction is the plain change of forces.
    pub(super) fn restart(&mut self) {
        self.last_square = 0.0;
    }

    /// Remember forces and motions before a sweep.
    pub(super) fn remember(&mut self, problem: &mut ContactProblem, bodies: &[u32], members: &[u32]) {
        for at in members.iter().map(|&member| member as usize) {
            problem.constraints[at].before = problem.contacts[at].force;
        }
        for at in bodies.iter().map(|&body| body as usize) {
            let own = &mut problem.states[at];
            own.points.remember();
            self.before[at] = motion(&own.increment);
        }
    }

    /// Extrapolate along the search direction after a sweep.
    pub(super) fn accelerate(&mut self, problem: &mut ContactProblem, bodies: &[u32], members: &[u32]) {
        let mut square = 0.0;
        for at in members.iter().map(|&member| member as usize) {
            square += (problem.contacts[at].force - problem.constraints[at].before).length_squared();
        }
        let last = self.last_square;
        let beta = if last > 0.0 && square < last { square / last } else { 0.0 };
        for at in members.iter().map(|&member| member as usize) {
            let (contact, constraint) = (&mut problem.contacts[at], &mut problem.constraints[at]);
            let change = contact.force - constraint.before;
            let more = constraint.direction * beta;
            contact.force += more;
            constraint.direction = more + change;
            shift_force(&mut problem.states[contact.id.object], contact.slot, more);
            match contact.other {
                OtherSide::Device(device) => problem.devices[device].force += more,
                OtherSide::Object { number, slot } => shift_force(&mut problem.states[number], slot, -more),
                OtherSide::Obstacle { .. } => {}
            }
        }
        for at in bodies.iter().map(|&body| body as usize) {
            let own = &mut problem.states[at];
            own.points.accelerate(beta);
            let now = motion(&own.increment);
            let mut moved = now;
            for k in 0..2 {
                let change = now[k] - self.before[at][k];
                let more = self.directions[at][k] * beta;
                moved[k] += more;
                self.directions[at][k] = more + change;
            }
            [own.increment.displacement, own.increment.rotation] = moved;
        }
        self.last_square = square;
    }
}
