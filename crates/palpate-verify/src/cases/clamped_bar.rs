//! A square bar between two clamps that stretch, twist and bend it.
//!
//! ```text
//! F = E·A/L·u        M_t = G·J/L·θ,  J = 0.1406·a⁴        M_b = E·I/L·θ,  I = a⁴/12
//! ```
//!
//! (Timoshenko & Goodier, *Theory of Elasticity*, articles 102 and 109.) With ν = 0 stretch and bending are exact on quadratic elements.

use crate::check::Check;
use crate::error::VerifyError;
use crate::run_invariants::RunInvariants;
use glam::{DQuat, DVec3};
use palpate::{Clamp, Input, Model, ModelParameters, Pose, Recording, State, step};
use palpate_fem::ElementOrder;
use palpate_fem::mesh::box_mesh;
use palpate_testkit::{ElasticMaterial, object_at, smoothstep};
use std::sync::Arc;

const LENGTH: f64 = 0.3;
const WIDTH: f64 = 0.03;
const YOUNG: f64 = 1e5;
/// β at which the lowest bending mode is near critical damping, so that the bar is at rest after some of them.
const BAR: ElasticMaterial =
    ElasticMaterial { young_pa: YOUNG, poisson: 0.0, density_kg_m3: 1000.0, stiffness_damping_s: 0.05 };
const TORSION: f64 = 0.1406;

/// Way [m] and angle [rad]: small, since strain is linear.
const WAY: f64 = 1e-4;
const ANGLE: f64 = 1e-3;

/// What is left of the motion when forces are read [1]: e^(−t/β) with t = 1 s.
const SETTLED: f64 = 1e-6;

/// Forces and torques of clamps with so many cells.
pub fn clamped_bar() -> Result<Vec<Check>, VerifyError> {
    /// Excess of the torsional stiffness: quadratic elements, 4 × 4 on the section, and warping that the ends restrain over about a
    /// width each.
    const TWIST: f64 = 0.04;
    let body = |cells: u32| {
        BAR.free_body(
            box_mesh([LENGTH, WIDTH, WIDTH], [5 * cells, cells, cells])?,
            ElementOrder::Quadratic,
            60,
        )
        .map_err(VerifyError::from)
    };
    let bar = body(2)?;
    let (area, bending) = (WIDTH * WIDTH, WIDTH.powi(4) / 12.0);
    let mut checks = Vec::new();
    let mut invariants = RunInvariants::default();
    for (max_cells, stretch, bend) in [(4, 1e-3, 0.3), (9, 1e-3, 0.05), (16, 1e-3, 0.05)] {
        let [force, torque, moment] = reactions(&bar, max_cells, &mut invariants)?;
        let exact = YOUNG * area / LENGTH * WAY;
        checks.push(Check::new(
            format!("stretch, {max_cells} cells: force against EA/L·u [N]"),
            force,
            exact,
            stretch,
        ));
        let exact = YOUNG * bending / LENGTH * ANGLE;
        checks.push(Check::new(
            format!("bend, {max_cells} cells: moment against EI/L·θ [N·m]"),
            moment,
            exact,
            bend,
        ));
        let exact = 0.5 * YOUNG * TORSION * WIDTH.powi(4) / LENGTH * ANGLE;
        checks.push(Check::new(
            format!("twist, {max_cells} cells: torque against GJ/L·θ [N·m]"),
            torque,
            exact,
            TWIST,
        ));
    }
    checks.extend(invariants.checks("all"));
    Ok(checks)
}

/// Force of a stretch [N], torque of a twist and moment of a bend [N·m] at rest.
fn reactions(
    bar: &Arc<Recording>,
    max_cells: usize,
    invariants: &mut RunInvariants,
) -> Result<[f64; 3], VerifyError> {
    let stretched = held(bar, max_cells, invariants, |side, share| Pose {
        position: DVec3::X * side * 0.5 * (LENGTH + WAY * share),
        ..Pose::IDENTITY
    })?;
    let turned = |axis: DVec3| {
        move |side: f64, share: f64| Pose {
            position: DVec3::X * (side * 0.5 * LENGTH),
            orientation: DQuat::from_axis_angle(axis, side * 0.5 * ANGLE * share),
        }
    };
    let twisted = held(bar, max_cells, invariants, turned(DVec3::X))?;
    let bent = held(bar, max_cells, invariants, turned(DVec3::Z))?;
    Ok([-stretched.0.x, -twisted.1.x, -bent.1.z])
}

/// Reaction force [N] and torque [N·m] on the clamp at x = +L/2, at rest. `frame` has the side, ±1, and the share of the way.
fn held(
    bar: &Arc<Recording>,
    max_cells: usize,
    invariants: &mut RunInvariants,
    frame: impl Fn(f64, f64) -> Pose,
) -> Result<(DVec3, DVec3), VerifyError> {
    const STEPS: u32 = 1500;
    const STEP: f64 = 1e-3;
    let clamp = |side: f64| {
        let corners = |t: &u32| bar.surface.triangles[*t as usize];
        let is_end =
            |t: &u32| corners(t).iter().all(|n| side * bar.surface.positions[*n as usize].x > 0.499 * LENGTH);
        let triangles = (0..bar.surface.triangles.len() as u32).filter(is_end).collect();
        Clamp { max_cells, ..Clamp::new(0, triangles, frame(side, 0.0)) }
    };
    let clamps = vec![clamp(-1.0), clamp(1.0)];
    let parameters = ModelParameters { step_s: STEP, clamps, ..ModelParameters::default() };
    let model = Model::new(parameters, vec![object_at(bar, DVec3::ZERO, DVec3::ZERO)])?;
    let mut state = State::new(&model);
    let (mut before, mut last) = (f64::NAN, f64::NAN);
    for number in 1..=STEPS {
        let share = smoothstep(f64::from(number) * STEP / 0.3);
        let clamps = vec![frame(-1.0, share), frame(1.0, share)];
        let output = step(&model, &mut state, &Input { clamps, ..Input::default() });
        invariants.observe(output);
        (before, last) = (last, output.clamps[1].force.length() + output.clamps[1].torque.length() / WIDTH);
    }
    if (last / before - 1.0).abs() > SETTLED {
        return Err(VerifyError::NotReached("rest of the clamped bar"));
    }
    let clamp = state.output().clamps[1];
    Ok((clamp.force, clamp.torque))
}
