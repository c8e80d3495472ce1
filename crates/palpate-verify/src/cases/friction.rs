//! Coulomb friction of a low, wide, stiff block on a plane: onset of sliding, acceleration, and stopping distance.

use crate::check::Check;
use crate::error::VerifyError;
use crate::run_invariants::RunInvariants;
use glam::{DQuat, DVec3};
use palpate::{Input, ModelObject, Pose, Recording, State, step};
use palpate_fem::ElementOrder;
use palpate_mesh::box_mesh;
use palpate_testkit::{ElasticMaterial, GRAVITY_M_S2, floor, object_at, scene};
use std::sync::Arc;

const SIZE: [f64; 3] = [0.1, 0.02, 0.1];
const FRICTION: f64 = 0.5;

/// Hard rubber, damped so that it comes to rest within tenths of a second: its lowest mode, at 200 Hz, by a fifth.
const RUBBER: ElasticMaterial =
    ElasticMaterial { young_pa: 2e6, poisson: 0.3, density_kg_m3: 1000.0, stiffness_damping_s: 3e-4 };

fn block() -> Result<Arc<Recording>, VerifyError> {
    Ok(RUBBER.free_body(box_mesh(SIZE, [6, 2, 6])?, ElementOrder::Linear, 40)?)
}

/// A plane through the origin that falls towards +x by an angle.
fn tilt(angle: f64) -> Pose {
    Pose { orientation: DQuat::from_rotation_z(-angle), ..Pose::IDENTITY }
}

/// The block at rest on a plane that is tilted.
fn on_plane(block: &Arc<Recording>, angle: f64) -> ModelObject {
    let pose = tilt(angle);
    let mut object = object_at(block, pose.world_from_body(DVec3::Y * (0.5 * SIZE[1])), DVec3::ZERO);
    object.start.pose.orientation = pose.orientation;
    object
}

/// Slope tan θ at which the block has begun to slide on a plane that tilts slowly about its place.
fn slope_of_sliding(
    block: &Arc<Recording>,
    step_s: f64,
    invariants: &mut RunInvariants,
) -> Result<f64, VerifyError> {
    /// From 5 % below to 5 % above in four seconds: by the time that the slide is seen, 0.3 % of the slope have passed.
    const SECONDS: f64 = 4.0;
    const SEEN: f64 = 2e-5;
    let angle = |t: f64| (FRICTION * (0.95 + 0.1 * t / SECONDS).min(1.05)).atan();
    // The block settles first.
    let settling = 1.0;
    let mut plane = floor(FRICTION);
    plane.pose = tilt(angle(0.0));
    let object = on_plane(block, angle(0.0));
    let model = scene(step_s, DVec3::Y * -GRAVITY_M_S2, vec![plane], Vec::new(), vec![object])?;
    let mut state = State::new(&model);
    invariants.observe(state.output());
    let mut settled = None;
    for number in 1..=((SECONDS + settling) / step_s) as usize {
        let t = number as f64 * step_s - settling;
        let pose = tilt(angle(t.max(0.0)));
        let output = step(&model, &mut state, &Input { obstacles: vec![pose], ..Input::default() });
        invariants.observe(output);
        let along = pose.body_from_world(output.objects[0].pose.position).x;
        if t >= 0.0 && along - *settled.get_or_insert(along) > SEEN {
            return Ok(angle(t).tan());
        }
    }
    Err(VerifyError::NotReached("the block does not slide"))
}

/// Acceleration [m/s²] down a fixed plane of a slope, over the second half of a second.
fn slide(block: &Arc<Recording>, slope: f64, invariants: &mut RunInvariants) -> Result<f64, VerifyError> {
    let (step_s, angle) = (1e-3, slope.atan());
    let mut plane = floor(FRICTION);
    plane.pose = tilt(angle);
    let object = on_plane(block, angle);
    let model = scene(step_s, DVec3::Y * -GRAVITY_M_S2, vec![plane], Vec::new(), vec![object])?;
    let mut state = State::new(&model);
    invariants.observe(state.output());
    let mut speed = [0.0; 2];
    for number in 0..1000 {
        let output = step(&model, &mut state, &Input::default());
        invariants.observe(output);
        if number == 499 || number == 999 {
            speed[number / 500] = (tilt(angle).orientation.inverse() * output.objects[0].twist.linear).x;
        }
    }
    Ok((speed[1] - speed[0]) / 0.5)
}

