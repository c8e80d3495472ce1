//! What the solver works on: objects, devices and contacts within a step, and what a change of force does to them.

use super::cone::{solve_contact, tangents};
use super::{Contact, DeviceState, Law, Other};
use crate::motion::RigidStep;
use crate::scene::{Model, RigidCompliance};
use crate::state::ObjectState;
use glam::{DMat3, DVec3};

/// A length below this share of (distance from the origin + size) is round-off: a few roundings of x + R·(r + u).
pub(super) const ROUND_OFF: f64 = 8.0 * f64::EPSILON;

/// Friction beyond the cone by less than this share is round-off.
const CONE: f64 = 1e-12;

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

/// The parts of a state that the solver works on.
pub(crate) struct Parts<'a> {
    pub(crate) model: &'a Model,
    pub(crate) objects: &'a mut [ObjectState],
    pub(crate) devices: &'a mut [DeviceState],
    pub(crate) contacts: &'a mut [Contact],
}

impl Parts<'_> {
    /// Begin from the free motion, without force.
    pub(super) fn start(&mut self, at: usize) {
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
    pub(super) fn compliance(&self, object: usize, a: usize, b: usize) -> DMat3 {
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
    pub(super) fn apart(&self, contact: &Contact) -> DVec3 {
        let other = match contact.other {
            Other::Device(device) => self.devices[device].proxy_under_force(),
            Other::Obstacle { end, .. } => end,
            Other::Object { number, slot } => self.place(number, slot),
        };
        other - self.place(contact.object, contact.slot)
    }

    /// Change the force on a point and, reversed, on the other side.
    pub(super) fn apply(&mut self, object: usize, slot: usize, other: Other, change: DVec3) {
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
    pub(super) fn remember(&mut self, bodies: &[u32], members: &[u32]) {
        for &member in members {
            let contact = &mut self.contacts[member as usize];
            contact.before = contact.force;
        }
        for &body in bodies {
            let own = &mut self.objects[body as usize];
            own.points.remember();
            own.lift.before = own.lift.moved;
        }
    }

    /// Go on in the direction of the sweeps (nonsmooth nonlinear conjugate gradients: Silcowitz, Niebe & Erleben
    /// 2010, Vis. Comput. 26, 893). All that follows from the forces is linear in them and goes along, so this costs
    /// no more than the contacts. Takes the last sweep's change of force, squared, and gives this one's.
    pub(super) fn accelerate(&mut self, bodies: &[u32], members: &[u32], last: f64) -> f64 {
        let mut square = 0.0;
        for &member in members {
            let contact = &self.contacts[member as usize];
            square += (contact.force - contact.before).length_squared();
        }
        let beta = if last > 0.0 && square < last { square / last } else { 0.0 };
        for &member in members {
            let contact = &mut self.contacts[member as usize];
            let change = contact.force - contact.before;
            let more = contact.along * beta;
            contact.force += more;
            contact.along = more + change;
            let Contact { object, slot, other, .. } = *contact;
            self.objects[object].shift_force(slot, more);
            match other {
                Other::Device(device) => self.devices[device].force += more,
                Other::Object { number, slot } => self.objects[number].shift_force(slot, -more),
                Other::Obstacle { .. } => {}
            }
        }
        for &body in bodies {
            let own = &mut self.objects[body as usize];
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

    /// What all contacts of a device, with any object, add up to.
    pub(super) fn sum_on_devices(&mut self) {
        self.devices.iter_mut().for_each(|device| device.force = DVec3::ZERO);
        for contact in self.contacts.iter() {
            if let Other::Device(device) = contact.other {
                self.devices[device].force += contact.force;
            }
        }
    }

    /// The step without contact force: sound whatever the hands ask for.
    pub(super) fn let_go(&mut self, bodies: &[u32], members: &[u32]) {
        // Whatever went wrong, nothing of it stays.
        for &member in members {
            let contact = &mut self.contacts[member as usize];
            (contact.force, contact.along) = (DVec3::ZERO, DVec3::ZERO);
            if let Other::Device(device) = contact.other {
                self.devices[device].force = DVec3::ZERO;
            }
        }
        for &body in bodies {
            let own = &mut self.objects[body as usize];
            own.points.let_go();
            own.end = own.free;
        }
    }

    /// Take away what the search has left of forces on contacts that are apart, traces without which they stay so, and of
    /// what is beyond Coulomb's cone.
    pub(super) fn drop_traces(&mut self, members: &[u32]) {
        for at in members.iter().map(|&at| at as usize) {
            let contact = self.contacts[at];
            let Law::Touch { friction } = contact.law else { continue };
            if contact.force == DVec3::ZERO {
                continue;
            }
            let closes = contact.force.length() * contact.compliance.x_axis.x;
            let normal = -contact.force.dot(contact.normal);
            if normal <= 0.0 || contact.gap(self.apart(&contact)) > contact.least_gap + closes {
                self.add_force(at, -contact.force);
                continue;
            }
            let (across, most) = (contact.force + contact.normal * normal, friction * normal);
            if across.length() > most * (1.0 + CONE) {
                self.add_force(at, across * (most / across.length() - 1.0));
            }
        }
    }

    /// Go on with a share of all forces, from objects that have started.
    pub(super) fn scale_forces(&mut self, members: &[u32], share: f64) {
        for &member in members {
            let Contact { object, slot, other, force, .. } = self.contacts[member as usize];
            self.contacts[member as usize].force = force * share;
            if let Other::Device(device) = other {
                self.devices[device].force -= force;
            }
            self.apply(object, slot, other, force * share);
        }
    }

    /// How far forces change an object over the step, in linear terms: the turn [rad], or the deformation as a share of
    /// the radius.
    pub(super) fn change(&self, at: usize) -> f64 {
        let own = &self.objects[at];
        let moved = |index: usize| (own.points.displaced(index) - own.points.points[index].free).length();
        let most = (0..own.points.points.len()).map(moved).fold(0.0, larger);
        larger(own.lift.moved[1].length(), most / self.model.objects[at].radius)
    }

    /// What roundings of places make of the contacts' work [J].
    pub(crate) fn rounding(&self) -> f64 {
        let of = |contact: &Contact| {
            let reach = self.objects[contact.object].reach(&self.model.objects[contact.object]);
            ROUND_OFF * reach * contact.force.length()
        };
        self.contacts.iter().map(of).sum()
    }

    /// Where the sides of contacts end up under the forces that were evaluated last. Gives the work [J] that they take.
    pub(super) fn end(&mut self, members: &[u32]) -> f64 {
        let mut taken = 0.0;
        for at in members.iter().map(|&at| at as usize) {
            self.contacts[at].end = self.apart(&self.contacts[at]);
            taken += self.contacts[at].taken();
        }
        taken
    }

    /// The largest gap [m] at the end of contacts that push all the same.
    pub(super) fn pushing_apart(&self, members: &[u32]) -> f64 {
        let contacts = members.iter().map(|&at| &self.contacts[at as usize]);
        let pushing = contacts.filter(|contact| contact.law != Law::Held && contact.force != DVec3::ZERO);
        pushing.map(|contact| contact.gap(contact.end)).fold(0.0, f64::max)
    }

    /// What a contact's law is solved with, in linear terms.
    pub(super) fn linearise(&mut self, at: usize) {
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

    /// A guess that moves a contact's sides by less than `enough` [m] from where they were is noise.
    pub(super) fn drop_noise(&mut self, at: usize, enough: f64) {
        let contact = &mut self.contacts[at];
        let w = contact.compliance * contact.axes.transpose();
        let noise = |last: &DVec3| (w * (contact.force - *last)).length() < enough;
        if let Some(last) = contact.guessed_from.filter(noise) {
            contact.force = last;
        }
    }

    pub(super) fn add_force(&mut self, contact: usize, change: DVec3) {
        self.contacts[contact].force += change;
        let Contact { object, slot, other, .. } = self.contacts[contact];
        self.apply(object, slot, other, change);
    }

    /// Solve one contact's law, unless that moves its sides by no more than `enough` [m]. Gives how far [m].
    pub(super) fn solve_touch(&mut self, at: usize, friction: f64, enough: f64) -> f64 {
        let contact = &self.contacts[at];
        let apart = self.apart(contact);
        let Contact { axes, compliance: w, .. } = contact;
        let into = axes.transpose();
        let moved = into * (apart - contact.start);
        let r = DVec3::new(contact.least_gap - contact.gap(apart), moved.y, moved.z);
        let before = into * contact.force;
        let after = solve_contact(w, &contact.stiffness, r + *w * before, friction, before);
        let change = after - before;
        let moved = (*w * change).length();
        if moved > enough {
            self.add_force(at, *axes * change);
        }
        moved
    }

    /// An object under its present forces, with the rotation of the last time: exact displacements, arms and rigid
    /// step. Gives how far that rotation is off, times the size of the body [m].
    pub(super) fn evaluate(&mut self, at: usize) -> f64 {
        let radius = self.model.objects[at].radius;
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
            let next = advance_rigid(self.model, at, own);
            miss = (next.turn - own.end.turn).length() * radius;
            own.end = next;
        }
        own.renew_arms();
        own.lift.moved = [DVec3::ZERO; 2];
        miss
    }

    /// Where rigid motion does not count within the step, it follows now.
    pub(super) fn finish(&mut self, at: usize) {
        let mobile = self.model.objects[at].inertia.is_some();
        let own = &mut self.objects[at];
        if mobile && own.lift.mobility == 0.0 {
            own.end = advance_rigid(self.model, at, own);
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

/// The larger of two sizes; infinite when one is no number, which a maximum would pass over.
pub(super) fn larger(a: f64, b: f64) -> f64 {
    if a.is_finite() && b.is_finite() { a.max(b) } else { f64::INFINITY }
}

/// Rigid motion of an object over the step under its contact forces and weight.
fn advance_rigid(model: &Model, at: usize, own: &ObjectState) -> RigidStep {
    let (mut force, mut torque) = (DVec3::ZERO, DVec3::ZERO);
    for point in &own.points.points {
        force += point.force;
        torque += ((point.start_arm + point.end_arm) * 0.5).cross(point.force);
    }
    model.objects[at].advance_rigid(&model.parameters, &own.rigid, (force, torque), Some(&own.end))
}
