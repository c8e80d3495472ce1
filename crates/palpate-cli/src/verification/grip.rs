//! A finger that sticks does what a hand does that holds: the same three rows, by two routes.

use super::scene::{PAPER, Stuff, Watch, at, scene};
use super::{Check, smooth};
use crate::Failure;
use glam::DVec3;
use palpate::{DeviceInput, DeviceParameters, Grasp, Input, Recording, State, step};
use palpate_fem::element::Order;
use palpate_fem::mesh::box_mesh;
use std::sync::Arc;

const STEPS: usize = 400;
/// Of a tip, in mean edges of the surface: a touch needs a side from which it comes.
const LEAST_TIP: f64 = 1e-3;

const JELLY: Stuff = Stuff { beta: 2e-4, ..PAPER };

/// Into the upper face and aside, by smooth ramps [m]; the first step is at rest, for the finger begins where it is then.
fn way(number: usize) -> DVec3 {
    DVec3::new(0.002, -0.006, 0.001) * smooth(number as f64 / STEPS as f64)
}

/// Force on the hand [N], one a step: touching, or holding the point below where the tip starts. And by how much the
/// normal of the touch turned [rad].
fn forces(body: &Arc<Recording>, held: bool, watch: &mut Watch) -> Result<(Vec<DVec3>, f64), Failure> {
    let tip = LEAST_TIP * body.surface.mean_edge();
    let top = body.surface.positions.iter().map(|p| p.y).fold(f64::NEG_INFINITY, f64::max);
    let Some((point, _)) = body.surface.nearest(DVec3::Y * top) else {
        return Err(Failure("the cube has no surface".into()));
    };
    let rest = body.surface.rest_position(&point);
    let finger = DeviceParameters { friction: 5.0, ..DeviceParameters::default() };
    let model = scene(1e-3, DVec3::ZERO, Vec::new(), vec![finger], vec![at(body, DVec3::ZERO, DVec3::ZERO)])?;
    let mut state = State::new(&model);
    watch.look(state.output());
    let mut turned = 0.0_f64;
    let forces: Vec<DVec3> = (0..=STEPS)
        .map(|number| {
            let device = if held {
                DeviceInput::held(rest + way(number), Grasp { object: 0, point })
            } else {
                DeviceInput::touching(rest + DVec3::Y * tip + way(number))
            };
            let output = step(&model, &mut state, &Input { devices: vec![device], ..Input::default() });
            watch.look(output);
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

/// The same path by touch and by hold.
pub fn fingers_hold() -> Result<Vec<Check>, Failure> {
    let body = JELLY.standing(box_mesh([0.1; 3], [8; 3])?, Order::Linear, 100, |node| node.y < -0.0499)?;
    let mut watch = Watch::default();
    let (held, _) = forces(&body, true, &mut watch)?;
    let mut checks = Vec::from(watch.checks("held"));
    let mut watch = Watch::default();
    let (touching, turned) = forces(&body, false, &mut watch)?;
    checks.extend(watch.checks("touching"));
    // The tip stands on the point along the normal. As that turns, the point is moved by a share of the tip's radius.
    // A move from step to step and back counts twice, and within a step a point is 1.6 times as stiff as at rest. A place
    // is also kept while it is off by a ten-thousandth of an edge, and beside its node a point is stiffer by up to
    // twice that share.
    let same = turned * LEAST_TIP * body.surface.mean_edge() / way(STEPS).length();
    let allowed = 3.2 * same + 2e-4;
    checks.push(Check::new("normal turns, where the surface bends beside the dent [rad]", turned, 0.0, 0.1));
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
