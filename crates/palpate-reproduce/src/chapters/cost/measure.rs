//! Times of steps: held points on an object in either form, and objects that only move.

use crate::bodies::table_in_memory;
use crate::error::ReproduceError;
use crate::medians::Median;
use glam::DVec3;
use palpate::{
    DeviceInput, DeviceMode, DeviceParameters, Grasp, Input, Model, ModelObject, ModelParameters,
    ObjectStart, Pose, Recording, ResponseForm, Sampling, State, SurfacePoint, Twist, step,
};
use palpate_fem::RecordedBody;
use palpate_fem::table::{TableMethod, TableParameters, TableRecorder};
use palpate_haptics::percentile_us;
use std::sync::Arc;
use std::time::{Duration, Instant};

pub const STEP_S: f64 = 1e-3;

/// Distance between objects that only move [m].
const APART_M: f64 = 0.5;

/// Form of the response.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// The table R[s] by direct convolution, with a window of T samples.
    Table(usize),
    /// Modes and residual compliance.
    Modal,
}

/// One measured configuration.
#[derive(Debug, Clone, Copy)]
pub struct Cost {
    pub form: Form,
    /// Observed degrees of freedom n.
    pub observed: usize,
    /// Degrees of freedom in contact, n_c.
    pub contact: usize,
    /// Time of a step: the force, with motion and everything.
    pub force: Median,
    /// 99th percentile [µs].
    pub force_p99_us: f64,
    /// Time for the displacement of the whole surface.
    pub deformation: Median,
    /// Size of the columns in use [bytes], in double precision.
    pub table_bytes: usize,
}

impl Cost {
    /// Samples T of the window; 0 in modal form.
    pub fn samples(&self) -> usize {
        if let Form::Table(samples) = self.form { samples } else { 0 }
    }
}

/// A duration [ns].
pub fn nanoseconds(duration: Duration) -> u32 {
    duration.as_nanos().min(u128::from(u32::MAX)) as u32
}

/// Steps whose mean time is taken: a convolution on R[s] spreads its work over so many, most of which have little to do with few points.
const BLOCK: usize = 16;

/// Surface nodes spread over the body, each as a point of one of its triangles.
fn points(recording: &Recording, count: usize) -> Vec<SurfacePoint> {
    let surface = &recording.surface;
    let nodes = surface.positions.len();
    let at_node = |node: usize| {
        let triangle = surface.triangles.iter().position(|t| t.contains(&(node as u32)))?;
        let weights = surface.triangles[triangle].map(|corner| f64::from(u8::from(corner as usize == node)));
        Some(SurfacePoint { triangle: triangle as u32, weights })
    };
    (0..count).filter_map(|k| at_node((2 * k + 1) * nodes / (2 * count))).collect()
}

