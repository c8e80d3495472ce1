//! Transfer of loads of the residual compliance between contact points of two levels of detail.
//!
//! Equations: docs/theory.md (C61).

use super::modal::ModalState;
use super::sampled_residual::{Products, ResidualMemory, SampledResidual};
use super::{Body, ContactLocation};
use crate::surface::patch_kernel;

/// Load of a contact point, the memory of the forces on it, at its location.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LocatedLoad {
    pub(crate) location: ContactLocation,
    pub(crate) load: ResidualMemory,
}

impl ModalState {
    /// Move loads to other locations, near ones above all, without a gain of energy. The others' loads become their shares. Gives the
    /// energy [J] that is lost.
    ///
    /// # Real time
    /// Costs loaded vertices × locations, and the squares of the numbers of locations.
    pub(super) fn transfer_loads(
        &mut self,
        body: &Body,
        residual: &SampledResidual,
        from: &[LocatedLoad],
        to: &mut [LocatedLoad],
    ) -> f64 {
        let before = self.residual_energy;
        let mut products = self.products;
        self.loads.clear_cache();
        for LocatedLoad { location, load } in from {
            let taken = load.map(|force| -force);
            products.add(&Products::of(&taken, &self.displacements_by_memory(body, location)), 2.0);
            products.add(&self_products(body, location, &taken), 1.0);
            self.loads.add(body, location, &taken, residual);
        }
        share_out(body, from, to);
        // Products of the moved loads with the others, and with each other.
        let [mut between, mut moved] = [Products::default(); 2];
        for (at, LocatedLoad { location, load }) in to.iter().enumerate() {
            between.add(&Products::of(load, &self.displacements_by_memory(body, location)), 2.0);
            moved.add(&self_products(body, location, load), 1.0);
            for other in &to[..at] {
                let block = body.residual(location, &other.location);
                moved.add(&Products::of(load, &other.load.map(|force| block * force)), 2.0);
            }
        }
        let scale = largest_scale(
            [&moved, &between].map(|products| residual.energy(products)),
            residual.energy(&products) - before,
        );
        products.add(&between, scale);
        products.add(&moved, scale * scale);
        self.set_products(products, residual);
        for LocatedLoad { location, load } in to {
            load.scale(scale);
            self.loads.add(body, location, load, residual);
        }
        before - self.residual_energy
    }
}

/// Products of a load with its own displacement.
fn self_products(body: &Body, location: &ContactLocation, load: &ResidualMemory) -> Products {
    let block = body.residual(location, location);
    Products::of(load, &load.map(|force| block * force))
}

/// Share loads out between other locations.
fn share_out(body: &Body, from: &[LocatedLoad], to: &mut [LocatedLoad]) {
    to.iter_mut().for_each(|to| to.load = ResidualMemory::default());
    let radius = |location: &ContactLocation| body.patch_radius(location.footprint);
    for LocatedLoad { location, load } in from {
        let share = |to: &LocatedLoad| {
            let distance = (body.rest_position(&to.location) - body.rest_position(location)).length();
            let s = distance / radius(&to.location).max(radius(location));
            patch_kernel(1.0, s * s)
        };
        let sum: f64 = to.iter().map(share).sum();
        if sum > 0.0 {
            to.iter_mut().for_each(|to| {
                let part = share(to) / sum;
                to.load.add(&load.map(|force| force * part));
            });
        }
    }
}

/// Largest scale s ≤ 1 with moved·s² + between·s + excess ≤ 0: energies [J] of the moved loads and with the others, and what the others alone have more than
/// there was.
fn largest_scale([moved, between]: [f64; 2], excess: f64) -> f64 {
    if moved + between + excess <= 0.0 {
        return 1.0;
    }
    if moved <= 0.0 {
        return 0.0;
    }
    let root = libm::sqrt((between * between - 4.0 * moved * excess).max(0.0));
    ((root - between) / (2.0 * moved)).clamp(0.0, 1.0)
}
