//! Contact problem of a step: objects, devices and contacts, and the effect of contact forces on them.
//!
//! ```text
//! r_c = b_c − Σ_d W_cd·f_d        W = J·(Φ·B·Φᵀ + (1 − e + c)·S)·Jᵀ + rigid motion + 1/(k + d/h)
//! ```
//!
//! W [m/N], the Delassus operator, is not formed: every object keeps its compliance between its contact points, and its
//! linearised rigid motion.
//!
//! Equations: docs/theory.md (C31), (C32), (C34), (C36), (C37), (C44), (C45), (C46).

use super::constraint::{Constraint, Yielding};
use super::coulomb::{solve_contact, tangents};
use super::parameters::{MAX_EVALUATIONS, ROUND_OFF, UNSOLVED};
use crate::collision::{Contact, ContactLaw, OtherSide};
use crate::device::DeviceState;
use crate::motion::{RigidIncrement, RigidIntegrator, RigidStep};
use crate::object::{Object, ObjectState};
use glam::{DMat3, DVec3};

/// Rules of a step that the problem depends on.
#[derive(Debug, Clone, Copy)]
pub(crate) struct StepRules {
    /// Step h [s].
    pub(crate) step_s: f64,
    /// Gravity [m/s², world].
    pub(crate) gravity: DVec3,
    pub(crate) integrator: RigidIntegrator,
    /// Whether rigid motion counts in the compliance within the step.
    pub(crate) includes_rigid_compliance: bool,
}

/// Contact problem: references to what the solver works on.
pub(crate) struct ContactProblem<'a> {
    pub(crate) objects: &'a [Object],
    pub(crate) rules: StepRules,
    /// Objects that are awake, ascending: contacts are between them.
    pub(crate) awake: &'a [u32],
    pub(crate) states: &'a mut [ObjectState],
    pub(crate) devices: &'a mut [DeviceState],
    pub(crate) contacts: &'a mut [Contact],
    /// One for each contact.
    pub(crate) constraints: &'a mut [Constraint],
}

