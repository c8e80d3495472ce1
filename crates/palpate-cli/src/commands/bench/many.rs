//! Steps of many bodies: apart, a tenth of them touched; and at rest on a floor, awake and asleep.

use super::{Case, timed_step};
use crate::failure::Failure;
use glam::DVec3;
use palpate::{DeviceInput, Input, Model, ModelObject, ModelParameters, State};
use palpate_testkit::{
    GRAVITY_M_S2, finger, floor, free_block, half_extent, start_at, with_stiffness_damping,
};
use std::f64::consts::TAU;

/// Steps that are timed, and steps in which bodies come to rest and fall asleep.
const STEPS: usize = 300;
const SETTLING: usize = 500;

/// Damping by the stiffness matrix [s] with which they rest within these steps, and the time for which they are still before they sleep [s].
const DAMPING_S: f64 = 2e-2;
const SLEEP_AFTER_S: f64 = 0.05;

/// Numbers of bodies.
const APART: [usize; 3] = [10, 100, 1000];
const AWAKE: [usize; 2] = [100, 1000];
const ASLEEP: [usize; 2] = [1000, 10_000];
const TOUCHED_ON_A_FLOOR: usize = 100;

/// Cases of many bodies.
pub fn cases() -> Vec<Case> {
    let apart = APART.map(|bodies| -> Case {
        let touched = bodies / 10;
        let label = format!("many: {bodies} bodies apart, {touched} touched");
        (label, Box::new(move |steps| apart_steps(bodies, touched, steps)))
    });
    let at_rest = |bodies: usize, sleep_after_s: f64, touched: usize, what: &str| -> Case {
        let label = format!("many: {bodies} bodies at rest on a floor, {what}");
        (label, Box::new(move |steps| resting_steps(bodies, sleep_after_s, touched, steps)))
    };
    let awake = AWAKE.map(|bodies| at_rest(bodies, f64::INFINITY, 0, "awake"));
    let asleep = ASLEEP.map(|bodies| at_rest(bodies, SLEEP_AFTER_S, 0, "asleep"));
    let touched = at_rest(1000, SLEEP_AFTER_S, TOUCHED_ON_A_FLOOR, "a tenth touched, the others asleep");
    apart.into_iter().chain(awake).chain(asleep).chain([touched]).collect()
}

/// Places of bodies on a grid in x and z [m].
fn place(number: usize, bodies: usize, spacing: f64) -> DVec3 {
    let columns = (bodies as f64).sqrt().ceil() as usize;
    DVec3::new((number % columns) as f64, 0.0, (number / columns) as f64) * spacing
}

fn apart_steps(bodies: usize, touched: usize, steps: usize) -> Result<Vec<u32>, Failure> {
    let block = free_block();
    let (radius, half) = (block.surface.radius(), half_extent(&block, 0));
    let tip = 0.1 * radius;
    let parameters = ModelParameters {
        devices: vec![finger(tip, 0.1 * radius, 0.5); touched],
        ..ModelParameters::for_reference()
    };
    let at = |number| place(number, bodies, 4.0 * radius);
    let objects = (0..bodies).map(|number| ModelObject::new(block.clone(), start_at(at(number))));
    let model = Model::new(parameters, objects.collect())?;
    let mut state = State::new(&model);
    let mut times = Vec::new();
    for number in 0..steps.min(STEPS) {
        let time = number as f64 * model.parameters().step_s;
        let press = press(radius, time);
        let finger = |touched| DeviceInput::touching(at(touched) - DVec3::X * (half + tip - press));
        let input = Input { devices: (0..touched).map(finger).collect(), ..Input::default() };
        times.push(timed_step(&model, &mut state, &input));
    }
    Ok(times)
}

/// Depth of a press at a time [s], at 4 Hz [m].
fn press(radius: f64, time: f64) -> f64 {
    0.03 * radius * (TAU * 4.0 * time).sin().abs()
}

fn resting_steps(
    bodies: usize,
    sleep_after_s: f64,
    touched: usize,
    steps: usize,
) -> Result<Vec<u32>, Failure> {
    let block = with_stiffness_damping(&free_block(), DAMPING_S);
    let (radius, half) = (block.surface.radius(), half_extent(&block, 1));
    let tip = 0.1 * radius;
    let parameters = ModelParameters {
        gravity: DVec3::Y * -GRAVITY_M_S2,
        obstacles: vec![floor(0.5)],
        devices: vec![finger(tip, 0.1 * radius, 0.5); touched],
        max_contact_samples: 12,
        sleep_after_s,
        ..ModelParameters::for_reference()
    };
    let at = |number| place(number, bodies, 4.0 * radius) + DVec3::Y * half;
    let objects = (0..bodies).map(|number| ModelObject::new(block.clone(), start_at(at(number))));
    let model = Model::new(parameters, objects.collect())?;
    let mut state = State::new(&model);
    let mut times = Vec::new();
    for number in 0..SETTLING + steps.min(STEPS) {
        let press = press(radius, number as f64 * model.parameters().step_s);
        let finger = |at: DVec3| DeviceInput::touching(at + DVec3::Y * (half + tip - press));
        let touched = if number < SETTLING { 0 } else { touched };
        let devices = (0..touched).map(|finger_of| finger(at(finger_of * bodies / touched))).collect();
        let time = timed_step(&model, &mut state, &Input { devices, ..Input::default() });
        if number >= SETTLING {
            times.push(time);
        }
    }
    Ok(times)
}
