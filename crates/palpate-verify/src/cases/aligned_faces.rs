//! Flat faces of elastic objects on one another: St Venant's impact of two bars, cubes that rest on cubes, and cubes under boxes.

use crate::check::Check;
use crate::error::VerifyError;
use crate::run_invariants::RunInvariants;
use glam::{DQuat, DVec3};
use palpate::{
    Collider, Input, Model, ModelObject, ModelParameters, Obstacle, Output, Pose, Recording, Shape, State,
    step,
};
use palpate_fem::ElementOrder;
use palpate_mesh::box_mesh;
use palpate_testkit::{ElasticMaterial, GRAVITY_M_S2, floor, object_at, scene, smoothstep};
use std::sync::Arc;

/// Faces in all positions.
pub fn aligned_faces() -> Result<Vec<Check>, VerifyError> {
    let mut checks = Vec::new();
    for (order, name) in [(ElementOrder::Linear, "order 1"), (ElementOrder::Quadratic, "order 2")] {
        checks.extend(two_bars(order, name)?);
    }
    for (shift, turn, name) in [
        (DVec3::ZERO, 0.0, "equal faces"),
        (DVec3::new(0.013, 0.0, 0.007), 0.0, "shifted"),
        (DVec3::ZERO, 0.5, "turned"),
    ] {
        checks.extend(cube_on_cube(shift, turn, name)?);
    }
    for cells in [2, 3, 6] {
        checks.extend(cube_under_box(cells)?);
    }
    Ok(checks)
}

/// A bar of length L₁ that meets one of length L₂ > L₁ of the same section end to end: the shorter one stops, and the
/// coefficient of restitution is L₁/L₂ (St Venant; Timoshenko & Goodier, *Theory of Elasticity*, article 169).
fn two_bars(order: ElementOrder, name: &str) -> Result<Vec<Check>, VerifyError> {
    const WIDTH: f64 = 0.02;
    const LENGTHS: [f64; 2] = [0.1, 0.2];
    const CELL: f64 = 2.5e-3;
    const BAR: ElasticMaterial =
        ElasticMaterial { young_pa: 1e5, poisson: 0.0, density_kg_m3: 1000.0, stiffness_damping_s: 0.0 };
    const SPEED: f64 = 0.1;
    const STEP: f64 = 1e-4;
    /// Fronts are not sharp on a mesh, see `drop_block`.
    const RESTITUTION: f64 = 0.03;
    let bar = |length: f64| {
        let cells = if order == ElementOrder::Linear { length / CELL } else { 0.5 * length / CELL };
        BAR.free_body(box_mesh([WIDTH, length, WIDTH], [2, cells.round() as u32, 2])?, order, 200)
    };
    let [short, long] = [bar(LENGTHS[0])?, bar(LENGTHS[1])?];
    let objects = vec![
        object_at(&short, DVec3::Y * (-0.5 * LENGTHS[0] - 0.5 * STEP * SPEED), DVec3::Y * SPEED),
        object_at(&long, DVec3::Y * 0.5 * LENGTHS[1], DVec3::ZERO),
    ];
    let objects = objects.into_iter().map(|object| ModelObject { friction: 0.0, ..object }).collect();
    let model = scene(STEP, DVec3::ZERO, Vec::new(), Vec::new(), objects)?;
    let (mut state, mut invariants) = (State::new(&model), RunInvariants::default());
    invariants.observe(state.output());
    let waves = 2.0 * LENGTHS[1] / (BAR.young_pa / BAR.density_kg_m3).sqrt();
    let mut lateral = 0.0_f64;
    for _ in 0..(1.5 * waves / STEP) as usize {
        let output = step(&model, &mut state, &Input::default());
        invariants.observe(output);
        let force: DVec3 = output.contacts.iter().map(|contact| contact.force).sum();
        lateral = lateral.max(force.x.hypot(force.z));
    }
    let [first, second] = [0, 1].map(|at| state.output().objects[at].twist.linear.y);
    let impedance = (BAR.young_pa * BAR.density_kg_m3).sqrt() * WIDTH * WIDTH;
    let mut checks = vec![
        Check::new(
            format!("two bars, {name}: restitution against L₁/L₂"),
            (second - first) / SPEED,
            LENGTHS[0] / LENGTHS[1],
            RESTITUTION,
        ),
        Check::new(
            format!("two bars, {name}: largest lateral force, share of ρcAv/2"),
            lateral / (0.5 * impedance * SPEED),
            0.0,
            1e-3,
        ),
    ];
    checks.extend(invariants.checks(&format!("two bars, {name}")));
    Ok(checks)
}

