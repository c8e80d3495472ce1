//! Force-error certificate: the recording against the unreduced finite element model.
//!
//! At sampled points and patches of the surface, in three directions each, the response of the recording is compared with
//! that of all modes (see `krylov`): R[0], static compliance, dynamic compliance over frequency, and the force of an
//! imposed displacement. The certificate also states the convergence error of this reference. The geometric error of the levels of
//! contact samples is measured by [`palpate::CertificateLevel::new`] and added by `record`.

use crate::krylov::{KrylovSpaces, LoadedMode};
use crate::modes::ElasticModes;
use crate::progress::Progress;
use crate::solve_error::SolveError;
use crate::system::System;
use faer::Mat;
use glam::{DMat3, DVec3};
use palpate::{
    Certificate, CertificateEvent, Damping, OscillatorState, ResidualCompliance, SampledOscillator, Surface,
};

/// Number of sampled points.
const POINTS: usize = 8;

/// Number of sampled points that are the centre of a patch as well.
const PATCHES: usize = 4;

/// Radius of a patch as a share of the body's diagonal: a fingertip on the paper's cube.
const PATCH_DIAGONAL: f64 = 0.03;

/// Least radius of a patch in mean edges of the surface.
const PATCH_EDGES: f64 = 2.0;

/// Number of Krylov blocks of the reference.
const BLOCKS: usize = 18;

/// Number of last blocks that the convergence error of the reference is measured with.
const CONVERGENCE_BLOCKS: usize = 2;

/// Error of the dynamic compliance that ends the bandwidth, as a share of the static compliance.
const BANDWIDTH_TOLERANCE: f64 = 0.05;

/// Relative force error of a certificate above which [`record`](crate::record) warns.
pub const FORCE_ERROR_WARNING: f64 = 0.05;

/// Relative force error above which the warning says that the recording is unusable.
pub(crate) const FORCE_ERROR_UNUSABLE: f64 = 10.0;

/// Value for an unbounded error: too few modes without residual compliance have directions without any compliance.
const UNBOUNDED: f64 = 1e6;

/// Sampled point or patch: surface nodes with weights that sum to one.
struct Sample {
    nodes: Vec<(usize, f64)>,
    centre: DVec3,
    radius: f64,
}

/// Response of a sample: kept modes, substitutes of the truncated modes, residual compliance [m/N].
struct Response {
    kept: Vec<LoadedMode>,
    truncated: Vec<LoadedMode>,
    residual: DMat3,
}

/// Imposed displacement of the force comparison: a smooth ramp, then held.
pub(crate) const EVENT: CertificateEvent = CertificateEvent { step_s: 1e-3, rise_s: 0.05, duration_s: 0.5 };

