//! Certified peak force error: not exceeded by hands that hold one, two and three places of free bodies.
//!
//! The reference keeps all modes of the body, in the same runtime with steps of an eighth: no Krylov space, no residual compliance, and
//! large rotations. The certificate is made from neither.

use crate::check::Check;
use crate::error::VerifyError;
use glam::DVec3;
use palpate::{
    Damping, DeviceInput, DeviceParameters, Grasp, Input, Model, ModelParameters, Recording, State,
    SurfacePoint, step,
};
use palpate_fem::mesh::{Mesh, ball_mesh, box_mesh};
use palpate_fem::paper_cube::{DENSITY_KG_M3, POISSON, YOUNG_PA};
use palpate_fem::{ElementOrder, RecordExtent, RecordParameters, SilentProgress, record};
use palpate_testkit::{Random, object_at, smoothstep, undamped};
use std::sync::Arc;

/// Step of the recordings [s], and steps of the reference in it.
const STEP_S: f64 = 1e-3;
const REFERENCE_STEPS: usize = 8;

/// Steps of the ramp, and of a motion.
const RISE: usize = 50;
const STEPS: usize = 250;

/// Motions of each number of hands; their directions are random.
const MOTIONS: usize = 4;

/// Least distance of two hands and size of their displacement, as shares of the body's diagonal.
const APART: f64 = 0.2;
const MOVED: f64 = 0.02;

/// Stiffness dampings β [s] and numbers of modes.
const DAMPINGS: [f64; 3] = [0.0, 2e-4, 1e-2];
const MODES: [usize; 2] = [20, 200];

/// Share of the cases in which the certificate may be more than [`LOOSE`] times the largest error.
const LOOSE_CASES: f64 = 0.5;
const LOOSE: f64 = 3.0;

/// Hands that hold surface points, with their displacements [m].
type Motion = Vec<(SurfacePoint, DVec3)>;

/// Certificates of a cube, a bar and a ball with three dampings and two numbers of modes, at one to three places each.
pub fn peak_force() -> Result<Vec<Check>, VerifyError> {
    let bodies: [(&str, Mesh); 3] = [
        ("cube", box_mesh([0.1; 3], [6; 3])?),
        ("bar", box_mesh([0.2, 0.05, 0.05], [12, 3, 3])?),
        ("ball", ball_mesh(0.05, 4)?),
    ];
    let (mut checks, mut tight, mut cases) = (Vec::new(), 0_usize, 0_usize);
    for (name, mesh) in &bodies {
        for beta in DAMPINGS {
            let recorded = |modes, extent| -> Result<Arc<Recording>, VerifyError> {
                let parameters = RecordParameters {
                    damping: Damping::Rayleigh { alpha: 0.0, beta },
                    extent,
                    ..undamped(YOUNG_PA, POISSON, DENSITY_KG_M3, ElementOrder::Linear, modes)
                };
                Ok(Arc::new(record(mesh.clone(), &parameters, &mut SilentProgress)?))
            };
            let unreduced = recorded(3 * mesh.nodes.len() - 6, RecordExtent::NoCertificate)?;
            let motions = motions(&unreduced);
            let references = forces_of(&unreduced, &motions, REFERENCE_STEPS)?;
            for modes in MODES {
                let reduced = recorded(modes, RecordExtent::Full)?;
                let certificate = reduced.metadata.certificate.as_ref();
                let certified = certificate
                    .and_then(|certificate| certificate.peak_force_error_max)
                    .ok_or(VerifyError::NotReached("a certificate with a peak force error"))?;
                let forces = forces_of(&reduced, &motions, 1)?;
                for (hands, stated) in (1..=3).zip(certified.held) {
                    let of_hands = motions.iter().zip(forces.iter().zip(&references));
                    let errors = of_hands.filter(|(motion, _)| motion.len() == hands);
                    let error = errors.map(|(_, (f, r))| peak_error(f, r)).fold(0.0, f64::max);
                    let quantity =
                        format!("{name}, β = {beta:.0e} s, {modes} modes, {hands} held: error / certified");
                    checks.push(Check::new(quantity, error / stated, 0.0, 1.0));
                    cases += 1;
                    tight += usize::from(stated <= LOOSE * error);
                }
            }
        }
    }
    let quantity = format!("share of {cases} cases whose certificate is more than {LOOSE} × the error");
    checks.push(Check::new(quantity, 1.0 - tight as f64 / cases as f64, 0.0, LOOSE_CASES));
    Ok(checks)
}

/// Motions of one to three hands: every second one presses all places in.
fn motions(body: &Recording) -> Vec<Motion> {
    let surface = &body.surface;
    let diagonal = surface.diagonal();
    let mut random = Random::new(7);
    let mut all = Vec::new();
    for hands in 1..=3 {
        for number in 0..MOTIONS {
            let mut motion = Motion::new();
            while motion.len() < hands {
                let triangle = (random.unit() * surface.triangles.len() as f64) as u32;
                let point = SurfacePoint { triangle, weights: [1.0, 0.0, 0.0] };
                let at = surface.rest_position(&point);
                if motion
                    .iter()
                    .any(|(other, _)| (surface.rest_position(other) - at).length() < APART * diagonal)
                {
                    continue;
                }
                let mut component = || 2.0 * random.unit() - 1.0;
                let any = DVec3::new(component(), component(), component());
                let towards = if number % 2 == 0 { -at } else { any };
                motion.push((point, towards.normalize() * MOVED * diagonal));
            }
            all.push(motion);
        }
    }
    all
}

/// Forces [N] of every motion, hand after hand in every step, as means over the step.
fn forces_of(
    body: &Arc<Recording>,
    motions: &[Motion],
    fraction: usize,
) -> Result<Vec<Vec<DVec3>>, VerifyError> {
    motions.iter().map(|motion| forces(body, motion, fraction)).collect()
}

fn forces(body: &Arc<Recording>, motion: &Motion, fraction: usize) -> Result<Vec<DVec3>, VerifyError> {
    let parameters = ModelParameters {
        step_s: STEP_S / fraction as f64,
        devices: vec![DeviceParameters::default(); motion.len()],
        ..ModelParameters::default()
    };
    let model = Model::new(parameters, vec![object_at(body, DVec3::ZERO, DVec3::ZERO)])?;
    let mut state = State::new(&model);
    let mut means = vec![DVec3::ZERO; STEPS * motion.len()];
    for number in 0..STEPS * fraction {
        let share = smoothstep((number + 1) as f64 / (RISE * fraction) as f64);
        let hand = |(point, by): &(SurfacePoint, DVec3)| {
            let grasp = Grasp { object: 0, point: *point };
            DeviceInput::held(body.surface.rest_position(point) + *by * share, grasp)
        };
        let input = Input { devices: motion.iter().map(hand).collect(), ..Input::default() };
        let devices = &step(&model, &mut state, &input).devices;
        let first = number / fraction * motion.len();
        for (mean, device) in means[first..].iter_mut().zip(devices) {
            *mean += device.force_on_hand / fraction as f64;
        }
    }
    Ok(means)
}

/// Largest difference as a share of the largest reference force.
fn peak_error(forces: &[DVec3], reference: &[DVec3]) -> f64 {
    let peak = reference.iter().map(|force| force.length()).fold(0.0, f64::max);
    forces.iter().zip(reference).map(|(f, r)| (*f - *r).length()).fold(0.0, f64::max) / peak
}
