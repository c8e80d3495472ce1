//! Faces with fewer contact samples than nodes: changes within their tolerances, and what must not change.

use crate::check::Check;
use crate::error::VerifyError;
use crate::run_invariants::RunInvariants;
use glam::DVec3;
use palpate::{
    Collider, Input, Model, ModelObject, ModelParameters, Obstacle, Pose, Recording, Shape, State, Twist,
    step,
};
use palpate_fem::ElementOrder;
use palpate_fem::paper_cube::{self, CELLS};
use palpate_mesh::{ball_mesh, box_mesh};
use palpate_testkit::{ElasticMaterial, GRAVITY_M_S2, PAPER_MATERIAL, floor, object_at};
use std::sync::Arc;

/// Contact samples at all nodes.
const ALL: usize = usize::MAX;

/// Contact samples of a run in real time.
const USUAL: usize = 48;

/// Tolerance of the sag with 48 and with 24 samples: 0.7 % at most.
const SAG: [(usize, f64); 2] = [(USUAL, 0.01), (24, 0.01)];

/// Tolerances of the sags of two cubes on one another.
const STACKED_SAG: [(usize, f64); 2] = [(USUAL, 0.02), (24, 0.06)];

/// Tolerance of the floor's mean force: the body still oscillates a little.
const FLOOR_FORCE: f64 = 1e-4;

/// Steps, of 3000, in which the stack is solved to 10⁻⁵ to 10⁻⁴ of the size only, where 24 samples and up to twice as many nodes among them
/// share the load: their footprints overlap, and sweeps converge slowly.
const LOOSE_STEPS: u32 = 360;

/// Tolerance of the mean force between two cubes, which sway longer.
const PAIR_FORCE: f64 = 5e-3;

/// Tolerance of the rebound: −1.5 to 2.1 % by samples.
const REBOUND: f64 = 0.025;

fn scene(
    max_contact_samples: usize,
    step_s: f64,
    friction: f64,
    objects: Vec<ModelObject>,
) -> Result<Model, VerifyError> {
    let parameters = ModelParameters {
        step_s,
        gravity: DVec3::Y * -GRAVITY_M_S2,
        obstacles: vec![floor(friction)],
        max_contact_samples,
        ..ModelParameters::for_reference()
    };
    Ok(Model::new(parameters, objects)?)
}

/// Bodies at rest and in a fall, by contact samples and by nodes.
pub fn contact_samples() -> Result<Vec<Check>, VerifyError> {
    let mut checks = Vec::new();
    let calm = ElasticMaterial { stiffness_damping_s: 4e-3, ..PAPER_MATERIAL };
    for cells in [12, 18] {
        let cube = calm.free_body(paper_cube::mesh(cells)?, ElementOrder::Linear, 200)?;
        checks.extend(rest(&format!("cube of {cells}³ cells"), &cube, 0.05, &SAG)?);
    }
    let ball = calm.free_body(ball_mesh(0.05, 8)?, ElementOrder::Linear, 200)?;
    checks.extend(rest("ball", &ball, 0.05, &SAG)?);
    checks.extend(pressed("ball", &ball, 24)?);
    let cube = calm.free_body(paper_cube::mesh(CELLS)?, ElementOrder::Linear, 200)?;
    checks.extend(pressed("cube", &cube, USUAL)?);
    checks.extend(given_back(&ball)?);
    checks.extend(fall()?);
    checks.extend(topple()?);
    checks.extend(stacked()?);
    checks.extend(overhang()?);
    Ok(checks)
}

/// Sag [m] of a body on a floor, where samples at edges average over some of the side faces, and the force of the floor [N].
fn rest(
    name: &str,
    body: &Arc<Recording>,
    half: f64,
    cases: &[(usize, f64)],
) -> Result<Vec<Check>, VerifyError> {
    const STEPS: u32 = 2000;
    /// The last part of the run, of which the force is a mean.
    const LATE: u32 = 500;
    let weight = body.mass() * GRAVITY_M_S2;
    let lie = |most: usize| -> Result<(f64, f64, RunInvariants), VerifyError> {
        let model = scene(most, 1e-3, 0.5, vec![object_at(body, DVec3::Y * half, DVec3::ZERO)])?;
        let (mut state, mut invariants, mut force) = (State::new(&model), RunInvariants::default(), 0.0);
        invariants.observe(state.output());
        for number in 0..STEPS {
            let output = step(&model, &mut state, &Input::default());
            invariants.observe(output);
            if number >= STEPS - LATE {
                force += output.contacts.iter().map(|c| c.force.y).sum::<f64>() / f64::from(LATE);
            }
        }
        Ok((half - state.output().objects[0].pose.position.y, force, invariants))
    };
    let (expected, ..) = lie(ALL)?;
    let mut checks = Vec::new();
    for &(most, allowed) in cases {
        let (sag, force, invariants) = lie(most)?;
        let of = format!("{name}, {most} places");
        checks.push(Check::new(format!("{of}: sag on a floor, by all nodes [m]"), sag, expected, allowed));
        checks.push(Check::new(format!("{of}: force of the floor [N]"), force, weight, FLOOR_FORCE));
        checks.extend(invariants.checks(&of));
    }
    Ok(checks)
}