/// Measures the certificate of a recording.
///
/// # Errors
/// [`SolveError`] when a factor or a small eigenproblem fails, or on interruption.
#[allow(clippy::too_many_arguments)]
pub(crate) fn certificate(
    system: &System,
    modes: &ElasticModes,
    surface: &Surface,
    surface_nodes: &[u32],
    residual: &ResidualCompliance,
    damping: Damping,
    progress: &mut dyn Progress,
) -> Result<Certificate, SolveError> {
    // A fixed node has no compliance to compare.
    let movable = |node: usize| !system.is_fixed(3 * surface_nodes[node] as usize);
    let samples = samples(surface, &movable);
    progress.begin("certificate", (BLOCKS + samples.len()) as u64);
    let loads = loads(system, surface_nodes, &samples);
    let reference = KrylovSpaces::new(system, modes, loads, EVENT.step_s, BLOCKS, progress)?;
    let mut worst = Certificate {
        force_error_max: 0.0,
        force_error_median: 0.0,
        static_compliance_error_max: 0.0,
        instantaneous_compliance_error_max: 0.0,
        bandwidth_hz: f64::INFINITY,
        reference_error: 0.0,
        samples: samples.len() as u64,
        modes_of: [modes.squares.len() as u64, system.elastic_modes() as u64],
        event: EVENT,
        worst_at_m: [0.0; 3],
        worst_patch_radius_m: 0.0,
        sample_levels: Vec::new(),
    };
    let mut force_errors = Vec::new();
    for (at, sample) in samples.iter().enumerate() {
        let kept = (0..modes.squares.len())
            .map(|i| LoadedMode {
                square: modes.squares[i],
                gain: weighted(sample, |node, axis| {
                    modes.shapes[(3 * surface_nodes[node] as usize + axis, i)]
                }),
            })
            .collect();
        let mut response = Response {
            kept,
            truncated: reference.truncated_modes(system, at, BLOCKS - CONVERGENCE_BLOCKS)?,
            residual: residual_at(residual, sample),
        };
        let coarse = (response.instantaneous(damping), response.ramp_forces(damping, true));
        response.truncated = reference.truncated_modes(system, at, BLOCKS)?;
        let (instantaneous, exact) = (response.instantaneous(damping), response.ramp_forces(damping, true));
        let change = relative(coarse.0, instantaneous).max(relative_difference(&coarse.1, &exact));

        let force_error = relative_difference(&response.ramp_forces(damping, false), &exact);
        if force_error >= worst.force_error_max || force_error.is_nan() {
            worst.force_error_max = force_error;
            worst.worst_at_m = sample.centre.to_array();
            worst.worst_patch_radius_m = sample.radius;
        }
        force_errors.push(force_error);
        // NaN counts as the largest error.
        let raise = |worst: &mut f64, error: f64| {
            *worst = if error > *worst || error.is_nan() { error } else { *worst }
        };
        raise(
            &mut worst.static_compliance_error_max,
            relative(response.modelled_static(), response.exact_static()),
        );
        raise(
            &mut worst.instantaneous_compliance_error_max,
            relative(response.modelled_instantaneous(damping), instantaneous),
        );
        raise(&mut worst.reference_error, change);
        worst.bandwidth_hz = worst.bandwidth_hz.min(response.bandwidth_hz(damping));
        progress.advance(1);
    }
    force_errors.sort_by(f64::total_cmp);
    worst.force_error_median = force_errors[force_errors.len() / 2];
    for error in [
        &mut worst.force_error_max,
        &mut worst.force_error_median,
        &mut worst.static_compliance_error_max,
        &mut worst.instantaneous_compliance_error_max,
        &mut worst.reference_error,
    ] {
        *error = if *error < UNBOUNDED { *error } else { UNBOUNDED };
    }
    Ok(worst)
}

/// Points spread over the surface by farthest-point sampling, and patches about the last of them.
fn samples(surface: &Surface, movable: &dyn Fn(usize) -> bool) -> Vec<Sample> {
    let positions = &surface.positions;
    let candidates: Vec<usize> = (0..positions.len()).filter(|&node| movable(node)).collect();
    let mut nearest: Vec<f64> = positions.iter().map(|p| p.length()).collect();
    let mut points = Vec::new();
    for _ in 0..POINTS.min(candidates.len()) {
        let farthest = candidates.iter().copied().max_by(|&a, &b| nearest[a].total_cmp(&nearest[b]));
        let Some(farthest) = farthest else { break };
        points.push(farthest);
        for (node, distance) in nearest.iter_mut().enumerate() {
            let new = (positions[node] - positions[farthest]).length();
            *distance = if points.len() == 1 { new } else { distance.min(new) };
        }
    }
    let areas = node_areas(surface);
    let radius = (PATCH_DIAGONAL * surface.diagonal()).max(PATCH_EDGES * surface.mean_edge());
    let patch = |&centre: &usize| {
        let within = |node: &usize| (positions[*node] - positions[centre]).length() <= radius;
        let nodes: Vec<usize> = candidates.iter().copied().filter(within).collect();
        let total: f64 = nodes.iter().map(|&node| areas[node]).sum();
        Sample {
            nodes: nodes.iter().map(|&node| (node, areas[node] / total)).collect(),
            centre: positions[centre],
            radius,
        }
    };
    let point = |&node: &usize| Sample { nodes: vec![(node, 1.0)], centre: positions[node], radius: 0.0 };
    // The last points lie on faces rather than at corners.
    let patches = points.iter().rev().take(PATCHES).map(patch);
    points.iter().map(point).chain(patches).collect()
}

