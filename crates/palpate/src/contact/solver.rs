//! The forces of all contacts that depend on one another: held points, touches, obstacles, pairs.
//!
//! With W [m/N] the Delassus operator (displacement at the end of the step per held force, from modes, residual
//! compliance, rigid motion and virtual couplings), the sides of contact c end up apart by
//!
//! ```text
//! apart_c = free_c − Σ_d W_cd·f_d
//! ```
//!
//! Sweeps over the contacts solve each one's law with the others' forces as they are (block Gauss-Seidel, see
//! `cone`); the held points of an object are one block, solved by Cholesky's factors. W is not formed: every object
//! keeps C between its points, and its rigid motion is carried along. Between sweeps everything is evaluated anew
//! with the rotation that the forces cause, so that what is solved in the end are the equations of motion
//! themselves and not their linear part.

use super::cone::{solve_contact, tangents};
use super::{Contact, DeviceState, HeldSystem, Law, Other};
use crate::motion::RigidStep;
use crate::scene::{Model, RigidCompliance, SceneObject};
use crate::state::{ObjectState, StepStatus};
use alloc::vec;
use alloc::vec::Vec;
use glam::{DMat3, DVec3};

/// The equations of motion are met by repeating sweeps with the rotation of the last time, which gains a factor of
/// about h·|ω| + strain each time; this many reach round-off for any motion a hand can make.
const MAX_ITERATIONS: u32 = 40;

/// Sweeps over all evaluations together: far more than contacts that can be solved need.
const MAX_SWEEPS: u32 = 300;

/// A miss below this share of (distance from the origin + size) is round-off: a few roundings of x + R·(r + u).
const ROUND_OFF: f64 = 8.0 * f64::EPSILON;

/// A miss above this share of the reach is no solution: a hand or a body moves too far in a step.
const UNSOLVED: f64 = 1e-9;

/// Few contacts are solved to round-off. Many need not be better than [`CLOSE`], and after so many visits than
/// [`LOOSE`], as shares of the object's size: a face at rest on the floor is close at once, one that hits it gets loose.
const FEW: usize = 24;
const VISITS: u32 = 600;
const CLOSE: f64 = 1e-8;
const LOOSE: f64 = 1e-5;

/// How an object moves rigidly with the forces, in linear terms about the last evaluation.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lift {
    /// Displacement [m] and rotation [rad] since then.
    moved: [DVec3; 2],
    /// The same before a sweep, and along the direction of search.
    before: [DVec3; 2],
    along: [DVec3; 2],
    /// Per force [m/N], and per torque [rad/(N·m)].
    mobility: f64,
    turning: DMat3,
}

impl Default for Lift {
    fn default() -> Self {
        let none = [DVec3::ZERO; 2];
        Self { moved: none, before: none, along: none, mobility: 0.0, turning: DMat3::ZERO }
    }
}

/// Buffers of the solver.
#[derive(Debug, Clone)]
pub(crate) struct Solver {
    system: HeldSystem,
    held: Vec<u32>,
    /// Which group of objects each belongs to.
    group: Vec<u32>,
    members: Vec<u32>,
}

/// The parts of a state that the solver works on.
pub(crate) struct Parts<'a> {
    pub(crate) model: &'a Model,
    pub(crate) objects: &'a mut [ObjectState],
    pub(crate) devices: &'a mut [DeviceState],
    pub(crate) contacts: &'a mut [Contact],
}

impl Solver {
    pub(crate) fn new(objects: usize, devices: usize, contacts: usize) -> Self {
        Self {
            system: HeldSystem::new(devices),
            held: Vec::with_capacity(devices),
            group: vec![0; objects],
            members: Vec::with_capacity(contacts),
        }
    }

    /// Find all forces. Objects whose contacts can't be solved move freely for the step.
    ///
    /// # Real time
    /// Costs sweeps × contacts × contact points of an object.
    pub(crate) fn solve(&mut self, parts: &mut Parts, status: &mut StepStatus) {
        self.group_objects(parts);
        for first in 0..self.group.len() {
            if self.group[first] as usize != first {
                continue;
            }
            self.members.clear();
            let mine = |c: &Contact| self.group[c.object] as usize == first;
            self.members
                .extend((0..parts.contacts.len()).filter(|&c| mine(&parts.contacts[c])).map(|c| c as u32));
            if self.members.is_empty() {
                let own = &mut parts.objects[first];
                own.end = own.free;
            } else {
                self.solve_group(parts, first, status);
            }
        }
    }

