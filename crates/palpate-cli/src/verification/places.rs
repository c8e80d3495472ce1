//! Faces that stand on fewer places than they have nodes: what that changes, and what it must not.

use super::Check;
use super::scene::{G, PAPER, Stuff, Watch, at, floor};
use crate::Failure;
use glam::DVec3;
use palpate::{Collider, Input, Model, ModelObject, ModelParameters, Pose, Recording, State, Twist, step};
use palpate_fem::element::Order;
use palpate_fem::mesh::{ball_mesh, box_mesh};
use std::sync::Arc;

/// Every node.
const ALL: usize = usize::MAX;

/// As many as a run in real time takes.
const USUAL: usize = 48;

fn scene(
    max_contact_samples: usize,
    step_s: f64,
    friction: f64,
    objects: Vec<ModelObject>,
) -> Result<Model, Failure> {
    let parameters = ModelParameters {
        step_s,
        gravity: DVec3::Y * -G,
        obstacles: vec![floor(friction)],
        max_contact_samples,
        ..ModelParameters::default()
    };
    Ok(Model::new(parameters, objects)?)
}

/// Bodies on a floor at rest and in a fall, by places and by nodes.
pub fn places() -> Result<Vec<Check>, Failure> {
    let mut checks = Vec::new();
    let calm = Stuff { beta: 4e-3, ..PAPER };
    for cells in [12, 18] {
        let cube = calm.body(box_mesh([0.1; 3], [cells; 3])?, Order::Linear, 200)?;
        checks.extend(rest(&format!("cube of {cells}³ cells"), &cube, 0.05, &[(USUAL, 0.03), (24, 0.06)])?);
    }
    let ball = calm.body(ball_mesh(0.05, 8)?, Order::Linear, 200)?;
    checks.extend(rest("ball", &ball, 0.05, &[(USUAL, 0.03), (24, 0.06)])?);
    checks.extend(fall()?);
    checks.extend(topple()?);
    checks.extend(stacked()?);
    checks.extend(overhang()?);
    Ok(checks)
}

/// How far a body sags on the floor that it lies on, where places read some of the sides with the edges, and that the floor carries it.
fn rest(name: &str, body: &Arc<Recording>, half: f64, cases: &[(usize, f64)]) -> Result<Vec<Check>, Failure> {
    /// The last part of the run, of which the force is a mean.
    const STEPS: u32 = 4000;
    const LATE: u32 = 1000;
    let weight = body.mass() * G;
    let lie = |most: usize| -> Result<(f64, f64, Watch), Failure> {
        let model = scene(most, 1e-3, 0.5, vec![at(body, DVec3::Y * half, DVec3::ZERO)])?;
        let (mut state, mut watch, mut force) = (State::new(&model), Watch::default(), 0.0);
        watch.look(state.output());
        for number in 0..STEPS {
            let output = step(&model, &mut state, &Input::default());
            watch.look(output);
            if number >= STEPS - LATE {
                force += output.contacts.iter().map(|c| c.force.y).sum::<f64>() / f64::from(LATE);
            }
        }
        Ok((half - state.output().objects[0].pose.position.y, force, watch))
    };
    let (expected, ..) = lie(ALL)?;
    let mut checks = Vec::new();
    for &(most, allowed) in cases {
        let (sag, force, watch) = lie(most)?;
        let of = format!("{name}, {most} places");
        checks.push(Check::new(format!("{of}: sag on a floor, by all nodes [m]"), sag, expected, allowed));
        checks.push(Check::new(format!("{of}: force of the floor [N]"), force, weight, 1e-4));
        checks.extend(watch.checks(&of));
    }
    Ok(checks)
}

/// The paper's cube falls flat: how high it rebounds.
fn fall() -> Result<Vec<Check>, Failure> {
    let cube = PAPER.body(box_mesh([0.1; 3], [12; 3])?, Order::Linear, 200)?;
    let rebound = |most: usize, step_s: f64| -> Result<(f64, Watch), Failure> {
        let model = scene(most, step_s, 0.0, vec![at(&cube, DVec3::Y * 0.1, DVec3::ZERO)])?;
        let (mut state, mut watch) = (State::new(&model), Watch::default());
        let (mut lowest, mut top) = (f64::INFINITY, 0.0_f64);
        watch.look(state.output());
        for _ in 0..(0.29 / step_s).round() as usize {
            let output = step(&model, &mut state, &Input::default());
            watch.look(output);
            let height = output.objects[0].pose.position.y - 0.05;
            top = if height < lowest { height } else { top.max(height) };
            lowest = lowest.min(height);
        }
        Ok((top, watch))
    };
    let mut checks = Vec::new();
    for (name, step_s) in [("2 ms", 2e-3), ("1 ms", 1e-3), ("0.5 ms", 5e-4)] {
        let ((ours, watch), (expected, _)) = (rebound(USUAL, step_s)?, rebound(ALL, step_s)?);
        let quantity = format!("rebound at {name}, {USUAL} places, by all nodes [m]");
        checks.push(Check::new(quantity, ours, expected, 0.04));
        checks.extend(watch.checks(&format!("fall at {name}, {USUAL} places")));
    }
    Ok(checks)
}

