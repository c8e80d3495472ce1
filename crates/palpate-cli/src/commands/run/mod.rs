//! `palpate run`: a scene without a viewer, offline or in real time.

mod outputs;
mod realtime;
mod realtime_report;
mod summary;
mod warnings;

use crate::failure::Failure;
use crate::terminal::{notify, print, print_json};
use clap::Args;
use glam::DVec3;
use indicatif::ProgressBar;
pub use outputs::{OutputArguments, Outputs};
use palpate::{DeviceInput, DeviceMode, Grasp, Input, State, step};
use palpate_scene::{RunMode, Scene, SceneDevice, read_scene};
pub use realtime::{RealtimeArguments, read_secret};
pub use realtime_report::{device_line, percentiles, safety, timing};
use std::io::IsTerminal;
use std::path::PathBuf;
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
    /// Scene file
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
    let scene = read_scene(&arguments.scene, mode)?;
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
        print(&summary.text(&scene))?;
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
        check_status(scene, &input, &state)?;
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
    let devices = scene.devices.iter().filter_map(|device| device.path.as_ref());
    let paths = devices.chain(scene.obstacles.iter().filter_map(|obstacle| obstacle.path.as_ref()));
    let paths = paths.chain(scene.clamps.iter().filter_map(|clamp| clamp.path.as_ref()));
    let paths = paths.chain(scene.bases.iter().flatten());
    let paths = paths.chain(&scene.gravity);
    let longest = paths.map(|path| path.end()).fold(0.0, f64::max);
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

/// Ends the run of a scene of held points at an unsolved step, in which the object would be released. In scenes with contacts
/// unsolved steps are counted instead, since the next may be solved.
fn check_status(scene: &Scene, input: &Input, state: &State) -> Result<(), Failure> {
    let output = state.output();
    let moves = output.objects.iter().all(|o| o.energy.stored().is_finite() && o.pose.position.is_finite());
    let finite = moves && output.devices.iter().all(|d| d.force_on_hand.is_finite() && d.proxy.is_finite());
    let solved = output.status.unsolved_islands == 0 || scene.can_touch();
    if solved && output.status.rejected_inputs == 0 && finite {
        return Ok(());
    }
    if scene.can_touch() {
        return Err(Failure(format!(
            "at {:.6} s the numbers are not finite any more, or a device or an obstacle is where it can't be. Use a \
             shorter step than {} s, and check that paths are in metres",
            output.time_s,
            scene.model.parameters().step_s
        )));
    }
    let hint = farthest_hand(scene, input, state).map_or(String::new(), |(distance, name)| {
        format!("; the hand of {name:?} is {distance:.3e} m from the point that it holds")
    });
    Err(Failure(format!(
        "at {:.6} s the held points can't be met: a hand moves, or a body turns, too far in one step of {} s{hint}. Use a \
         shorter step, and check that paths are in metres",
        output.time_s,
        scene.model.parameters().step_s
    )))
}

/// Device without a coupling that is farthest from its held point, with the distance [m].
fn farthest_hand<'s>(scene: &'s Scene, input: &Input, state: &State) -> Option<(f64, &'s str)> {
    let apart = |(device, hand): (&'s SceneDevice, &DeviceInput)| {
        let DeviceMode::Held(Grasp { object, point }) = device.mode else { return None };
        let surface = &scene.model.recordings().nth(object)?.surface;
        let mut displacement = vec![DVec3::ZERO; surface.positions.len()];
        state.surface_displacement(&scene.model, object, &mut displacement);
        let moved: DVec3 =
            surface.corners(&point).iter().map(|&(node, weight)| displacement[node] * weight).sum();
        let pose = state.output().objects[object].pose;
        let held = pose.world_from_body(surface.rest_position(&point) + moved);
        let stiff = device.parameters.coupling.is_none();
        stiff.then(|| ((hand.position - held).length(), device.name.as_str()))
    };
    let hands = scene.devices.iter().zip(&input.devices).filter_map(apart);
    hands.filter(|(distance, _)| *distance > 0.0).max_by(|a, b| a.0.total_cmp(&b.0))
}
