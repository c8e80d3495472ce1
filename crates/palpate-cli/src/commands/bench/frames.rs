//! Encoding of frames for the viewer: time and bytes.

use super::{Case, touch::FINGER, touch::HALF};
use crate::failure::Failure;
use crate::terminal::notify;
use glam::DVec3;
use palpate::{DeviceInput, Input, Model, ModelParameters, Obstacle, Pose, Recording, State, step};
use palpate_haptics::Snapshot;
use palpate_testkit::{GRAVITY_M_S2, floor, object_at};
use palpate_viewer::{FrameEncoder, FrameFormat};
use std::f64::consts::TAU;
use std::sync::Arc;
use std::time::Instant;

/// Frame rate [Hz], and steps per frame.
const FRAMES_HZ: f64 = 60.0;
const STEPS_PER_FRAME: usize = 16;

/// Number of frames below which percentiles are meaningless.
const MIN_FRAMES: usize = 200;

/// Frames of an object that two fingers pinch and shake, on a floor or free.
pub fn case(recording: Arc<Recording>, form: FrameFormat, on_floor: bool) -> Case {
    let nodes = recording.surface.positions.len();
    let how = match form {
        FrameFormat::Modal => "modal",
        FrameFormat::Vertices => "vertices",
    };
    let on_a_floor = if on_floor { " and it lies on a floor" } else { "" };
    let label = format!("{nodes} surface nodes, a frame ({how}), 2 fingers{on_a_floor}");
    (label, Box::new(move |steps| frame_times(&recording, form, on_floor, steps)))
}

fn frame_times(
    recording: &Arc<Recording>,
    form: FrameFormat,
    on_floor: bool,
    steps: usize,
) -> Result<Vec<u32>, Failure> {
    let mut parameters = ModelParameters { devices: vec![FINGER; 2], ..ModelParameters::for_reference() };
    if on_floor {
        parameters.gravity = DVec3::Y * -GRAVITY_M_S2;
        parameters.max_contact_samples = 48;
        let pose = Pose { position: DVec3::Y * -HALF, ..Pose::IDENTITY };
        parameters.obstacles = vec![Obstacle { pose, ..floor(0.5) }];
    }
    let object = object_at(recording, DVec3::ZERO, DVec3::ZERO);
    let model = Arc::new(Model::new(parameters, vec![object])?);
    let mut state = State::new(&model);
    let mut encoder = FrameEncoder::new(model.clone(), 1);
    let obstacles: Vec<Pose> = model.parameters().obstacles.iter().map(|obstacle| obstacle.pose).collect();
    let mut input = Input { devices: vec![DeviceInput::inactive(); 2], obstacles, ..Input::default() };
    let mut snapshot = Snapshot::new(&model, &state, &input);
    let (mut times, mut bytes) = (Vec::new(), 0);
    for number in 1..=steps.max(STEPS_PER_FRAME * MIN_FRAMES) {
        let t = number as f64 * model.parameters().step_s;
        let squeeze = 0.006 * (t / 0.2).min(1.0);
        let shake = 0.01 * (TAU * 2.0 * t).sin() * (t / 0.5).min(1.0);
        for (device, side) in input.devices.iter_mut().zip([-1.0, 1.0]) {
            let x = side * (HALF + FINGER.tip_radius - squeeze) + shake;
            *device = DeviceInput::touching(DVec3::new(x, 0.0, 0.0));
        }
        step(&model, &mut state, &input);
        if number % STEPS_PER_FRAME == 0 {
            snapshot.capture(number as u64, &input, &state);
            let before = Instant::now();
            let frame = encoder.encode(&snapshot, form);
            times.push(before.elapsed().as_nanos().min(u128::from(u32::MAX)) as u32);
            bytes += frame.len();
        }
    }
    let seconds: f64 = times.iter().map(|time| f64::from(*time) * 1e-9).sum();
    let frames = times.len() as f64;
    notify(&format!(
        "{:.1} kB a frame; at {FRAMES_HZ} Hz {:.0} kB/s and {:.1} % of a core:",
        bytes as f64 / frames / 1e3,
        bytes as f64 / frames * FRAMES_HZ / 1e3,
        100.0 * seconds / frames * FRAMES_HZ
    ));
    Ok(times)
}
