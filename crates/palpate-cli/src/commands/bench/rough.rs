//! Steps in rough motion: what a hand does to the scenes of the page, a fast finger, throws, and a body with a coarse mesh of curved facets.

use super::touch::{FINGER, HALF, on_a_floor};
use super::{Case, timed_step};
use crate::failure::Failure;
use glam::{DQuat, DVec3};
use palpate::{
    DeviceInput, Grasp, Input, Model, ModelObject, ModelParameters, ObjectStart, Obstacle, Pose, Recording,
    Shape, State, Twist,
};
use palpate_scene::{BUILT_IN_SCENES, OpenedScene, SceneLibrary, SilentProgress};
use palpate_testkit::{BodyShape, Fineness, Random, RandomPointer, start_at};
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Upper limit of steps of a row.
const MAX_STEPS: usize = 10_000;

/// Steps between two throws.
const THROW_STEPS: usize = 500;

/// Speed of a throw [m/s].
const THROW_M_S: f64 = 3.0;

/// Seed of throws and random pointers, the first of several.
const SEED: u64 = 11;

/// Contact samples in real time.
const SAMPLES: usize = 48;

/// Cases with the paper's cube and the scenes of the page, with so many random motions each.
pub fn cases(cube: Arc<Recording>, cache: Option<&Path>, seeds: u64) -> Vec<Case> {
    let mut cases: Vec<Case> = Vec::new();
    let mut add = |label: String, run: Box<dyn Fn(usize) -> Result<Vec<u32>, Failure>>| {
        cases.push((format!("rough: {label}"), run));
    };
    let cache: Option<PathBuf> = cache.map(Path::to_path_buf);
    let (bounce, stack) = (cache.clone(), cache.clone());
    add(
        "scene bounce, held on top and moved by 5 cm at 1 Hz".into(),
        Box::new(move |steps| on_scene(bounce.as_deref(), "bounce", steps, held_on_top)),
    );
    add(
        "scene stack, a finger pushes by 5 cm at 1 Hz".into(),
        Box::new(move |steps| on_scene(stack.as_deref(), "stack", steps, pushing_finger)),
    );
    for scene in &BUILT_IN_SCENES {
        let cache = cache.clone();
        add(
            format!("scene {}, random pointers", scene.id),
            Box::new(move |steps| {
                over_seeds(seeds, |seed| random_pointers(cache.as_deref(), scene.id, steps, seed))
            }),
        );
    }
    let (held, swept, thrown) = (cube.clone(), cube.clone(), cube);
    add(
        "cube on a floor, held on top and moved by 5 cm at 2 Hz".into(),
        Box::new(move |steps| held_cube(&held, steps)),
    );
    add(
        "cube on a floor, a finger sweeps over 40 cm at 4 Hz".into(),
        Box::new(move |steps| swept_cube(&swept, steps)),
    );
    add(
        "cube thrown into a corner at 3 m/s".into(),
        Box::new(move |steps| over_seeds(seeds, |seed| thrown_cube(&thrown, steps, seed))),
    );
    for (max_contact_samples, what) in [(usize::MAX, "all nodes"), (SAMPLES, "48 contact samples")] {
        add(
            format!("blob of 1,000 nodes and order 2, falls on a table by 1 cm, {what}"),
            Box::new(move |steps| falling_blob(max_contact_samples, steps)),
        );
    }
    cases
}

/// Compute times of a model's steps under inputs by time [ns].
fn timed(model: &Model, steps: usize, mut input: impl FnMut(f64, &State) -> Input) -> Vec<u32> {
    let mut state = State::new(model);
    let h = model.parameters().step_s;
    let mut times = Vec::with_capacity(steps);
    for number in 1..=steps.min(MAX_STEPS) {
        let input = input(number as f64 * h, &state);
        times.push(timed_step(model, &mut state, &input));
    }
    times
}

/// Compute times of a built-in scene, whose first pointer does something [ns].
fn on_scene(
    cache: Option<&Path>,
    id: &str,
    steps: usize,
    hand: fn(&Model, f64) -> DeviceInput,
) -> Result<Vec<u32>, Failure> {
    let OpenedScene { scene, .. } = SceneLibrary::new(cache)?.open_built_in(id, &mut SilentProgress)?;
    let pointer = scene.devices.iter().position(|device| device.pointer);
    let Some(pointer) = pointer else { return Err(Failure(format!("the scene {id} has no pointer"))) };
    Ok(timed(&scene.model, steps, |time, _| {
        let mut input = scene.input_at(time);
        for (device, input) in scene.devices.iter().zip(&mut input.devices) {
            if device.pointer {
                *input = DeviceInput::inactive();
            }
        }
        input.devices[pointer] = hand(&scene.model, time);
        input
    }))
}

/// Compute times of several random motions, one after the other [ns].
fn over_seeds(
    seeds: u64,
    mut times: impl FnMut(u64) -> Result<Vec<u32>, Failure>,
) -> Result<Vec<u32>, Failure> {
    let all: Result<Vec<_>, _> = (SEED..SEED + seeds).map(&mut times).collect();
    Ok(all?.concat())
}