/// Tolerance of the force of a plate that presses a body onto the floor: 1.3 % of a ball, of which a dozen samples are in contact, 0.02 % of a cube.
const PRESSED: f64 = 0.02;

/// Tolerance of the energy that contacts give back in a ball's fall, as a share of the ball's energy.
const GIVEN_BACK: f64 = 0.02;

/// Force [N] of a plate that presses a body by a tenth of its height onto the floor.
fn pressed(name: &str, body: &Arc<Recording>, most: usize) -> Result<Vec<Check>, VerifyError> {
    let half = 0.05;
    /// Of all, the last part for the mean of the force.
    const STEPS: u32 = 2000;
    const LATE: u32 = 500;
    let thickness = 0.2 * half;
    let top = |number: u32| {
        let pressed = 0.2 * half * (f64::from(number) / 500.0).min(1.0);
        Pose { position: DVec3::Y * (2.0 * half + thickness - pressed), ..Pose::IDENTITY }
    };
    let force = |most: usize| -> Result<(f64, RunInvariants), VerifyError> {
        let half_extents = DVec3::new(4.0 * half, thickness, 4.0 * half);
        let plate = Obstacle { shape: Shape::Box { half_extents }, pose: top(0), friction: 0.5 };
        let parameters = ModelParameters {
            gravity: DVec3::Y * -GRAVITY_M_S2,
            obstacles: vec![floor(0.5), plate],
            max_contact_samples: most,
            ..ModelParameters::for_reference()
        };
        let model = Model::new(parameters, vec![object_at(body, DVec3::Y * half, DVec3::ZERO)])?;
        let (mut state, mut invariants, mut force) = (State::new(&model), RunInvariants::default(), 0.0);
        invariants.observe(state.output());
        for number in 0..STEPS {
            let obstacles = vec![Pose::IDENTITY, top(number + 1)];
            let output = step(&model, &mut state, &Input { obstacles, ..Input::default() });
            invariants.observe(output);
            if number >= STEPS - LATE {
                let on_plate = output.contacts.iter().filter(|c| c.against == Collider::Obstacle(1));
                force -= on_plate.map(|c| c.force.y).sum::<f64>() / f64::from(LATE);
            }
        }
        Ok((force, invariants))
    };
    let ((expected, _), (measured, invariants)) = (force(ALL)?, force(most)?);
    let of = format!("{name} under a plate, {most} places");
    let mut checks = vec![Check::new(format!("{of}: force, by all nodes [N]"), measured, expected, PRESSED)];
    checks.extend(invariants.checks(&of));
    Ok(checks)
}

/// Energy [J] that contacts give back in the fall of a ball, whose level of detail changes with the area in contact.
fn given_back(ball: &Arc<Recording>) -> Result<Vec<Check>, VerifyError> {
    const HEIGHT: f64 = 0.05;
    let model = scene(USUAL, 1e-3, 0.5, vec![object_at(ball, DVec3::Y * (0.05 + HEIGHT), DVec3::ZERO)])?;
    let (mut state, mut invariants) = (State::new(&model), RunInvariants::default());
    invariants.observe(state.output());
    let (mut given, mut before) = (0.0, 0.0);
    for _ in 0..1500 {
        let output = step(&model, &mut state, &Input::default());
        invariants.observe(output);
        given += (before - output.energy.impact).max(0.0);
        before = output.energy.impact;
    }
    let share = given / (ball.mass() * GRAVITY_M_S2 * HEIGHT);
    let of = format!("fall of a ball, {USUAL} places");
    let mut checks = vec![Check::new(format!("{of}: energy given back, of all [1]"), share, 0.0, GIVEN_BACK)];
    checks.extend(invariants.checks(&of));
    Ok(checks)
}

