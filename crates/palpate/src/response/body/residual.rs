//! Residual compliance between the contact locations of a body.
//!
//! Equations: docs/theory.md (C27), (C28), (C60), (C92).

use super::super::contact_location::{ContactLocation, Footprint, SpringForce};
use super::super::level_residual::LevelPair;
use super::super::patch_field::PatchCentres;
use super::super::residual_kernel::ResidualKernel;
use super::super::sampled_residual::{ResidualMemory, SampledResidual};
use super::Body;
use glam::{DMat3, DVec3};

impl Body {
    /// Largest residual displacement of a node, or of a tip's patch about a node, per force on a location, over that of the location [1].
    ///
    /// # Real time
    pub(crate) fn residual_peak(&self, location: &ContactLocation) -> f64 {
        match self.patch(location.footprint).map(|patch| &patch.centres) {
            None => 1.0,
            Some(PatchCentres::Nodes(kernel)) => kernel.peak(&self.recording, &location.point),
            Some(PatchCentres::Samples(samples)) => samples.peak(&location.point),
        }
    }

    /// Residual compliance between two locations [m/N]; zero between patches of tips and other footprints, which couple by the
    /// modes alone.
    ///
    /// # Real time
    pub(crate) fn residual(&self, a: &ContactLocation, b: &ContactLocation) -> DMat3 {
        match self.kernel(a.footprint) {
            Some(kernel) if a.footprint == b.footprint => kernel.between(&self.recording, &a.point, &b.point),
            _ => used(self.corners(a))
                .map(|(node, weight)| self.residual_at(a.footprint, node, b) * weight)
                .sum(),
        }
    }

    /// Residual compliance [m/N] of a surface node or a contact sample: its displacement per force at a location.
    ///
    /// # Real time
    /// Costs a few blocks; between samples of different levels a patch.
    pub(crate) fn residual_at(&self, footprint: Footprint, node: usize, location: &ContactLocation) -> DMat3 {
        if self.is_tip(footprint) || self.is_tip(location.footprint) {
            return DMat3::ZERO;
        }
        match (self.samples(footprint), self.samples(location.footprint)) {
            (None, None) => self.residual_of_node(node, location),
            (Some(own), _) if footprint == location.footprint => own.residual_at(node, &location.point),
            (Some(own), _) => {
                if let Some(known) = self.between_levels(footprint, location.footprint) {
                    let of = |(sample, weight): (usize, f64)| known.between(node, sample) * weight;
                    return used(self.corners(location)).map(of).sum();
                }
                let sum = |(corner, weight): (usize, f64)| match self.patch(location.footprint) {
                    None => own.to_nodes.averaged(node, self.recording.model_nodes_of(corner)) * weight,
                    Some(patch) => own.to_nodes.averaged(node, patch.weights.of(corner)) * weight,
                };
                used(self.corners(location)).map(sum).sum()
            }
            (None, Some(_)) => {
                let of_model = self.recording.model_nodes_of(node);
                of_model.map(|(node, weight)| self.residual_of_model_node(node, location) * weight).sum()
            }
        }
    }

    /// Residual compliance [m/N] of a model node: its displacement per force at a contact sample; zero for patches of tips.
    ///
    /// # Real time
    pub(crate) fn residual_of_model_node(&self, node: usize, location: &ContactLocation) -> DMat3 {
        let Some(samples) = self.samples(location.footprint) else { return DMat3::ZERO };
        let of = |sample: usize| samples.to_nodes.between(sample, node).transpose();
        used(self.corners(location)).map(|(sample, weight)| of(sample) * weight).sum()
    }

    /// Residual compliance between the contact samples of two levels, if it is precomputed.
    fn between_levels(&self, a: Footprint, b: Footprint) -> Option<LevelPair<'_>> {
        let (a, b) = (self.level_of(a)?.checked_sub(1)?, self.level_of(b)?.checked_sub(1)?);
        LevelPair::find(&self.between_levels, [a, b])
    }

    /// Whether a footprint is a patch of tips.
    pub(crate) fn is_tip(&self, footprint: Footprint) -> bool {
        matches!(footprint, Footprint::Patch(index) if (index as usize) < self.device_patches)
    }

    fn kernel(&self, footprint: Footprint) -> Option<&ResidualKernel> {
        match &self.patch(footprint)?.centres {
            PatchCentres::Nodes(kernel) => Some(kernel),
            PatchCentres::Samples(_) => None,
        }
    }

    /// Spring force at a location with the memory of its forces [N, body].
    ///
    /// # Real time
    pub(crate) fn spring_force(
        &self,
        location: ContactLocation,
        memory: ResidualMemory,
        residual: &SampledResidual,
    ) -> SpringForce {
        let rest = self.rest_position(&location);
        let factor = self
            .kernel(location.footprint)
            .map_or(DMat3::ZERO, |kernel| kernel.factor_at(&self.recording, &location.point).transpose());
        let force = residual.effective(&memory);
        SpringForce { location, memory, force, rest, factor, factored: factor * force }
    }

    /// Residual displacement of a node or contact sample under a force [m, body].
    ///
    /// # Real time
    pub(crate) fn residual_displacement(
        &self,
        footprint: Footprint,
        node: usize,
        applied: &SpringForce,
    ) -> DVec3 {
        self.residual_at(footprint, node, &applied.location) * applied.force
    }

    /// Residual displacement of the patch of a tip about a node [m, body] under forces on patches of the same radius, each constant up to a
    /// distance [m] from it.
    ///
    /// # Real time
    pub(crate) fn tip_displacement<'s>(
        &self,
        footprint: Footprint,
        node: usize,
        forces: impl Iterator<Item = (&'s SpringForce, f64)>,
    ) -> DVec3 {
        let Some(kernel) = self.kernel(footprint) else { return DVec3::ZERO };
        let forces = forces.map(|(force, flat_radius)| (force.rest, force.factored, flat_radius));
        kernel.displacement(&self.recording, node, forces)
    }

    /// Distribution of a force at a location to the model's nodes, with weights; a node may come more than once. Corners that have no weight but for
    /// round-off get none.
    pub(crate) fn distribute(&self, location: &ContactLocation, mut give: impl FnMut(usize, f64)) {
        for (corner, weight) in self.corners(location) {
            match self.patch(location.footprint) {
                _ if weight.abs() <= f64::EPSILON => {}
                None => self.recording.model_nodes_of(corner).for_each(|(node, w)| give(node, w * weight)),
                Some(patch) => patch.weights.of(corner).for_each(|(node, w)| give(node, w * weight)),
            }
        }
    }

    /// Residual compliance of a surface node [m/N]: its displacement per force at a location.
    pub(crate) fn residual_of_node(&self, node: usize, location: &ContactLocation) -> DMat3 {
        let recording = &self.recording;
        let of = |own: usize| {
            let mut sum = DMat3::ZERO;
            self.distribute(location, |other, weight| sum += recording.residual.block(own, other) * weight);
            sum
        };
        recording.model_nodes_of(node).map(|(own, weight)| of(own) * weight).sum()
    }
}

/// Corners that carry weight.
fn used(corners: [(usize, f64); 3]) -> impl Iterator<Item = (usize, f64)> {
    corners.into_iter().filter(|(_, weight)| *weight != 0.0)
}