    /// Objects that touch each other, or that one elastic coupling pulls at, are solved together.
    fn group_objects(&mut self, parts: &Parts) {
        let group = &mut self.group;
        for (at, of) in group.iter_mut().enumerate() {
            *of = at as u32;
        }
        let join = |group: &mut Vec<u32>, a: usize, b: usize| {
            let (a, b) = (group[a], group[b]);
            group.iter_mut().filter(|of| **of == a.max(b)).for_each(|of| *of = a.min(b));
        };
        for (at, contact) in parts.contacts.iter().enumerate() {
            match contact.other {
                Other::Object { number, .. } => join(group, contact.object, number),
                Other::Device(device) if parts.devices[device].compliance > 0.0 => {
                    let same = |c: &&Contact| c.other == contact.other;
                    if let Some(earlier) = parts.contacts[..at].iter().find(same) {
                        join(group, contact.object, earlier.object);
                    }
                }
                _ => {}
            }
        }
    }

    fn solve_group(&mut self, parts: &mut Parts, first: usize, status: &mut StepStatus) {
        let bodies = (first..self.group.len()).filter(|&o| self.group[o] as usize == first);
        let (mut reach, mut size) = (0.0_f64, f64::INFINITY);
        let many = self.members.len() > FEW;
        for at in bodies {
            let radius = parts.model.objects[at].radius;
            parts.objects[at].points.least_move = if many { 0.03 * CLOSE * radius } else { 0.0 };
            parts.start(at);
            reach =
                reach.max(parts.objects[at].rigid.pose.position.length() + parts.model.objects[at].radius);
            size = size.min(parts.model.objects[at].radius);
        }
        for &member in &self.members {
            let contact = parts.contacts[member as usize];
            if contact.law != Law::Held {
                parts.prepare(member as usize);
            }
            parts.apply(contact.object, contact.slot, contact.other, contact.force);
        }
        let dependent = self.factorise_held(parts);
        status.dependent_rows += dependent as u32;

        let touching = self.members.iter().any(|&c| parts.contacts[c as usize].law != Law::Held);
        let tight = ROUND_OFF * reach;
        let (mut least, mut first_miss) = (f64::INFINITY, f64::INFINITY);
        let (mut iterations, mut visits, mut sweeps) = (0, 0, 0);
        let solved = loop {
            let turned = self.evaluate(parts, first);
            iterations += 1;
            let miss = larger(turned, self.sweep(parts, 0.1 * self.accuracy(visits, size)));
            visits += self.members.len() as u32;
            if iterations == 1 {
                first_miss = miss;
            }
            // Done at round-off, or near it when no more digits are gained, or as near as contacts need.
            let stalled = miss > 0.5 * least && miss < 1e3 * tight;
            let enough = touching && miss < self.accuracy(visits, size);
            let spent = iterations == MAX_ITERATIONS || sweeps >= MAX_SWEEPS && touching;
            if miss <= tight || stalled || enough || spent || !miss.is_finite() {
                status.iterations = status.iterations.max(iterations);
                // Points that repeat others can't be met where their hands differ, and need not be.
                let allowed = if touching { LOOSE * size } else { UNSOLVED * reach };
                if miss <= allowed || dependent > 0 && miss <= first_miss {
                    status.solver_residual_m = status.solver_residual_m.max(miss);
                    break true;
                }
                status.solver_residual_m =
                    status.solver_residual_m.max(if miss.is_finite() { miss } else { reach });
                break false;
            }
            least = least.min(miss);
            let goal = tight.max(0.02 * miss);
            let mut last = 0.0;
            while sweeps < MAX_SWEEPS {
                sweeps += 1;
                parts.remember(&self.members);
                let moved = self.sweep(parts, 0.1 * goal);
                last = self.accelerate(parts, first, last);
                visits += self.members.len() as u32;
                if moved <= goal.max(0.3 * self.accuracy(visits, size)) || !moved.is_finite() {
                    break;
                }
            }
        };
        if !solved {
            status.unsolved_objects += 1;
            self.let_go(parts, first);
        }
        self.evaluate(parts, first);
        for object in (first..self.group.len()).filter(|&o| self.group[o] as usize == first) {
            parts.finish(object);
        }
        for &member in &self.members {
            let contact = parts.contacts[member as usize];
            parts.contacts[member as usize].end = parts.apart(&contact);
        }
    }

