//! Rigid motion of the floating frame, under a force that is held over the step.
//!
//! With world force F [N], torque τ [N·m] about the centre of mass, step h [s]:
//!
//! ```text
//! exact held update                           the paper's update, (11)-(14)
//! v⁺ = v + h·F/m                              v⁺ = v + h·F/m
//! x⁺ = x + h·(v + v⁺)/2                       x⁺ = x + h·v⁺
//! L⁺ = L + h·τ                                ω⁺ = ω + h·I⁻¹·τ
//! R⁺ = cay(h·ω̄)·R                            R⁺ = exp(h·ω⁺)·R
//! ```
//!
//! L is the angular momentum in world axes, ω̄ = R·(Ω + Ω⁺)/2 the mean of the body's angular
//! velocities Ω = I⁻¹·Rᵀ·L: the implicit midpoint rule, gyroscopic term included. It conserves L
//! and, without torque, the kinetic energy exactly, and changes the energy by exactly τ·h·ω̄
//! (Simo & Wong 1991, Int. J. Numer. Meth. Eng. 31, 19). The orientation is second order.
//! The paper accumulates a vector θ; turning by h·θ̇⁺ each step equals it for small angles.
//!
//! Equations: docs/theory.md (C9), (C10), (C11), (C12).

mod increment;

pub(crate) use increment::RigidIncrement;

use crate::spatial::{Pose, Twist, cayley, cross_matrix, inertia_in_world};
use glam::{DMat3, DQuat, DVec3};

/// Time integrator of the rigid motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum RigidIntegrator {
    /// Exact for a held force; the rigid and the elastic part are sampled alike.
    #[default]
    ExactHold,
    /// Semi-implicit Euler, equations (11)-(14) of the paper. Loses energy at contact and in
    /// free fall; for comparison.
    Paper,
}

impl RigidIntegrator {
    /// Factor c of the displacement c·h²·F/m at the end of a step under a held force [1].
    pub(crate) fn held_factor(self) -> f64 {
        match self {
            Self::ExactHold => 0.5,
            Self::Paper => 1.0,
        }
    }
}

/// Mass [kg] and inertia about the centre of mass [kg·m²], in body axes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Inertia {
    pub(crate) mass: f64,
    tensor: DMat3,
    inverse: DMat3,
}

/// Pose and momentum of a free body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct RigidState {
    pub(crate) pose: Pose,
    /// Velocity of the centre of mass [m/s, world].
    pub(crate) velocity: DVec3,
    /// Angular momentum about the centre of mass [kg·m²/s, world].
    pub(crate) angular_momentum: DVec3,
}

/// Rigid step: state at its end under given forces.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RigidStep {
    pub(crate) end: RigidState,
    /// Turn h·ω̄ [rad]: vector of the Cayley map over the step.
    pub(crate) turn: DVec3,
    /// Residual of the turn's equation [rad].
    pub(crate) residual: f64,
}

/// Upper limit of Newton iterations of the implicit midpoint rule. They converge quadratically, to round-off for turns of up to
/// two radians in a step.
const MAX_ITERATIONS: usize = 20;

/// Residual [rad] below which one more iteration reaches round-off.
const CONVERGED: f64 = 1e-9;

/// Turn [rad] below which a step under nearly equal forces is a start of the iteration.
const SMALL_TURN: f64 = 0.3;

impl Inertia {
    pub(crate) fn new(mass: f64, tensor: DMat3) -> Self {
        Self { mass, tensor, inverse: tensor.inverse() }
    }

    /// Inverse inertia I⁻¹ in world axes [1/(kg·m²)].
    pub(crate) fn inverse_in_world(&self, orientation: DQuat) -> DMat3 {
        inertia_in_world(self.inverse, DMat3::from_quat(orientation))
    }

    /// Angular momentum [kg·m²/s, world] at an angular velocity ω [rad/s, world].
    pub(crate) fn angular_momentum(&self, orientation: DQuat, angular_velocity: DVec3) -> DVec3 {
        orientation * (self.tensor * (orientation.inverse() * angular_velocity))
    }

    fn angular_velocity_in_body(&self, state: &RigidState) -> DVec3 {
        self.inverse * (state.pose.orientation.inverse() * state.angular_momentum)
    }

