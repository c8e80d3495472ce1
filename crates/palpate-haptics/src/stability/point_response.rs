//! Driving-point response of an object at a point of its surface, along a direction n.
//!
//! ```text
//! C(z) = Σᵢ φᵢ²·gᵢ(z) + s·((1 − e)/(1 − e/z) + c·(1 − 1/z)) + m·g₀(z)
//! φ = nᵀ·J·Φ,  s = nᵀ·J·S·Jᵀ·n,  m = 1/M + (r×n)ᵀ·I⁻¹·(r×n),  e = exp(−h/τ)
//! ```
//!
//! C [m/N] is the displacement at the end of a step per held force; C(∞) = R[0]. gᵢ is the response of mode i (see
//! `discrete_oscillator`), g₀ that of a free mass of 1 kg, s [m/N] the residual compliance with its relaxation time τ, m [1/kg] the mobility of the rigid body, 0 if
//! nodes are fixed.

use super::discrete_oscillator::DiscreteOscillator;
use glam::DVec3;
use palpate::{Recording, SampledResidual, Support, Surface, SurfacePoint};
use std::collections::BTreeMap;

/// Driving-point response at a point of an object's surface, along a direction.
#[derive(Debug, Clone)]
pub struct PointResponse {
    /// Angular frequency ω [rad/s], damping ratio ζ and φ² [1/kg] of every mode.
    modes: Vec<[f64; 3]>,
    /// Mobility m of the rigid body [1/kg].
    mobility: f64,
    /// Residual compliance s [m/N], and its relaxation time τ [s].
    residual: f64,
    relaxation_s: f64,
}

impl PointResponse {
    /// Response at a point of the surface, or averaged over a patch with a radius [m] around it, along a direction [body].
    pub fn new(recording: &Recording, point: &SurfacePoint, patch_radius: f64, direction: DVec3) -> Self {
        let (surface, modes) = (&recording.surface, &recording.modes);
        let n = direction.normalize_or(DVec3::Y);
        let corners = surface.corners(point).into_iter().filter(|(_, weight)| *weight != 0.0);
        let weights: Vec<(usize, f64)> = corners
            .flat_map(|(node, weight)| {
                patch(surface, node, patch_radius).into_iter().map(move |(at, share)| (at, share * weight))
            })
            .collect();
        let mut shapes = vec![0.0; modes.len()];
        for &(node, weight) in &weights {
            for (axis, component) in n.to_array().into_iter().enumerate() {
                let row = modes.row(node, axis);
                shapes.iter_mut().zip(row).for_each(|(sum, phi)| *sum += weight * component * phi);
            }
        }
        let mut of_model = BTreeMap::new();
        for &(surface_node, weight) in &weights {
            let nodes = recording.model_nodes_of(surface_node);
            nodes.for_each(|(node, share)| *of_model.entry(node).or_insert(0.0) += weight * share);
        }
        let pairs = of_model.iter().flat_map(|a| of_model.iter().map(move |b| (a, b)));
        let residual =
            pairs.map(|((i, wi), (j, wj))| wi * wj * n.dot(recording.residual.block(*i, *j) * n)).sum();
        let mobility = match recording.metadata.support {
            Support::Fixed => 0.0,
            Support::Free => {
                let turn = surface.rest_position(point).cross(n);
                1.0 / recording.mass() + turn.dot(recording.inertia().inverse() * turn)
            }
        };
        let pairs = modes.angular_frequencies.iter().zip(&modes.damping_ratios);
        let modes = pairs.zip(shapes).map(|((&omega, &zeta), phi)| [omega, zeta, phi * phi]).collect();
        let relaxation_s = recording.residual_relaxation_s();
        Self { modes, mobility, residual, relaxation_s }
    }

    /// R[0] [m/N]: displacement per force within one step [s].
    pub fn instantaneous_compliance(&self, step_s: f64) -> f64 {
        self.discrete_oscillators(step_s)
            .iter()
            .map(|(map, gain)| gain * map.instantaneous_compliance())
            .sum::<f64>()
            + self.residual * self.sampled_residual(step_s).share(0)
    }

    /// Static compliance [m/N], without rigid motion.
    pub fn static_compliance(&self) -> f64 {
        self.modes.iter().map(|[omega, _, gain]| gain / (omega * omega)).sum::<f64>() + self.residual
    }

    /// Residual compliance s [m/N].
    pub fn residual(&self) -> f64 {
        self.residual
    }

    /// Residual compliance at a step [s].
    pub fn sampled_residual(&self, step_s: f64) -> SampledResidual {
        SampledResidual::new(self.relaxation_s, step_s)
    }

    /// Oscillators: ω [rad/s], ζ and gain φ² [1/kg] of every mode, and of the rigid motion with ω = 0.
    pub fn oscillators(&self) -> impl Iterator<Item = [f64; 3]> + '_ {
        let rigid = (self.mobility > 0.0).then_some([0.0, 0.0, self.mobility]);
        self.modes.iter().copied().chain(rigid)
    }

    /// Oscillators as one-step maps, with their gains [1/kg].
    pub(super) fn discrete_oscillators(&self, step_s: f64) -> Vec<(DiscreteOscillator, f64)> {
        let one = |[omega, zeta, gain]: [f64; 3]| match omega {
            0.0 => (DiscreteOscillator::free(0.0, step_s), gain),
            _ => (DiscreteOscillator::oscillator(omega, zeta, step_s), gain),
        };
        self.oscillators().map(one).collect()
    }
}

/// Outward unit normal at a point of the surface at rest [body].
pub fn normal_at(surface: &Surface, point: &SurfacePoint) -> DVec3 {
    let [a, b, c] = surface.corners(point).map(|(node, _)| surface.positions[node]);
    (b - a).cross(c - a).normalize_or(DVec3::Y)
}

/// Nodes of a patch around a node, with weights (1 − s²)²·(area of the node), s = distance/radius, that sum to 1.
fn patch(surface: &Surface, centre: usize, radius: f64) -> Vec<(usize, f64)> {
    let middle = surface.positions[centre];
    let kernel = |node: usize| {
        let s = (surface.positions[node] - middle).length() / radius;
        if s < 1.0 { (1.0 - s * s).powi(2) } else { 0.0 }
    };
    let mut weights = BTreeMap::from([(centre, f64::MIN_POSITIVE)]);
    if radius > 0.0 {
        for corners in &surface.triangles {
            let nodes = corners.map(|node| node as usize);
            let [a, b, c] = nodes.map(|node| surface.positions[node]);
            let third = (b - a).cross(c - a).length() / 6.0;
            for node in nodes {
                *weights.entry(node).or_insert(0.0) += third * kernel(node);
            }
        }
    }
    let total: f64 = weights.values().sum();
    weights
        .into_iter()
        .filter(|(_, weight)| *weight > 0.0)
        .map(|(node, weight)| (node, weight / total))
        .collect()
}
