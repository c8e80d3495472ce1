//! Force-error certificate: the recording against the unreduced finite element model.
//!
//! At sampled points and patches of the surface, three directions each, the recording's response is compared with that
//! of all modes (see `reference`): R[0], static compliance, dynamic compliance over frequency, and the force of a press.
//! The certificate states how far the reference itself has converged.

use crate::factor::FactorError;
use crate::modes::{Modes, ModesError};
use crate::progress::Progress;
use crate::reference::{LoadedMode, Reference};
use crate::system::System;
use faer::Mat;
use glam::{DMat3, DVec3};
use palpate::{
    Certificate, CertificateEvent, Damping, OscillatorState, ResidualCompliance, SampledOscillator, Surface,
};

/// Sampled points, and how many of them carry a patch as well.
const POINTS: usize = 8;
const PATCHES: usize = 4;

/// Radius of a patch as a share of the body's diagonal (a fingertip on the paper's cube), and in mean edges
/// at least.
const PATCH_DIAGONAL: f64 = 0.03;
const PATCH_EDGES: f64 = 2.0;

/// Krylov blocks of the reference, and how many are left out to see whether it has converged.
const BLOCKS: usize = 18;
const LEFT_OUT: usize = 2;

/// The dynamic compliance may be off by this share of the static one within the bandwidth.
const BANDWIDTH_TOLERANCE: f64 = 0.05;

/// Force error above which a recording gets a remark, and above which the remark says that it is worth nothing.
pub const DOUBTFUL: f64 = 0.05;
/// See [`DOUBTFUL`].
pub const WORTHLESS: f64 = 10.0;

/// What stands for an error without bound: too few modes without residual can't be held in every direction at all.
const UNBOUNDED: f64 = 1e6;

/// Why no certificate could be made.
#[derive(Debug, thiserror::Error)]
pub enum CertificateError {
    /// The shifted factor failed.
    #[error("certificate: {0}")]
    Factor(#[from] FactorError),
    /// A small eigenproblem failed.
    #[error("certificate: {0}")]
    Modes(#[from] ModesError),
}

/// A place where the recording is tried: surface nodes with weights that sum to one.
struct Sample {
    nodes: Vec<(usize, f64)>,
    centre: DVec3,
    radius: f64,
}

/// A sample's responses, kept and left out.
struct Response {
    kept: Vec<LoadedMode>,
    left_out: Vec<LoadedMode>,
    residual: DMat3,
}

/// The press that forces are compared on.
pub const EVENT: CertificateEvent = CertificateEvent { step_s: 1e-3, rise_s: 0.05, duration_s: 0.5 };

/// Measure the certificate of a recording's parts.
///
/// # Errors
/// When a factor or a small eigenproblem fails.
#[allow(clippy::too_many_arguments)]
pub fn certificate(
    system: &System,
    modes: &Modes,
    surface: &Surface,
    surface_nodes: &[u32],
    residual: &ResidualCompliance,
    damping: Damping,
    progress: &mut dyn Progress,
) -> Result<Certificate, CertificateError> {
    // A fixed place has no compliance to compare.
    let movable = |node: usize| !system.is_fixed(3 * surface_nodes[node] as usize);
    let samples = samples(surface, &movable);
    progress.begin("certificate", (BLOCKS + samples.len()) as u64);
    let loads = loads(system, surface_nodes, &samples);
    let reference = Reference::new(system, modes, loads, EVENT.step_s, BLOCKS, progress)?;
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
            left_out: reference.left_out(system, at, BLOCKS - LEFT_OUT)?,
            residual: residual_at(residual, sample),
        };
        let coarse = (response.instantaneous(damping), response.presses(damping, true));
        response.left_out = reference.left_out(system, at, BLOCKS)?;
        let (instantaneous, exact) = (response.instantaneous(damping), response.presses(damping, true));
        let change = relative(coarse.0, instantaneous).max(apart(&coarse.1, &exact));

        let force_error = apart(&response.presses(damping, false), &exact);
        if force_error >= worst.force_error_max || force_error.is_nan() {
            worst.force_error_max = force_error;
            worst.worst_at_m = sample.centre.to_array();
            worst.worst_patch_radius_m = sample.radius;
        }
        force_errors.push(force_error);
        // An error that is no number is the worst of all.
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

/// Points spread over the surface, each as far from the others as it gets, and patches about the first of them.
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
    // Patches where the last points fell: those lie on faces rather than at corners.
    let patches = points.iter().rev().take(PATCHES).map(patch);
    points.iter().map(point).chain(patches).collect()
}

/// Area [m²] of the surface that belongs to each node: a third of its triangles.
fn node_areas(surface: &Surface) -> Vec<f64> {
    let mut areas = vec![0.0; surface.positions.len()];
    for triangle in &surface.triangles {
        let [a, b, c] = triangle.map(|node| surface.positions[node as usize]);
        let third = (b - a).cross(c - a).length() / 6.0;
        triangle.iter().for_each(|&node| areas[node as usize] += third);
    }
    areas
}

fn weighted(sample: &Sample, value: impl Fn(usize, usize) -> f64) -> DVec3 {
    let part = |axis| sample.nodes.iter().map(|&(node, weight)| weight * value(node, axis)).sum();
    DVec3::new(part(0), part(1), part(2))
}

fn residual_at(residual: &ResidualCompliance, sample: &Sample) -> DMat3 {
    let mut sum = DMat3::ZERO;
    for &(i, wi) in &sample.nodes {
        for &(j, wj) in &sample.nodes {
            sum += residual.block(i, j) * (wi * wj);
        }
    }
    sum
}

/// Unit forces on the samples: three columns each.
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
fn apart(a: &[DVec3], b: &[DVec3]) -> f64 {
    let difference: f64 = a.iter().zip(b).map(|(a, b)| (*a - *b).length_squared()).sum();
    (difference / b.iter().map(|b| b.length_squared()).sum::<f64>()).sqrt()
}

fn oscillator(mode: &LoadedMode, damping: Damping) -> SampledOscillator {
    let omega = mode.square.sqrt();
    SampledOscillator::new(omega, damping.ratio(omega), EVENT.step_s)
}

impl Response {
    fn sum(modes: &[LoadedMode], weight: impl Fn(&LoadedMode) -> f64) -> DMat3 {
        modes.iter().map(|mode| outer(mode.gain) * weight(mode)).fold(DMat3::ZERO, |a, b| a + b)
    }