/// Compute times of a built-in scene with random pointers [ns].
fn random_pointers(cache: Option<&Path>, id: &str, steps: usize, seed: u64) -> Result<Vec<u32>, Failure> {
    let OpenedScene { scene, .. } = SceneLibrary::new(cache)?.open_built_in(id, &mut SilentProgress)?;
    let h = scene.model.parameters().step_s;
    let slots = scene.devices.iter().enumerate().filter(|(_, device)| device.pointer);
    let mut pointers: Vec<(usize, RandomPointer)> =
        slots.map(|(slot, device)| (slot, RandomPointer::new(device.parameters.tip_radius))).collect();
    let mut random = Random::new(seed);
    Ok(timed(&scene.model, steps, |time, state| {
        let mut input = scene.input_at(time);
        for (slot, pointer) in &mut pointers {
            input.devices[*slot] = pointer.next(&mut random, &scene.model, state.output(), h);
        }
        input
    }))
}

/// The topmost point of the first object at rest, held and moved sideways by 5 cm at 1 Hz.
fn held_on_top(model: &Model, time: f64) -> DeviceInput {
    let surface = &model.recordings().next().expect("a recording of each object").surface;
    let Some((point, _)) = surface.nearest(DVec3::Y * surface.radius()) else {
        return DeviceInput::inactive();
    };
    // The scene's cube begins 10 cm above the floor.
    let top = surface.rest_position(&point) + DVec3::Y * 0.1;
    DeviceInput::held(top + DVec3::X * (0.05 * (TAU * time).sin()), Grasp { object: 0, point })
}

/// A finger that pushes the upper cube of the scene *stack* to and fro.
fn pushing_finger(_: &Model, time: f64) -> DeviceInput {
    let from = DVec3::new(-0.1, 0.12, 0.0);
    DeviceInput::touching(from + DVec3::X * (0.05 * (1.0 - (TAU * time).cos())))
}

fn held_cube(cube: &Arc<Recording>, steps: usize) -> Result<Vec<u32>, Failure> {
    let nearest = cube.surface.nearest(DVec3::Y * HALF);
    let (point, _) = nearest.ok_or_else(|| Failure("the cube has no surface".into()))?;
    let parameters = ModelParameters { devices: vec![FINGER], ..on_a_floor(SAMPLES) };
    let model = Model::new(parameters, vec![ModelObject::new(cube.clone(), start_at(DVec3::Y * HALF))])?;
    let top = cube.surface.rest_position(&point) + DVec3::Y * HALF;
    Ok(timed(&model, steps, |time, _| {
        let place = top + DVec3::X * (0.05 * (TAU * 2.0 * time).sin());
        let held = DeviceInput::held(place, Grasp { object: 0, point });
        Input { devices: vec![held], ..Input::default() }
    }))
}

fn swept_cube(cube: &Arc<Recording>, steps: usize) -> Result<Vec<u32>, Failure> {
    let mut parameters = ModelParameters { devices: vec![FINGER], ..on_a_floor(SAMPLES) };
    // Walls that keep the cube where the finger comes by.
    for (normal, at) in [(DVec3::X, -0.15), (-DVec3::X, 0.15), (DVec3::Z, -0.15), (-DVec3::Z, 0.15)] {
        parameters.obstacles.push(wall(normal, normal.abs() * at));
    }
    let model = Model::new(parameters, vec![ModelObject::new(cube.clone(), start_at(DVec3::Y * HALF))])?;
    Ok(timed(&model, steps, |time, _| {
        let height = HALF * (1.0 + 0.5 * (TAU * 0.7 * time).sin());
        let aside = 0.08 * (TAU * 0.3 * time).sin();
        let sweep = 0.2 * (TAU * 4.0 * time).cos();
        let finger = DeviceInput::touching(DVec3::new(sweep, height, aside));
        Input { devices: vec![finger], ..Input::default() }
    }))
}

fn wall(normal: DVec3, position: DVec3) -> Obstacle {
    Obstacle { shape: Shape::Plane { normal }, pose: Pose { position, ..Pose::IDENTITY }, friction: 0.5 }
}

/// Throws from always other sides, each with a turn and a spin of its own.
fn thrown_cube(cube: &Arc<Recording>, steps: usize, seed: u64) -> Result<Vec<u32>, Failure> {
    let mut random = Random::new(seed);
    let mut times = Vec::new();
    while times.len() < steps.min(MAX_STEPS) {
        let mut parameters = on_a_floor(SAMPLES);
        parameters.obstacles.extend([wall(DVec3::X, DVec3::ZERO), wall(DVec3::Z, DVec3::ZERO)]);
        let from = DVec3::new(0.15, 0.15, 0.15) + 0.04 * random.vector();
        let start = ObjectStart {
            pose: Pose { position: from, orientation: DQuat::from_scaled_axis(random.vector() * TAU) },
            twist: Twist { linear: -from.normalize() * THROW_M_S, angular: random.vector() * 10.0 },
        };
        let model = Model::new(parameters, vec![ModelObject::new(cube.clone(), start)])?;
        times.extend(timed(&model, THROW_STEPS, |_, _| Input::default()));
    }
    Ok(times)
}

fn falling_blob(max_contact_samples: usize, steps: usize) -> Result<Vec<u32>, Failure> {
    let blob = BodyShape::Blob.recording(Fineness::Fine)?;
    let lowest = blob.surface.positions.iter().map(|p| p.y).fold(f64::INFINITY, f64::min);
    let start = start_at(DVec3::Y * (0.01 - lowest));
    let model = Model::new(on_a_floor(max_contact_samples), vec![ModelObject::new(blob, start)])?;
    // All nodes take a long time.
    Ok(timed(&model, steps.min(1000), |_, _| Input::default()))
}
