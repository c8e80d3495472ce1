//! Residual compliance between locations of a body: row by row, the displacement of one vertex per force at the vertices of one surface.
//!
//! Equations: docs/theory.md (C7), (C28), (C60).

use super::body::used;
use super::level_residual::LevelPair;
use super::sample_surface::PatchNodeCompliance;
use super::tip_springs::TipSpring;
use super::{Body, ContactLocation, Footprint};
use crate::recording::ResidualCompliance;
use crate::surface::PatchWeights;
use glam::{DMat3, DVec3};

/// Row of the residual compliance between the vertices of two surfaces [m/N].
#[derive(Clone, Copy)]
pub(super) enum ResidualRow<'a> {
    /// Between vertices of one surface.
    Same { residual: &'a ResidualCompliance, vertex: usize },
    /// Between contact samples of two levels, precomputed.
    Levels { pair: LevelPair<'a>, sample: usize },
    /// Between a patch and nodes.
    OfPatch { to_nodes: &'a PatchNodeCompliance, patch: usize },
    /// Between a node and patches.
    OfNode { to_nodes: &'a PatchNodeCompliance, node: usize },
    /// Between a patch and those of another level.
    Averaged { to_nodes: &'a PatchNodeCompliance, patch: usize, others: &'a PatchWeights },
}

impl ResidualRow<'_> {
    /// Displacement of the vertex per force at another [m/N].
    ///
    /// # Real time
    /// Costs a few numbers; between patches of levels that are not precomputed, the nodes of one.
    pub(super) fn block(&self, other: usize) -> DMat3 {
        match *self {
            Self::Same { residual, vertex } => residual.block(vertex, other),
            Self::Levels { ref pair, sample } => pair.between(sample, other),
            Self::OfPatch { to_nodes, patch } => to_nodes.between(patch, other),
            Self::OfNode { to_nodes, node } => to_nodes.between(other, node).transpose(),
            Self::Averaged { to_nodes, patch, others } => to_nodes.averaged(patch, others.of(other)),
        }
    }
}

impl Body {
    /// Residual compliance between two locations [m/N]; zero between patches of tips and other footprints, which couple by the
    /// modes alone.
    ///
    /// # Real time
    pub(crate) fn residual(&self, a: &ContactLocation, b: &ContactLocation) -> DMat3 {
        match self.kernel(a.footprint) {
            Some(kernel) if a.footprint == b.footprint => kernel.between(&self.recording, &a.point, &b.point),
            _ => used(self.corners(a))
                .map(|(vertex, weight)| self.residual_at(a.footprint, vertex, b) * weight)
                .sum(),
        }
    }

    /// Residual compliance [m/N] of a surface node or a contact sample: its displacement per force at a location.
    ///
    /// # Real time
    /// Costs a few blocks; between samples of different levels a patch.
    pub(crate) fn residual_at(
        &self,
        footprint: Footprint,
        vertex: usize,
        location: &ContactLocation,
    ) -> DMat3 {
        let Some(row) = self.residual_row(footprint, vertex, location.footprint) else { return DMat3::ZERO };
        used(self.corners(location)).map(|(other, weight)| row.block(other) * weight).sum()
    }

    /// Residual compliance between a node or contact sample and the vertices of another footprint's surface; none with patches of tips.
    pub(super) fn residual_row(
        &self,
        footprint: Footprint,
        vertex: usize,
        other: Footprint,
    ) -> Option<ResidualRow<'_>> {
        if self.is_tip(footprint) || self.is_tip(other) {
            return None;
        }
        Some(match (self.samples(footprint), self.samples(other)) {
            (None, None) => ResidualRow::Same { residual: &self.recording.residual, vertex },
            (Some(own), _) if footprint == other => ResidualRow::Same { residual: &own.residual, vertex },
            (Some(own), None) => ResidualRow::OfPatch { to_nodes: &own.to_nodes, patch: vertex },
            (None, Some(others)) => ResidualRow::OfNode { to_nodes: &others.to_nodes, node: vertex },
            (Some(own), Some(_)) => match self.between_levels(footprint, other) {
                Some(pair) => ResidualRow::Levels { pair, sample: vertex },
                None => {
                    let others = &self.patch(other)?.weights;
                    ResidualRow::Averaged { to_nodes: &own.to_nodes, patch: vertex, others }
                }
            },
        })
    }

    /// Residual compliance between the contact samples of two levels, if it is precomputed.
    fn between_levels(&self, a: Footprint, b: Footprint) -> Option<LevelPair<'_>> {
        let (a, b) = (self.level_of(a)?.checked_sub(1)?, self.level_of(b)?.checked_sub(1)?);
        LevelPair::find(&self.between_levels, [a, b])
    }

    /// Factor A of the residual compliance of a tip's patch [√(m/N)]; none elsewhere.
    ///
    /// # Real time
    pub(super) fn tip_factor(&self, location: &ContactLocation) -> Option<DMat3> {
        Some(self.kernel(location.footprint)?.factor_at(&self.recording, &location.point))
    }

    /// Residual displacement of the patch of a tip about a node [m, body] under forces on patches of the same radius, each constant up to a
    /// distance [m] from it.
    ///
    /// # Real time
    pub(crate) fn tip_displacement<'s>(
        &self,
        footprint: Footprint,
        node: usize,
        forces: impl Iterator<Item = (&'s TipSpring, f64)>,
    ) -> DVec3 {
        let Some(kernel) = self.kernel(footprint) else { return DVec3::ZERO };
        let forces = forces.map(|(force, flat_radius)| (force.rest, force.factored, flat_radius));
        kernel.displacement(&self.recording, node, forces)
    }

    /// Residual compliance of a surface node [m/N]: its displacement per force at a location.
    pub(super) fn residual_of_node(&self, node: usize, location: &ContactLocation) -> DMat3 {
        let mut sum = DMat3::ZERO;
        self.distribute(location, |other, weight| sum += self.recording.residual.block(node, other) * weight);
        sum
    }
}
