//! Force-error certificate: the recording against the unreduced finite element model.
//!
//! At points and patches of the surface the response of the recording is compared with that of all modes (see `krylov`): R[0], static
//! compliance, dynamic compliance over frequency, the force of an imposed displacement ([`response`]), and the peak force error of hands
//! that hold one to three places of the moving body ([`held_places`]). The certificate also states the convergence error of this reference.
//! The geometric error of the levels of contact samples is measured by [`palpate::CertificateLevel::new`] and added by `record`.

mod held_places;
mod places;
mod response;

use crate::carriers::Carriers;
use crate::krylov::{KrylovSpaces, ModeAtPlaces};
use crate::modes::ElasticModes;
use crate::progress::Progress;
use crate::solve_error::SolveError;
use crate::system::System;
use held_places::{HeldPlaces, MARGIN, MARGIN_OF_PATCHES, kept_modes};
use palpate::{
    Certificate, CertificateEvent, Damping, PeakForceError, ResidualCompliance, SampledOscillator, Surface,
};
use places::{loads, places, residual_between};
use response::{Response, relative, relative_difference};

/// Number of Krylov blocks of the reference.
const BLOCKS: usize = 18;

/// Number of last blocks that the convergence error of the reference is measured with.
const CONVERGENCE_BLOCKS: usize = 2;

/// Number of places whose responses are projected on a common space, and that are held together.
const GROUP: usize = 4;

/// Sets of places of a group that hands hold at the same time.
const HELD: [&[usize]; 9] = [&[0], &[1], &[2], &[3], &[0, 1], &[2, 3], &[0, 3], &[0, 1, 2], &[1, 2, 3]];

/// Relative force error above which the warning says that the recording is unusable.
pub(crate) const FORCE_ERROR_UNUSABLE: f64 = 10.0;

/// Value for an unbounded error: too few modes without residual compliance have directions without any compliance.
const UNBOUNDED: f64 = 1e6;

/// Imposed displacement of the force comparison: a smooth ramp, then held.
pub(crate) const EVENT: CertificateEvent = CertificateEvent { step_s: 1e-3, rise_s: 0.05, duration_s: 0.5 };

/// Imposed displacement at a time of the [`EVENT`] [s], as a share of its size.
fn displacement(time_s: f64) -> f64 {
    0.5 - 0.5 * (std::f64::consts::PI * (time_s / EVENT.rise_s).min(1.0)).cos()
}

/// Sampled oscillator of a mode with ω² = `square` [rad²/s²].
fn oscillator(square: f64, damping: Damping, step_s: f64) -> SampledOscillator {
    let omega = square.sqrt();
    SampledOscillator::new(omega, damping.ratio(omega), step_s)
}

/// Raises a largest error; NaN counts as the largest one.
fn raise(worst: &mut f64, error: f64) {
    if error > *worst || error.is_nan() {
        *worst = error;
    }
}

/// Measures the certificate of a recording.
///
/// # Errors
/// [`SolveError`] when a factor or a small eigenproblem fails, or on interruption.
#[allow(clippy::too_many_arguments)]
pub(crate) fn certificate(
    system: &System,
    modes: &ElasticModes,
    surface: &Surface,
    carriers: &Carriers,
    residual: &ResidualCompliance,
    damping: Damping,
    progress: &mut dyn Progress,
) -> Result<Certificate, SolveError> {
    let places = places(system, surface, carriers);
    progress.begin("certificate", (BLOCKS + places.len()) as u64);
    let loads = loads(system, &carriers.nodes, &places);
    let rigid = system.rigid_participation(&loads);
    let reference = KrylovSpaces::new(system, modes, loads, EVENT.step_s, BLOCKS, progress)?;
    let mut worst = Certificate {
        force_error_max: 0.0,
        force_error_median: 0.0,
        peak_force_error_max: None,
        static_compliance_error_max: 0.0,
        instantaneous_compliance_error_max: 0.0,
        bandwidth_hz: f64::INFINITY,
        reference_error: 0.0,
        samples: places.len() as u64,
        modes_of: [modes.squares.len() as u64, system.elastic_modes() as u64],
        event: EVENT,
        worst_at_m: [0.0; 3],
        worst_patch_radius_m: 0.0,
        sample_levels: Vec::new(),
    };
    let mut force_errors = Vec::new();
    let mut peaks = PeakForceError { held: [0.0; 3], touched: [0.0; 3] };
    let (points, patches) = places.split_at(places.partition_point(|place| place.radius == 0.0));
    let mut first = 0;
    for group in points.chunks(GROUP).chain(patches.chunks(GROUP)) {
        let projected = reference.projected(system, first..first + group.len());
        let coarse = projected.truncated_modes(BLOCKS - CONVERGENCE_BLOCKS)?;
        let truncated = projected.truncated_modes(BLOCKS)?;
        let kept = kept_modes(group, &modes.squares, |node, axis, mode| {
            modes.shapes[(3 * carriers.nodes[node] as usize + axis, mode)]
        });
        for (at, place) in group.iter().enumerate() {
            let at_place = |modes: &[ModeAtPlaces]| modes.iter().map(|mode| mode.at(at)).collect();
            let mut response = Response {
                kept: at_place(&kept),
                truncated: at_place(&coarse),
                residual: residual_between(residual, place, place),
            };
            let coarse = (response.instantaneous(damping), response.ramp_forces(damping, true));
            response.truncated = at_place(&truncated);
            let (instantaneous, exact) =
                (response.instantaneous(damping), response.ramp_forces(damping, true));
            let change = relative(coarse.0, instantaneous).max(relative_difference(&coarse.1, &exact));

            let force_error = relative_difference(&response.ramp_forces(damping, false), &exact);
            if force_error >= worst.force_error_max || force_error.is_nan() {
                worst.force_error_max = force_error;
                worst.worst_at_m = place.centre.to_array();
                worst.worst_patch_radius_m = place.radius;
            }
            force_errors.push(force_error);
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
        let rigid = rigid.subcols(3 * first, 3 * group.len()).to_owned();
        for chosen in HELD.iter().filter(|chosen| chosen.iter().all(|&place| place < group.len())) {
            let held = HeldPlaces::new(group, chosen, &rigid, &kept, &truncated, residual, damping);
            let (peak, margin) = match group[0].radius {
                0.0 => (&mut peaks.held, MARGIN),
                _ => (&mut peaks.touched, MARGIN_OF_PATCHES),
            };
            raise(&mut peak[chosen.len() - 1], margin * held.peak_force_error(damping));
        }
        first += group.len();
    }
    force_errors.sort_by(f64::total_cmp);
    worst.force_error_median = force_errors[force_errors.len() / 2];
    for error in [
        &mut worst.force_error_max,
        &mut worst.force_error_median,
        &mut worst.static_compliance_error_max,
        &mut worst.instantaneous_compliance_error_max,
        &mut worst.reference_error,
    ]
    .into_iter()
    .chain(&mut peaks.held)
    .chain(&mut peaks.touched)
    {
        *error = if *error < UNBOUNDED { *error } else { UNBOUNDED };
    }
    worst.peak_force_error_max = Some(peaks);
    Ok(worst)
}
