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
use palpate_mesh::box_mesh;
use palpate_testkit::{ElasticMaterial, half_extent, object_at, smoothstep};
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

/// Remaining motion when forces are read [1]: e^(−t/β) with t = 1 s.
const SETTLED: f64 = 1e-6;

/// Excess of the torsional stiffness with 2 × 2 and 4 × 4 quadratic elements on the section: they follow its warping, which is of fourth
/// degree.
const TWIST: f64 = 0.04;
const TWIST_FINE: f64 = 5e-3;

/// Clamps with 4, 9 and 16 cells, and the errors of the stretch and of the bend that they may have: tractions on cells are uniform,
/// those of a bend are linear.
const CELLS: [(usize, f64, f64); 3] = [(4, 1e-6, 5e-3), (9, 1e-6, 1e-3), (16, 1e-6, 3e-4)];

/// Bar of a length in halves of [`LENGTH`], with so many elements on a side of its section.
fn bar(halves: u32, section: u32) -> Result<Arc<Recording>, VerifyError> {
    let mesh = box_mesh([0.5 * LENGTH * f64::from(halves), WIDTH, WIDTH], [5 * halves, section, section])?;
    Ok(BAR.free_body(mesh, ElementOrder::Quadratic, 60)?)
}

/// Forces and torques of clamps with so many cells; and the torsion between two lengths, which leaves the ends out.
pub fn clamped_bar() -> Result<Vec<Check>, VerifyError> {
    let body = bar(2, 2)?;
    let (area, bending) = (WIDTH * WIDTH, WIDTH.powi(4) / 12.0);
    let torsion = 0.5 * YOUNG * TORSION * WIDTH.powi(4);
    let mut checks = Vec::new();
    let mut invariants = RunInvariants::default();
    for (max_cells, stretch, bend) in CELLS {
        let of = |what: &str| format!("at most {max_cells} cells: {what}");
        let force = stretched(&body, max_cells, &mut invariants)?;
        let exact = YOUNG * area / LENGTH * WAY;
        checks.push(Check::new(of("stretch against EA/L·u [N]"), force, exact, stretch));
        let moment = turned(&body, max_cells, &mut invariants, DVec3::Z)?;
        let exact = YOUNG * bending / LENGTH * ANGLE;
        checks.push(Check::new(of("bend against EI/L·θ [N·m]"), moment, exact, bend));
        let torque = turned(&body, max_cells, &mut invariants, DVec3::X)?;
        checks.push(Check::new(of("twist against GJ/L·θ [N·m]"), torque, torsion / LENGTH * ANGLE, TWIST));
    }
    let mut between = |section: u32| -> Result<f64, VerifyError> {
        let compliance = |torque: f64| ANGLE / torque;
        let short = turned(&bar(2, section)?, 16, &mut invariants, DVec3::X)?;
        let long = turned(&bar(3, section)?, 16, &mut invariants, DVec3::X)?;
        Ok(0.5 * LENGTH / (compliance(long) - compliance(short)))
    };
    let (coarse, fine) = (between(2)?, between(4)?);
    let off = |stiffness: f64| (stiffness / torsion - 1.0).abs();
    let check =
        Check::new("twist between two lengths, 4 × 4 on the section: GJ [N·m²]", fine, torsion, TWIST_FINE);
    checks.push(check.with_order(off(coarse), off(fine), 2.0, 3.0));
    checks.extend(invariants.checks("all"));
    Ok(checks)
}

/// Force of a stretch [N] at rest.
fn stretched(
    bar: &Arc<Recording>,
    max_cells: usize,
    invariants: &mut RunInvariants,
) -> Result<f64, VerifyError> {
    let half = half_extent(bar, 0);
    let frame = |side: f64, share: f64| Pose {
        position: DVec3::X * side * (half + 0.5 * WAY * share),
        ..Pose::IDENTITY
    };
    Ok(-held(bar, max_cells, invariants, frame)?.0.x)
}

/// Torque of clamps that turn against each other about an axis [N·m] at rest.
fn turned(
    bar: &Arc<Recording>,
    max_cells: usize,
    invariants: &mut RunInvariants,
    axis: DVec3,
) -> Result<f64, VerifyError> {
    let half = half_extent(bar, 0);
    let frame = |side: f64, share: f64| Pose {
        position: DVec3::X * (side * half),
        orientation: DQuat::from_axis_angle(axis, side * 0.5 * ANGLE * share),
    };
    Ok(-held(bar, max_cells, invariants, frame)?.1.dot(axis))
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
            |node: &u32| side * bar.surface.positions[*node as usize].x > 0.999 * half_extent(bar, 0);
        let triangles =
            (0..bar.surface.triangles.len() as u32).filter(|t| corners(t).iter().all(is_end)).collect();
        Clamp { max_cells, ..Clamp::new(0, triangles, frame(side, 0.0)) }
    };
    let clamps = vec![clamp(-1.0), clamp(1.0)];
    let parameters = ModelParameters { step_s: STEP, clamps, ..ModelParameters::for_reference() };
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
