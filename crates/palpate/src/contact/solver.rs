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

use super::parts::{ROUND_OFF, larger};
use super::{Contact, HeldSystem, Law, Other, Parts};
use crate::state::StepStatus;
use alloc::vec;
use alloc::vec::Vec;
use glam::{DMat3, DVec3};

/// The equations of motion are met by repeating sweeps with the rotation of the last time, which gains a factor of
/// about h·|ω| + strain each time; this many reach round-off for any motion a hand can make.
const MAX_ITERATIONS: u32 = 40;

/// And this many reach it from where contacts are loose.
const LAST_EVALUATIONS: u32 = 6;

/// Sweeps over all evaluations together: far more than contacts that can be solved need.
const MAX_SWEEPS: u32 = 300;

/// A miss above this share of the reach is no solution: a hand or a body moves too far in a step.
const UNSOLVED: f64 = 1e-9;

/// Few contacts are solved to round-off. Many need not be better than [`CLOSE`], after so many visits than [`LOOSE`], and
/// after very many than [`ROUGH`], as shares of the object's size: a face at rest on the floor is close at once, one that
/// hits it gets loose, and two faces that hit each other, whose contacts repeat one another, are left rough.
const FEW: usize = 24;
const VISITS: u32 = 600;
/// The same where fewer places stand for many nodes, which is not more exact than [`LOOSE`] is.
const HASTY_VISITS: u32 = 60;
const MANY_VISITS: u32 = 20_000;
const MOST_VISITS: u32 = 40_000;
const CLOSE: f64 = 1e-8;
const LOOSE: f64 = 1e-5;
const ROUGH: f64 = 1e-4;

/// A body that an evaluation turns by more than this [rad] answers its contacts differently.
const TURNED: f64 = 0.01;

/// A body that turns by more than this [rad, Cayley] under the forces of a step has lost its solution.
const WHIRL: f64 = 4.0;

/// Contacts that can't be met whole are met in part: with forces from so many sweeps that turn a body by at most this
/// [rad] and deform it by this share of its radius; so many shares of them are tried, with so many evaluations each.
const PART: f64 = 0.3;
const PART_SWEEPS: u32 = 20;
const PARTS: u32 = 4;
const PART_EVALUATIONS: u32 = 20;

/// Buffers of the solver.
#[derive(Debug, Clone)]
pub(crate) struct Solver {
    /// After so many visits contacts need not be better than [`LOOSE`].
    patience: u32,
    system: HeldSystem,
    held: Vec<u32>,
    /// Which group of objects each belongs to.
    group: Vec<u32>,
    /// Objects and contacts of the group that is being solved.
    bodies: Vec<u32>,
    members: Vec<u32>,
}

impl Solver {
    /// `thinned` says whether few places may stand for many nodes.
    pub(crate) fn new(objects: usize, devices: usize, contacts: usize, thinned: bool) -> Self {
        Self {
            patience: if thinned { HASTY_VISITS } else { VISITS },
            system: HeldSystem::new(devices),
            held: Vec::with_capacity(devices),
            group: vec![0; objects],
            bodies: Vec::with_capacity(objects),
            members: Vec::with_capacity(contacts),
        }
    }

