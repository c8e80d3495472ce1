//! Steps with contacts: fingers on meshes of different resolution, a cube on a floor.

use super::{Case, frames, timed_step};
use crate::failure::Failure;
use glam::{DMat3, DVec3};
use palpate::{
    DeviceInput, DeviceParameters, Input, ModalBasis, Model, ModelObject, ModelParameters, NearField,
    ObjectStart, Obstacle, Pose, Recording, ResidualCompliance, Shape, State, Surface, Twist,
};
use palpate_viewer::FrameFormat;
use std::collections::HashMap;
use std::sync::Arc;

/// Typical finger.
pub const FINGER: DeviceParameters =
    DeviceParameters { tip_radius: 0.005, patch_radius: 0.004, friction: 0.6, coupling: None };

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
            recording = Arc::new(refined(&recording));
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

fn at_height(y: f64) -> ObjectStart {
    ObjectStart { pose: Pose { position: DVec3::Y * y, ..Pose::IDENTITY }, twist: Twist::ZERO }
}

/// Compute times of steps in which two fingers pinch the cube by 4 mm and shake it at 2 Hz, or slide over it [ns].
fn finger_steps(recording: &Arc<Recording>, sliding: bool, steps: usize) -> Result<Vec<u32>, Failure> {
    let parameters = ModelParameters {
        devices: vec![
            DeviceParameters { friction: if sliding { 0.1 } else { FINGER.friction }, ..FINGER };
            2
        ],
        ..ModelParameters::default()
    };
    let model = Model::new(parameters, vec![ModelObject::new(recording.clone(), at_height(0.0))])?;
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
        ModelObject::new(recording.clone(), at_height(HALF + above))
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
fn on_a_floor(max_contact_samples: usize) -> ModelParameters {
    let floor = Obstacle { shape: Shape::Plane { normal: DVec3::Y }, pose: Pose::IDENTITY, friction: 0.5 };
    let gravity = DVec3::Y * -9.81;
    ModelParameters { gravity, obstacles: vec![floor], max_contact_samples, ..ModelParameters::default() }
}

/// Compute times of steps in which two fingers press a cube on a floor by 3 mm and push it [ns].
fn moving_steps(
    recording: &Arc<Recording>,
    max_contact_samples: usize,
    steps: usize,
) -> Result<Vec<u32>, Failure> {
    let parameters = ModelParameters { devices: vec![FINGER; 2], ..on_a_floor(max_contact_samples) };
    let model = Model::new(parameters, vec![ModelObject::new(recording.clone(), at_height(HALF))])?;
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

/// Copy with every surface triangle split in four: modes and residual compliance are interpolated linearly, for fine surfaces
/// without finite elements.
fn refined(coarse: &Recording) -> Recording {
    let surface = &coarse.surface;
    let m = coarse.modes.len();
    // Nodes at the ends of the edge that a new node halves.
    let mut parents: Vec<[u32; 2]> = (0..surface.positions.len() as u32).map(|n| [n, n]).collect();
    let mut middles = HashMap::new();
    let mut triangles = Vec::with_capacity(4 * surface.triangles.len());
    for &[a, b, c] in &surface.triangles {
        let mut middle = |i: u32, j: u32| {
            *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                parents.push([i, j]);
                parents.len() as u32 - 1
            })
        };
        let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
        triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
    }
    let mean =
        |of: &[u32; 2], value: &dyn Fn(usize) -> DVec3| (value(of[0] as usize) + value(of[1] as usize)) * 0.5;
    let positions: Vec<DVec3> = parents.iter().map(|of| mean(of, &|n| surface.positions[n])).collect();
    let mut mode_shapes = Vec::with_capacity(3 * positions.len() * m);
    for [a, b] in &parents {
        for axis in 0..3 {
            let (a, b) = (coarse.modes.row(*a as usize, axis), coarse.modes.row(*b as usize, axis));
            mode_shapes.extend(a.iter().zip(b).map(|(x, y)| 0.5 * (x + y)));
        }
    }
    let source_nodes = (0..positions.len() as u32).collect();
    let surface = Surface { positions, triangles, source_nodes };
    let residual = near_field(&surface, &parents, &coarse.residual);
    let modes = ModalBasis { mode_shapes, ..coarse.modes.clone() };
    Recording { metadata: coarse.metadata.clone(), surface, modes, residual, gravity: None }
}

/// Residual compliance between the new nodes, within a few edges.
fn near_field(surface: &Surface, parents: &[[u32; 2]], coarse: &ResidualCompliance) -> ResidualCompliance {
    let radius = 3.0 * surface.mean_edge();
    let cell = |p: DVec3| (p / radius).floor().to_array().map(|x| x as i64);
    let mut cells: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
    for (node, p) in surface.positions.iter().enumerate() {
        cells.entry(cell(*p)).or_default().push(node as u32);
    }
    let mut near = NearField { radius, offsets: vec![0], nodes: Vec::new(), blocks: Vec::new() };
    for (i, p) in surface.positions.iter().enumerate() {
        let [x, y, z] = cell(*p);
        let around =
            (-1..=1).flat_map(|dx| (-1..=1).flat_map(move |dy| (-1..=1).map(move |dz| [dx, dy, dz])));
        let mut others: Vec<u32> = around
            .filter_map(|[dx, dy, dz]| cells.get(&[x + dx, y + dy, z + dz]))
            .flatten()
            .copied()
            .filter(|&j| (surface.positions[j as usize] - *p).length() < radius)
            .collect();
        others.sort_unstable();
        for j in others {
            let mut block = DMat3::ZERO;
            for a in parents[i] {
                for b in parents[j as usize] {
                    block += coarse.block(a as usize, b as usize) * 0.25;
                }
            }
            let distance = (surface.positions[j as usize] - *p).length();
            block *= NearField::taper(distance / radius);
            near.nodes.push(j);
            near.blocks.extend((0..3).flat_map(|row| block.row(row).to_array()).map(|x| x as f32));
        }
        near.offsets.push(near.nodes.len() as u32);
    }
    ResidualCompliance::NearField(near)
}
