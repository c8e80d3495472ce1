//! Waves in a block with ν = 0, which is a bar.

use crate::check::Check;
use crate::error::VerifyError;
use glam::DVec3;
use palpate::{
    DeviceInput, DeviceMode, DeviceParameters, Grasp, Input, Model, ModelParameters, State, SurfacePoint,
    step,
};
use palpate_fem::ElementOrder;
use palpate_mesh::box_mesh;
use palpate_testkit::{object_at, recorded, undamped};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

const LENGTH: f64 = 0.2;
const WIDTH: f64 = 0.05;
const YOUNG: f64 = 5e4;
const DENSITY: f64 = 1000.0;
const AMPLITUDE: f64 = 1e-3;
/// kL/2: halfway to the resonance at π/2, where the wave matters (tan 0.8 = 1.03, kL/2 alone gives 0.8).
const HALF_PHASE: f64 = 0.8;

/// Error of linear elements with 8 cells along the bar.
const MESH: f64 = 0.01;

/// Both end faces held at all their nodes and moved by u₀·sin ωt: the total force has the amplitude
/// 2EAk·tan(kL/2)·u₀, k = ω/c, c = √(E/ρ).
pub fn shaken_block() -> Result<Vec<Check>, VerifyError> {
    let wave_number = 2.0 * HALF_PHASE / LENGTH;
    let exact = 2.0 * YOUNG * WIDTH * WIDTH * wave_number * HALF_PHASE.tan() * AMPLITUDE;
    let omega = wave_number * (YOUNG / DENSITY).sqrt();
    let (coarse, fine) = (amplitude(4, omega)?, amplitude(8, omega)?);
    let quantity = "total force amplitude, 8×2×2 cells, linear [N]";
    let [first, second] = [coarse, fine].map(|computed| (computed / exact - 1.0).abs());
    Ok(vec![Check::new(quantity, fine, exact, MESH).with_order(first, second, 2.0, 2.0)])
}

/// Amplitude [N] of the total force in the fifth to eighth period after a smooth start of twelve.
fn amplitude(cells: u32, omega: f64) -> Result<f64, VerifyError> {
    const START_PERIODS: f64 = 12.0;
    const PERIODS: f64 = 20.0;
    let mesh = box_mesh([LENGTH, WIDTH, WIDTH], [cells, cells / 4, cells / 4])?;
    let body = recorded(mesh, &undamped(YOUNG, 0.0, DENSITY, ElementOrder::Linear, 60))?;
    let surface = &body.recording.surface;
    let mut grasps = Vec::new();
    for (node, position) in surface.positions.iter().enumerate() {
        if position.x.abs() > 0.49 * LENGTH {
            grasps.extend(node_point(&surface.triangles, node));
        }
    }
    let rest: Vec<DVec3> = grasps.iter().map(|point| surface.rest_position(point)).collect();
    let step_s = TAU / omega / 200.0;
    let parameters = ModelParameters {
        step_s,
        devices: vec![DeviceParameters::default(); grasps.len()],
        ..ModelParameters::for_reference()
    };
    let model = Model::new(parameters, vec![object_at(&Arc::new(body.recording), DVec3::ZERO, DVec3::ZERO)])?;
    let mut state = State::new(&model);
    let (mut in_phase, mut quadrature, mut count) = (0.0, 0.0, 0.0);
    for number in 1..=(PERIODS * 200.0) as usize {
        let phase = omega * number as f64 * step_s;
        let share = (phase / TAU / START_PERIODS).min(1.0);
        let soft = 0.5 - 0.5 * (PI * share).cos();
        let hand = DVec3::X * (AMPLITUDE * soft * phase.sin());
        let hold = |(point, rest): (&SurfacePoint, &DVec3)| DeviceInput {
            position: *rest + hand,
            mode: DeviceMode::Held(Grasp { object: 0, point: *point }),
        };
        let devices = grasps.iter().zip(&rest).map(hold).collect();
        let output = step(&model, &mut state, &Input { devices, ..Input::default() });
        let force: f64 = output.devices.iter().map(|device| device.force_on_hand.x).sum();
        if share == 1.0 {
            // The force is the mean over its step: it belongs to the step's middle.
            let middle = phase - 0.5 * omega * step_s;
            in_phase += force * middle.sin();
            quadrature += force * middle.cos();
            count += 0.5;
        }
    }
    Ok(f64::hypot(in_phase, quadrature) / count)
}

/// A surface node as a point: the corner of some triangle.
fn node_point(triangles: &[[u32; 3]], node: usize) -> Option<SurfacePoint> {
    let number = triangles.iter().position(|corners| corners.contains(&(node as u32)))?;
    let weights = triangles[number].map(|corner| f64::from(u8::from(corner == node as u32)));
    Some(SurfacePoint { triangle: number as u32, weights })
}
