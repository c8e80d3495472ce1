//! State of one object: rigid motion, response, contact points and energy ledger.

use super::base::Base;
use super::{InitialDeformation, Object};
use crate::energy::EnergyLedger;
use crate::motion::{RigidIncrement, RigidState, RigidStep};
use crate::response::{ContactPoints, ResponseState};
use glam::DVec3;

/// One object in motion.
#[derive(Debug, Clone)]
pub(crate) struct ObjectState {
    /// Rigid motion at the start of the step.
    pub(crate) rigid: RigidState,
    pub(crate) response: ResponseState,
    pub(crate) points: ContactPoints,
    /// End of the step without contact force, and under the forces of the solver.
    pub(crate) free: RigidStep,
    pub(crate) end: RigidStep,
    pub(crate) increment: RigidIncrement,
    /// Upper bound of the deformation of any surface node over the step without contact force [m].
    pub(crate) surface_motion: f64,
    /// Largest displacement of a contact point by contact forces in the last step, but of patches of tips [m].
    pub(crate) contact_displacement: f64,
    /// Whether a device held a point of it in the last step.
    pub(crate) is_held: bool,
    /// Motion of the base of a body with fixed nodes.
    pub(crate) base: Base,
    pub(crate) ledger: EnergyLedger,
    pub(crate) stored_at_start: f64,
}

impl ObjectState {
    /// Object at its start, with room for contact points.
    pub(crate) fn new(object: &Object, gravity: DVec3, capacity: usize) -> Self {
        let twist = object.start.twist;
        let pose = object.start.pose;
        let angular_momentum = object
            .inertia
            .map_or(DVec3::ZERO, |inertia| inertia.angular_momentum(pose.orientation, twist.angular));
        let rigid = RigidState { pose, velocity: twist.linear, angular_momentum };
        let still = RigidStep { end: rigid, turn: DVec3::ZERO, residual: 0.0 };
        let mut state = Self {
            rigid,
            response: object.response.at_rest(&object.body.recording, capacity),
            points: ContactPoints::new(capacity),
            free: still,
            end: still,
            increment: RigidIncrement::default(),
            surface_motion: 0.0,
            contact_displacement: 0.0,
            is_held: false,
            base: Base::default(),
            ledger: EnergyLedger::default(),
            stored_at_start: 0.0,
        };
        if object.deformation == InitialDeformation::Equilibrium {
            let gravity = object.gravity_in_body(gravity, &pose);
            state.response.start_at_equilibrium(&object.body, gravity);
        }
        state.update_ledger(object, gravity);
        state.stored_at_start = state.ledger.stored();
        state
    }

    /// Distance from the world's origin that the object reaches [m]: the scale of round-off of its positions.
    pub(crate) fn reach(&self, object: &Object) -> f64 {
        self.rigid.pose.position.length() + object.radius
    }

    /// Write kinetic, elastic and potential energy of the state into its ledger.
    ///
    /// # Real time
    pub(crate) fn update_ledger(&mut self, object: &Object, gravity: DVec3) {
        let elastic = self.response.energy(&object.response);
        let rigid = object.inertia.map_or(0.0, |inertia| inertia.kinetic_energy(&self.rigid));
        self.ledger.kinetic = elastic.kinetic + rigid + self.base_energy(object);
        self.ledger.elastic = elastic.elastic;
        self.ledger.residual = elastic.residual;
        self.ledger.potential = self.potential(object, gravity);
    }

    /// Stop all motion, under a gravity [m/s², world]. What it stored is dissipated.
    pub(crate) fn stop(&mut self, object: &Object, gravity: DVec3) {
        let stored = self.ledger.stored();
        (self.rigid.velocity, self.rigid.angular_momentum) = (DVec3::ZERO, DVec3::ZERO);
        self.response.stop();
        self.update_ledger(object, gravity);
        self.ledger.dissipated += stored - self.ledger.stored();
    }

    /// Potential energy of the state in a gravity field [J].
    pub(crate) fn potential(&self, object: &Object, gravity: DVec3) -> f64 {
        let mut potential = -object.body.recording.mass() * gravity.dot(self.rigid.pose.position);
        if let Some(response) = &object.body.recording.gravity {
            let acceleration = object.gravity_in_body(gravity, &self.rigid.pose);
            let modes = self.response.modes();
            for (axis, a) in acceleration.to_array().into_iter().enumerate() {
                let loads = &response.modal_forces[axis * modes.len()..][..modes.len()];
                let work: f64 = loads.iter().zip(modes).map(|(p, mode)| p * mode.q).sum();
                potential -= a * work;
            }
        }
        potential
    }

    /// Prescribed forces [N, world] and their torque about the centre of mass with the arms at the start of the step [N·m].
    pub(crate) fn prescribed_wrench(&self) -> (DVec3, DVec3) {
        let orientation = self.rigid.pose.orientation;
        let (mut force, mut torque) = (DVec3::ZERO, DVec3::ZERO);
        for point in &self.points.points {
            let Some(prescribed) = point.prescribed else { continue };
            force += prescribed;
            torque += (orientation * (point.rest + point.state.displacement)).cross(prescribed);
        }
        (force, torque)
    }

    /// Whether prescribed forces act.
    pub(crate) fn has_prescribed_forces(&self) -> bool {
        self.points.points.iter().any(|point| point.prescribed.is_some())
    }

    /// Set all forces to the prescribed ones.
    ///
    /// # Real time
    pub(crate) fn restore_prescribed_forces(&mut self) {
        for index in 0..self.points.points.len() {
            let point = &mut self.points.points[index];
            point.force = point.prescribed.unwrap_or_default();
            if let Some(force) = point.prescribed {
                let in_body = self.body_force(force);
                self.points.push(index, in_body);
            }
        }
    }

    /// Force in body axes whose work on the deformation is exact, Rᵀ·(1 − v̂/2)·f [N] (see `step`).
    pub(crate) fn body_force(&self, force: DVec3) -> DVec3 {
        self.end.end.pose.orientation.inverse() * (force + self.end.turn.cross(force) * 0.5)
    }

    /// Arms of all contact points at the end of the step, from their displacements.
    pub(crate) fn update_arms(&mut self) {
        let orientation = self.end.end.pose.orientation;
        for point in &mut self.points.points {
            point.end_arm = orientation * (point.rest + point.displacement);
        }
    }
}