/// A cube on another: how far each sags, and what the lower one carries. By all nodes that takes its time, so the cubes are
/// coarser than elsewhere.
fn stacked() -> Result<Vec<Check>, Failure> {
    const STEPS: u32 = 3000;
    const LATE: u32 = 1000;
    let calm = Stuff { beta: 4e-3, ..PAPER };
    let cube = calm.body(box_mesh([0.1; 3], [8; 3])?, Order::Linear, 200)?;
    let weight = cube.mass() * G;
    let lie = |most: usize| -> Result<([f64; 2], f64, Watch), Failure> {
        let cubes = [0.05, 0.15].map(|y| at(&cube, DVec3::Y * y, DVec3::ZERO));
        let model = scene(most, 1e-3, 0.5, cubes.to_vec())?;
        let (mut state, mut watch, mut carried) = (State::new(&model), Watch::default(), 0.0);
        let mut sag = [0.0; 2];
        watch.look(state.output());
        for number in 0..STEPS {
            let output = step(&model, &mut state, &Input::default());
            watch.look(output);
            if number < STEPS - LATE {
                continue;
            }
            for contact in &output.contacts {
                let on_the_upper = match (contact.object, contact.against) {
                    (1, Collider::Object(_)) => contact.force.y,
                    (_, Collider::Object(_)) => -contact.force.y,
                    _ => 0.0,
                };
                carried += on_the_upper / f64::from(LATE);
            }
            for (at, sag) in sag.iter_mut().enumerate() {
                *sag += (0.05 + 0.1 * at as f64 - output.objects[at].pose.position.y) / f64::from(LATE);
            }
        }
        Ok((sag, carried, watch))
    };
    let (expected, ..) = lie(ALL)?;
    let mut checks = Vec::new();
    for (most, allowed) in [(USUAL, 0.04), (24, 0.08)] {
        let (sag, carried, watch) = lie(most)?;
        // The upper one lies on two faces that are few places, the lower one on one.
        for (at, (name, share)) in [("lower", 1.0), ("upper", 1.5)].into_iter().enumerate() {
            let quantity = format!("{name} of two cubes, {most} places: sag, by all nodes [m]");
            checks.push(Check::new(quantity, sag[at], expected[at], share * allowed));
        }
        let of = format!("two cubes, {most} places");
        checks.push(Check::new(format!("{of}: force between them [N]"), carried, weight, 5e-3));
        checks.extend(watch.checks(&of));
    }
    Ok(checks)
}

/// A block on another stays while its centre is over it: few places are as wide as all nodes on both sides.
fn overhang() -> Result<Vec<Check>, Failure> {
    const STIFF: Stuff = Stuff { young: 2e6, poisson: 0.3, density: 1000.0, beta: 3e-4 };
    let size = [0.1, 0.05, 0.05];
    let block = STIFF.body(box_mesh(size, [16, 8, 8])?, Order::Linear, 40)?;
    let falls = |most: usize, share: f64| -> Result<bool, Failure> {
        let lower = at(&block, DVec3::Y * (0.5 * size[1]), DVec3::ZERO);
        let upper = at(&block, DVec3::new(0.5 * size[0] * share, 1.5 * size[1], 0.0), DVec3::ZERO);
        let model = scene(most, 1e-3, 0.9, vec![lower, upper])?;
        let mut state = State::new(&model);
        for _ in 0..1000 {
            step(&model, &mut state, &Input::default());
        }
        Ok(state.output().objects[1].pose.position.y < 1.2 * size[1])
    };
    let mut checks = Vec::new();
    for most in [ALL, USUAL, 16] {
        let name = if most == ALL { "all nodes".to_string() } else { format!("{most} places") };
        for (share, expected) in [(0.95, 0.0), (1.05, 1.0)] {
            let fallen = f64::from(u8::from(falls(most, share)?));
            let quantity = format!("a block with its centre at {share} of the other's half falls, {name}");
            checks.push(Check::new(quantity, fallen, expected, 0.0));
        }
    }
    Ok(checks)
}

/// A block that leans stands until its centre is beyond the edge that it leans on: few places are as wide as all nodes.
fn topple() -> Result<Vec<Check>, Failure> {
    /// Twice as high as wide, of something stiff: it tips beyond atan(1/2) = 26.6°.
    const STIFF: Stuff = Stuff { young: 2e6, poisson: 0.3, density: 1000.0, beta: 3e-4 };
    let size = [0.05, 0.1, 0.05];
    let block = STIFF.body(box_mesh(size, [8, 16, 8])?, Order::Linear, 40)?;
    let balance = (size[0] / size[1]).atan();
    let falls = |most: usize, angle: f64| -> Result<bool, Failure> {
        // On its right lower edge, turned about it.
        let orientation = glam::DQuat::from_rotation_z(-angle);
        let edge = DVec3::new(0.5 * size[0], -0.5 * size[1], 0.0);
        let mut object = at(&block, -(orientation * edge), DVec3::ZERO);
        object.start.pose = Pose { orientation, ..object.start.pose };
        object.start.twist = Twist::ZERO;
        let model = scene(most, 1e-3, 0.9, vec![object])?;
        let mut state = State::new(&model);
        for _ in 0..1500 {
            step(&model, &mut state, &Input::default());
        }
        // Upright it points up again, fallen it lies.
        Ok((state.output().objects[0].pose.orientation * DVec3::Y).y < 0.7)
    };
    let mut checks = Vec::new();
    for most in [ALL, USUAL, 16] {
        let name = if most == ALL { "all nodes".to_string() } else { format!("{most} places") };
        for (share, expected) in [(0.97, 0.0), (1.03, 1.0)] {
            let fallen = f64::from(u8::from(falls(most, share * balance)?));
            let quantity = format!("a block at {share} of its balance falls, {name}");
            checks.push(Check::new(quantity, fallen, expected, 0.0));
        }
    }
    Ok(checks)
}