/// A cube rests on an equal one, by all nodes of both; frictionless where its faces are aligned.
fn cube_on_cube(shift: DVec3, turn: f64, name: &str) -> Result<Vec<Check>, VerifyError> {
    const SIDE: f64 = 0.1;
    const STEP: f64 = 2e-3;
    const REST_S: f64 = 6.0;
    /// Soft, and damped so that it comes to rest.
    const JELLY: ElasticMaterial =
        ElasticMaterial { young_pa: 5000.0, poisson: 0.4, density_kg_m3: 110.0, stiffness_damping_s: 1e-2 };
    /// Share of the weight.
    const FORCE: f64 = 1e-3;
    /// Share of the size; at rest, and on the way there.
    const PENETRATION: [f64; 2] = [2e-3, 1e-2];
    let is_aligned = shift == DVec3::ZERO && turn == 0.0;
    let friction = if is_aligned { 0.0 } else { 0.5 };
    let cube = JELLY.free_body(box_mesh([SIDE; 3], [6; 3])?, ElementOrder::Linear, 60)?;
    let mut objects = vec![
        object_at(&cube, DVec3::Y * 0.5 * SIDE, DVec3::ZERO),
        object_at(&cube, shift + DVec3::Y * 1.5 * SIDE, DVec3::ZERO),
    ];
    objects[1].start.pose.orientation = DQuat::from_rotation_y(turn);
    objects.iter_mut().for_each(|object| object.friction = friction);
    let model = scene(STEP, DVec3::Y * -GRAVITY_M_S2, vec![floor(friction)], Vec::new(), objects)?;
    let (mut state, mut invariants) = (State::new(&model), RunInvariants::default());
    invariants.observe(state.output());
    let mut deepest = [0.0_f64; 2];
    let steps = (REST_S / STEP).round() as usize;
    for number in 1..=steps {
        let output = step(&model, &mut state, &Input::default());
        invariants.observe(output);
        let least = output.contacts.iter().map(|contact| -contact.gap).fold(0.0, f64::max);
        let phase = usize::from(2 * number < steps);
        deepest[phase] = deepest[phase].max(least / SIDE);
    }
    let weight = cube.mass() * GRAVITY_M_S2;
    let between = on_upper(state.output());
    let mut checks = vec![
        Check::new(format!("cube on cube, {name}: what the lower one carries [N]"), between.y, weight, FORCE),
        Check::new(
            format!("cube on cube, {name}: lateral force, share of the weight"),
            between.x.hypot(between.z) / weight,
            0.0,
            FORCE,
        ),
        Check::new(
            format!("cube on cube, {name}: penetration at rest, share of the size"),
            deepest[0],
            0.0,
            PENETRATION[0],
        ),
        Check::new(
            format!("cube on cube, {name}: penetration on the way, share of the size"),
            deepest[1],
            0.0,
            PENETRATION[1],
        ),
    ];
    checks.extend(invariants.checks(&format!("cube on cube, {name}")));
    Ok(checks)
}

/// A cube on a floor is pressed by a box of its own width, whose rim lies on the cube's, and resists as under a wider one: by all
/// nodes and by contact samples.
fn cube_under_box(cells: u32) -> Result<Vec<Check>, VerifyError> {
    /// Shares of the force under the wider box, by all nodes.
    const FORCE: f64 = 0.01;
    const LATERAL: f64 = 1e-3;
    let cube = RUBBER.free_body(box_mesh([RUBBER_SIDE; 3], [cells; 3])?, ElementOrder::Linear, 60)?;
    let (wide, _) = force_under_box(&cube, RUBBER_SIDE, usize::MAX)?;
    let mut checks = Vec::new();
    for (max_contact_samples, name) in [(usize::MAX, "all nodes"), (48, "48 samples")] {
        let name = format!("cube of {cells} cells an edge under a box of its width, {name}");
        let (force, invariants) = force_under_box(&cube, 0.5 * RUBBER_SIDE, max_contact_samples)?;
        checks.push(Check::new(format!("{name}: force against a wider box [N]"), force.y, wide.y, FORCE));
        let lateral = force.x.hypot(force.z) / wide.y;
        checks.push(Check::new(format!("{name}: lateral force, share"), lateral, 0.0, LATERAL));
        checks.extend(invariants.checks(&name));
    }
    Ok(checks)
}

const RUBBER: ElasticMaterial =
    ElasticMaterial { young_pa: 2e4, poisson: 0.4, density_kg_m3: 1000.0, stiffness_damping_s: 5e-3 };
const RUBBER_SIDE: f64 = 0.1;

/// Force [N] on a box that has come down on a rubber cube on a floor and has stayed while vibrations decayed.
fn force_under_box(
    cube: &Arc<Recording>,
    half_width: f64,
    max_contact_samples: usize,
) -> Result<(DVec3, RunInvariants), VerifyError> {
    const STEP: f64 = 1e-3;
    const DEPTH: f64 = 5e-3;
    const TIMES_S: [f64; 2] = [0.5, 1.0];
    const HALF_HEIGHT: f64 = 0.02;
    const FRICTION: f64 = 0.3;
    let above = Pose { position: DVec3::Y * (RUBBER_SIDE + HALF_HEIGHT), ..Pose::IDENTITY };
    let shape = Shape::Box { half_extents: DVec3::new(half_width, HALF_HEIGHT, half_width) };
    let object = object_at(cube, DVec3::Y * 0.5 * RUBBER_SIDE, DVec3::ZERO);
    let parameters = ModelParameters {
        step_s: STEP,
        obstacles: vec![floor(FRICTION), Obstacle { shape, pose: above, friction: FRICTION }],
        max_contact_samples,
        ..ModelParameters::for_reference()
    };
    let model = Model::new(parameters, vec![ModelObject { friction: FRICTION, ..object }])?;
    let (mut state, mut invariants) = (State::new(&model), RunInvariants::default());
    invariants.observe(state.output());
    for number in 1..=(TIMES_S.iter().sum::<f64>() / STEP) as usize {
        let down = DVec3::Y * (DEPTH * smoothstep(number as f64 * STEP / TIMES_S[0]));
        let pose = Pose { position: above.position - down, ..above };
        let input = Input { obstacles: vec![Pose::IDENTITY, pose], ..Input::default() };
        invariants.observe(step(&model, &mut state, &input));
    }
    let on_box = state.output().contacts.iter().filter(|contact| contact.against == Collider::Obstacle(1));
    Ok((-on_box.map(|contact| contact.force).sum::<DVec3>(), invariants))
}

/// Force [N] on the upper object from the lower one: a contact has one row, with the force on its object.
fn on_upper(output: &Output) -> DVec3 {
    let sign = |object: usize| if object == 1 { 1.0 } else { -1.0 };
    let pair = output.contacts.iter().filter(|contact| matches!(contact.against, Collider::Object(_)));
    pair.map(|contact| contact.force * sign(contact.object)).sum()
}
