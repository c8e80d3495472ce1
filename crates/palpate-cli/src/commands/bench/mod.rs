//! `palpate bench`: percentiles of step times.

mod baseline;
mod frames;
mod many;
mod rough;
mod table;
mod touch;

use crate::commands::demo::cached_cube;
use crate::failure::Failure;
use crate::terminal::{print, print_json};
use baseline::PERCENTILES;
use clap::Args;
use glam::DVec3;
use palpate::{
    DeviceInput, DeviceParameters, Grasp, Input, Model, ModelObject, ModelParameters, ObjectStart, Pose,
    Recording, State, Twist, step,
};
use palpate_haptics::percentile_us;
use serde_json::{Value, json};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

/// Time a step: against the mesh, the modes, held points and objects; fingers, floors, recorded tables, rough motion, many bodies; and the encoding of frames
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
    /// Number of repeats: the minimum over them is taken for each step, its compute time without interruptions
    #[arg(long, default_value_t = 1, value_name = "N")]
    runs: usize,
    /// Number of random motions in rows of random pointers and throws: their steps are timed together. Such motion is chaotic, and one
    /// alone may change by a third with the last digit of a number
    #[arg(long, default_value_t = 1, value_name = "N")]
    seeds: u64,
    /// Time only the rows whose name contains this
    #[arg(long, value_name = "TEXT")]
    only: Option<String>,
    /// Cache folder of recordings [default: $XDG_CACHE_HOME/palpate or ~/.cache/palpate]
    #[arg(long, value_name = "DIR")]
    cache: Option<PathBuf>,
    /// Save the times as a baseline, to compare with later
    #[arg(long, value_name = "FILE")]
    save: Option<PathBuf>,
    /// Compare with a baseline that --save wrote: ratios now/then of each row, and what got slower. Compare two builds on one machine that
    /// does nothing else, with --runs 3 or more
    #[arg(long, value_name = "FILE")]
    against: Option<PathBuf>,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

/// Case with moving held points.
struct HeldCase {
    label: String,
    recording: Arc<Recording>,
    objects: usize,
    points: usize,
}

/// Case: a label, and a function from a number of steps, the same each time, to their compute times [ns].
type Case = (String, Box<dyn Fn(usize) -> Result<Vec<u32>, Failure>>);

/// Runs the command.
pub fn bench(arguments: &Arguments) -> Result<(), Failure> {
    if arguments.steps == 0 {
        return Err(Failure("--steps is 0, expected 1 or more".into()));
    }
    if arguments.runs == 0 {
        return Err(Failure("--runs is 0, expected 1 or more".into()));
    }
    if arguments.seeds == 0 {
        return Err(Failure("--seeds is 0, expected 1 or more".into()));
    }
    let before = arguments.against.as_deref().map(baseline::read).transpose()?.unwrap_or_default();
    let cube = |cells, modes| -> Result<Arc<Recording>, Failure> {
        Ok(Arc::new(cached_cube(cells, modes, arguments.cache.as_deref())?))
    };
    let mut cases: Vec<HeldCase> = Vec::new();
    for &cells in &arguments.cells {
        let recording = cube(cells, 200)?;
        let nodes = recording.metadata.mesh.nodes;
        let label = format!("{cells}³ cells, {nodes} nodes, 200 modes, 2 held points");
        cases.push(HeldCase { label, recording, objects: 1, points: 2 });
    }
    let usual = cube(12, 200)?;
    for modes in [50, 400] {
        let label = format!("12³ cells, {modes} modes, 2 held points");
        cases.push(HeldCase { label, recording: cube(12, modes)?, objects: 1, points: 2 });
    }
    for points in [1, 4, 8, 16] {
        let label = format!("12³ cells, 200 modes, {points} held points");
        cases.push(HeldCase { label, recording: usual.clone(), objects: 1, points });
    }
    for objects in [4, 16] {
        let label = format!("{objects} cubes of 12³ cells, 200 modes, 2 held points each");
        cases.push(HeldCase { label, recording: usual.clone(), objects, points: 2 });
    }
    let held = cases.into_iter().map(|case| -> Case {
        let label = case.label.clone();
        (label, Box::new(move |steps| held_steps(&case, steps)))
    });
    let touch = touch::cases(usual.clone(), cube(16, 200)?);
    let table = table::cases(cube(4, 100)?);
    let rough = rough::cases(usual, arguments.cache.as_deref(), arguments.seeds);
    let wanted = |label: &str| arguments.only.as_deref().is_none_or(|text| label.contains(text));
    let cases =
        held.chain(touch).chain(table).chain(rough).chain(many::cases()).filter(|(label, _)| wanted(label));
    if !arguments.json {
        let ratios = if arguments.against.is_some() { "  now/then" } else { "" };
        print(&format!(
            "{:<70}{:>8}{:>8}{:>8}{:>9}{ratios}\n",
            "step time [µs]", "p50", "p99", "p99.9", "max"
        ))?;
    }
    let mut rows = Vec::new();
    for (label, measure) in cases {
        let row = measured_row(&label, &measure, arguments)?;
        if !arguments.json {
            let [p50, p99, p999, max] = PERCENTILES.map(|(name, _)| row[name].as_f64().unwrap_or(f64::NAN));
            let ratios =
                baseline::ratios(&row, &before).map(|ratios| ratios.map(|ratio| format!("{ratio:6.2}")));
            let ratios = ratios.map(|ratios| format!("  {}", ratios.join(""))).unwrap_or_default();
            print(&format!("{label:<70}{p50:>8.2}{p99:>8.2}{p999:>8.2}{max:>9.2}{ratios}\n"))?;
        }
        rows.push(row);
    }
    if rows.is_empty() {
        let text = arguments.only.as_deref().unwrap_or_default();
        return Err(Failure(format!(
            "no row's name contains '{text}'; palpate bench --steps 1 shows them all"
        )));
    }
    if let Some(path) = &arguments.save {
        baseline::save(path, &rows)?;
    }
    if arguments.json {
        return print_json(&json!({ "step_time_us": rows }));
    }
    if arguments.against.is_some() { print(&baseline::summary(&rows, &before)) } else { Ok(()) }
}

