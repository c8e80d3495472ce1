//! `palpate run`: a scene without a viewer, offline or in real time.

mod outputs;
mod realtime;
mod realtime_report;
mod summary;
mod warnings;

use crate::failure::Failure;
use crate::standard_streams::{
    FOLDER, LOG_OUTPUT, SEEKS, STANDARD_INPUT, is_stream, read_input, refuse, report, takes_output,
};
use crate::terminal::{notify, print_json};
use clap::Args;
use indicatif::ProgressBar;
pub use outputs::{OutputArguments, Outputs};
use palpate::{State, step};
use palpate_scene::{RunMode, Scene, SceneDevice, read_piped_scene, read_scene};
pub use realtime::{RealtimeArguments, read_secret};
pub use realtime_report::{device_line, percentiles, safety, timing};
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::time::Instant;
pub use summary::Summary;

/// Run a scene and write forces, contacts, motion and energies
///
/// Devices hold points of the objects or touch them, and follow their paths; objects fall on planes and meet obstacles.
/// The results are the forces on the hands, all contacts, the motion and the deformation, by step.
#[derive(Args, Debug, Clone)]
#[command(after_help = "A scene (docs/scene.md has every key):
  step = 0.001
  [[object]]
  name = \"cube\"
  recording = \"cube.palp\"
  [[device]]
  name = \"left\"
  mode = \"held\"
  attach = { object = \"cube\", point = [-0.05, 0.0, 0.0] }
  path = { file = \"left.csv\" }     # t,x,y,z in s and m, world
  [[device]]
  name = \"finger\"
  mode = \"touch\"
  tip_radius = 0.005                # m
  path = { file = \"finger.csv\" }
  [[plane]]
  point = [0.0, -0.05, 0.0]
  normal = [0.0, 1.0, 0.0]          # out of the floor
  [[obstacle]]
  sphere = { radius = 0.02 }        # or box, capsule, mesh
  position = [0.0, 0.2, 0.0]        # or path = { file = \"ball.csv\" }")]
pub struct Arguments {
    /// Scene file; `-` for standard input, with the files that it names in the current folder
    pub scene: PathBuf,
    /// Duration [s]; by default to the end of the longest path, in real time with real or linked devices until Ctrl-C
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub duration: Option<f64>,
    /// Treat warnings as errors: end with status 1, before the first step if the scene has one
    #[arg(long)]
    pub strict: bool,
    /// Every surface node as a contact, and no object asleep, where the scene does not say otherwise: slow, to compare with
    #[arg(long, conflicts_with = "realtime")]
    pub reference: bool,
    /// Outputs
    #[command(flatten)]
    pub outputs: OutputArguments,
    /// Real time
    #[command(flatten)]
    pub realtime: RealtimeArguments,
}

/// Duration without paths [s]: long enough for a fall.
const DEFAULT_DURATION_S: f64 = 1.0;

/// Number of steps (a second of work) above which a progress bar is shown.
const PROGRESS_FROM: usize = 200_000;

/// Upper bound of the number of steps: a day at 1 kHz.
const MAX_STEPS: f64 = 1e8;

/// Runs the command.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let mode = match (arguments.realtime.realtime, arguments.reference) {
        (true, _) => RunMode::RealTime,
        (false, true) => RunMode::Reference,
        (false, false) => RunMode::Offline,
    };
    let outputs = &arguments.outputs;
    refuse(&[
        ("--vtu", outputs.vtu.as_deref(), FOLDER),
        ("--sound", outputs.sound.as_deref(), SEEKS),
        ("--log", arguments.realtime.log.as_deref(), LOG_OUTPUT),
    ])?;
    let output_is_taken = takes_output(
        &[("--csv", outputs.csv.as_deref()), ("--contacts", outputs.contacts.as_deref())],
        outputs.json,
    )?;
    let scene = if is_stream(&arguments.scene) {
        if arguments.realtime.log.is_some() {
            return Err(Failure("a log keeps the scene's file: write the scene to one for --log".into()));
        }
        read_piped_scene(Path::new(STANDARD_INPUT), &read_input()?, mode)?
    } else {
        read_scene(&arguments.scene, mode)?
    };
    scene.warnings.iter().for_each(|warning| notify(&format!("warning: {warning}")));
    scene.choices.iter().for_each(|choice| notify(choice));
    warnings::refuse(arguments.strict, &scene.warnings)?;
    if arguments.realtime.realtime {
        return realtime::run(&scene, arguments);
    }
    arguments.realtime.refuse()?;
    let summary = simulate(&scene, arguments)?;
    if arguments.outputs.json {
        print_json(&summary.json(&scene))?;
    } else {
        report(&summary.text(&scene), output_is_taken)?;
    }
    warnings::refuse(arguments.strict, &summary.warnings(&scene))
}

/// Runs a scene offline to its end.
pub fn simulate(scene: &Scene, arguments: &Arguments) -> Result<Summary, Failure> {
    for SceneDevice { name, path, simulated, real, pointer, .. } in &scene.devices {
        if *pointer {
            return Err(pointer_without_page(name));
        }
        let what = match (real, path, simulated) {
            (Some(_), ..) => "is held by a real hand",
            (None, None, _) => "comes over a link",
            (None, _, Some(_)) => "is held by a simulated hand",
            _ => continue,
        };
        return Err(Failure(format!("the device {name:?} {what}, which lives in real time: add --realtime")));
    }
    let step_s = scene.model.parameters().step_s;
    let steps = count_steps(scene, arguments)?;
    let mut state = State::new(&scene.model);
    let start = scene.input_at(0.0);
    let mut outputs = Outputs::new(&arguments.outputs, scene, &state, &start, steps)?;
    let bar = if std::io::stderr().is_terminal() && steps > PROGRESS_FROM {
        ProgressBar::new(steps as u64)
    } else {
        ProgressBar::hidden()
    };
    for number in 1..=steps {
        if number % 1024 == 0 {
            bar.set_position(number as u64);
        }
        let input = scene.input_at(number as f64 * step_s);
        let before = Instant::now();
        step(&scene.model, &mut state, &input);
        let took = before.elapsed();
        scene.check_step(&input, &state).map_err(Failure)?;
        outputs.take(scene, &input, &state, took)?;
    }
    bar.finish_and_clear();
    outputs.finish(scene, &state)
}

/// Failure for a pointer, which needs the viewer.
fn pointer_without_page(name: &str) -> Failure {
    Failure(format!("the device {name:?} is a pointer of the viewer: open the scene with palpate serve"))
}

/// Number of steps: for the given duration, or to the end of the longest path.
fn count_steps(scene: &Scene, arguments: &Arguments) -> Result<usize, Failure> {
    let step_s = scene.model.parameters().step_s;
    let longest = scene.end_s();
    let duration = arguments.duration.unwrap_or(if longest > 0.0 { longest } else { DEFAULT_DURATION_S });
    let steps = (duration / step_s).round();
    if !(duration.is_finite() && duration > 0.0 && steps >= 1.0) {
        return Err(Failure(format!(
            "the duration is {duration} s, expected at least one step of {step_s} s"
        )));
    }
    if steps > MAX_STEPS {
        return Err(Failure(format!(
            "{duration} s are {steps} steps of {step_s} s, at most {MAX_STEPS} are run at once"
        )));
    }
    Ok(steps as usize)
}
