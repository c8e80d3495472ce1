//! Residual compliance under forces that are held over each step.
//!
//! The truncated modes are massless springs S with dampers, u + τ·u̇ = S·f. Their displacement at the end of step n answers to the force
//! at that end, which two held forces extrapolate:
//!
//! ```text
//! g⁺ = e·g + (1 − e)·f        u = S·(g⁺ + c·(f − f₋))        e = exp(−h/τ)        c = ½·(1 + e)/(1 − e) − τ/h
//! ```
//!
//! Without damping that is u = S·(3f − f₋)/2, the second-order backward difference of the force's integral, and dissipates the square of the second difference
//! of the force. The network is passive for every τ ≥ 0: it stores ½·xᵀ·P·x of its state x = (g, f, f₋), P ≥ 0, and dissipates ½·y², y linear in x and f.
//!
//! Equations: docs/theory.md (C55) to (C57).

use glam::{DMat3, DVec3};

/// Residual compliance at a step.
///
/// ```
/// use palpate::SampledResidual;
///
/// // Undamped: a force that rises evenly is met at the end of each step, half a step after its mean.
/// let undamped = SampledResidual::new(0.0, 1e-3);
/// let ramp: f64 = (0..100).map(|s| undamped.share(s) * f64::from(100 - s as i32)).sum();
/// assert!((ramp - 100.5).abs() < 1e-12);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampledResidual {
    /// e [1].
    decay: f64,
    /// c [1].
    lead: f64,
    /// P [1].
    storage: Products,
}

/// Products of the parts of two states x = (g, f, f₋): of forces with the residual compliance between them [J], or the entries of P [1].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Products {
    relaxed_relaxed: f64,
    relaxed_held: f64,
    relaxed_previous: f64,
    held_held: f64,
    held_previous: f64,
    previous_previous: f64,
}

/// Memory of the force on a location [N, body], or the displacements by it at another place [m, body].
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct ResidualMemory {
    /// Relaxed force g.
    pub(super) relaxed: DVec3,
    /// Held forces f of the last step and f₋ of the one before.
    pub(super) held: DVec3,
    pub(super) previous: DVec3,
}

/// Step h over the relaxation time τ below which c is summed as a series [1]: its next term is 10⁻¹³ of the first.
const SERIES_BELOW: f64 = 0.05;

impl SampledResidual {
    /// For a relaxation time τ ≥ 0 [s] and a step [s].
    pub fn new(relaxation_s: f64, step_s: f64) -> Self {
        let (decay, lead) = if relaxation_s > 0.0 {
            let x = step_s / relaxation_s;
            let series = x / 12.0 * (1.0 - x * x / 60.0 * (1.0 - x * x / 42.0));
            let closed = 0.5 - 1.0 / x + 1.0 / libm::expm1(x);
            (libm::exp(-x), if x < SERIES_BELOW { series } else { closed })
        } else {
            (0.0, 0.5)
        };
        Self { decay, lead, storage: storage(decay, lead) }
    }

    /// Factor e by which a relaxed force decays in a step [1].
    pub fn decay(&self) -> f64 {
        self.decay
    }

    /// Share c of the last change of force that is added [1].
    pub fn lead(&self) -> f64 {
        self.lead
    }

    /// Share of S in the displacement `s` steps after a unit force that was held for one step [1]; R[s] has share(s)·S.
    pub fn share(&self, s: usize) -> f64 {
        let Self { decay, lead, .. } = *self;
        let relaxed = (1.0 - decay) * libm::pow(decay, s as f64);
        match s {
            0 => relaxed + lead,
            1 => relaxed - lead,
            _ => relaxed,
        }
    }

    /// Let a memory pass over a step without force.
    pub(super) fn relax(&self, memory: &mut ResidualMemory) {
        let ResidualMemory { relaxed, held, .. } = *memory;
        *memory = ResidualMemory { relaxed: relaxed * self.decay, held: DVec3::ZERO, previous: held };
    }

    /// Memory of a force in the step in which it is held.
    pub(super) fn of_force(&self, force: DVec3) -> ResidualMemory {
        ResidualMemory { relaxed: force * (1.0 - self.decay), held: force, previous: DVec3::ZERO }
    }

    /// Force whose static displacement the present one is, g + c·(f − f₋).
    pub(super) fn effective(&self, memory: &ResidualMemory) -> DVec3 {
        memory.relaxed + (memory.held - memory.previous) * self.lead
    }

