//! What a device feels of an object at a place of its surface, along one direction n.
//!
//! ```text
//! C(z) = Σᵢ φᵢ²·gᵢ(z) + s + m·g₀(z)        φ = nᵀ·J·Φ,  s = nᵀ·J·S·Jᵀ·n,  m = 1/M + (r×n)ᵀ·I⁻¹·(r×n)
//! ```
//!
//! C [m/N] is the displacement at the end of a step per held force: C(∞) = R[0], what one step gives. gᵢ is that of
//! mode i (see `sampled`), g₀ that of a mass of 1 kg, s the residual compliance, m the body's mobility, 0 if nodes are fixed.

use super::sampled::Sampled;
use glam::DVec3;
use palpate::{Recording, Support, Surface, SurfacePoint};

/// A place on an object, and a direction.
#[derive(Debug, Clone)]
pub struct PlaceResponse {
    /// ω [rad/s], ζ and φ² [1/kg] of every mode.
    modes: Vec<[f64; 3]>,
    /// m [1/kg].
    mobility: f64,
    /// s [m/N].
    residual: f64,
}

impl PlaceResponse {
    /// At a point of the surface, or averaged over a patch of a radius [m] about it, along a direction in the body frame.
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
        let pairs = weights.iter().flat_map(|a| weights.iter().map(move |b| (a, b)));
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
        Self { modes, mobility, residual }
    }

    /// R[0] [m/N] for a step [s]: how far the place gives within one.
    pub fn within_step(&self, step_s: f64) -> f64 {
        self.sampled(step_s).iter().map(|(map, gain)| gain * map.within_step()).sum::<f64>() + self.residual
    }

    /// How far it gives at rest [m/N], the body's own motion apart.
    pub fn at_rest(&self) -> f64 {
        self.modes.iter().map(|[omega, _, gain]| gain / (omega * omega)).sum::<f64>() + self.residual
    }

    /// s [m/N].
    pub fn residual(&self) -> f64 {
        self.residual
    }

    /// Everything that swings, with its gain [1/kg]: ω [rad/s], ζ and φ²; ω is 0 for the body's own motion.
    pub fn swings(&self) -> impl Iterator<Item = [f64; 3]> + '_ {
        let rigid = (self.mobility > 0.0).then_some([0.0, 0.0, self.mobility]);
        self.modes.iter().copied().chain(rigid)
    }

    pub(super) fn sampled(&self, step_s: f64) -> Vec<(Sampled, f64)> {
        let one = |[omega, zeta, gain]: [f64; 3]| match omega {
            0.0 => (Sampled::free(0.0, step_s), gain),
            _ => (Sampled::oscillator(omega, zeta, step_s), gain),
        };
        self.swings().map(one).collect()
    }
}

/// The normal out of the body [body frame] at a point of its surface at rest.
pub fn normal_at(surface: &Surface, point: &SurfacePoint) -> DVec3 {
    let [a, b, c] = surface.corners(point).map(|(node, _)| surface.positions[node]);
    (b - a).cross(c - a).normalize_or(DVec3::Y)
}

/// Nodes of a patch about a node with their weights, (1 − s²)² times the area about each; they sum to 1.
fn patch(surface: &Surface, centre: usize, radius: f64) -> Vec<(usize, f64)> {
    let middle = surface.positions[centre];
    let kernel = |node: usize| {
        let s = (surface.positions[node] - middle).length() / radius;
        if s < 1.0 { (1.0 - s * s).powi(2) } else { 0.0 }
    };
    let mut shares = std::collections::BTreeMap::from([(centre, f64::MIN_POSITIVE)]);
    if radius > 0.0 {
        for corners in &surface.triangles {
            let nodes = corners.map(|node| node as usize);
            let [a, b, c] = nodes.map(|node| surface.positions[node]);
            let third = (b - a).cross(c - a).length() / 6.0;
            for node in nodes {
                *shares.entry(node).or_insert(0.0) += third * kernel(node);
            }
        }
    }
    let total: f64 = shares.values().sum();
    shares.into_iter().filter(|(_, share)| *share > 0.0).map(|(node, share)| (node, share / total)).collect()
}