/// Measures one configuration, with all devices in motion and a full history.
pub fn measure(body: &RecordedBody, held: usize, form: Form, steps: usize) -> Result<Cost, ReproduceError> {
    let recording = Arc::new(body.recording.clone());
    let surface_nodes = body.surface_nodes();
    let held = points(&recording, held);
    let (response, table_bytes) = match form {
        Form::Modal => (ResponseForm::Modal, 0),
        Form::Table(samples) => {
            let corners = held.iter().flat_map(|point| recording.surface.corners(point));
            let mut touchable: Vec<u32> =
                corners.filter(|(_, weight)| *weight > 0.0).map(|(node, _)| surface_nodes[node]).collect();
            touchable.sort_unstable();
            touchable.dedup();
            let table = table_in_memory(body, STEP_S, samples, touchable, |value| value)?;
            let bytes = 8 * table.touchable_dofs.len() * table.columns.column_length();
            (ResponseForm::Fir(Arc::new(table)), bytes)
        }
    };
    let start = ObjectStart { pose: Pose::IDENTITY, twist: Twist::ZERO };
    let object = ModelObject { response, ..ModelObject::new(recording.clone(), start) };
    let parameters = ModelParameters {
        devices: vec![DeviceParameters::default(); held.len()],
        ..ModelParameters::for_reference()
    };
    let model = Model::new(parameters, vec![object])?;
    let mut state = State::new(&model);
    let mut cost = Cost {
        form,
        observed: 3 * surface_nodes.len(),
        contact: 3 * held.len(),
        force: Median::of(&[]),
        force_p99_us: 0.0,
        deformation: Median::of(&[]),
        table_bytes,
    };
    let history = cost.samples();
    let mut times = Vec::with_capacity(steps);
    for number in 0..history + steps {
        let t = number as f64 * STEP_S;
        let sway = DVec3::new((12.0 * t).sin(), 0.5 * (5.0 * t).sin(), 0.3 * (7.0 * t).sin()) * 0.01;
        let device = |point: &SurfacePoint| DeviceInput {
            position: recording.surface.rest_position(point) * 0.99 + sway,
            mode: DeviceMode::Held(Grasp { object: 0, point: *point }),
        };
        let input = Input { devices: held.iter().map(device).collect(), ..Input::default() };
        let before = Instant::now();
        let status = step(&model, &mut state, &input).status;
        if number >= history {
            times.push(nanoseconds(before.elapsed()));
        }
        if status.unsolved_islands + status.rejected_inputs > 0 {
            return Err(ReproduceError::Measurement(format!(
                "the cost of a step can't be measured: {status:?}"
            )));
        }
    }
    let mean =
        |block: &[u32; BLOCK]| (block.iter().map(|&ns| u64::from(ns)).sum::<u64>() / BLOCK as u64) as u32;
    cost.force = Median::of(&times.as_chunks().0.iter().map(mean).collect::<Vec<u32>>());
    times.sort_unstable();
    cost.force_p99_us = percentile_us(&times, 0.99);
    let mut shape = vec![DVec3::ZERO; recording.surface.positions.len()];
    let shapes: Vec<u32> = (0..25)
        .map(|_| {
            let before = Instant::now();
            state.surface_displacement(&model, 0, &mut shape);
            nanoseconds(before.elapsed())
        })
        .collect();
    cost.deformation = Median::of(&shapes);
    Ok(cost)
}

/// Time of a step of a number of objects that touch nothing.
pub fn motion_time(body: &RecordedBody, objects: usize, steps: usize) -> Result<Median, ReproduceError> {
    let recording = Arc::new(body.recording.clone());
    let object = |number: usize| {
        let pose = Pose { position: DVec3::X * (APART_M * number as f64), ..Pose::IDENTITY };
        let twist = Twist { linear: DVec3::Y, angular: DVec3::new(1.0, 2.0, 3.0) };
        ModelObject::new(recording.clone(), ObjectStart { pose, twist })
    };
    let model = Model::new(ModelParameters::for_reference(), (0..objects).map(object).collect())?;
    let mut state = State::new(&model);
    let times: Vec<u32> = (0..steps)
        .map(|_| {
            let before = Instant::now();
            step(&model, &mut state, &Input::default());
            nanoseconds(before.elapsed())
        })
        .collect();
    Ok(Median::of(&times))
}

/// Solutions in a step of the integrator of tables, which is of order 5 (`palpate_fem::table`).
const SOLVES_PER_STEP: usize = 5;

/// Steps of time integration in each of five timed runs.
const TIMED_STEPS: usize = 8;

/// Time of one solution with the factored system matrix of the whole mesh, and of the products that a step of time integration needs
/// beside it.
pub fn finite_element_time(body: &RecordedBody) -> Result<Median, ReproduceError> {
    let surface = body.surface_nodes();
    let parameters = TableParameters {
        step_s: STEP_S,
        samples: TIMED_STEPS,
        sampling: Sampling::End,
        method: TableMethod::Transient { substeps: 1 },
        touchable_nodes: vec![surface[0]],
        observed_nodes: vec![surface[0]],
    };
    // The factor is made here, once; a step solves with it.
    let recorder = TableRecorder::new(body, &parameters)?;
    let mut load = vec![0.0; body.dofs()];
    load[3 * surface[0] as usize + 1] = 1.0;
    let mut times = Vec::new();
    for _ in 0..5 {
        let before = Instant::now();
        recorder.responses(std::slice::from_ref(&load));
        let solves = (parameters.samples * SOLVES_PER_STEP) as f64;
        times.push(nanoseconds(before.elapsed().div_f64(solves)));
    }
    Ok(Median::of(&times))
}