    /// Force whose static displacement is that at the end of the next step without force, e·g − c·f.
    pub(super) fn free(&self, memory: &ResidualMemory) -> DVec3 {
        memory.relaxed * self.decay - memory.held * self.lead
    }

    /// Energy [J] that is stored in a state with these products, ½·xᵀ·P·x.
    pub(super) fn energy(&self, products: &Products) -> f64 {
        let (p, x) = (&self.storage, products);
        let squares = p.relaxed_relaxed * x.relaxed_relaxed
            + p.held_held * x.held_held
            + p.previous_previous * x.previous_previous;
        let mixed = p.relaxed_held * x.relaxed_held
            + p.relaxed_previous * x.relaxed_previous
            + p.held_previous * x.held_previous;
        0.5 * squares + mixed
    }

    /// dᵀ·S·d of the effective forces d [J].
    pub(super) fn effective_square(&self, x: &Products) -> f64 {
        let c = self.lead;
        x.relaxed_relaxed
            + 2.0 * c * (x.relaxed_held - x.relaxed_previous)
            + c * c * (x.held_held - 2.0 * x.held_previous + x.previous_previous)
    }

    /// Products at the end of a step, from those at its start and the products of its forces with the displacements: by the relaxed forces and the held
    /// ones of the last step, and by its own forces [J].
    pub(super) fn advance(&self, start: &Products, [by_relaxed, by_held, by_own]: [f64; 3]) -> Products {
        let (e, new) = (self.decay, 1.0 - self.decay);
        Products {
            relaxed_relaxed: e * (e * start.relaxed_relaxed + 2.0 * new * by_relaxed) + new * new * by_own,
            relaxed_held: e * by_relaxed + new * by_own,
            relaxed_previous: e * start.relaxed_held + new * by_held,
            held_held: by_own,
            held_previous: by_held,
            previous_previous: start.held_held,
        }
    }
}

/// P, from the factor y of the supplied power: Re[(1 − w)·Σ share·wˢ] = ½·|(1 − w)·n(w)/(1 − e·w)|² on |w| = 1, n of second degree; what a state
/// dissipates when it is left alone.
fn storage(e: f64, c: f64) -> Products {
    let b = (1.0 - e) * (1.0 + e) + 4.0 * c * e;
    let product = 2.0 * c * (1.0 + e * e);
    let p = libm::sqrt(0.5 * (b + libm::sqrt(((b - product) * (b + product)).max(0.0))));
    let n0 = 0.5 * (p + libm::sqrt((p * p - 4.0 * c * e).max(0.0)));
    let n1 = -c * (1.0 + e * e) / p;
    // y = n0·f⁺ + of_held·f + of_previous·f₋ + of_relaxed·g.
    let of_held = c * c / (n0 * n0 * p) - c / n0 - c * e / p;
    let of_previous = c / n0;
    let of_relaxed = (n1 - n0 * (1.0 - e) - of_held) / (1.0 - e);
    Products {
        relaxed_relaxed: of_relaxed * of_relaxed / ((1.0 - e) * (1.0 + e)),
        relaxed_held: of_relaxed * (of_held + e * of_previous),
        relaxed_previous: of_relaxed * of_previous,
        held_held: of_held * of_held + of_previous * of_previous,
        held_previous: of_held * of_previous,
        previous_previous: of_previous * of_previous,
    }
}

impl Products {
    /// Add a multiple.
    pub(super) fn add(&mut self, other: &Self, factor: f64) {
        self.relaxed_relaxed += factor * other.relaxed_relaxed;
        self.relaxed_held += factor * other.relaxed_held;
        self.relaxed_previous += factor * other.relaxed_previous;
        self.held_held += factor * other.held_held;
        self.held_previous += factor * other.held_previous;
        self.previous_previous += factor * other.previous_previous;
    }

    /// Products of forces with displacements; those of different parts are the mean of both orders.
    pub(super) fn of(forces: &ResidualMemory, displacements: &ResidualMemory) -> Self {
        let (f, u) = (forces, displacements);
        Self {
            relaxed_relaxed: f.relaxed.dot(u.relaxed),
            relaxed_held: 0.5 * (f.relaxed.dot(u.held) + f.held.dot(u.relaxed)),
            relaxed_previous: 0.5 * (f.relaxed.dot(u.previous) + f.previous.dot(u.relaxed)),
            held_held: f.held.dot(u.held),
            held_previous: 0.5 * (f.held.dot(u.previous) + f.previous.dot(u.held)),
            previous_previous: f.previous.dot(u.previous),
        }
    }
}