/// Area of each surface node [m²]: a third of its triangles.
fn node_areas(surface: &Surface) -> Vec<f64> {
    let mut areas = vec![0.0; surface.positions.len()];
    for triangle in &surface.triangles {
        let [a, b, c] = triangle.map(|node| surface.positions[node as usize]);
        let third = (b - a).cross(c - a).length() / 6.0;
        triangle.iter().for_each(|&node| areas[node as usize] += third);
    }
    areas
}

/// Weighted mean over the nodes of a sample.
fn weighted(sample: &Sample, value: impl Fn(usize, usize) -> f64) -> DVec3 {
    let part = |axis| sample.nodes.iter().map(|&(node, weight)| weight * value(node, axis)).sum();
    DVec3::new(part(0), part(1), part(2))
}

/// Residual compliance of a sample [m/N].
fn residual_at(residual: &ResidualCompliance, sample: &Sample) -> DMat3 {
    let mut sum = DMat3::ZERO;
    for &(i, wi) in &sample.nodes {
        for &(j, wj) in &sample.nodes {
            sum += residual.block(i, j) * (wi * wj);
        }
    }
    sum
}

/// Unit forces on the samples [N], three columns each.
fn loads(system: &System, surface_nodes: &[u32], samples: &[Sample]) -> Mat<f64> {
    let mut loads = Mat::zeros(system.discretisation.dofs(), 3 * samples.len());
    for (at, sample) in samples.iter().enumerate() {
        for (&(node, weight), axis) in sample.nodes.iter().flat_map(|n| (0..3).map(move |axis| (n, axis))) {
            let dof = 3 * surface_nodes[node] as usize + axis;
            if !system.is_fixed(dof) {
                loads[(dof, 3 * at + axis)] += weight;
            }
        }
    }
    loads
}

/// Outer product a·aᵀ.
fn outer(a: DVec3) -> DMat3 {
    DMat3::from_cols(a * a.x, a * a.y, a * a.z)
}

