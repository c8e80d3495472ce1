//! The pinch: two opposite face centres of the paper's cube moved in by 5 mm within 50 ms and held.

use super::{Check, column, recorded, smooth};
use crate::Failure;
use crate::commands::demo::paper_cube;
use glam::DVec3;
use palpate::{
    DeviceInput, DeviceParameters, Grasp, Input, Model, ModelObject, ModelParameters, ObjectStart, Pose,
    Recording, State, Twist, step,
};
use palpate_fem::mesh::box_mesh;
use palpate_fem::record::RecordParameters;
use palpate_fem::residual::ResidualChoice;
use std::sync::Arc;

const REFERENCE: &str = include_str!("../../../../data/reference/pinch_full_1ms.csv");

/// Force on the left node [N].
fn pinched(recording: Recording, steps: usize) -> Result<Vec<f64>, Failure> {
    const REACH: f64 = 0.05;
    let surface = &recording.surface;
    let grasps =
        [-REACH, REACH].map(|x| surface.nearest(DVec3::X * x).map(|(point, _)| Grasp { object: 0, point }));
    let start = ObjectStart { pose: Pose::IDENTITY, twist: Twist::ZERO };
    let parameters =
        ModelParameters { devices: vec![DeviceParameters::default(); 2], ..ModelParameters::default() };
    let model = Model::new(parameters, vec![ModelObject::new(Arc::new(recording), start)])?;
    let mut state = State::new(&model);
    let forces = (1..=steps).map(|number| {
        let inward = 0.005 * smooth(number as f64 / 50.0);
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

/// Modes with residual compliance against all modes; modes alone, whose error the certificate must show.
pub fn pinch() -> Result<Vec<Check>, Failure> {
    // Force on the left node with all modes [N], one a step.
    let reference = column(REFERENCE, 1);
    let mut checks = Vec::new();
    // The errors found independently, with half a digit.
    for (modes, error) in [(50, 0.0019), (100, 0.0017), (200, 0.0012)] {
        let body = recorded(box_mesh([0.1; 3], [12; 3])?, &paper_cube(12, modes))?;
        let certified = body.recording.metadata.certificate.as_ref().map_or(f64::NAN, |c| c.force_error_max);
        let forces = pinched(body.recording, reference.len())?;
        let quantity = format!("force over 1 s, {modes} modes + S, error");
        checks.push(Check::new(quantity, apart(&forces, &reference), 0.0, error + 0.5e-4));
        let quantity = format!("certified force error is no less, {modes} modes + S (shortfall)");
        checks.push(Check::new(quantity, (apart(&forces, &reference) - certified).max(0.0), 0.0, 0.0));
        if modes == 200 {
            let last = forces.last().copied().unwrap_or(f64::NAN);
            checks.push(Check::new("force at the end, 200 modes + S [N]", last, 0.17639, 0.003));
        }
    }
    let alone = RecordParameters { residual: ResidualChoice::None, ..paper_cube(12, 200) };
    let body = recorded(box_mesh([0.1; 3], [12; 3])?, &alone)?;
    let certified = body.recording.metadata.certificate.as_ref().map_or(f64::NAN, |c| c.force_error_max);
    let error = apart(&pinched(body.recording, reference.len())?, &reference);
    checks.push(Check::new("error of 200 modes without S", error, 1.79, 0.005));
    checks.push(Check::new("the same as the certificate shows it", certified, error, 0.3));
    Ok(checks)
}