    fn exact_static(&self) -> DMat3 {
        Self::sum(&self.kept, |m| 1.0 / m.square) + Self::sum(&self.left_out, |m| 1.0 / m.square)
    }

    fn modelled_static(&self) -> DMat3 {
        Self::sum(&self.kept, |m| 1.0 / m.square) + self.residual
    }

    /// R[0] of all modes.
    fn instantaneous(&self, damping: Damping) -> DMat3 {
        let compliance = |m: &LoadedMode| oscillator(m, damping).instantaneous_compliance();
        Self::sum(&self.kept, compliance) + Self::sum(&self.left_out, compliance)
    }

    /// R[0] of the recording.
    fn modelled_instantaneous(&self, damping: Damping) -> DMat3 {
        Self::sum(&self.kept, |m| oscillator(m, damping).instantaneous_compliance()) + self.residual
    }

    /// Up to where the left-out modes answer as if they were a spring. The kept ones are the same in both.
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
            let real = Self::sum(&self.left_out, |m| parts(m).0) - self.residual;
            let imaginary = Self::sum(&self.left_out, |m| parts(m).1);
            if norm(real).hypot(norm(imaginary)) > allowed {
                return within;
            }
            within = omega / std::f64::consts::TAU;
            omega *= 1.01;
        }
        within
    }

    /// Forces [N] when the sample is moved by a smooth ramp along each axis in turn, with all modes or as recorded.
    fn presses(&self, damping: Damping, all: bool) -> Vec<DVec3> {
        let steps = (EVENT.duration_s / EVENT.step_s).round() as usize;
        let axes = [DVec3::X, DVec3::Y, DVec3::Z];
        axes.into_iter().flat_map(|axis| self.press(damping, axis, steps, all)).collect()
    }

    /// Forces [N] of a press of 1 m by equation (9), without rigid motion.
    fn press(&self, damping: Damping, axis: DVec3, steps: usize, all: bool) -> Vec<DVec3> {
        let modes = self.kept.iter().chain(self.left_out.iter().filter(|_| all));
        let mut modes: Vec<_> =
            modes.map(|m| (oscillator(m, damping), m.gain, OscillatorState::default())).collect();
        let compliance = if all { self.instantaneous(damping) } else { self.modelled_instantaneous(damping) };
        let inverse = compliance.inverse();
        (1..=steps)
            .map(|step| {
                let share = (step as f64 * EVENT.step_s / EVENT.rise_s).min(1.0);
                let target = axis * (0.5 - 0.5 * (std::f64::consts::PI * share).cos());
                let free: DVec3 =
                    modes.iter().map(|(map, gain, state)| *gain * map.advance(*state, 0.0).q).sum();
                let force = inverse * (target - free);
                for (map, gain, state) in &mut modes {
                    *state = map.advance(*state, gain.dot(force));
                }
                force
            })
            .collect()
    }
}
