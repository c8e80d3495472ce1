//! The pinch: two opposite face centres of the paper's cube moved in by 5 mm within 50 ms and held.

use crate::check::Check;
use crate::error::VerifyError;
use crate::reference::{PINCH_1_MS, column};
use glam::DVec3;
use palpate::{DeviceInput, DeviceParameters, Grasp, Input, Model, ModelParameters, Recording, State, step};
use palpate_fem::paper_cube::{self, CELLS};
use palpate_fem::{RecordParameters, ResidualChoice};
use palpate_testkit::{object_at, recorded, smoothstep};
use std::sync::Arc;

/// Errors of the force that were found independently with so many modes and S.
const ERRORS: [(usize, f64); 3] = [(50, 0.0019), (100, 0.0017), (200, 0.0012)];

/// Half a unit in the last digit of [`ERRORS`].
const HALF_DIGIT: f64 = 0.5e-4;

/// Force at the end with all modes [N].
const FORCE_AT_END_N: f64 = 0.17639;

/// Tolerance of it with 200 modes + S: some times the error of the whole curve.
const FORCE_AT_END: f64 = 0.003;

/// Error without S that was found independently, to three digits.
const ERROR_WITHOUT_RESIDUAL: f64 = 1.79;

/// Its last digit, 0.01, as a share of it.
const LAST_DIGIT: f64 = 0.005;

/// Tolerance of the certified error without S: the certificate's loads are others than this one.
const CERTIFICATE: f64 = 0.3;

/// Force on the left node of each step [N].
fn pinched(recording: Recording, steps: usize) -> Result<Vec<f64>, VerifyError> {
    const REACH: f64 = 0.05;
    let surface = &recording.surface;
    let grasps =
        [-REACH, REACH].map(|x| surface.nearest(DVec3::X * x).map(|(point, _)| Grasp { object: 0, point }));
    let parameters =
        ModelParameters { devices: vec![DeviceParameters::default(); 2], ..ModelParameters::for_reference() };
    let model = Model::new(parameters, vec![object_at(&Arc::new(recording), DVec3::ZERO, DVec3::ZERO)])?;
    let mut state = State::new(&model);
    let forces = (1..=steps).map(|number| {
        let inward = 0.005 * smoothstep(number as f64 / 50.0);
        let hand = |side: f64, grasp: Option<Grasp>| DeviceInput {
            position: DVec3::X * side * (REACH - inward),
            mode: grasp.into(),
        };
        let input = Input { devices: vec![hand(-1.0, grasps[0]), hand(1.0, grasps[1])], ..Input::default() };
        -step(&model, &mut state, &input).devices[0].force_on_hand.x
    });
    Ok(forces.collect())
}

/// √(Σ|f − r|²/Σ|r|²).
fn apart(forces: &[f64], reference: &[f64]) -> f64 {
    let difference: f64 = forces.iter().zip(reference).map(|(f, r)| (f - r).powi(2)).sum();
    (difference / reference.iter().map(|r| r * r).sum::<f64>()).sqrt()
}

/// Modes with residual compliance against all modes; and modes alone, whose error the certificate has to show.
pub fn pinch() -> Result<Vec<Check>, VerifyError> {
    // Force on the left node with all modes [N], one a step.
    let reference = column(PINCH_1_MS, 1);
    let mut checks = Vec::new();
    for (modes, error) in ERRORS {
        let body = recorded(paper_cube::mesh(CELLS)?, &paper_cube::parameters(CELLS, modes))?;
        let certified = body.recording.metadata.certificate.as_ref().map_or(f64::NAN, |c| c.force_error_max);
        let forces = pinched(body.recording, reference.len())?;
        let quantity = format!("force over 1 s, {modes} modes + S, error");
        checks.push(Check::new(quantity, apart(&forces, &reference), 0.0, error + HALF_DIGIT));
        let quantity = format!("certified force error is no less, {modes} modes + S (shortfall)");
        checks.push(Check::new(quantity, (apart(&forces, &reference) - certified).max(0.0), 0.0, 0.0));
        if modes == 200 {
            let last = forces.last().copied().unwrap_or(f64::NAN);
            checks.push(Check::new(
                "force at the end, 200 modes + S [N]",
                last,
                FORCE_AT_END_N,
                FORCE_AT_END,
            ));
        }
    }
    let alone = RecordParameters { residual: ResidualChoice::None, ..paper_cube::parameters(CELLS, 200) };
    let body = recorded(paper_cube::mesh(CELLS)?, &alone)?;
    let certified = body.recording.metadata.certificate.as_ref().map_or(f64::NAN, |c| c.force_error_max);
    let error = apart(&pinched(body.recording, reference.len())?, &reference);
    checks.push(Check::new("error of 200 modes without S", error, ERROR_WITHOUT_RESIDUAL, LAST_DIGIT));
    checks.push(Check::new("the same as the certificate shows it", certified, error, CERTIFICATE));
    Ok(checks)
}
