//! The paper's cube falls flat on a frictionless floor, and lies on one.

use super::Check;
use super::scene::{G, PAPER, Stuff, Watch, at, floor, scene};
use crate::Failure;
use glam::DVec3;
use palpate::{Input, Recording, State, step};
use palpate_fem::element::Order;
use palpate_fem::mesh::box_mesh;
use std::sync::Arc;

const AT_1_MS: &str = include_str!("../../../../data/reference/bounce_full_1ms.csv");
const AT_2_MS: &str = include_str!("../../../../data/reference/bounce_full_2ms.csv");

/// Height of the fall [m].
const DROP: f64 = 0.05;
/// Before the second contact [s].
const FIRST_JUMP: f64 = 0.29;

fn column(reference: &str, number: usize) -> Vec<f64> {
    reference.lines().skip(1).filter_map(|row| row.split(',').nth(number)?.parse().ok()).collect()
}

/// A fall: height of the lower face of the undeformed frame [m] and energy over that of the floor [J], one a step.
struct Fall {
    heights: Vec<f64>,
    energies: Vec<f64>,
    watch: Watch,
}

fn fall(recording: &Arc<Recording>, step_s: f64, seconds: f64) -> Result<Fall, Failure> {
    let objects = vec![at(recording, DVec3::Y * (DROP + 0.05), DVec3::ZERO)];
    let model = scene(step_s, DVec3::Y * -G, vec![floor(0.0)], Vec::new(), objects)?;
    let mut state = State::new(&model);
    let mut fall = Fall { heights: Vec::new(), energies: Vec::new(), watch: Watch::default() };
    fall.watch.look(state.output());
    for _ in 0..(seconds / step_s).round() as usize {
        let output = step(&model, &mut state, &Input::default());
        fall.watch.look(output);
        fall.heights.push(output.objects[0].pose.position.y - 0.05);
        fall.energies.push(output.energy.stored() - recording.mass() * G * 0.05);
    }
    Ok(fall)
}

/// The highest after the first contact.
fn rebound(heights: &[f64]) -> f64 {
    let lowest = (0..heights.len()).min_by(|&a, &b| heights[a].total_cmp(&heights[b])).unwrap_or(0);
    heights[lowest..].iter().copied().fold(f64::NEG_INFINITY, f64::max)
}

/// Dropped from 5 cm, against the solution with all 6585 modes at the same step, and at four steps.
pub fn bounce() -> Result<Vec<Check>, Failure> {
    let cube = PAPER.body(box_mesh([0.1; 3], [12; 3])?, Order::Linear, 200)?;
    let mut checks = Vec::new();
    for (name, step_s, reference) in [("1 ms", 1e-3, AT_1_MS), ("2 ms", 2e-3, AT_2_MS)] {
        let (heights, energies) = (column(reference, 1), column(reference, 3));
        let until = (FIRST_JUMP / step_s).round() as usize;
        let own = fall(&cube, step_s, FIRST_JUMP)?;
        let top = rebound(&heights[..until]);
        checks.push(Check::new(
            format!("rebound at {name} against all modes [m]"),
            rebound(&own.heights),
            top,
            0.015,
        ));
        // What the rebound may miss, the curve may; it is a share of the height of the fall.
        let apart = own.heights.iter().zip(&heights).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        checks.push(Check::new(
            format!("height at {name} up to the second contact, share of the fall"),
            apart / DROP,
            0.0,
            0.015,
        ));
        let last = until - 1;
        checks.push(Check::new(
            format!("energy at {name} after the first jump [J]"),
            own.energies[last],
            energies[last],
            0.015,
        ));
    }
    for (name, step_s) in [("2 ms", 2e-3), ("1 ms", 1e-3), ("0.5 ms", 5e-4), ("0.25 ms", 2.5e-4)] {
        let own = fall(&cube, step_s, FIRST_JUMP)?;
        checks.push(Check::new(
            format!("rebound at {name} against 24.5 mm [m]"),
            rebound(&own.heights),
            0.0245,
            0.02,
        ));
        checks.extend(own.watch.checks(name));
    }
    checks.extend(rest()?);
    Ok(checks)
}

/// Lying on the floor, the force is the weight and does not alternate from step to step.
fn rest() -> Result<Vec<Check>, Failure> {
    /// A force that alternates with a thousandth of the weight can be felt in a hand; a millionth can't.
    const TINY: f64 = 1e-6;
    let calm = Stuff { beta: 4e-3, ..PAPER };
    let cube = calm.body(box_mesh([0.1; 3], [12; 3])?, Order::Linear, 200)?;
    let weight = cube.mass() * G;
    let mut checks = Vec::new();
    for friction in [0.0, 0.5] {
        let objects = vec![at(&cube, DVec3::Y * 0.0502, DVec3::ZERO)];
        let model = scene(1e-3, DVec3::Y * -G, vec![floor(friction)], Vec::new(), objects)?;
        let mut state = State::new(&model);
        let mut forces = Vec::new();
        for _ in 0..4000 {
            let output = step(&model, &mut state, &Input::default());
            forces.push(output.contacts.iter().map(|contact| contact.force.y).sum::<f64>());
        }
        let late = &forces[3000..];
        // A force that alternates by ±a has second differences of 4a.
        let seconds = late.windows(3).map(|f| (f[0] - 2.0 * f[1] + f[2]).abs() / 4.0);
        let alternation = seconds.fold(0.0, f64::max) / weight;
        let mean = late.iter().sum::<f64>() / late.len() as f64;
        checks.push(Check::new(format!("at rest, friction {friction}: mean force [N]"), mean, weight, TINY));
        checks.push(Check::new(
            format!("at rest, friction {friction}: alternation, share of the weight"),
            alternation,
            0.0,
            TINY,
        ));
    }
    Ok(checks)
}
