//! A finger that sticks does what a hand does that holds: the same three rows, by two routes.

use super::Check;
use super::scene::{PAPER, Stuff, Watch, at, scene};
use crate::Failure;
use glam::DVec3;
use palpate::{DeviceInput, DeviceParameters, Grasp, Input, Recording, State, step};
use palpate_fem::element::Order;
use palpate_fem::mesh::box_mesh;
use std::sync::Arc;

const STEPS: usize = 400;
const JELLY: Stuff = Stuff { beta: 2e-4, ..PAPER };

/// Into the upper face and aside, by smooth ramps [m].
fn way(number: usize) -> DVec3 {
    let s = number as f64 / STEPS as f64;
    let smooth = s * s * (3.0 - 2.0 * s);
    DVec3::new(0.002 * smooth, -0.006 * smooth, 0.001 * smooth)
}

/// Force on the hand [N], one a step: touching, or holding the point below where the tip starts.
fn forces(body: &Arc<Recording>, held: bool, watch: &mut Watch) -> Result<Vec<DVec3>, Failure> {
    // A point has a tip of a thousandth of an edge: a touch needs a side from which it comes.
    let tip = 1e-3 * body.surface.mean_edge();
    let top = body.surface.positions.iter().map(|p| p.y).fold(f64::NEG_INFINITY, f64::max);
    let Some((point, _)) = body.surface.nearest(DVec3::Y * top) else {
        return Err(Failure("the cube has no surface".into()));
    };
    let rest = body.surface.rest_position(&point);
    let finger = DeviceParameters { friction: 5.0, ..DeviceParameters::default() };
    let model = scene(1e-3, DVec3::ZERO, Vec::new(), vec![finger], vec![at(body, DVec3::ZERO, DVec3::ZERO)])?;
    let mut state = State::new(&model);
    watch.look(state.output());
    let forces = (1..=STEPS).map(|number| {
        let device = if held {
            DeviceInput::held(rest + way(number), Grasp { object: 0, point })
        } else {
            DeviceInput::touching(rest + DVec3::Y * tip + way(number))
        };
        let output = step(&model, &mut state, &Input { devices: vec![device], ..Input::default() });
        watch.look(output);
        output.devices[0].force_on_hand
    });
    Ok(forces.collect())
}

/// The same path by touch and by hold.
pub fn fingers_hold() -> Result<Vec<Check>, Failure> {
    /// Where a contact is met to a thousandth of an edge, its normal turns that by some degrees.
    const SAME: f64 = 1e-4;
    let body = JELLY.standing(box_mesh([0.1; 3], [8; 3])?, Order::Linear, 100, |node| node.y < -0.0499)?;
    let mut watch = Watch::default();
    let held = forces(&body, true, &mut watch)?;
    let mut checks = Vec::from(watch.checks("held"));
    let mut watch = Watch::default();
    let touching = forces(&body, false, &mut watch)?;
    checks.extend(watch.checks("touching"));
    let largest = held.iter().map(|f| f.length()).fold(0.0, f64::max);
    let apart = held.iter().zip(&touching).map(|(a, b)| (*a - *b).length()).fold(0.0, f64::max);
    checks.push(Check::new("force of a finger that sticks against a hand that holds, share", apart / largest, 0.0, SAME));
    let sideways = held.iter().zip(&touching).map(|(a, b)| (a.x - b.x).abs()).fold(0.0, f64::max);
    checks.push(Check::new("the same along the surface, share", sideways / largest, 0.0, SAME));
    Ok(checks)
}