    /// Find all forces. Contacts that can't be solved are met in part, if that is sound; if not, or where points are only
    /// held, their objects move freely for the step.
    ///
    /// # Real time
    /// Costs sweeps × contacts × contact points of an object.
    pub(crate) fn solve(&mut self, parts: &mut Parts, status: &mut StepStatus) {
        self.group_objects(parts);
        parts.devices.iter_mut().for_each(|device| device.force = DVec3::ZERO);
        for first in 0..self.group.len() {
            let Self { group, bodies, members, .. } = self;
            if group[first] as usize != first {
                continue;
            }
            bodies.clear();
            bodies.extend((first as u32..group.len() as u32).filter(|&o| group[o as usize] == first as u32));
            members.clear();
            let mine = |c: &u32| group[parts.contacts[*c as usize].object] as usize == first;
            members.extend((0..parts.contacts.len() as u32).filter(mine));
            if members.is_empty() {
                let own = &mut parts.objects[first];
                own.end = own.free;
            } else {
                self.solve_group(parts, status);
            }
        }
        parts.sum_on_devices();
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

    fn solve_group(&mut self, parts: &mut Parts, status: &mut StepStatus) {
        let (mut reach, mut size) = (0.0_f64, f64::INFINITY);
        let many = self.members.len() > FEW;
        for at in self.bodies.iter().map(|&at| at as usize) {
            let radius = parts.model.objects[at].radius;
            parts.objects[at].points.least_move = if many { 0.03 * CLOSE * radius } else { 0.0 };
            parts.start(at);
            reach = reach.max(parts.objects[at].reach(&parts.model.objects[at]));
            size = size.min(radius);
        }
        self.linearise(parts);
        for &member in &self.members {
            if parts.contacts[member as usize].law != Law::Held {
                parts.drop_noise(member as usize, self.accuracy(0, size));
            }
            let contact = parts.contacts[member as usize];
            parts.apply(contact.object, contact.slot, contact.other, contact.force);
        }
        let dependent = self.factorise_held(parts);
        status.dependent_rows += dependent as u32;

        let touching = self.members.iter().any(|&c| parts.contacts[c as usize].law != Law::Held);
        let tight = ROUND_OFF * reach;
        let (mut least, mut first_miss) = (f64::INFINITY, f64::INFINITY);
        let (mut iterations, mut visits, mut sweeps) = (0, 0, 0);
        let mut rough = false;
        let solved = loop {
            let turned = self.evaluate(parts);
            if turned > TURNED * size {
                self.linearise(parts);
            }
            iterations += 1;
            let miss = larger(turned, self.sweep(parts, 0.1 * self.accuracy(visits, size).min(LOOSE * size)));
            visits += self.members.len() as u32;
            if iterations == 1 {
                first_miss = miss;
            }
            // Done at round-off, or near it when no more digits are gained, or as near as contacts need.
            let stalled = miss > 0.5 * least && miss < 1e3 * tight;
            let enough = touching && miss < self.accuracy(visits, size);
            let worn = sweeps >= MAX_SWEEPS || visits >= MOST_VISITS;
            let hopeless = touching && (worn || self.whirls(parts));
            let spent = iterations == MAX_ITERATIONS || hopeless;
            if miss <= tight || stalled || enough || spent || !miss.is_finite() {
                status.iterations = status.iterations.max(iterations);
                // Points that repeat others can't be met where their hands differ, and need not be.
                let loose = self.accuracy(visits, size).max(LOOSE * size);
                let allowed = if touching { loose } else { UNSOLVED * reach };
                if miss <= allowed || dependent > 0 && miss <= first_miss {
                    status.solver_residual_m = status.solver_residual_m.max(miss);
                    // Rough is better than nothing, but not solved.
                    rough = touching && (loose > LOOSE * size || miss > LOOSE * size);
                    break true;
                }
                status.solver_residual_m =
                    status.solver_residual_m.max(if miss.is_finite() { miss } else { reach });
                break false;
            }
            least = least.min(miss);
            let goal = tight.max(0.02 * miss);
            let mut last = 0.0;
            // Held points alone are solved by the one sweep.
            while touching && sweeps < MAX_SWEEPS && visits < MOST_VISITS {
                sweeps += 1;
                parts.remember(&self.bodies, &self.members);
                let moved = self.sweep(parts, 0.1 * goal);
                last = parts.accelerate(&self.bodies, &self.members, last);
                visits += self.members.len() as u32;
                if moved <= goal.max(0.3 * self.accuracy(visits, size)) || !moved.is_finite() {
                    break;
                }
            }
        };
        if solved {
            parts.drop_traces(&self.members);
        } else {
            status.unsolved_islands += 1;
            if !(touching && self.solve_in_part(parts, tight)) {
                parts.let_go(&self.bodies, &self.members);
            }
        }
        // Contacts may be loose, the equations of motion under their forces not: energy counts on them.
        (0..LAST_EVALUATIONS).any(|_| self.evaluate(parts) <= tight);
        for &object in &self.bodies {
            parts.finish(object as usize);
        }
        parts.end(&self.members);
        // What the last sweep has moved comes on top of the miss that it saw.
        rough |= solved && touching && parts.pushing_apart(&self.members) > 1.9 * LOOSE * size;
        status.unsolved_islands += u32::from(rough);
    }

    /// Whether forces turn a body so far that nothing linear about it is of use.
    fn whirls(&self, parts: &Parts) -> bool {
        self.bodies.iter().any(|&at| parts.objects[at as usize].end.turn.length() > WHIRL)
    }

    /// What can't be met is met in part: the forces that linear terms about the free motion give, scaled down until the
    /// equations of motion hold under them and contacts give no energy. Says whether such forces were found.
    fn solve_in_part(&mut self, parts: &mut Parts, tight: f64) -> bool {
        parts.let_go(&self.bodies, &self.members);
        self.bodies.iter().for_each(|&at| parts.start(at as usize));
        self.linearise(parts);
        let mut last = 0.0;
        for _ in 0..PART_SWEEPS {
            parts.remember(&self.bodies, &self.members);
            let moved = self.sweep(parts, 0.0);
            last = parts.accelerate(&self.bodies, &self.members, last);
            if moved <= tight {
                break;
            }
        }
        let largest = self.bodies.iter().map(|&at| parts.change(at as usize)).fold(0.0, larger);
        let mut share = (PART / largest).min(0.5);
        for _ in 0..PARTS {
            self.bodies.iter().for_each(|&at| parts.start(at as usize));
            parts.scale_forces(&self.members, share);
            let met = (0..PART_EVALUATIONS).any(|_| self.evaluate(parts) <= tight);
            if met && parts.end(&self.members) >= 0.0 {
                return true;
            }
            share = 0.25;
        }
        false
    }

    /// A miss [m] that is small enough after so many visits.
    fn accuracy(&self, visits: u32, size: f64) -> f64 {
        let few = self.members.len() <= FEW;
        size * match visits {
            visits if visits > MANY_VISITS && !few => ROUGH,
            visits if visits > self.patience => LOOSE,
            _ if few => 0.0,
            _ => CLOSE,
        }
    }

    /// Everything under the present forces, with the rotation of the last time. Gives how far that is off [m].
    fn evaluate(&self, parts: &mut Parts) -> f64 {
        self.bodies.iter().map(|&object| parts.evaluate(object as usize)).fold(0.0, larger)
    }

    /// The contacts' own W about the last evaluation.
    fn linearise(&self, parts: &mut Parts) {
        for &member in &self.members {
            if parts.contacts[member as usize].law != Law::Held {
                parts.linearise(member as usize);
            }
        }
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

    /// Solve every contact once with the others as they are, where that moves its sides by more than `enough` [m].
    /// Gives the largest movement [m].
    fn sweep(&mut self, parts: &mut Parts, enough: f64) -> f64 {
        let mut largest = 0.0_f64;
        let Self { system, held, members, .. } = self;
        if !held.is_empty() {
            largest = system.solve(|point| parts.apart(&parts.contacts[held[point] as usize]));
            for (at, &contact) in held.iter().enumerate() {
                parts.add_force(contact as usize, system.force(at));
            }
        }
        for at in members.iter().map(|&at| at as usize) {
            let Law::Touch { friction } = parts.contacts[at].law else { continue };
            let moved = parts.solve_touch(at, friction, enough);
            largest = larger(largest, moved);
        }
        largest
    }
}
