//! A bar with ν = 0 whose base is shaken along it.

use crate::check::Check;
use crate::error::VerifyError;
use crate::run_invariants::RunInvariants;
use glam::DVec3;
use palpate::{Input, Model, ModelParameters, State, step};
use palpate_fem::ElementOrder;
use palpate_mesh::box_mesh;
use palpate_testkit::{ElasticMaterial, object_at};
use std::f64::consts::{PI, TAU};

const LENGTH: f64 = 0.2;
const WIDTH: f64 = 0.05;
const BAR: ElasticMaterial =
    ElasticMaterial { young_pa: 5e4, poisson: 0.0, density_kg_m3: 1000.0, stiffness_damping_s: 0.0 };
const AMPLITUDE: f64 = 1e-3;

/// kL below the resonance at π/2, and above it, where the end moves against the base.
const PHASES: [f64; 2] = [0.8, 2.2];

/// Error of linear elements with 16 cells along the bar: the wave number is off by (kL/16)²/24.
const MESH: f64 = 8e-4;

/// Amplitude of the free end over that of the base, in space: 1/cos(kL), k = ω/c, c = √(E/ρ).
pub fn shaken_base() -> Result<Vec<Check>, VerifyError> {
    let mut invariants = RunInvariants::default();
    let mut checks = Vec::new();
    for phase in PHASES {
        let omega = phase / LENGTH * (BAR.young_pa / BAR.density_kg_m3).sqrt();
        let exact = 1.0 / phase.cos();
        let (coarse, fine) =
            (transmissibility(8, omega, &mut invariants)?, transmissibility(16, omega, &mut invariants)?);
        let [first, second] = [coarse, fine].map(|computed| (computed / exact - 1.0).abs());
        let quantity = format!("end over base at kL = {phase}, 16×4×4 cells, linear");
        checks.push(Check::new(quantity, fine, exact, MESH).with_order(first, second, 2.0, 2.0));
    }
    checks.extend(invariants.checks("all"));
    Ok(checks)
}

/// Motion of the end over that of the base in the thirteenth to twentieth period, after a smooth start of twelve.
fn transmissibility(cells: u32, omega: f64, invariants: &mut RunInvariants) -> Result<f64, VerifyError> {
    const START_PERIODS: f64 = 12.0;
    const PERIODS: f64 = 20.0;
    const STEPS: f64 = 200.0;
    let mesh = box_mesh([LENGTH, WIDTH, WIDTH], [cells, cells / 4, cells / 4])?;
    let body = BAR.fixed_body(mesh, ElementOrder::Linear, 60, |x| x.x < -0.499 * LENGTH)?;
    let (end, _) =
        body.surface.nearest(DVec3::X * 0.5 * LENGTH).ok_or(VerifyError::NotReached("no surface"))?;
    let step_s = TAU / omega / STEPS;
    let parameters = ModelParameters { step_s, ..ModelParameters::for_reference() };
    let model = Model::new(parameters, vec![object_at(&body, DVec3::ZERO, DVec3::ZERO)])?;
    let mut state = State::new(&model);
    invariants.observe(state.output());
    let (mut of_end, mut of_base) = (0.0, 0.0);
    for number in 1..=(PERIODS * STEPS) as usize {
        // The base is half a step behind what is given.
        let (phase, given) = (omega * number as f64 * step_s, omega * (number as f64 + 0.5) * step_s);
        let soft = 0.5 - 0.5 * (PI * (given / TAU / START_PERIODS).min(1.0)).cos();
        let base = DVec3::X * (AMPLITUDE * soft * given.sin());
        let output = step(&model, &mut state, &Input { bases: vec![Some(base)], ..Input::default() });
        invariants.observe(output);
        if phase > TAU * START_PERIODS {
            let base = output.objects[0].pose.position.x;
            let end = base + state.point_displacement(&model, 0, &end).x;
            of_end += end * phase.sin();
            of_base += base * phase.sin();
        }
    }
    Ok(of_end / of_base)
}