    /// A miss [m] that is small enough after so many visits.
    fn accuracy(&self, visits: u32, size: f64) -> f64 {
        match (self.members.len() <= FEW, visits > VISITS) {
            (true, false) => 0.0,
            (false, false) => CLOSE * size,
            (_, true) => LOOSE * size,
        }
    }

    /// The step without contact force: sound whatever the hands ask for.
    fn let_go(&mut self, parts: &mut Parts, first: usize) {
        // Whatever went wrong, nothing of it stays: sums are made anew, since they may not be numbers.
        for &member in &self.members {
            parts.contacts[member as usize].force = DVec3::ZERO;
        }
        for &member in &self.members {
            if let Other::Device(device) = parts.contacts[member as usize].other {
                let its = parts.contacts.iter().filter(|c| c.other == Other::Device(device));
                parts.devices[device].force = its.map(|c| c.force).sum();
            }
        }
        for object in (first..self.group.len()).filter(|&o| self.group[o] as usize == first) {
            let own = &mut parts.objects[object];
            own.points.let_go();
            own.end = own.free;
        }
    }

    /// Everything under the present forces, with the rotation of the last time. Gives how far that is off [m].
    fn evaluate(&self, parts: &mut Parts, first: usize) -> f64 {
        let objects = (first..self.group.len()).filter(|&o| self.group[o] as usize == first);
        objects.map(|object| parts.evaluate(object)).fold(0.0, larger)
    }

    /// Factors of the held points' W, object by object. Gives the number of dependent rows.
    fn factorise_held(&mut self, parts: &Parts) -> usize {
        self.held.clear();
        let is_held = |c: &&u32| parts.contacts[**c as usize].law == Law::Held;
        self.held.extend(self.members.iter().filter(is_held));
        let Self { system, held, .. } = self;
        system.factorise(held.len(), |a, b| {
            let (a, b) = (&parts.contacts[held[a] as usize], &parts.contacts[held[b] as usize]);
            let mut w = DMat3::ZERO;
            if a.object == b.object {
                w += parts.compliance(a.object, a.slot, b.slot);
            }
            if let (true, Other::Device(device)) = (a.other == b.other, a.other) {
                w += DMat3::from_diagonal(DVec3::splat(parts.devices[device].compliance));
            }
            w
        })
    }

    /// Go on in the direction of the sweeps (nonsmooth nonlinear conjugate gradients: Silcowitz, Niebe & Erleben
    /// 2010, Vis. Comput. 26, 893). All that follows from the forces is linear in them and goes along, so this costs
    /// no more than the contacts. Takes the last sweep's change of force, squared, and gives this one's.
    fn accelerate(&self, parts: &mut Parts, first: usize, last: f64) -> f64 {
        let mut square = 0.0;
        for &member in &self.members {
            let contact = &parts.contacts[member as usize];
            square += (contact.force - contact.before).length_squared();
        }
        let beta = if last > 0.0 && square < last { square / last } else { 0.0 };
        for &member in &self.members {
            let contact = &mut parts.contacts[member as usize];
            let change = contact.force - contact.before;
            let more = contact.along * beta;
            contact.force += more;
            contact.along = more + change;
            let contact = *contact;
            parts.objects[contact.object].shift_force(contact.slot, more);
            match contact.other {
                Other::Device(device) => parts.devices[device].force += more,
                Other::Object { number, slot } => parts.objects[number].shift_force(slot, -more),
                Other::Obstacle { .. } => {}
            }
        }
        for object in (first..self.group.len()).filter(|&o| self.group[o] as usize == first) {
            let own = &mut parts.objects[object];
            own.points.accelerate(beta);
            for k in 0..2 {
                let change = own.lift.moved[k] - own.lift.before[k];
                let more = own.lift.along[k] * beta;
                own.lift.moved[k] += more;
                own.lift.along[k] = more + change;
            }
        }
        square
    }