/// Stopping distance [m] of a block with an initial speed [m/s], and its creep [m] in the second after it.
fn stopping_distance(
    block: &Arc<Recording>,
    speed: f64,
    step_s: f64,
    invariants: &mut RunInvariants,
) -> Result<[f64; 2], VerifyError> {
    let object = object_at(block, DVec3::Y * (0.5 * SIZE[1]), DVec3::X * speed);
    let model = scene(step_s, DVec3::Y * -GRAVITY_M_S2, vec![floor(FRICTION)], Vec::new(), vec![object])?;
    let mut state = State::new(&model);
    invariants.observe(state.output());
    let stop = speed / (FRICTION * GRAVITY_M_S2) + 0.3;
    let mut places = [0.0; 2];
    for place in &mut places {
        for _ in 0..(stop.max(1.0) / step_s) as usize {
            let output = step(&model, &mut state, &Input::default());
            invariants.observe(output);
            *place = output.objects[0].pose.position.x;
        }
    }
    Ok([places[0], places[1] - places[0]])
}

/// Coulomb's law on a tilting, a tilted and a level plane.
pub fn friction() -> Result<Vec<Check>, VerifyError> {
    const SPEED: f64 = 1.0;
    /// A millionth of the block [m].
    const CREEP: f64 = 1e-7;
    /// The slope passes 0.3 % until the slide is seen, and the block is not rigid.
    const ONSET: f64 = 0.01;
    /// The block hops a little, so that its weight is carried in the mean.
    const KINETIC: f64 = 0.01;
    /// Acceleration of a sticking block [m/s²]: vibration that has not died yet.
    const STICKING: f64 = 1e-6;
    let block = block()?;
    let mut invariants = RunInvariants::default();
    let mut checks = Vec::new();
    let slope = slope_of_sliding(&block, 1e-3, &mut invariants)?;
    checks.push(Check::new("slope at which a block begins to slide", slope, FRICTION, ONSET));
    checks.extend(invariants.checks("tilting plane"));

    let mut invariants = RunInvariants::default();
    let steep = 1.2 * FRICTION;
    // g·(sin θ − μ·cos θ).
    let exact = GRAVITY_M_S2 * (steep - FRICTION) / steep.hypot(1.0);
    let quantity = format!("acceleration down a slope of {steep} [m/s²]");
    checks.push(Check::new(quantity, slide(&block, steep, &mut invariants)?, exact, KINETIC));
    checks.extend(invariants.checks("steep plane"));
    let mut invariants = RunInvariants::default();
    let gentle = slide(&block, 0.9 * FRICTION, &mut invariants)?;
    checks.push(Check::new("acceleration down a slope 10 % below [m/s²]", gentle, 0.0, STICKING));
    checks.extend(invariants.checks("gentle plane"));

    let exact = SPEED * SPEED / (2.0 * FRICTION * GRAVITY_M_S2);
    for (name, step_s) in [("4 ms", 4e-3), ("2 ms", 2e-3), ("1 ms", 1e-3), ("0.5 ms", 5e-4)] {
        let mut invariants = RunInvariants::default();
        let [distance, creep] = stopping_distance(&block, SPEED, step_s, &mut invariants)?;
        checks.push(Check::new(
            format!("way of a block pushed with 1 m/s, {name} [m]"),
            distance,
            exact,
            KINETIC,
        ));
        checks.push(Check::new(format!("creep in 1 s after it, {name} [m]"), creep, 0.0, CREEP));
        checks.extend(invariants.checks(name));
    }
    Ok(checks)
}
