//! Random device motion against five bodies: no energy comes out, nothing becomes infinite, no proxy that leaves the body stays in
//! contact, and no force exceeds the bound of its coupling. Steps that can't be solved report it. A fifth of the scenes has a small budget of
//! the contact solver.
//!
//! With e the stretch of a coupling, device minus proxy, every step is held to
//!
//! ```text
//! stored − stored at the start ≤ input        |f| ≤ k·|e⁺| + d·|e⁺ − e|/h
//! ```
//!
//! The force on a hand is the reaction of its contacts, and the input is the work of the devices. Small errors of a force are left to the
//! other cases.

mod bodies;
mod exit_direction;
mod invariants;
mod random_device;

use crate::check::Check;
use crate::error::VerifyError;
pub(super) use bodies::bodies;
use glam::{DQuat, DVec3};
use invariants::{InvariantChecker, Violations};
use palpate::{
    Coupling, DeviceParameters, Input, Model, ModelObject, ModelParameters, ObjectStart, Obstacle, Pose,
    Recording, State, Twist, step,
};
use palpate_testkit::{GRAVITY_M_S2, Random, floor};
use random_device::{RandomDevice, View};
use rayon::prelude::*;
use std::sync::Arc;

/// Scenes of each of the 5 bodies.
const SCENES: usize = 100;

/// Steps of each scene: a million in all.
const STEPS: usize = 2000;

/// Friction coefficients.
const FRICTIONS: [f64; 3] = [0.0, 0.5, 1.0];

/// One scene of so many has a small budget of the solver: about two sweeps of ten contacts.
const BUDGETED: usize = 5;
const SMALL_BUDGET: u64 = 200;

/// Checks of every body.
pub fn adversarial() -> Result<Vec<Check>, VerifyError> {
    let bodies = bodies()?;
    let play = |scene: usize| play(&bodies[scene / SCENES].1, scene / SCENES, scene % SCENES);
    let violations: Result<Vec<Violations>, VerifyError> =
        (0..bodies.len() * SCENES).into_par_iter().map(play).collect();
    let violations = violations?;
    let of_bodies = bodies.iter().zip(violations.chunks(SCENES));
    let checks = of_bodies.flat_map(|((name, _), violations)| {
        violations.iter().cloned().fold(Violations::default(), Violations::join).checks(name)
    });
    Ok(checks.collect())
}

/// One scene from its start to its end.
fn play(body: &Arc<Recording>, number: usize, scene: usize) -> Result<Violations, VerifyError> {
    let mut random = Random::from_pair(number as u64, scene as u64);
    let solver_budget = if scene.is_multiple_of(BUDGETED) { SMALL_BUDGET } else { u64::MAX };
    let model = random_model(body, solver_budget, &mut random)?;
    let mut state = State::new(&model);
    let mut randoms: Vec<RandomDevice> =
        model.parameters().devices.iter().map(|_| RandomDevice::new()).collect();
    let mut checker = InvariantChecker::new(&model, scene, state.output());
    for number in 0..STEPS {
        let poses: Vec<Pose> = state.output().objects.iter().map(|object| object.pose).collect();
        let devices = randoms.iter_mut().enumerate().map(|(device, motion)| {
            let exit_direction = || exit_direction::exit_direction(&model, &state, device);
            let (size, lag) = (body.surface.radius(), lag(&model, device));
            let view = View { poses: &poses, size, step: number, exit_direction: &exit_direction, lag };
            motion.next(&mut random, &view)
        });
        let input = Input { devices: devices.collect(), ..Input::default() };
        if !checker.observe(&input, &randoms, step(&model, &mut state, &input)) {
            break;
        }
    }
    Ok(checker.violations)
}

/// Share of a device's stretch that its coupling's damper leaves after a step without force.
fn lag(model: &Model, device: usize) -> f64 {
    let parameters = model.parameters();
    parameters.devices[device].coupling.map_or(0.0, |coupling| {
        let rate = coupling.damping / parameters.step_s;
        rate / (coupling.stiffness + rate)
    })
}

/// One to three devices, one or two objects, with or without gravity and floor.
fn random_model(
    body: &Arc<Recording>,
    solver_budget: u64,
    random: &mut Random,
) -> Result<Model, VerifyError> {
    let devices = (0..random.one_of([1, 2, 3])).map(|_| random_device(body, random)).collect();
    let gravity = if random.chance(0.5) { DVec3::Y * -GRAVITY_M_S2 } else { DVec3::ZERO };
    let obstacles = if random.chance(0.5) { vec![random_floor(body, random)] } else { Vec::new() };
    let objects = (0..if random.chance(0.1) { 2 } else { 1 }).map(|at| random_object(body, at, random));
    let objects = objects.collect();
    let step_s = random.one_of([2e-3, 1e-3, 2.5e-4]);
    let parameters = ModelParameters {
        step_s,
        gravity,
        obstacles,
        devices,
        solver_budget,
        ..ModelParameters::for_reference()
    };
    Ok(Model::new(parameters, objects)?)
}

fn random_device(body: &Recording, random: &mut Random) -> DeviceParameters {
    let edge = body.surface.mean_edge();
    let coupling =
        Coupling { stiffness: 10_f64.powf(random.within(1.0, 4.0)), damping: random.one_of([0.0, 0.5, 5.0]) };
    DeviceParameters {
        tip_radius: random.one_of([0.0, 0.003, 0.01, 0.03]),
        patch_radius: random.one_of([0.0, 0.5, 1.5, 4.0]) * edge,
        friction: random.one_of(FRICTIONS),
        coupling: random.chance(0.6).then_some(coupling),
    }
}

/// A floor at the lowest node, or below it.
fn random_floor(body: &Recording, random: &mut Random) -> Obstacle {
    let lowest = body.surface.positions.iter().map(|p| p.y).fold(f64::INFINITY, f64::min);
    let below = random.one_of([0.0, 1e-4, 0.05]);
    let mut plane = floor(random.one_of(FRICTIONS));
    plane.pose.position = DVec3::Y * (lowest - below);
    plane
}

/// An object at rest or in motion; the second one is above the first.
fn random_object(body: &Arc<Recording>, at: u32, random: &mut Random) -> ModelObject {
    let moving = if random.chance(0.5) { 1.0 } else { 0.0 };
    let twist = Twist { linear: random.vector() * moving, angular: random.vector() * (5.0 * moving) };
    let highest = body.surface.positions.iter().map(|p| p.y).fold(0.0, f64::max);
    let position = DVec3::Y * (2.05 * highest * f64::from(at));
    let orientation = DQuat::from_rotation_y(random.within(-1.0, 1.0) * f64::from(at));
    let mut object =
        ModelObject::new(body.clone(), ObjectStart { pose: Pose { position, orientation }, twist });
    object.friction = random.one_of(FRICTIONS);
    object
}