    /// Solve every contact once with the others as they are, where that moves its sides by more than `enough` [m].
    /// Gives the largest movement [m].
    fn sweep(&mut self, parts: &mut Parts, enough: f64) -> f64 {
        let mut largest = 0.0_f64;
        let Self { system, held, members, .. } = self;
        if !held.is_empty() {
            let apart = |point: usize| parts.apart(&parts.contacts[held[point] as usize]);
            largest = (0..held.len()).map(|point| apart(point).length()).fold(0.0, larger);
            system.solve(apart);
            for (at, &contact) in held.iter().enumerate() {
                parts.add_force(contact as usize, system.force(at));
            }
        }
        for at in members.iter().map(|&at| at as usize) {
            let contact = parts.contacts[at];
            let Law::Touch { friction } = contact.law else { continue };
            let moved = parts.solve_touch(at, &contact, friction, enough);
            largest = larger(largest, moved);
        }
        largest
    }
}

/// The larger of two sizes; infinite when one is no number, which a maximum would pass over.
fn larger(a: f64, b: f64) -> f64 {
    if a.is_finite() && b.is_finite() { a.max(b) } else { f64::INFINITY }
}

impl Parts<'_> {
    fn object(&self, at: usize) -> (&SceneObject, &ObjectState) {
        (&self.model.objects[at], &self.objects[at])
    }

    /// Begin from the free motion, without force.
    fn start(&mut self, at: usize) {
        let object = &self.model.objects[at];
        let own = &mut self.objects[at];
        own.end = own.free;
        let orientation = own.free.end.pose.orientation;
        let counts = self.model.parameters.rigid_compliance == RigidCompliance::Included;
        own.lift = match object.inertia.filter(|_| counts) {
            Some(inertia) => {
                let parameters = &self.model.parameters;
                let factor = parameters.motion.held_factor() * parameters.step_s * parameters.step_s;
                Lift {
                    mobility: factor / inertia.mass,
                    turning: inertia.inverse_in_world(orientation) * factor,
                    ..Lift::default()
                }
            }
            None => Lift::default(),
        };
        for point in &mut own.points.points {
            point.force = DVec3::ZERO;
            point.displacement = point.free;
            point.end_arm = orientation * (point.rest + point.free);
        }
    }

    /// W between two points of an object, in linear terms about the last evaluation.
    fn compliance(&self, object: usize, a: usize, b: usize) -> DMat3 {
        let own = &self.objects[object];
        let (i, j) = (own.points.index(a), own.points.index(b));
        let r = DMat3::from_quat(own.end.end.pose.orientation);
        let (arm_a, arm_b) = (own.points.points[i].end_arm, own.points.points[j].end_arm);
        let rigid = DMat3::from_diagonal(DVec3::splat(own.lift.mobility))
            - crate::spatial::cross_matrix(arm_a) * own.lift.turning * crate::spatial::cross_matrix(arm_b);
        r * own.points.block(i, j) * r.transpose() + rigid
    }

    /// Where a contact point is at the end of the step [m, world].
    fn place(&self, object: usize, slot: usize) -> DVec3 {
        let own = &self.objects[object];
        let index = own.points.index(slot);
        let point = &own.points.points[index];
        let pose = &own.end.end.pose;
        let elastic = pose.orientation * (own.points.displaced(index) - point.displacement);
        pose.position + point.end_arm + elastic + own.lift.moved[0] + own.lift.moved[1].cross(point.end_arm)
    }

    /// The other side minus the object's point at the end of the step [m, world].
    fn apart(&self, contact: &Contact) -> DVec3 {
        let other = match contact.other {
            Other::Device(device) => self.devices[device].proxy_under_force(),
            Other::Obstacle { end, .. } => end,
            Other::Object { number, slot } => self.place(number, slot),
        };
        other - self.place(contact.object, contact.slot)
    }

    /// Change the force on a point and, reversed, on the other side.
    fn apply(&mut self, object: usize, slot: usize, other: Other, change: DVec3) {
        self.push(object, slot, change);
        match other {
            Other::Device(device) => self.devices[device].force += change,
            Other::Object { number, slot } => self.push(number, slot, -change),
            Other::Obstacle { .. } => {}
        }
    }

    fn push(&mut self, object: usize, slot: usize, change: DVec3) {
        let own = &mut self.objects[object];
        let index = own.points.index(slot);
        let point = &mut own.points.points[index];
        point.force += change;
        let (force, arm) = (point.force, point.end_arm);
        own.lift.moved[0] += change * own.lift.mobility;
        own.lift.moved[1] += own.lift.turning * arm.cross(change);
        let in_body = own.body_force(force);
        own.points.push(index, in_body);
    }

    /// Keep everything that depends on the forces.
    fn remember(&mut self, members: &[u32]) {
        for &member in members {
            let contact = &mut self.contacts[member as usize];
            contact.before = contact.force;
        }
        for own in self.objects.iter_mut() {
            own.points.remember();
            own.lift.before = own.lift.moved;
        }
    }

    /// What a contact's law is solved with, in linear terms.
    fn prepare(&mut self, at: usize) {
        let contact = self.contacts[at];
        let mut w = self.compliance(contact.object, contact.slot, contact.slot);
        match contact.other {
            Other::Device(device) => w += DMat3::from_diagonal(DVec3::splat(self.devices[device].compliance)),
            Other::Object { number, slot } => w += self.compliance(number, slot, slot),
            Other::Obstacle { .. } => {}
        }
        let (t1, t2) = tangents(contact.normal);
        let axes = DMat3::from_cols(-contact.normal, t1, t2);
        let compliance = axes.transpose() * w * axes;
        let contact = &mut self.contacts[at];
        (contact.axes, contact.compliance, contact.stiffness) = (axes, compliance, compliance.inverse());
    }

    fn add_force(&mut self, contact: usize, change: DVec3) {
        self.contacts[contact].force += change;
        let Contact { object, slot, other, .. } = self.contacts[contact];
        self.apply(object, slot, other, change);
    }

    /// Solve one contact's law, unless that moves its sides by no more than `enough` [m]. Gives how far [m].
    fn solve_touch(&mut self, at: usize, contact: &Contact, friction: f64, enough: f64) -> f64 {
        let apart = self.apart(contact);
        let Contact { axes, compliance: w, .. } = *contact;
        let into = axes.transpose();
        let moved = into * (apart - contact.start);
        let r = DVec3::new(contact.least_gap - contact.gap(apart), moved.y, moved.z);
        let before = into * contact.force;
        let after = solve_contact(&w, &contact.stiffness, r + w * before, friction, before);
        let change = after - before;
        let moved = (w * change).length();
        if moved > enough {
            self.add_force(at, axes * change);
        }
        moved
    }

    /// An object under its present forces, with the rotation of the last time: exact displacements, arms and rigid
    /// step. Gives how far that rotation is off, times the size of the body [m].
    fn evaluate(&mut self, at: usize) -> f64 {
        let (object, _) = self.object(at);
        let (radius, inertia) = (object.radius, object.inertia);
        let own = &mut self.objects[at];
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
        let mut miss = 0.0;
        if own.lift.mobility > 0.0 {
            let next = advance_rigid(self.model, inertia.is_some(), at, own);
            miss = (next.turn - own.end.turn).length() * radius;
            own.end = next;
        }
        own.renew_arms();
        own.lift.moved = [DVec3::ZERO; 2];
        miss
    }

    /// Where rigid motion does not count within the step, it follows now.
    fn finish(&mut self, at: usize) {
        let inertia = self.model.objects[at].inertia.is_some();
        let own = &mut self.objects[at];
        if inertia && own.lift.mobility == 0.0 {
            own.end = advance_rigid(self.model, inertia, at, own);
            own.renew_arms();
        }
    }
}

impl ObjectState {
    /// A force [N] in body axes so that its work on the deformation is exact (see `step`).
    fn body_force(&self, force: DVec3) -> DVec3 {
        self.end.end.pose.orientation.inverse() * (force + self.end.turn.cross(force) * 0.5)
    }

    /// Change the force on a point without what follows from it.
    fn shift_force(&mut self, slot: usize, change: DVec3) {
        let at = self.points.index(slot);
        self.points.points[at].force += change;
    }

    fn renew_arms(&mut self) {
        let orientation = self.end.end.pose.orientation;
        for point in &mut self.points.points {
            point.end_arm = orientation * (point.rest + point.displacement);
        }
    }
}

/// Rigid motion of an object over the step under its contact forces and weight; a fixed body stays.
fn advance_rigid(model: &Model, mobile: bool, at: usize, own: &ObjectState) -> RigidStep {
    debug_assert!(mobile);
    let (mut force, mut torque) = (DVec3::ZERO, DVec3::ZERO);
    for point in &own.points.points {
        force += point.force;
        torque += ((point.start_arm + point.end_arm) * 0.5).cross(point.force);
    }
    model.objects[at].advance_rigid(&model.parameters, &own.rigid, force, torque)
}
