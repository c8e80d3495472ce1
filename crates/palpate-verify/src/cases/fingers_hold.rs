//! A sticking finger against a held point: the same three constraint rows, assembled by two routes.

use crate::check::Check;
use crate::error::VerifyError;
use crate::run_invariants::RunInvariants;
use glam::DVec3;
use palpate::{DeviceInput, DeviceParameters, Grasp, Input, Recording, State, step};
use palpate_fem::{ElementOrder, paper_cube};
use palpate_testkit::{ElasticMaterial, PAPER_MATERIAL, object_at, scene, smoothstep};
use std::sync::Arc;

const STEPS: usize = 400;
/// Least tip radius, in mean edges of the surface: a touch needs a side from which it comes.
const LEAST_TIP: f64 = 1e-3;

/// Largest rotation of the contact normal [rad] with which the estimate below holds.
const NORMAL_ROTATION: f64 = 0.1;

const JELLY: ElasticMaterial = ElasticMaterial { stiffness_damping_s: 2e-4, ..PAPER_MATERIAL };

/// Displacement of the hand into the upper face and aside [m]; zero in the first step, where the contact of the finger begins.
fn displacement(number: usize) -> DVec3 {
    DVec3::new(0.002, -0.006, 0.001) * smoothstep(number as f64 / STEPS as f64)
}

/// Force on the hand of each step [N], touching, or holding the point below the tip's start; and the rotation of the contact
/// normal [rad].
fn forces(
    body: &Arc<Recording>,
    held: bool,
    invariants: &mut RunInvariants,
) -> Result<(Vec<DVec3>, f64), VerifyError> {
    let tip = LEAST_TIP * body.surface.mean_edge();
    let top = body.surface.positions.iter().map(|p| p.y).fold(f64::NEG_INFINITY, f64::max);
    let Some((point, _)) = body.surface.nearest(DVec3::Y * top) else {
        return Err(VerifyError::NotReached("the cube has no surface"));
    };
    let rest = body.surface.rest_position(&point);
    let finger = DeviceParameters { friction: 5.0, ..DeviceParameters::default() };
    let model =
        scene(1e-3, DVec3::ZERO, Vec::new(), vec![finger], vec![object_at(body, DVec3::ZERO, DVec3::ZERO)])?;
    let mut state = State::new(&model);
    invariants.observe(state.output());
    let mut turned = 0.0_f64;
    let forces: Vec<DVec3> = (0..=STEPS)
        .map(|number| {
            let device = if held {
                DeviceInput::held(rest + displacement(number), Grasp { object: 0, point })
            } else {
                DeviceInput::touching(rest + DVec3::Y * tip + displacement(number))
            };
            let output = step(&model, &mut state, &Input { devices: vec![device], ..Input::default() });
            invariants.observe(output);
            turned = output
                .contacts
                .iter()
                .map(|contact| (contact.normal - DVec3::Y).length())
                .fold(turned, f64::max);
            output.devices[0].force_on_hand
        })
        .collect();
    Ok((forces, turned))
}

/// One path by touch and by hold.
pub fn fingers_hold() -> Result<Vec<Check>, VerifyError> {
    let body = JELLY.fixed_body(paper_cube::mesh(8)?, ElementOrder::Linear, 100, |node| node.y < -0.0499)?;
    let mut invariants = RunInvariants::default();
    let (held, _) = forces(&body, true, &mut invariants)?;
    let mut checks = Vec::from(invariants.checks("held"));
    let mut invariants = RunInvariants::default();
    let (touching, turned) = forces(&body, false, &mut invariants)?;
    checks.extend(invariants.checks("touching"));
    // The tip stands on the point along the normal. As that turns, the point is moved by a share of the tip's radius.
    // A move from step to step and back counts twice, and within a step a point is 1.6 times as stiff as at rest. A place
    // is also kept while it is off by a ten-thousandth of an edge, and beside its node a point is stiffer by up to
    // twice that share.
    let same = turned * LEAST_TIP * body.surface.mean_edge() / displacement(STEPS).length();
    let allowed = 3.2 * same + 2e-4;
    checks.push(Check::new(
        "normal turns, where the surface bends beside the indentation [rad]",
        turned,
        0.0,
        NORMAL_ROTATION,
    ));
    let largest = held.iter().map(|f| f.length()).fold(0.0, f64::max);
    let apart = held.iter().zip(&touching).map(|(a, b)| (*a - *b).length()).fold(0.0, f64::max);
    checks.push(Check::new(
        "force of a finger that sticks against a hand that holds, share",
        apart / largest,
        0.0,
        allowed,
    ));
    let sideways = held.iter().zip(&touching).map(|(a, b)| (a.x - b.x).abs()).fold(0.0, f64::max);
    checks.push(Check::new("the same along the surface, share", sideways / largest, 0.0, allowed));
    Ok(checks)
}