impl ResidualMemory {
    pub(super) fn scale(&mut self, factor: f64) {
        *self = self.map(|part| part * factor);
    }

    pub(super) fn add(&mut self, other: &Self) {
        self.relaxed += other.relaxed;
        self.held += other.held;
        self.previous += other.previous;
    }

    /// Add the displacements by another memory's forces through a block of the residual compliance [m/N].
    pub(super) fn add_displacements(&mut self, block: &DMat3, forces: &Self) {
        self.add(&forces.map(|force| *block * force));
    }

    /// Every part, linearly mapped.
    pub(super) fn map(&self, map: impl Fn(DVec3) -> DVec3) -> Self {
        Self { relaxed: map(self.relaxed), held: map(self.held), previous: map(self.previous) }
    }

    /// Length of the largest part.
    pub(super) fn size(&self) -> f64 {
        self.relaxed.length().max(self.held.length()).max(self.previous.length())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::vec::Vec;

    const STEP_S: f64 = 1e-3;
    /// Relaxation times [s]: none, shorter and longer than a step, and about a step.
    const TIMES: [f64; 9] = [0.0, 1e-8, 3e-5, 2e-4, 1e-3, 5e-3, 2.1e-2, 1e-1, 10.0];

    fn memories(residual: &SampledResidual, forces: impl Iterator<Item = f64>) -> Vec<(f64, ResidualMemory)> {
        let mut memory = ResidualMemory::default();
        forces
            .map(|force| {
                residual.relax(&mut memory);
                memory.add(&residual.of_force(DVec3::X * force));
                (force, memory)
            })
            .collect()
    }

    #[test]
    fn shares_are_the_response_to_a_force_held_for_one_step() {
        for time in TIMES {
            let residual = SampledResidual::new(time, STEP_S);
            let pulse = (0..50).map(|step| if step == 0 { 1.0 } else { 0.0 });
            for (s, (_, memory)) in memories(&residual, pulse).iter().enumerate() {
                assert!((residual.effective(memory).x - residual.share(s)).abs() < 1e-15, "{time} {s}");
            }
        }
    }

    #[test]
    fn an_even_rise_is_followed_as_by_the_continuous_network() {
        // u + τ·u̇ = t has u = t − τ in the long run.
        for time in [0.0, 3e-5, 2e-4, 1e-3, 5e-3, 2.1e-2] {
            let residual = SampledResidual::new(time, STEP_S);
            let steps = 2000;
            let means = (0..steps).map(|step| (f64::from(step) + 0.5) * STEP_S);
            let all = memories(&residual, means);
            let end = residual.effective(&all[steps as usize - 1].1).x;
            let expected = f64::from(steps) * STEP_S - time;
            assert!((end - expected).abs() < 1e-12, "{time}: {end} {expected}");
        }
    }

    #[test]
    fn it_is_passive_and_stores_the_work_of_a_constant_force() {
        let mut random = 1_u64;
        let mut noise = || {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (random >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        };
        for time in TIMES {
            let residual = SampledResidual::new(time, STEP_S);
            let forces: Vec<f64> = (0..4000)
                .map(|step| match step / 1000 {
                    0 => noise(),
                    1 => (0.05 * f64::from(step)).sin(),
                    2 => f64::from((step / 7) % 2) + 0.1 * noise(),
                    _ => 0.5,
                })
                .collect();
            let (mut before, mut stored) = (0.0, 0.0);
            let mut start = Products::default();
            let mut last = ResidualMemory::default();
            for (step, (force, memory)) in memories(&residual, forces.into_iter()).into_iter().enumerate() {
                let products = Products::of(&memory, &memory);
                let by = [force * last.relaxed.x, force * last.held.x, force * force];
                let advanced = residual.advance(&start, by);
                let energy = residual.energy(&products);
                assert!(
                    (residual.energy(&advanced) - energy).abs() < 1e-13 * (1.0 + energy),
                    "{time} {step}"
                );
                let displacement = residual.effective(&memory).x;
                assert!((residual.effective_square(&products) - displacement * displacement).abs() < 1e-14);
                let dissipated = force * (displacement - before) - (energy - stored);
                assert!(
                    dissipated > -1e-14 * (1.0 + energy) && energy > -1e-15,
                    "{time} {step}: {dissipated} {energy}"
                );
                (before, stored, start, last) = (displacement, energy, products, memory);
            }
            if time < 0.1 {
                // ½·f².
                assert!((stored - 0.125).abs() < 1e-9, "{time}: {stored}");
            }
        }
    }
}
