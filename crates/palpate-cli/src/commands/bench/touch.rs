//! Steps with contacts: fingers on meshes of different resolution, a cube on a floor.

use super::{Case, frames, timed_step};
use crate::failure::Failure;
use glam::DVec3;
use palpate::{DeviceInput, DeviceParameters, Input, Model, ModelObject, ModelParameters, Recording, State};
use palpate_testkit::{GRAVITY_M_S2, finger, floor, start_at, subdivided_near_field};
use palpate_viewer::FrameFormat;
use std::sync::Arc;

/// Typical finger.
pub const FINGER: DeviceParameters = finger(0.005, 0.004, 0.6);

/// Half the side of the cubes [m].
pub const HALF: f64 = 0.05;

/// Contact samples: at all nodes, or few.
const ALL: usize = usize::MAX;
const FEW: usize = 48;

/// Refinements of the recorded surface, each of which splits every triangle in four.
const REFINEMENTS: usize = 3;

/// Cases with the paper's cube and a finer one.
pub fn cases(cube: Arc<Recording>, finer: Arc<Recording>) -> impl Iterator<Item = Case> {
    let mut cases: Vec<Case> = Vec::new();
    let mut fingers = |recording: Arc<Recording>, sliding: bool| {
        let nodes = recording.surface.positions.len();
        let what = if sliding { "2 fingers that slide" } else { "2 fingers that pinch and shake" };
        let label = format!("{nodes} surface nodes, 200 modes, {what}");
        cases.push((label, Box::new(move |steps| finger_steps(&recording, sliding, steps))));
    };
    fingers(cube.clone(), false);
    fingers(cube.clone(), true);
    let mut recording = finer;
    for refinement in 0..=REFINEMENTS {
        if refinement > 0 {
            recording = Arc::new(subdivided_near_field(&recording));
        }
        fingers(recording.clone(), false);
    }
    for form in [FrameFormat::Modal, FrameFormat::Vertices] {
        cases.push(frames::case(recording.clone(), form, false));
        cases.push(frames::case(cube.clone(), form, true));
    }
    let floors = [
        (0.0, 1, ALL, "lies on a floor"),
        (0.0, 1, FEW, "lies on a floor, 48 contact samples"),
        (0.05, 1, ALL, "falls on a floor from 5 cm, contact steps"),
        (0.05, 1, FEW, "falls on a floor from 5 cm, contact steps, 48 contact samples"),
        (0.0, 2, ALL, "one on another on a floor"),
        (0.0, 2, FEW, "one on another on a floor, 48 contact samples"),
        (0.001, 2, ALL, "one on another, falls on a floor, contact steps"),
        (0.001, 2, FEW, "one on another, falls on a floor, contact steps, 48 contact samples"),
    ];
    // Damping lets resting cubes come to rest.
    let damped_cube = Arc::new(damped(&cube));
    for (height, cubes, max_contact_samples, what) in floors {
        let recording = if height == 0.0 { damped_cube.clone() } else { cube.clone() };
        let label = format!("12³ cells, 200 modes, {what}");
        let run = move |steps| floor_steps(&recording, (height, cubes, max_contact_samples), steps);
        cases.push((label, Box::new(run)));
    }
    for (max_contact_samples, what) in
        [(ALL, "2 fingers move it on a floor"), (FEW, "2 fingers move it on a floor, 48 contact samples")]
    {
        let recording = damped_cube.clone();
        let label = format!("12³ cells, 200 modes, {what}");
        cases.push((label, Box::new(move |steps| moving_steps(&recording, max_contact_samples, steps))));
    }
    cases.into_iter()
}

