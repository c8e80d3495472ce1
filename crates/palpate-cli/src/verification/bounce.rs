//! The paper's cube falls flat on a frictionless floor, and lies on one.

use super::scene::{G, PAPER, Stuff, Watch, at, floor, scene};
use super::{Check, column};
use crate::Failure;
use glam::DVec3;
use palpate::{Input, OscillatorState, Recording, SampledOscillator, State, step};
use palpate_fem::element::Order;
use palpate_fem::mesh::box_mesh;
use std::sync::Arc;

const AT_1_MS: &str = include_str!("../../../../data/reference/bounce_full_1ms.csv");
const AT_2_MS: &str = include_str!("../../../../data/reference/bounce_full_2ms.csv");

/// The rebound of the solution with all modes [m].
pub const FULL_REBOUND_M: f64 = 0.0245;

/// Height of the fall [m].
const DROP: f64 = 0.05;
/// Before the second contact [s].
const FIRST_JUMP: f64 = 0.29;

/// Steps at which 200 modes + S rebound within 2 % of 24.5 mm. At 0.5 ms they are 2.2 % low, 23.97 mm, which is what the
/// modes give and not how contacts are solved: see `by_hand`. With 1200 modes it is 24.49 mm; see `bounce_many_modes`.
const STEPS_OF_200_MODES: [(&str, f64); 3] = [("2 ms", 2e-3), ("1 ms", 1e-3), ("0.25 ms", 2.5e-4)];

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

/// The fall with all modes at the paper's step: time [s], height [m] as above, force of the floor [N].
pub fn full_fall() -> Vec<[f64; 3]> {
    let [t, height, force] = [0, 1, 2].map(|number| column(AT_2_MS, number));
    t.into_iter().zip(height).zip(force).map(|((t, height), force)| [t, height, force]).collect()
}

/// Dropped from 5 cm, against the solution with all 6585 modes at the same step, and at other steps.
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
    for (name, step_s) in STEPS_OF_200_MODES {
        checks.extend(steps(&cube, name, step_s)?);
    }
    let (ours, theirs) = (fall(&cube, 5e-4, FIRST_JUMP)?, by_hand(&cube, 5e-4, FIRST_JUMP));
    // Where contacts open and close the runtime leaves them unmet by a micrometre, a 25 000th of the rebound.
    let quantity = "rebound at 0.5 ms against a second algorithm [m]";
    checks.push(Check::new(quantity, rebound(&ours.heights), rebound(&theirs), 1e-3));
    checks.extend(rest()?);
    Ok(checks)
}

/// The rebound at a step, and what must never happen.
fn steps(cube: &Arc<Recording>, name: &str, step_s: f64) -> Result<Vec<Check>, Failure> {
    let own = fall(cube, step_s, FIRST_JUMP)?;
    let quantity = format!("rebound at {name} against 24.5 mm [m]");
    let mut checks = vec![Check::new(quantity, rebound(&own.heights), FULL_REBOUND_M, 0.02)];
    checks.extend(own.watch.checks(name));
    Ok(checks)
}

/// As many modes as the rebound needs at every step.
pub fn bounce_many_modes() -> Result<Vec<Check>, Failure> {
    let cube = PAPER.body(box_mesh([0.1; 3], [12; 3])?, Order::Linear, 1200)?;
    let mut checks = Vec::new();
    for (name, step_s) in [("2 ms", 2e-3), ("1 ms", 1e-3), ("0.5 ms", 5e-4), ("0.25 ms", 2.5e-4)] {
        checks.extend(steps(&cube, name, step_s)?);
    }
    Ok(checks)
}

/// The same fall by a second algorithm: heights [m] when the lower nodes' normal forces f ≥ 0 with gaps g + W·f ≥ 0,
/// fᵀ(g + W·f) = 0, are found by projected Gauss–Seidel, and the cube does not turn.
fn by_hand(recording: &Recording, step_s: f64, seconds: f64) -> Vec<f64> {
    /// Of a gap [m].
    const CLOSE: f64 = 1e-9;
    const MOST_SWEEPS: usize = 20_000;
    let (modes, mass) = (&recording.modes, recording.mass());
    let count = modes.angular_frequencies.len();
    let positions = &recording.surface.positions;
    let low: Vec<usize> = (0..positions.len()).filter(|&node| positions[node].y < -0.0499).collect();
    let row = |i: usize| &modes.mode_shapes[(3 * low[i] + 1) * count..][..count];
    let dot = |a: &[f64], b: &mut dyn Iterator<Item = f64>| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let pairs = modes.angular_frequencies.iter().zip(&modes.damping_ratios);
    let oscillators: Vec<_> = pairs.map(|(&w, &z)| SampledOscillator::new(w, z, step_s)).collect();
    let n = low.len();
    let mut w = vec![vec![0.0; n]; n];
    for i in 0..n {
        for j in 0..n {
            let mut bent = oscillators.iter().zip(row(j)).map(|(o, phi)| o.instantaneous_compliance() * phi);
            let residual = recording.residual.block(low[i], low[j]).y_axis.y;
            w[i][j] = dot(row(i), &mut bent) + residual + 0.5 * step_s * step_s / mass;
        }
    }
    let mut q = vec![OscillatorState { q: 0.0, v: 0.0 }; count];
    let (mut height, mut speed, mut forces) = (DROP, 0.0, vec![0.0; n]);
    let run = (0..(seconds / step_s).round() as usize).map(|_| {
        let free: Vec<_> = oscillators.iter().zip(&q).map(|(o, q)| o.advance(*q, 0.0).q).collect();
        let fallen = height + step_s * speed - 0.5 * step_s * step_s * G;
        let gaps: Vec<f64> = (0..n).map(|i| fallen + dot(row(i), &mut free.iter().copied())).collect();
        if gaps.iter().all(|gap| *gap > 0.0) {
            forces.fill(0.0);
        } else {
            for _ in 0..MOST_SWEEPS {
                let mut change = 0.0_f64;
                for i in 0..n {
                    let gap = gaps[i] + dot(&w[i], &mut forces.iter().copied());
                    let force = (forces[i] - gap / w[i][i]).max(0.0);
                    change = change.max((force - forces[i]).abs() * w[i][i]);
                    forces[i] = force;
                }
                if change < CLOSE {
                    break;
                }
            }
        }
        for (mode, q) in q.iter_mut().enumerate() {
            let push = (0..n).map(|i| row(i)[mode] * forces[i]).sum();
            *q = oscillators[mode].advance(*q, push);
        }
        let acceleration = forces.iter().sum::<f64>() / mass - G;
        height += step_s * speed + 0.5 * step_s * step_s * acceleration;
        speed += step_s * acceleration;
        height
    });
    run.collect()
}

/// Lying on the floor, the force is the weight and does not alternate from step to step.
fn rest() -> Result<Vec<Check>, Failure> {
    /// Contacts are met to 1e-8 of the cube, 0.9 nm. A floor that moved by that every other step would push with
    /// 0.9 nm·2m/h² = 2e-4 of the weight; the errors of 169 contacts, from one solution to the next, leave a hundredth.
    const TINY: f64 = 1e-5;
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