/// Percentiles of a case: of each step, the least time over the runs.
fn measured_row(
    label: &str,
    measure: &dyn Fn(usize) -> Result<Vec<u32>, Failure>,
    arguments: &Arguments,
) -> Result<Value, Failure> {
    let mut times = measure(arguments.steps)?;
    for _ in 1..arguments.runs {
        times.iter_mut().zip(measure(arguments.steps)?).for_each(|(least, time)| *least = time.min(*least));
    }
    times.sort_unstable();
    let mut row = json!({ "case": label });
    for (name, share) in PERCENTILES {
        row[name] = json!(percentile_us(&times, share));
    }
    Ok(row)
}

/// Compute times of steps with moving held points [ns].
fn held_steps(case: &HeldCase, steps: usize) -> Result<Vec<u32>, Failure> {
    let surface = &case.recording.surface;
    let held: Vec<Grasp> = (0..case.objects)
        .flat_map(|object| {
            (0..case.points).filter_map(move |at| {
                // Points on a spiral over the bounding sphere, projected to the surface.
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
    // Side by side, far enough for no contact.
    let spacing = 5.0 * surface.radius();
    let centre = |object: usize| DVec3::Z * (spacing * object as f64);
    let start = |object| ObjectStart {
        pose: Pose { position: centre(object), ..Pose::IDENTITY },
        twist: Twist::ZERO,
    };
    let parameters = ModelParameters {
        devices: vec![DeviceParameters::default(); held.len()],
        ..ModelParameters::for_reference()
    };
    let objects = (0..case.objects).map(|object| ModelObject::new(case.recording.clone(), start(object)));
    let model = Model::new(parameters, objects.collect())?;
    let mut state = State::new(&model);
    let rest: Vec<DVec3> = held.iter().map(|grasp| surface.rest_position(&grasp.point)).collect();
    let mut input = Input { devices: Vec::new(), ..Input::default() };
    let mut times = Vec::with_capacity(steps);
    for number in 0..steps {
        let t = number as f64 * 1e-3;
        // Gently: the paper's cube is undamped here, and strong shaking builds up to several times its size.
        let sway = DVec3::new(0.006 * (12.0 * t).sin(), 0.004 * (5.0 * t).sin(), 0.002 * (7.0 * t).sin());
        input.devices = held
            .iter()
            .zip(&rest)
            .map(|(grasp, rest)| DeviceInput::held(centre(grasp.object) + *rest * 0.98 + sway, *grasp))
            .collect();
        times.push(timed_step(&model, &mut state, &input));
    }
    Ok(times)
}

/// Compute time of a step [ns].
fn timed_step(model: &Model, state: &mut State, input: &Input) -> u32 {
    let before = Instant::now();
    step(model, state, input);
    before.elapsed().as_nanos().min(u128::from(u32::MAX)) as u32
}