/// Compute times of steps in which two fingers pinch the cube by 4 mm and shake it at 2 Hz, or slide over it [ns].
fn finger_steps(recording: &Arc<Recording>, sliding: bool, steps: usize) -> Result<Vec<u32>, Failure> {
    let parameters = ModelParameters {
        devices: vec![
            DeviceParameters { friction: if sliding { 0.1 } else { FINGER.friction }, ..FINGER };
            2
        ],
        ..ModelParameters::for_reference()
    };
    let model = Model::new(parameters, vec![ModelObject::new(recording.clone(), start_at(DVec3::ZERO))])?;
    let mut state = State::new(&model);
    // A free cube between sliding fingers slips away in the end.
    let steps = if sliding { steps.min(4000) } else { steps };
    let mut times = Vec::with_capacity(steps);
    for number in 0..steps + 200 {
        let t = number as f64 * 1e-3;
        let press = 0.004 * (t / 0.1).min(1.0) - 0.0005;
        // Amplitude at which friction holds the cube.
        let sway = 0.006 * (std::f64::consts::TAU * 2.0 * t).sin();
        // In phase, or in opposite phase when sliding.
        let hand = |side: f64| {
            let across = if sliding { side * sway } else { sway };
            DeviceInput::touching(DVec3::new(side * (HALF + FINGER.tip_radius - press), across, 0.0))
        };
        let input = Input { devices: vec![hand(-1.0), hand(1.0)], ..Input::default() };
        let time = timed_step(&model, &mut state, &input);
        if number >= 200 {
            if state.output().contacts.len() < 2 {
                return Err(Failure(format!("a finger lost the cube at {t:.3} s: this is no measurement")));
            }
            times.push(time);
        }
    }
    Ok(times)
}

/// Compute times of steps with frictional contact of a face with a floor, or with another cube [ns].
fn floor_steps(
    recording: &Arc<Recording>,
    (height, cubes, max_contact_samples): (f64, usize, usize),
    steps: usize,
) -> Result<Vec<u32>, Failure> {
    let parameters = on_a_floor(max_contact_samples);
    let cube = |number: usize| {
        let above = height + number as f64 * (2.0 * HALF + height);
        ModelObject::new(recording.clone(), start_at(DVec3::Y * (HALF + above)))
    };
    let model = Model::new(parameters, (0..cubes).map(cube).collect())?;
    let mut state = State::new(&model);
    // Resting cubes settle first.
    let settling = if height > 0.0 { 0 } else { 3000 };
    let mut times = Vec::new();
    for number in 0..settling + steps.min(2000) {
        let time = timed_step(&model, &mut state, &Input::default());
        if number >= settling && !state.output().contacts.is_empty() {
            times.push(time);
        }
    }
    Ok(times)
}

/// Parameters with gravity and a floor.
pub fn on_a_floor(max_contact_samples: usize) -> ModelParameters {
    let gravity = DVec3::Y * -GRAVITY_M_S2;
    ModelParameters {
        gravity,
        obstacles: vec![floor(0.5)],
        max_contact_samples,
        ..ModelParameters::for_real_time()
    }
}

/// Compute times of steps in which two fingers press a cube on a floor by 3 mm and push it [ns].
fn moving_steps(
    recording: &Arc<Recording>,
    max_contact_samples: usize,
    steps: usize,
) -> Result<Vec<u32>, Failure> {
    let parameters = ModelParameters { devices: vec![FINGER; 2], ..on_a_floor(max_contact_samples) };
    let model = Model::new(parameters, vec![ModelObject::new(recording.clone(), start_at(DVec3::Y * HALF))])?;
    let mut state = State::new(&model);
    // Settling, then pressing, then pushing.
    let (settled, moved) = (1000, 1500);
    let mut times = Vec::new();
    for number in 0..moved + steps.min(20_000) {
        let t = (number as f64 - f64::from(moved as u32)).max(0.0) * 1e-3;
        let begun = number.saturating_sub(settled) as f64 * 1e-3;
        let press = if number < settled { -0.005 } else { 0.003 * (begun / 0.3).min(1.0) };
        let turn = std::f64::consts::TAU * t;
        let (ahead, aside) = (0.02 * (1.0 - (0.5 * turn).cos()), 0.02 * (0.8 * turn).sin());
        let hand = |side: f64| {
            let reach = side * (HALF + FINGER.tip_radius - press);
            DeviceInput::touching(DVec3::new(reach + aside, HALF, ahead))
        };
        let input = Input { devices: vec![hand(-1.0), hand(1.0)], ..Input::default() };
        let time = timed_step(&model, &mut state, &input);
        if number >= moved {
            times.push(time);
        }
    }
    Ok(times)
}

/// Copy with stiffness-proportional damping, β = 2 ms.
fn damped(cube: &Recording) -> Recording {
    let mut cube = cube.clone();
    let modes = &mut cube.modes;
    modes.damping_ratios = modes.angular_frequencies.iter().map(|omega| 0.5 * 2e-3 * omega).collect();
    cube
}
