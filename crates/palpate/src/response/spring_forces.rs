//! Forces of the residual compliance in modal form: relaxation, addition, and transfer at changes of level.
//!
//! Equations: docs/theory.md (C55) to (C57), (C61).

use super::modal::ModalState;
use super::sampled_residual::{Products, ResidualMemory, SampledResidual};
use super::{Body, ContactLocation, Footprint, SpringForce};
use crate::surface::patch_kernel;

/// Spring force that is forgotten, as a share of the largest one of the object: an error of that share of its displacement. Patches leave one
/// behind in every place; at points they gather on nodes, so that round-off can do.
const FORGOTTEN: f64 = 1e-6;
const FORGOTTEN_AT_NODES: f64 = 1e-13;

/// Room for relaxing forces on places that contacts have left.
pub(super) const RELAXING: usize = 256;

impl ModalState {
    /// Displacements of a location by every part of the residual compliance's state at the start of the step [m, body].
    pub(super) fn displacements_by_memory(&self, body: &Body, location: &ContactLocation) -> ResidualMemory {
        let springs = &self.spring_forces;
        let mut sum = ResidualMemory::default();
        if location.footprint != Footprint::Point {
            for other in springs.iter() {
                let block = body.residual(location, &other.location);
                sum.add_displacements(&block, &other.memory);
            }
            return sum;
        }
        let corners = body.recording.surface.corners(&location.point).into_iter();
        for (node, weight) in corners.filter(|(_, weight)| *weight != 0.0) {
            let mut own = self.nodal.displacements_by_memory(body, springs, node);
            own.scale(weight);
            sum.add(&own);
        }
        sum
    }

    /// Let all memories pass over a step without force, and forget those that are small.
    pub(super) fn relax(&mut self, residual: &SampledResidual) {
        let largest = self.spring_forces.iter().map(|spring| spring.memory.size()).fold(0.0, f64::max);
        self.spring_forces.iter_mut().for_each(|spring| spring.relax(residual));
        self.spring_forces.retain(|spring| spring.memory.size() > FORGOTTEN * largest);
        self.nodal.relax(residual, FORGOTTEN_AT_NODES * largest);
    }

    /// Add a spring force to that of its location; without room, the smallest one is forgotten.
    pub(super) fn add_spring_force(&mut self, spring: SpringForce) {
        let springs = &mut self.spring_forces;
        if let Some(same) = springs.iter_mut().find(|other| other.location == spring.location) {
            same.add(&spring);
            return;
        }
        if springs.is_full() {
            let size = |at: &usize| springs[*at].memory.size();
            if let Some(least) = (0..springs.len()).min_by(|a, b| size(a).total_cmp(&size(b))) {
                springs.swap_remove(least);
            }
        }
        springs.push(spring);
    }

    /// Index the spring forces on patches of tips, after the list has changed.
    pub(super) fn index_tip_springs(&mut self, body: &Body) {
        self.tip_springs.clear();
        let of_tips =
            self.spring_forces.iter().enumerate().filter(|(_, s)| body.is_tip(s.location.footprint));
        of_tips.for_each(|(at, _)| self.tip_springs.push(at as u32));
    }

    /// Move the spring forces of locations to others, near ones above all, without a gain of energy (C61). Gives
    /// the energy [J] that is lost.
    pub(super) fn move_spring_forces(
        &mut self,
        body: &Body,
        residual: &SampledResidual,
        from: impl Iterator<Item = ContactLocation>,
        to: impl Iterator<Item = ContactLocation> + Clone,
    ) -> f64 {
        let before = self.residual_energy;
        self.nodal.clear_cache();
        for location in from {
            let Some(at) = self.spring_forces.iter().position(|spring| spring.location == location) else {
                continue;
            };
            let SpringForce { memory, rest, .. } = self.spring_forces.swap_remove(at);
            self.add_at_nodes(body, &location, &memory.map(|force| -force), residual);
            let radius = |location: &ContactLocation| body.patch_radius(location.footprint);
            let share = |to: &ContactLocation| {
                let s = (body.rest_position(to) - rest).length() / radius(to).max(radius(&location));
                patch_kernel(1.0, s * s)
            };
            let sum: f64 = to.clone().map(|to| share(&to)).sum();
            for to in to.clone().filter(|_| sum > 0.0) {
                let part = memory.map(|force| force * (share(&to) / sum));
                if part.size() > 0.0 {
                    self.add_spring_force(body.spring_force(to, part, residual));
                    self.add_at_nodes(body, &to, &part, residual);
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
        self.index_tip_springs(body);
        let springs = &self.spring_forces;
        // Products, and with them the energy, of the moved memories, of the others, and between them.
        let [mut moved_products, mut between_products, mut other_products] = [Products::default(); 3];
        for (at, a) in springs.iter().enumerate() {
            for (other, b) in springs[..=at].iter().enumerate() {
                let block = body.residual(&a.location, &b.location);
                let products = Products::of(&a.memory, &b.memory.map(|force| block * force));
                let factor = if at == other { 1.0 } else { 2.0 };
                match (at < count, other < count) {
                    (true, _) => other_products.add(&products, factor),
                    (false, true) => between_products.add(&products, factor),
                    (false, false) => moved_products.add(&products, factor),
                }
            }
        }
        let [moved, between, others] =
            [&moved_products, &between_products, &other_products].map(|products| residual.energy(products));
        // The largest scale s ≤ 1 with moved·s² + between·s + others ≤ energy before.
        let excess = others - before;
        let root = libm::sqrt((between * between - 4.0 * moved * excess).max(0.0));
        let fits = moved + between + excess <= 0.0;
        let scale = match moved > 0.0 {
            _ if fits => 1.0,
            true => ((root - between) / (2.0 * moved)).clamp(0.0, 1.0),
            false => 0.0,
        };
        let mut products = other_products;
        products.add(&between_products, scale);
        products.add(&moved_products, scale * scale);
        self.set_products(products, residual);
        for at in count..self.spring_forces.len() {
            let SpringForce { location, memory, .. } = self.spring_forces[at];
            self.spring_forces[at].scale(scale);
            self.add_at_nodes(body, &location, &memory.map(|force| force * (scale - 1.0)), residual);
        }
        before - self.residual_energy
    }

    /// Add the memory of a force to those at nodes, if it acts at a point.
    pub(super) fn add_at_nodes(
        &mut self,
        body: &Body,
        location: &ContactLocation,
        memory: &ResidualMemory,
        residual: &SampledResidual,
    ) {
        if location.footprint == Footprint::Point {
            let recording = &body.recording;
            let corners = recording.surface.corners(&location.point).into_iter();
            let nodes = corners.flat_map(|(corner, weight)| {
                recording.model_nodes_of(corner).map(move |(node, share)| (node, share * weight))
            });
            self.nodal.add(nodes, memory, residual);
        }
    }
}
