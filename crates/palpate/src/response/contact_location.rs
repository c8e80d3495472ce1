//! Contact locations on a body, their state, and the forces of the residual compliance at them.
//!
//! Equations: docs/theory.md (C27), (C55).

use super::sampled_residual::{ResidualMemory, SampledResidual};
use crate::surface::SurfacePoint;
use glam::{DMat3, DVec3};

/// Contact footprint: average of displacement and distribution of force about a contact location.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Footprint {
    /// Surface point, by the weights of its triangle.
    #[default]
    Point,
    /// Contact patch, by its index in [`super::Body::patches`].
    Patch(u32),
}

/// Contact location on a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ContactLocation {
    pub(crate) point: SurfacePoint,
    pub(crate) footprint: Footprint,
}

/// State of a contact location at the start of a step [m, body].
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct LocationState {
    /// Elastic displacement.
    pub(crate) displacement: DVec3,
    /// Part of it by the residual compliance and the body's weight.
    pub(crate) residual: DVec3,
    /// Part by the body's weight beyond the modes; constant, since only bodies with fixed nodes have one.
    pub(crate) sag: DVec3,
    /// Displacements by every part of the residual compliance's state.
    pub(crate) memory: ResidualMemory,
}

/// Force of the residual compliance at a location.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SpringForce {
    pub(crate) location: ContactLocation,
    /// Memory of the forces there, and the force whose static displacement they have [N, body].
    pub(super) memory: ResidualMemory,
    pub(crate) force: DVec3,
    /// Rest position [m, body].
    pub(crate) rest: DVec3,
    /// Factor Aᵀ of a patch that is no contact sample [√(m/N)], and Aᵀ·force [√J].
    pub(super) factor: DMat3,
    pub(super) factored: DVec3,
}

impl SpringForce {
    /// Multiply the memory.
    pub(super) fn scale(&mut self, factor: f64) {
        self.memory.scale(factor);
        self.force *= factor;
        self.factored *= factor;
    }

    /// Add another memory at the same location.
    pub(super) fn add(&mut self, other: &Self) {
        self.memory.add(&other.memory);
        self.force += other.force;
        self.factored += other.factored;
    }

    /// Let the memory pass over a step without force.
    pub(super) fn relax(&mut self, residual: &SampledResidual) {
        residual.relax(&mut self.memory);
        self.force = residual.effective(&self.memory);
        self.factored = self.factor * self.force;
    }
}
