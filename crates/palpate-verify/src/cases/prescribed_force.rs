//! A bar with ν = 0 that is fixed at one end, under a prescribed force at the other.

use crate::check::Check;
use crate::error::VerifyError;
use crate::run_invariants::RunInvariants;
use glam::DVec3;
use palpate::{
    AppliedForce, DeviceInput, DeviceParameters, Grasp, Input, Model, ModelParameters, State, Surface,
    SurfacePoint, step,
};
use palpate_fem::ElementOrder;
use palpate_mesh::box_mesh;
use palpate_testkit::{ElasticMaterial, object_at};
use std::f64::consts::{PI, TAU};

const LENGTH: f64 = 0.2;
const WIDTH: f64 = 0.05;
const BAR: ElasticMaterial =
    ElasticMaterial { young_pa: 5e4, poisson: 0.0, density_kg_m3: 1000.0, stiffness_damping_s: 0.0 };
const FORCE: f64 = 0.05;

/// kL: where the wave matters, halfway to the resonance at π/2 (tan 0.8 = 1.03).
const PHASE: f64 = 0.8;

/// Steps in a period.
const STEPS: f64 = 200.0;

/// Error of linear elements with 8 cells along the bar: kL/8 = 0.1 a cell, so the wave number is off by 0.1²/24.
const MESH: f64 = 5e-4;

/// Traction over the free end, F·sin ωt in all: the end swings by F·tan(kL)/(EAk), k = ω/c, c = √(E/ρ).
pub fn prescribed_force() -> Result<Vec<Check>, VerifyError> {
    let wave_number = PHASE / LENGTH;
    let exact = FORCE * PHASE.tan() / (BAR.young_pa * WIDTH * WIDTH * wave_number);
    let omega = wave_number * (BAR.young_pa / BAR.density_kg_m3).sqrt();
    // A held sine has the amplitude sin(x)/x at its frequency, x = ωh/2.
    let half_turn = PI / STEPS;
    let exact = exact * half_turn.sin() / half_turn;
    let mut invariants = RunInvariants::default();
    let (coarse, fine) = (amplitude(4, omega, &mut invariants)?, amplitude(8, omega, &mut invariants)?);
    let [first, second] = [coarse, fine].map(|computed| (computed / exact - 1.0).abs());
    let swing = Check::new("amplitude of the end, 8×2×2 cells, linear [m]", fine, exact, MESH);
    let mut checks = vec![swing.with_order(first, second, 2.0, 2.0)];
    checks.extend(invariants.checks("both meshes"));
    Ok(checks)
}

/// Amplitude [m] of the end's mean displacement in the thirteenth to twentieth period, after a smooth start of twelve.
fn amplitude(cells: u32, omega: f64, invariants: &mut RunInvariants) -> Result<f64, VerifyError> {
    const START_PERIODS: f64 = 12.0;
    const PERIODS: f64 = 20.0;
    let mesh = box_mesh([LENGTH, WIDTH, WIDTH], [cells, cells / 4, cells / 4])?;
    let body = BAR.fixed_body(mesh, ElementOrder::Linear, 60, |x| x.x < -0.499 * LENGTH)?;
    let shares = end_shares(&body.surface);
    let step_s = TAU / omega / STEPS;
    let parameters = ModelParameters {
        step_s,
        devices: vec![DeviceParameters::default(); shares.len()],
        ..ModelParameters::for_reference()
    };
    let model = Model::new(parameters, vec![object_at(&body, DVec3::ZERO, DVec3::ZERO)])?;
    let mut state = State::new(&model);
    invariants.observe(state.output());
    let (mut in_phase, mut quadrature, mut count) = (0.0, 0.0, 0.0);
    for number in 1..=(PERIODS * STEPS) as usize {
        let phase = omega * number as f64 * step_s;
        // A held force belongs to the middle of its step.
        let middle = phase - 0.5 * omega * step_s;
        let share = (middle / TAU / START_PERIODS).min(1.0);
        let soft = 0.5 - 0.5 * (PI * share).cos();
        let force = DVec3::X * (FORCE * soft * middle.sin());
        let exert = |(point, share): &(SurfacePoint, f64)| {
            let grasp = Grasp { object: 0, point: *point };
            DeviceInput::exerting(AppliedForce { grasp, force: force * *share })
        };
        let devices = shares.iter().map(exert).collect();
        let output = step(&model, &mut state, &Input { devices, ..Input::default() });
        invariants.observe(output);
        let end = output.devices.iter().zip(&shares);
        let moved: f64 = end.map(|(device, (_, share))| share * (device.proxy.x - 0.5 * LENGTH)).sum();
        if share == 1.0 {
            in_phase += moved * phase.sin();
            quadrature += moved * phase.cos();
            count += 0.5;
        }
    }
    Ok(f64::hypot(in_phase, quadrature) / count)
}

/// Nodes of the free end with the share of a uniform traction that each takes: a third of its triangles' areas.
fn end_shares(surface: &Surface) -> Vec<(SurfacePoint, f64)> {
    let is_end = |node: &u32| surface.positions[*node as usize].x > 0.499 * LENGTH;
    let mut areas = vec![0.0; surface.positions.len()];
    for corners in surface.triangles.iter().filter(|corners| corners.iter().all(is_end)) {
        let [a, b, c] = corners.map(|node| surface.positions[node as usize]);
        let area = 0.5 * (b - a).cross(c - a).length() / (WIDTH * WIDTH);
        corners.iter().for_each(|&node| areas[node as usize] += area / 3.0);
    }
    let point = |(node, &share): (usize, &f64)| {
        let number = surface.triangles.iter().position(|corners| corners.contains(&(node as u32)))?;
        let weights = surface.triangles[number].map(|corner| f64::from(u8::from(corner == node as u32)));
        (share > 0.0).then_some((SurfacePoint { triangle: number as u32, weights }, share))
    };
    areas.iter().enumerate().filter_map(point).collect()
}