    /// Velocity of a state.
    pub(crate) fn twist(&self, state: &RigidState) -> Twist {
        Twist {
            linear: state.velocity,
            angular: state.pose.orientation * self.angular_velocity_in_body(state),
        }
    }

    /// Kinetic energy of the rigid motion [J].
    pub(crate) fn kinetic_energy(&self, state: &RigidState) -> f64 {
        let spin = self.angular_velocity_in_body(state);
        0.5 * (self.mass * state.velocity.length_squared() + spin.dot(self.tensor * spin))
    }

    /// Rigid step of h [s] with force F [N], weight included, and torque τ [N·m]. The iteration starts from `nearly`, a step
    /// from the same start under nearly equal forces.
    ///
    /// # Real time
    pub(crate) fn advance(
        &self,
        integrator: RigidIntegrator,
        start: &RigidState,
        h: f64,
        (force, torque): (DVec3, DVec3),
        nearly: Option<&RigidStep>,
    ) -> RigidStep {
        let velocity = start.velocity + force * (h / self.mass);
        match integrator {
            RigidIntegrator::ExactHold => {
                let position = start.pose.position + (start.velocity + velocity) * (0.5 * h);
                let angular_momentum = start.angular_momentum + torque * h;
                let (orientation, turn, residual) = self.midpoint(start, h, angular_momentum, nearly);
                let pose = Pose { position, orientation };
                RigidStep { end: RigidState { pose, velocity, angular_momentum }, turn, residual }
            }
            RigidIntegrator::Paper => {
                let position = start.pose.position + velocity * h;
                let inverse = self.inverse_in_world(start.pose.orientation);
                let spin = inverse * (start.angular_momentum + torque * h);
                let orientation = (DQuat::from_scaled_axis(spin * h) * start.pose.orientation).normalize();
                let angular_momentum = self.angular_momentum(orientation, spin);
                // Cayley vector of the same rotation: 2·tan(angle/2) along the axis.
                let angle = spin.length() * h;
                let scale = if angle < 1e-8 { 1.0 } else { 2.0 * libm::tan(0.5 * angle) / angle };
                let pose = Pose { position, orientation };
                let end = RigidState { pose, velocity, angular_momentum };
                RigidStep { end, turn: spin * (h * scale), residual: 0.0 }
            }
        }
    }

