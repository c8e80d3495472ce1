//! `palpate bench`: step times with percentiles, and how they grow.

use crate::Failure;
use crate::verbs::demo::cached_cube;
use crate::verbs::run::percentile_us;
use crate::verbs::{print, print_json};
use clap::Args;
use glam::DVec3;
use palpate::{
    DeviceInput, DeviceParameters, Grasp, Input, Model, ModelObject, ModelParameters, ObjectStart, Pose,
    Recording, State, Twist, step,
};
use serde_json::{Value, json};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

/// Time a step: against the mesh, the modes, the held points and the objects
///
/// Everything is measured in one run on this machine, so that rows can be compared; single numbers are not a promise
/// for another machine. Recording the largest cube takes about a minute the first time.
#[derive(Args)]
pub struct Arguments {
    /// Cells along a side of the cubes that are compared
    #[arg(long, value_delimiter = ',', default_value = "6,12,24")]
    cells: Vec<u32>,
    /// Steps that are timed per row
    #[arg(long, default_value_t = 20_000)]
    steps: usize,
    /// Where recordings are kept between runs [default: $XDG_CACHE_HOME/palpate or ~/.cache/palpate]
    #[arg(long, value_name = "DIR")]
    cache: Option<PathBuf>,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

struct Case {
    label: String,
    recording: Arc<Recording>,
    objects: usize,
    points: usize,
}

/// Run the verb.
pub fn bench(arguments: &Arguments) -> Result<(), Failure> {
    if arguments.steps == 0 {
        return Err(Failure("--steps is 0, expected 1 or more".into()));
    }
    let cube = |cells, modes| -> Result<Arc<Recording>, Failure> {
        Ok(Arc::new(cached_cube(cells, modes, arguments.cache.as_deref())?))
    };
    let mut cases = Vec::new();
    for &cells in &arguments.cells {
        let recording = cube(cells, 200)?;
        let nodes = recording.metadata.mesh.nodes;
        let label = format!("{cells}³ cells, {nodes} nodes, 200 modes, 2 held points");
        cases.push(Case { label, recording, objects: 1, points: 2 });
    }
    let usual = cube(12, 200)?;
    for modes in [50, 400] {
        let label = format!("12³ cells, {modes} modes, 2 held points");
        cases.push(Case { label, recording: cube(12, modes)?, objects: 1, points: 2 });
    }
    for points in [1, 4, 8, 16] {
        let label = format!("12³ cells, 200 modes, {points} held points");
        cases.push(Case { label, recording: usual.clone(), objects: 1, points });
    }
    for objects in [4, 16] {
        let label = format!("{objects} cubes of 12³ cells, 200 modes, 2 held points each");
        cases.push(Case { label, recording: usual.clone(), objects, points: 2 });
    }
    let mut rows = Vec::new();
    if !arguments.json {
        print(&format!("{:<58}{:>8}{:>8}{:>8}{:>9}\n", "step time [µs]", "p50", "p99", "p99.9", "max"))?;
    }
    for case in &cases {
        let times = measure(case, arguments.steps)?;
        let [p50, p99, p999, max] = [0.5, 0.99, 0.999, 1.0].map(|share| percentile_us(&times, share));
        rows.push(json!({ "case": case.label, "p50": p50, "p99": p99, "p999": p999, "max": max }));
        if !arguments.json {
            print(&format!("{:<58}{p50:>8.2}{p99:>8.2}{p999:>8.2}{max:>9.2}\n", case.label))?;
        }
    }
    if arguments.json { print_json(&json!({ "step_time_us": Value::Array(rows) })) } else { Ok(()) }
}

/// Sorted times [ns] of steps in which every held point moves.
fn measure(case: &Case, steps: usize) -> Result<Vec<u32>, Failure> {
    let surface = &case.recording.surface;
    let held: Vec<Grasp> = (0..case.objects)
        .flat_map(|object| {
            (0..case.points).filter_map(move |at| {
                // Points all over the surface, none twice: a spiral on the sphere about the body.
                let share = (at as f64 + 0.5) / case.points as f64;
                let height = 1.0 - 2.0 * share;
                let angle = at as f64 * 2.4;
                let around = (1.0 - height * height).sqrt();
                let towards =
                    DVec3::new(around * angle.cos(), around * angle.sin(), height) * surface.radius();
                surface.nearest(towards).map(|(point, _)| Grasp { object, point })
            })
        })
        .collect();
    let start = ObjectStart { pose: Pose::IDENTITY, twist: Twist::ZERO };
    let parameters = ModelParameters {
        devices: vec![DeviceParameters::default(); held.len()],
        ..ModelParameters::default()
    };
    let model = Model::new(parameters, vec![ModelObject::new(case.recording.clone(), start); case.objects])?;
    let mut state = State::new(&model);
    let rest: Vec<DVec3> = held.iter().map(|grasp| surface.rest_position(&grasp.point)).collect();
    let mut input = Input { devices: Vec::new(), ..Input::default() };
    let mut times = Vec::with_capacity(steps);
    for number in 0..steps {
        let t = number as f64 * 1e-3;
        let sway = DVec3::new(0.03 * (12.0 * t).sin(), 0.01 * (5.0 * t).sin(), 0.005 * (7.0 * t).sin());
        input.devices = held
            .iter()
            .zip(&rest)
            .map(|(grasp, rest)| DeviceInput::held(*rest * 0.98 + sway, *grasp))
            .collect();
        let before = Instant::now();
        step(&model, &mut state, &input);
        times.push(before.elapsed().as_nanos().min(u128::from(u32::MAX)) as u32);
    }
    times.sort_unstable();
    Ok(times)
}