impl ContactProblem<'_> {
    /// Start an object from its motion without contact force.
    pub(super) fn start(&mut self, at: usize) {
        let object = &self.objects[at];
        let own = &mut self.states[at];
        own.end = own.free;
        let orientation = own.free.end.pose.orientation;
        let rules = self.rules;
        own.increment = match object.inertia.filter(|_| rules.includes_rigid_compliance) {
            Some(inertia) => {
                let factor = rules.integrator.held_factor() * rules.step_s * rules.step_s;
                RigidIncrement {
                    mobility: factor / inertia.mass,
                    angular_mobility: inertia.inverse_in_world(orientation) * factor,
                    ..RigidIncrement::default()
                }
            }
            None => RigidIncrement::default(),
        };
        for point in &mut own.points.points {
            point.displacement = point.free;
            point.end_arm = orientation * (point.rest + point.free);
        }
        own.restore_prescribed_forces();
    }

    /// Block of W between two contact points of an object [m/N, world], linearised about the last evaluation.
    pub(super) fn compliance(&self, object: usize, a: usize, b: usize) -> DMat3 {
        let own = &self.states[object];
        let (i, j) = (own.points.index(a), own.points.index(b));
        let r = DMat3::from_quat(own.end.end.pose.orientation);
        let (arm_a, arm_b) = (own.points.points[i].end_arm, own.points.points[j].end_arm);
        let (cross_a, cross_b) = (crate::spatial::cross_matrix(arm_a), crate::spatial::cross_matrix(arm_b));
        let rigid = DMat3::from_diagonal(DVec3::splat(own.increment.mobility))
            - cross_a * own.increment.angular_mobility * cross_b;
        r * own.points.block(i, j) * r.transpose() + rigid
    }

    /// Position of a contact point at the end of the step [m, world].
    fn position(&self, object: usize, slot: usize) -> DVec3 {
        let own = &self.states[object];
        let index = own.points.index(slot);
        let point = &own.points.points[index];
        let pose = &own.end.end.pose;
        let elastic = pose.orientation * (own.points.displaced(index) - point.displacement);
        let RigidIncrement { displacement, rotation, .. } = own.increment;
        pose.position + point.end_arm + elastic + displacement + rotation.cross(point.end_arm)
    }

    /// The other side minus the object's point at the end of the step [m, world].
    pub(super) fn apart(&self, contact: &Contact) -> DVec3 {
        let other = match contact.other {
            OtherSide::Device(device) => self.devices[device].proxy_under_force(),
            OtherSide::Obstacle { end, .. } | OtherSide::Clamp { end, .. } => end,
            OtherSide::Object { number, slot } => self.position(number, slot),
        };
        other - self.position(contact.object(), contact.slot)
    }

    /// Change the force of a contact on its point and, reversed, on the other side [N, world].
    pub(super) fn apply(&mut self, contact: &Contact, change: DVec3) {
        self.push(contact.object(), contact.slot, change);
        match contact.other {
            OtherSide::Device(device) => self.devices[device].force += change,
            OtherSide::Object { number, slot } => self.push(number, slot, -change),
            OtherSide::Obstacle { .. } | OtherSide::Clamp { .. } => {}
        }
    }

    fn push(&mut self, object: usize, slot: usize, change: DVec3) {
        let own = &mut self.states[object];
        let index = own.points.index(slot);
        let point = &mut own.points.points[index];
        point.force += change;
        let (force, arm) = (point.force, point.end_arm);
        own.increment.push(change, arm);
        let in_body = own.body_force(force);
        own.points.push(index, in_body);
    }

    /// Add to a contact's force [N, world].
    pub(super) fn add_force(&mut self, at: usize, change: DVec3) {
        self.contacts[at].force += change;
        let contact = self.contacts[at];
        self.apply(&contact, change);
    }

    /// Sum the forces of all contacts of each device, with any object.
    pub(super) fn sum_on_devices(&mut self) {
        self.devices.iter_mut().for_each(|device| device.force = DVec3::ZERO);
        for contact in self.contacts.iter() {
            if let OtherSide::Device(device) = contact.other {
                self.devices[device].force += contact.force;
            }
        }
    }

    /// Release all forces of an island: the step without contact.
    pub(super) fn release_forces(&mut self, bodies: &[u32], members: &[u32]) {
        for at in members.iter().map(|&member| member as usize) {
            self.contacts[at].force = DVec3::ZERO;
            if let OtherSide::Device(device) = self.contacts[at].other {
                self.devices[device].force = DVec3::ZERO;
            }
        }
        for &body in bodies {
            let own = &mut self.states[body as usize];
            own.points.release_forces();
            own.end = own.free;
            own.restore_prescribed_forces();
        }
    }

    /// Project forces onto their laws, (C36) and (C37): none on contacts that are open without it, and no friction beyond the cone.
    pub(super) fn project_forces(&mut self, members: &[u32]) {
        for at in members.iter().map(|&at| at as usize) {
            let contact = self.contacts[at];
            let ContactLaw::Unilateral { friction } = contact.law else { continue };
            if contact.force == DVec3::ZERO {
                continue;
            }
            let Constraint { compliance, min_gap, .. } = self.constraints[at];
            let closes = contact.force.length() * compliance.x_axis.x;
            let normal = -contact.force.dot(contact.normal);
            if normal <= 0.0 || contact.gap(self.apart(&contact)) > min_gap + closes {
                self.add_force(at, -contact.force);
                continue;
            }
            let (tangential, limit) = (contact.force + contact.normal * normal, friction * normal);
            if tangential.length() > limit * (1.0 + ROUND_OFF) {
                self.add_force(at, tangential * (limit / tangential.length() - 1.0));
            }
        }
    }

    /// Scale all forces of an island whose objects have started.
    pub(super) fn scale_forces(&mut self, members: &[u32], share: f64) {
        for &member in members {
            let contact = self.contacts[member as usize];
            self.contacts[member as usize].force = contact.force * share;
            if let OtherSide::Device(device) = contact.other {
                self.devices[device].force -= contact.force;
            }
            self.apply(&contact, contact.force * share);
        }
    }

    /// Linear estimate of how far forces change an object over the step: its rotation [rad], or its deformation as a share
    /// of its radius.
    pub(super) fn change(&self, at: usize) -> f64 {
        let own = &self.states[at];
        let moved = |index: usize| (own.points.displaced(index) - own.points.points[index].free).length();
        let most = (0..own.points.points.len()).map(moved).fold(0.0, larger);
        larger(own.increment.rotation.length(), most / self.objects[at].radius)
    }

    /// Round-off of the contacts' work [J].
    pub(crate) fn rounding(&self) -> f64 {
        let of = |contact: &Contact| {
            let object = contact.object();
            ROUND_OFF * self.states[object].reach(&self.objects[object]) * contact.force.length()
        };
        self.contacts.iter().map(of).sum()
    }

    /// Work [J] that all contacts dissipate over the step.
    pub(crate) fn dissipated(&self) -> f64 {
        let pairs = self.constraints.iter().zip(self.contacts.iter());
        pairs.map(|(constraint, contact)| constraint.dissipated(contact)).sum()
    }

    /// Block products that a change of a contact's force costs: the contact points of its objects.
    pub(super) fn products_of(&self, contact: &Contact) -> u64 {
        let of = |object: usize| self.states[object].points.points.len() as u64;
        let other = if let OtherSide::Object { number, .. } = contact.other { of(number) } else { 0 };
        of(contact.object()) + other
    }

    /// Work [J] that losses pay for pushing penetrations of an island out.
    pub(super) fn paid(&self, members: &[u32]) -> f64 {
        let of = |&at: &u32| {
            let (contact, constraint) = (&self.contacts[at as usize], &self.constraints[at as usize]);
            let pushed = constraint.min_gap - contact.gap(constraint.start).min(0.0);
            if contact.is_held() { 0.0 } else { (-contact.force.dot(contact.normal) * pushed).max(0.0) }
        };
        members.iter().map(of).sum()
    }

    /// Work [J] that an island's present forces dissipate on the motion without them: to first order in their scale.
    pub(super) fn dissipated_without_forces(&self, members: &[u32]) -> f64 {
        let free = |object: usize, slot: usize| {
            let (own, point) = (&self.states[object], self.states[object].points.of(slot));
            let pose = &own.free.end.pose;
            pose.world_from_body(point.rest + point.free)
        };
        let of = |&at: &u32| {
            let (contact, constraint) = (&self.contacts[at as usize], &self.constraints[at as usize]);
            let other = match contact.other {
                OtherSide::Device(device) => {
                    let device = &self.devices[device];
                    device.proxy_under_force() + device.force * device.compliance
                }
                OtherSide::Obstacle { end, .. } | OtherSide::Clamp { end, .. } => end,
                OtherSide::Object { number, slot } => free(number, slot),
            };
            let apart = other - free(contact.object(), contact.slot);
            if contact.is_held() { 0.0 } else { contact.force.dot(apart - constraint.start) }
        };
        members.iter().map(of).sum()
    }

    /// Write the ends of an island's contacts under the forces of the last evaluation. Gives the work [J] that they
    /// dissipate.
    pub(super) fn write_ends(&mut self, members: &[u32]) -> f64 {
        let mut dissipated = 0.0;
        for at in members.iter().map(|&at| at as usize) {
            let contact = self.contacts[at];
            self.constraints[at].end = self.apart(&contact);
            dissipated += self.constraints[at].dissipated(&contact);
        }
        dissipated
    }

    /// Largest gap at the end of unilateral contacts that carry force [m]: 0 by Signorini's law.
    pub(super) fn max_open_gap(&self, members: &[u32]) -> f64 {
        let pairs = members.iter().map(|&at| (&self.contacts[at as usize], &self.constraints[at as usize]));
        let pushing = pairs.filter(|(contact, _)| !contact.is_held() && contact.force != DVec3::ZERO);
        pushing.map(|(contact, constraint)| contact.gap(constraint.end)).fold(0.0, f64::max)
    }

    /// Linearise a contact: its axes, and its own W in them.
    pub(super) fn linearise(&mut self, at: usize) {
        let contact = self.contacts[at];
        let mut w = self.compliance(contact.object(), contact.slot, contact.slot);
        match contact.other {
            OtherSide::Device(device) => {
                w += DMat3::from_diagonal(DVec3::splat(self.devices[device].compliance));
            }
            OtherSide::Object { number, slot } => w += self.compliance(number, slot, slot),
            OtherSide::Obstacle { .. } | OtherSide::Clamp { .. } => {}
        }
        let (t1, t2) = tangents(contact.normal);
        let axes = DMat3::from_cols(-contact.normal, t1, t2);
        self.constraints[at].linearise(axes, axes.transpose() * w * axes);
    }

    /// Solve one contact's law with the others as they are, unless that moves its sides by no more than `enough` [m].
    /// Gives that movement [m].
    pub(super) fn solve_unilateral(&mut self, at: usize, friction: f64, enough: f64) -> f64 {
        let (contact, constraint) = (&self.contacts[at], &self.constraints[at]);
        let friction = match constraint.yields {
            Yielding::Everywhere => friction,
            Yielding::AlongNormal => 0.0,
            Yielding::Nowhere => {
                let force = contact.force;
                if force != DVec3::ZERO {
                    self.add_force(at, -force);
                }
                return 0.0;
            }
        };
        let apart = self.apart(contact);
        let Constraint { axes, compliance: w, .. } = constraint;
        let into = axes.transpose();
        let moved = into * (apart - constraint.start);
        let r = DVec3::new(constraint.min_gap - contact.gap(apart), moved.y, moved.z);
        let before = into * contact.force;
        let after = solve_contact(w, &constraint.stiffness, r + *w * before, friction, before);
        let change = after - before;
        let moved = (*w * change).length();
        if moved > enough {
            self.add_force(at, *axes * change);
        }
        moved
    }

    /// Evaluate an object exactly under its present forces, with the rotation of the last evaluation: displacements, arms
    /// and rigid step. Gives the residual of the rotation, times the size of the body [m].
    pub(super) fn evaluate(&mut self, at: usize) -> f64 {
        let moves = self.states[at].increment.mobility > 0.0;
        self.evaluate_motion(at, moves)
    }

    /// Motion of an object without contact force: under its weight and the prescribed forces, which are part of it, so that no
    /// contact and no fallback scales them. Gives whether the equations of motion hold.
    ///
    /// # Real time
    pub(crate) fn predict_under_prescribed_forces(&mut self, at: usize) -> bool {
        let object = &self.objects[at];
        let own = &mut self.states[at];
        own.points.release_forces();
        own.end = own.free;
        own.restore_prescribed_forces();
        let allowed = ROUND_OFF * own.reach(object);
        let mut last = f64::INFINITY;
        for _ in 0..MAX_EVALUATIONS {
            let residual = self.evaluate_motion(at, object.inertia.is_some());
            if residual <= allowed || residual >= last {
                last = residual.min(last);
                break;
            }
            last = residual;
        }
        let own = &mut self.states[at];
        own.free = own.end;
        last <= UNSOLVED * own.reach(object)
    }

    /// Evaluation of an object, whose rigid motion follows the forces if it `moves`.
    fn evaluate_motion(&mut self, at: usize, moves: bool) -> f64 {
        let radius = self.objects[at].radius;
        let own = &mut self.states[at];
        let orientation = own.end.end.pose.orientation;
        for index in 0..own.points.points.len() {
            let in_body = own.body_force(own.points.points[index].force);
            own.points.push(index, in_body);
        }
        for index in 0..own.points.points.len() {
            let displacement = own.points.displaced(index);
            let point = &mut own.points.points[index];
            point.displacement = displacement;
            point.end_arm = orientation * (point.rest + displacement);
        }
        let mut residual = 0.0;
        if moves {
            let next = advance_rigid(&self.objects[at], &self.rules, own);
            residual = (next.turn - own.end.turn).length() * radius;
            own.end = next;
        }
        own.update_arms();
        own.increment.reset();
        residual
    }

    /// Let rigid motion follow the forces, where it does not count within the step.
    pub(super) fn finish(&mut self, at: usize) {
        let own = &mut self.states[at];
        if self.objects[at].inertia.is_some() && own.increment.mobility == 0.0 {
            own.end = advance_rigid(&self.objects[at], &self.rules, own);
            own.update_arms();
        }
    }
}

/// The larger of two sizes; infinite when one is not a number, which a maximum would pass over.
pub(super) fn larger(a: f64, b: f64) -> f64 {
    if a.is_finite() && b.is_finite() { a.max(b) } else { f64::INFINITY }
}

/// Rigid motion of an object over the step under its contact forces and weight.
fn advance_rigid(object: &Object, rules: &StepRules, own: &ObjectState) -> RigidStep {
    let (mut force, mut torque) = (DVec3::ZERO, DVec3::ZERO);
    for point in &own.points.points {
        force += point.force;
        torque += ((point.start_arm + point.end_arm) * 0.5).cross(point.force);
    }
    let StepRules { integrator, step_s, gravity, .. } = *rules;
    object.advance_rigid((integrator, step_s, gravity), &own.rigid, (force, torque), Some(&own.end))
}