    /// Orientation at the end of the step, turn h·ω̄ [rad] and residual [rad], by the implicit midpoint rule.
    ///
    /// With b = Rᵀ·L⁺ and y = cay(−h·w)·b the angular momentum at the end in body axes, the mean w satisfies
    /// w = ½(Ω + I⁻¹·y); and δy = ½·h·(1 + h·ŵ/2)⁻¹·(b + y)×δw.
    fn midpoint(
        &self,
        start: &RigidState,
        h: f64,
        end_momentum: DVec3,
        nearly: Option<&RigidStep>,
    ) -> (DQuat, DVec3, f64) {
        let from_world = start.pose.orientation;
        let spin = self.angular_velocity_in_body(start);
        let b = from_world.inverse() * end_momentum;
        // A large or unconverged turn is no start.
        let nearly = nearly.filter(|step| step.turn.length() < SMALL_TURN && step.residual < CONVERGED);
        let mut mean = nearly.map_or(spin, |step| from_world.inverse() * step.turn / h);
        let mut residual = f64::INFINITY;
        for _ in 0..MAX_ITERATIONS {
            let y = cayley(mean * h).inverse() * b;
            let excess = mean - (spin + self.inverse * y) * 0.5;
            residual = excess.length() * h;
            if residual == 0.0 {
                break;
            }
            let half_turn = DMat3::IDENTITY + cross_matrix(mean * (0.5 * h));
            let slope = half_turn.inverse() * cross_matrix(b + y) * (0.5 * h);
            let jacobian = DMat3::IDENTITY - self.inverse * slope * 0.5;
            mean -= jacobian.inverse() * excess;
            if residual < CONVERGED {
                // Quadratic convergence: the remaining residual is below round-off.
                residual *= residual;
                break;
            }
        }
        // cay(h·ω̄)·R = R·cay(h·Ω̄).
        let orientation = (from_world * cayley(mean * h)).normalize();
        (orientation, from_world * mean * h, residual)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn brick() -> (Inertia, RigidState) {
        let inertia = Inertia::new(2.0, DMat3::from_diagonal(DVec3::new(0.02, 0.05, 0.04)));
        let pose = Pose { position: DVec3::ZERO, orientation: cayley(DVec3::new(0.3, 0.2, -0.5)) };
        let angular_momentum = inertia.angular_momentum(pose.orientation, DVec3::new(1.0, 8.0, 0.5));
        (inertia, RigidState { pose, velocity: DVec3::ZERO, angular_momentum })
    }

    fn spin_for(h: f64, duration: f64) -> (RigidState, f64) {
        let (inertia, start) = brick();
        let mut state = start;
        for _ in 0..(duration / h).round() as usize {
            state =
                inertia.advance(RigidIntegrator::ExactHold, &state, h, (DVec3::ZERO, DVec3::ZERO), None).end;
        }
        let energy = inertia.kinetic_energy(&start);
        (state, inertia.kinetic_energy(&state) / energy - 1.0)
    }

    #[test]
    fn torque_free_spin_conserves_energy_to_round_off_and_turns_with_second_order() {
        let (exact, _) = spin_for(1e-5, 1.0);
        let mut errors = [0.0; 2];
        for (error, h) in errors.iter_mut().zip([2e-3, 1e-3]) {
            let (state, energy_change) = spin_for(h, 1.0);
            assert!(energy_change.abs() < 1e-12, "energy changes by {energy_change}");
            *error = state.pose.orientation.angle_between(exact.pose.orientation);
        }
        let order = libm::log2(errors[0] / errors[1]);
        assert!((order - 2.0).abs() < 0.05, "observed order {order}, errors {errors:?}");
    }

    #[test]
    fn a_long_thin_bar_that_turns_half_a_radian_a_step_keeps_its_energy() {
        let inertia = Inertia::new(1.0, DMat3::from_diagonal(DVec3::new(0.002, 0.04, 0.041)));
        let pose = Pose::IDENTITY;
        let angular_momentum = inertia.angular_momentum(pose.orientation, DVec3::new(300.0, 400.0, 200.0));
        let mut state = RigidState { pose, velocity: DVec3::ZERO, angular_momentum };
        let energy = inertia.kinetic_energy(&state);
        for _ in 0..1000 {
            let step =
                inertia.advance(RigidIntegrator::ExactHold, &state, 1e-3, (DVec3::ZERO, DVec3::ZERO), None);
            assert!(step.residual < 1e-12, "{}", step.residual);
            state = step.end;
        }
        assert!((inertia.kinetic_energy(&state) / energy - 1.0).abs() < 1e-11);
    }

    #[test]
    fn torque_changes_the_energy_by_exactly_its_work() {
        let (inertia, start) = brick();
        let torque = DVec3::new(0.3, -0.2, 0.5);
        let step = inertia.advance(RigidIntegrator::ExactHold, &start, 1e-2, (DVec3::ZERO, torque), None);
        let change = inertia.kinetic_energy(&step.end) - inertia.kinetic_energy(&start);
        let work = torque.dot(step.turn);
        assert!((change - work).abs() < 1e-13, "{change} {work}");
    }

    #[test]
    fn the_papers_update_is_the_small_angle_limit() {
        let (inertia, start) = brick();
        let (force, torque) = (DVec3::new(0.1, 0.2, 0.0), DVec3::new(0.0, 0.1, 0.2));
        let gap = |h: f64| {
            let a = inertia.advance(RigidIntegrator::ExactHold, &start, h, (force, torque), None).end;
            let b = inertia.advance(RigidIntegrator::Paper, &start, h, (force, torque), None).end;
            (a.pose.position - b.pose.position).length()
                + a.pose.orientation.angle_between(b.pose.orientation)
        };
        // Both are consistent: one step differs by O(h²).
        let order = libm::log2(gap(2e-3) / gap(1e-3));
        assert!((order - 2.0).abs() < 0.1, "observed order {order}");
    }
}
