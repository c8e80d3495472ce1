//! Spring forces g of the residual compliance in modal form: relaxation, addition, and transfer at changes of level.
//!
//! Equations: docs/theory.md (C55) to (C57), (C61).

use super::modal::ModalState;
use super::{Body, ContactLocation, Footprint, SpringForce};
use crate::surface::patch_kernel;
use glam::DVec3;

/// Spring force that is forgotten, as a share of the largest one of the object: an error of that share of S·g. Patches leave one
/// behind in every place; at points they gather on nodes, so that round-off can do.
pub(super) const FORGOTTEN: f64 = 1e-6;
const FORGOTTEN_AT_NODES: f64 = 1e-13;

/// Room for relaxing forces on places that contacts have left.
pub(super) const RELAXING: usize = 256;

impl ModalState {
    /// Residual displacement of a location at the start of the step [m, body]; that of nodes is cached until the forces change.
    pub(super) fn residual_displacement(&mut self, body: &Body, location: &ContactLocation) -> DVec3 {
        let springs = &self.spring_forces;
        if location.footprint != Footprint::Point {
            return springs.iter().map(|other| body.residual(location, &other.location) * other.force).sum();
        }
        let corners = body.recording.surface.corners(&location.point).into_iter();
        let mut sum = DVec3::ZERO;
        for (node, weight) in corners.filter(|(_, weight)| *weight != 0.0) {
            let displacement = self.nodal.residual_displacement(body, springs, node);
            self.nodal.store(node, displacement);
            sum += displacement * weight;
        }
        sum
    }

    /// Let all spring forces decay by a factor, and forget those that are small.
    pub(super) fn relax(&mut self, decay: f64) {
        let largest = self.spring_forces.iter().map(|spring| spring.force.length()).fold(0.0, f64::max);
        let least = largest / decay;
        self.spring_forces.retain(|spring| decay > 0.0 && spring.force.length() > FORGOTTEN * least);
        self.spring_forces.iter_mut().for_each(|spring| spring.scale(decay));
        self.nodal.relax(decay, FORGOTTEN_AT_NODES * least);
    }

    /// Add a spring force to that of its location; without room, the smallest one is forgotten.
    pub(super) fn add_spring_force(&mut self, spring: SpringForce) {
        let springs = &mut self.spring_forces;
        if let Some(same) = springs.iter_mut().find(|other| other.location == spring.location) {
            same.add(&spring);
            return;
        }
        if springs.is_full() {
            let size = |at: &usize| springs[*at].force.length();
            if let Some(least) = (0..springs.len()).min_by(|a, b| size(a).total_cmp(&size(b))) {
                springs.swap_remove(least);
            }
        }
        springs.push(spring);
    }

    /// Move the spring forces of locations to others, near ones above all, without a gain of energy (C61). Gives
    /// the energy [J] that is lost.
    pub(super) fn move_spring_forces(
        &mut self,
        body: &Body,
        from: impl Iterator<Item = ContactLocation>,
        to: impl Iterator<Item = ContactLocation> + Clone,
    ) -> f64 {
        let before = self.residual_energy;
        self.nodal.clear_cache();
        for location in from {
            let Some(at) = self.spring_forces.iter().position(|spring| spring.location == location) else {
                continue;
            };
            let SpringForce { force, rest, .. } = self.spring_forces.swap_remove(at);
            self.add_at_nodes(body, &location, -force);
            let radius = |location: &ContactLocation| body.patch_radius(location.footprint);
            let share = |to: &ContactLocation| {
                let s = (body.rest_position(to) - rest).length() / radius(to).max(radius(&location));
                patch_kernel(1.0, s * s)
            };
            let sum: f64 = to.clone().map(|to| share(&to)).sum();
            for to in to.clone().filter(|_| sum > 0.0) {
                let part = force * (share(&to) / sum);
                if part != DVec3::ZERO {
                    self.add_spring_force(body.spring_force(to, part));
                    self.add_at_nodes(body, &to, part);
                }
            }
        }
        // The others first, then those that have moved.
        let springs = &mut self.spring_forces;
        let mut count = 0;
        for at in 0..springs.len() {
            if !to.clone().any(|to| to == springs[at].location) {
                springs.swap(at, count);
                count += 1;
            }
        }
        // Energy ½·gᵀ·S·g of the moved forces, of the others, and between them.
        let (mut moved, mut between, mut others) = (0.0, 0.0, 0.0);
        for (at, a) in springs.iter().enumerate() {
            for (other, b) in springs[..=at].iter().enumerate() {
                let product = a.force.dot(body.residual(&a.location, &b.location) * b.force);
                let energy = if at == other { 0.5 * product } else { product };
                match (at < count, other < count) {
                    (true, _) => others += energy,
                    (false, true) => between += energy,
                    (false, false) => moved += energy,
                }
            }
        }
        // The largest scale s ≤ 1 with moved·s² + between·s + others ≤ energy before.
        let excess = others - before;
        let root = libm::sqrt((between * between - 4.0 * moved * excess).max(0.0));
        let fits = moved + between + excess <= 0.0;
        let scale = match moved > 0.0 {
            _ if fits => 1.0,
            true => ((root - between) / (2.0 * moved)).clamp(0.0, 1.0),
            false => 0.0,
        };
        self.residual_energy = (moved * scale + between) * scale + others;
        for at in count..self.spring_forces.len() {
            let SpringForce { location, force, .. } = self.spring_forces[at];
            self.spring_forces[at].scale(scale);
            self.add_at_nodes(body, &location, force * (scale - 1.0));
        }
        before - self.residual_energy
    }

    /// Add a force to those at nodes, if it acts at a point.
    pub(super) fn add_at_nodes(&mut self, body: &Body, location: &ContactLocation, force: DVec3) {
        if location.footprint == Footprint::Point {
            self.nodal.add(body.recording.surface.corners(&location.point), force);
        }
    }
}
