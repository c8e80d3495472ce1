//! Spring forces of the residual compliance on patches of tips.
//!
//! A patch may lie anywhere on the surface, and its residual compliance is a kernel of distance: each place that a tip has touched keeps a force of its own.
//!
//! Equations: docs/theory.md (C28), (C55) to (C57).

use super::sampled_residual::{ResidualMemory, SampledResidual};
use super::{Body, ContactLocation};
use crate::bounded_vec::BoundedVec;
use glam::{DMat3, DVec3};

/// Spring force that is forgotten, as a share of the largest one of the object: an error of that share of its displacement. Tips leave one
/// behind in every place.
const FORGOTTEN: f64 = 1e-6;

/// Room for forces on places that tips have left.
const RELAXING: usize = 256;

/// Force of the residual compliance on a patch of a tip.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TipSpring {
    pub(crate) location: ContactLocation,
    /// Memory of the forces there, and the force whose static displacement they have [N, body].
    pub(super) memory: ResidualMemory,
    pub(crate) force: DVec3,
    /// Rest position [m, body].
    pub(super) rest: DVec3,
    /// Factor Aᵀ of the patch [√(m/N)], and Aᵀ·force [√J].
    factor: DMat3,
    pub(super) factored: DVec3,
}

impl TipSpring {
    /// Spring force at a location with the memory of its forces [N, body]; none where no patch of a tip is.
    ///
    /// # Real time
    pub(super) fn new(
        body: &Body,
        location: ContactLocation,
        memory: ResidualMemory,
        residual: &SampledResidual,
    ) -> Option<Self> {
        let factor = body.tip_factor(&location)?.transpose();
        let rest = body.rest_position(&location);
        let force = residual.effective(&memory);
        Some(Self { location, memory, force, rest, factor, factored: factor * force })
    }
}

/// Spring forces on the patches of tips; the buffer is made once.
#[derive(Debug, Clone)]
pub(crate) struct TipSprings(BoundedVec<TipSpring>);

impl TipSprings {
    /// With room for so many contact points.
    pub(super) fn new(contact_points: usize) -> Self {
        Self(BoundedVec::new(contact_points + RELAXING))
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = &TipSpring> {
        self.0.iter()
    }

    /// Upper limit of spring forces.
    pub(super) fn room(&self) -> usize {
        self.0.bound()
    }

    /// Size of the largest one [N].
    pub(super) fn largest(&self) -> f64 {
        self.0.iter().map(|spring| spring.memory.size()).fold(0.0, f64::max)
    }

    /// Whether tips have left places that still have forces.
    pub(super) fn has_left(&self) -> bool {
        self.0.iter().any(|spring| spring.memory.held == DVec3::ZERO)
    }

    /// Let all memories pass over a step without force, and forget those that are small beside the largest one [N] of the object.
    pub(super) fn relax(&mut self, residual: &SampledResidual, largest: f64) {
        for spring in self.0.iter_mut() {
            residual.relax(&mut spring.memory);
            spring.force = residual.effective(&spring.memory);
            spring.factored = spring.factor * spring.force;
        }
        self.0.retain(|spring| spring.memory.size() > FORGOTTEN * largest);
    }

    /// Add a spring force to that of its location; without room, the smallest one is forgotten.
    pub(super) fn add(&mut self, spring: TipSpring) {
        let springs = &mut self.0;
        if let Some(same) = springs.iter_mut().find(|other| other.location == spring.location) {
            same.memory.add(&spring.memory);
            same.force += spring.force;
            same.factored += spring.factored;
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
}