/// Rebound [m] of the paper's cube from a flat fall.
fn fall() -> Result<Vec<Check>, VerifyError> {
    let cube = PAPER_MATERIAL.free_body(paper_cube::mesh(CELLS)?, ElementOrder::Linear, 200)?;
    let rebound = |most: usize, step_s: f64| -> Result<(f64, RunInvariants), VerifyError> {
        let model = scene(most, step_s, 0.0, vec![object_at(&cube, DVec3::Y * 0.1, DVec3::ZERO)])?;
        let (mut state, mut invariants) = (State::new(&model), RunInvariants::default());
        let (mut lowest, mut top) = (f64::INFINITY, 0.0_f64);
        invariants.observe(state.output());
        for _ in 0..(0.29 / step_s).round() as usize {
            let output = step(&model, &mut state, &Input::default());
            invariants.observe(output);
            let height = output.objects[0].pose.position.y - 0.05;
            top = if height < lowest { height } else { top.max(height) };
            lowest = lowest.min(height);
        }
        Ok((top, invariants))
    };
    let mut checks = Vec::new();
    for (name, step_s) in [("2 ms", 2e-3), ("1 ms", 1e-3), ("0.5 ms", 5e-4)] {
        let ((ours, invariants), (expected, _)) = (rebound(USUAL, step_s)?, rebound(ALL, step_s)?);
        let quantity = format!("rebound at {name}, {USUAL} places, by all nodes [m]");
        checks.push(Check::new(quantity, ours, expected, REBOUND));
        checks.extend(invariants.checks(&format!("fall at {name}, {USUAL} places")));
    }
    Ok(checks)
}

/// Sag [m] of two stacked cubes, and the force between them [N]. With all nodes this is slow, so the cubes are coarser than
/// elsewhere.
fn stacked() -> Result<Vec<Check>, VerifyError> {
    const STEPS: u32 = 3000;
    const LATE: u32 = 1000;
    let calm = ElasticMaterial { stiffness_damping_s: 4e-3, ..PAPER_MATERIAL };
    let cube = calm.free_body(paper_cube::mesh(8)?, ElementOrder::Linear, 200)?;
    let weight = cube.mass() * GRAVITY_M_S2;
    let lie = |most: usize| -> Result<([f64; 2], f64, RunInvariants), VerifyError> {
        let cubes = [0.05, 0.15].map(|y| object_at(&cube, DVec3::Y * y, DVec3::ZERO));
        let model = scene(most, 1e-3, 0.5, cubes.to_vec())?;
        let (mut state, mut invariants, mut carried) = (State::new(&model), RunInvariants::default(), 0.0);
        let mut sag = [0.0; 2];
        invariants.observe(state.output());
        for number in 0..STEPS {
            let output = step(&model, &mut state, &Input::default());
            invariants.observe(output);
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
        Ok((sag, carried, invariants))
    };
    let (expected, ..) = lie(ALL)?;
    let mut checks = Vec::new();
    for (most, allowed) in STACKED_SAG {
        let (sag, carried, invariants) = lie(most)?;
        for (at, name) in ["lower", "upper"].into_iter().enumerate() {
            let quantity = format!("{name} of two cubes, {most} places: sag, by all nodes [m]");
            checks.push(Check::new(quantity, sag[at], expected[at], allowed));
        }
        let of = format!("two cubes, {most} places");
        checks.push(Check::new(format!("{of}: force between them [N]"), carried, weight, PAIR_FORCE));
        checks.extend(invariants.checks_with(&of, if most < USUAL { LOOSE_STEPS } else { 0 }));
    }
    Ok(checks)
}

/// A block on another stays while its centre is over it: the samples span as wide a base as all nodes, on both sides.
fn overhang() -> Result<Vec<Check>, VerifyError> {
    const STIFF: ElasticMaterial =
        ElasticMaterial { young_pa: 2e6, poisson: 0.3, density_kg_m3: 1000.0, stiffness_damping_s: 3e-4 };
    let size = [0.1, 0.05, 0.05];
    let block = STIFF.free_body(box_mesh(size, [16, 8, 8])?, ElementOrder::Linear, 40)?;
    let falls = |most: usize, share: f64| -> Result<bool, VerifyError> {
        let lower = object_at(&block, DVec3::Y * (0.5 * size[1]), DVec3::ZERO);
        let upper = object_at(&block, DVec3::new(0.5 * size[0] * share, 1.5 * size[1], 0.0), DVec3::ZERO);
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

/// A tilted block stands until its centre is beyond its edge: the samples span as wide a base as all nodes.
fn topple() -> Result<Vec<Check>, VerifyError> {
    /// Twice as high as wide, of something stiff: it tips beyond atan(1/2) = 26.6°.
    const STIFF: ElasticMaterial =
        ElasticMaterial { young_pa: 2e6, poisson: 0.3, density_kg_m3: 1000.0, stiffness_damping_s: 3e-4 };
    let size = [0.05, 0.1, 0.05];
    let block = STIFF.free_body(box_mesh(size, [8, 16, 8])?, ElementOrder::Linear, 40)?;
    let balance = (size[0] / size[1]).atan();
    let falls = |most: usize, angle: f64| -> Result<bool, VerifyError> {
        // On its right lower edge, turned about it.
        let orientation = glam::DQuat::from_rotation_z(-angle);
        let edge = DVec3::new(0.5 * size[0], -0.5 * size[1], 0.0);
        let mut object = object_at(&block, -(orientation * edge), DVec3::ZERO);
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