/// Frobenius norm.
fn norm(m: DMat3) -> f64 {
    m.to_cols_array().iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// |a − b| / |b|.
fn relative(a: DMat3, b: DMat3) -> f64 {
    norm(a - b) / norm(b)
}

/// √(Σ|a − b|² / Σ|b|²).
fn relative_difference(a: &[DVec3], b: &[DVec3]) -> f64 {
    let difference: f64 = a.iter().zip(b).map(|(a, b)| (*a - *b).length_squared()).sum();
    (difference / b.iter().map(|b| b.length_squared()).sum::<f64>()).sqrt()
}

/// Sampled oscillator of a mode.
fn oscillator(mode: &LoadedMode, damping: Damping) -> SampledOscillator {
    let omega = mode.square.sqrt();
    SampledOscillator::new(omega, damping.ratio(omega), EVENT.step_s)
}

impl Response {
    /// Sum of γγᵀ over modes, weighted.
    fn sum(modes: &[LoadedMode], weight: impl Fn(&LoadedMode) -> f64) -> DMat3 {
        modes.iter().map(|mode| outer(mode.gain) * weight(mode)).fold(DMat3::ZERO, |a, b| a + b)
    }

    /// Static compliance of all modes [m/N].
    fn exact_static(&self) -> DMat3 {
        Self::sum(&self.kept, |m| 1.0 / m.square) + Self::sum(&self.truncated, |m| 1.0 / m.square)
    }

    /// Static compliance of the recording [m/N].
    fn modelled_static(&self) -> DMat3 {
        Self::sum(&self.kept, |m| 1.0 / m.square) + self.residual
    }

    /// Instantaneous compliance R[0] of all modes [m/N].
    fn instantaneous(&self, damping: Damping) -> DMat3 {
        let compliance = |m: &LoadedMode| oscillator(m, damping).instantaneous_compliance();
        Self::sum(&self.kept, compliance) + Self::sum(&self.truncated, compliance)
    }

    /// Instantaneous compliance R[0] of the recording [m/N].
    fn modelled_instantaneous(&self, damping: Damping) -> DMat3 {
        let decay = self.residual_decay(damping);
        Self::sum(&self.kept, |m| oscillator(m, damping).instantaneous_compliance())
            + self.residual * (1.0 - decay)
    }

    /// Relaxation time of the residual compliance [s].
    fn residual_relaxation_s(&self, damping: Damping) -> f64 {
        self.kept.last().map_or(0.0, |highest| damping.residual_relaxation_s(highest.square.sqrt()))
    }

    /// Factor by which the displacement of the residual compliance decays in a step.
    fn residual_decay(&self, damping: Damping) -> f64 {
        self.kept.last().map_or(0.0, |highest| damping.residual_decay(highest.square.sqrt(), EVENT.step_s))
    }

    /// Frequency [Hz] up to which the truncated modes respond quasi-statically. The kept modes are equal in both models.
    fn bandwidth_hz(&self, damping: Damping) -> f64 {
        let allowed = BANDWIDTH_TOLERANCE * norm(self.exact_static());
        let first = self.kept.first().map_or(1.0, |m| m.square.sqrt());
        let last = std::f64::consts::PI / EVENT.step_s;
        let mut omega = 1e-3 * first;
        let mut within = 0.0;
        while omega < last.max(2.0 * first) {
            // Σ γγᵀ/(ωᵢ² − ω² + 2iζωᵢω): real and imaginary part.
            let parts = |m: &LoadedMode| {
                let (a, b) = (
                    m.square - omega * omega,
                    2.0 * damping.ratio(m.square.sqrt()) * m.square.sqrt() * omega,
                );
                (a / (a * a + b * b), -b / (a * a + b * b))
            };
            // S/(1 + iωτ).
            let relaxed = omega * self.residual_relaxation_s(damping);
            let residual = self.residual * (1.0 / (1.0 + relaxed * relaxed));
            let real = Self::sum(&self.truncated, |m| parts(m).0) - residual;
            let imaginary = Self::sum(&self.truncated, |m| parts(m).1) + residual * relaxed;
            if norm(real).hypot(norm(imaginary)) > allowed {
                return within;
            }
            within = omega / std::f64::consts::TAU;
            omega *= 1.01;
        }
        within
    }

    /// Forces [N] of the imposed displacement [`EVENT`] along each axis in turn, with all modes or as recorded.
    fn ramp_forces(&self, damping: Damping, all: bool) -> Vec<DVec3> {
        let steps = (EVENT.duration_s / EVENT.step_s).round() as usize;
        let axes = [DVec3::X, DVec3::Y, DVec3::Z];
        axes.into_iter().flat_map(|axis| self.ramp_force(damping, axis, steps, all)).collect()
    }

    /// Forces [N] of an imposed displacement of 1 m along one axis by equation (9), without rigid motion.
    fn ramp_force(&self, damping: Damping, axis: DVec3, steps: usize, all: bool) -> Vec<DVec3> {
        let modes = self.kept.iter().chain(self.truncated.iter().filter(|_| all));
        let mut modes: Vec<_> =
            modes.map(|m| (oscillator(m, damping), m.gain, OscillatorState::default())).collect();
        let compliance = if all { self.instantaneous(damping) } else { self.modelled_instantaneous(damping) };
        let inverse = compliance.inverse();
        let decay = if all { 0.0 } else { self.residual_decay(damping) };
        let mut residual = DVec3::ZERO;
        (1..=steps)
            .map(|step| {
                let share = (step as f64 * EVENT.step_s / EVENT.rise_s).min(1.0);
                let target = axis * (0.5 - 0.5 * (std::f64::consts::PI * share).cos());
                let free: DVec3 =
                    modes.iter().map(|(map, gain, state)| *gain * map.advance(*state, 0.0).q).sum();
                let force = inverse * (target - free - residual * decay);
                residual = residual * decay + self.residual * force * (1.0 - decay);
                for (map, gain, state) in &mut modes {
                    *state = map.advance(*state, gain.dot(force));
                }
                force
            })
            .collect()
    }
}
