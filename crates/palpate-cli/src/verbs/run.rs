//! `palpate run`: a scene, headless, as fast as it goes.

use crate::Failure;
use crate::csv::CsvWriter;
use crate::scene_file::{self, Scene};
use crate::verbs::{print, print_json};
use crate::vtu::VtuSeries;
use clap::Args;
use glam::DVec3;
use indicatif::ProgressBar;
use palpate::{DeviceInput, Input, Output, State, StepStatus, step};
use serde_json::{Value, json};
use std::io::IsTerminal;
use std::path::PathBuf;
use std::time::Instant;

/// Run a scene and write forces, motion and energies
///
/// Devices hold points of the objects and follow their paths; out come the forces on the hands, the motion and the
/// deformation, step by step.
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
  path = { file = \"left.csv\" }     # t,x,y,z in s and m, world")]
pub struct Arguments {
    /// The scene file
    pub scene: PathBuf,
    /// How long [s]; by default to the end of the longest path
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub duration: Option<f64>,
    /// Write every step: device positions and forces, object poses and velocities, energies
    #[arg(long, value_name = "OUT.csv")]
    pub csv: Option<PathBuf>,
    /// Write the deformed surfaces for ParaView (VTU files and scene.pvd)
    #[arg(long, value_name = "DIR")]
    pub vtu: Option<PathBuf>,
    /// Frames of --vtu per second of simulated time
    #[arg(long, default_value_t = 50.0, value_name = "FPS", allow_negative_numbers = true)]
    pub fps: f64,
    /// One JSON object on standard output
    #[arg(long)]
    pub json: bool,
}

/// Longest run [s] without a path to tell: long enough to see a fall.
const DEFAULT_DURATION_S: f64 = 1.0;

/// How often the deformation is looked at: seldom enough to cost nothing beside the steps.
const LOOKS: usize = 100;

/// Elastic displacement, as a share of the object's diagonal, beyond which linear elasticity is doubtful.
const LARGE_DEFORMATION: f64 = 0.1;

/// Runs of more steps than this (a second of work) show a bar on a terminal.
const PROGRESS_FROM: usize = 200_000;

/// More steps than this are a slip of the keyboard (a day at 1 kHz).
const MOST_STEPS: f64 = 1e8;

/// Run the verb.
pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let scene = scene_file::read(&arguments.scene)?;
    scene.remarks.iter().for_each(|remark| crate::tell(&format!("warning: {remark}")));
    let summary = simulate(&scene, arguments)?;
    if arguments.json { print_json(&summary.json(&scene)) } else { print(&summary.text(&scene)) }
}

/// What a run came to.
pub struct Summary {
    steps: usize,
    /// Force on the hand [N], every step, per device.
    pub forces: Vec<Vec<DVec3>>,
    last: Output,
    /// Worst of every step.
    status: StepStatus,
    start_energy: f64,
    /// Compute time of each step [ns], sorted.
    times_ns: Vec<u32>,
    index: Option<PathBuf>,
    /// Largest elastic displacement of the surface [m] per object, looked at now and then.
    deformation: Vec<f64>,
}

/// Run a scene to its end.
pub fn simulate(scene: &Scene, arguments: &Arguments) -> Result<Summary, Failure> {
    let step_s = scene.model.parameters().step_s;
    let longest = scene.devices.iter().map(|device| device.path.end()).fold(0.0, f64::max);
    let duration = arguments.duration.unwrap_or(if longest > 0.0 { longest } else { DEFAULT_DURATION_S });
    let steps = (duration / step_s).round();
    if !(duration.is_finite() && duration > 0.0 && steps >= 1.0) {
        return Err(Failure(format!(
            "the duration is {duration} s, expected at least one step of {step_s} s"
        )));
    }
    if steps > MOST_STEPS {
        return Err(Failure(format!(
            "{duration} s are {steps} steps of {step_s} s, at most {MOST_STEPS} are run at once"
        )));
    }
    if !(arguments.fps.is_finite() && arguments.fps > 0.0) {
        return Err(Failure(format!("--fps is {}, expected a positive number", arguments.fps)));
    }
    let steps = steps as usize;
    let mut state = State::new(&scene.model);
    let mut csv = arguments.csv.as_deref().map(|path| CsvWriter::new(path, scene)).transpose()?;
    let mut series =
        arguments.vtu.as_deref().map(|dir| VtuSeries::new(dir, scene.object_names.clone())).transpose()?;
    let mut input = Input {
        devices: scene
            .devices
            .iter()
            .map(|device| DeviceInput { position: device.path.at(0.0), grasp: Some(device.grasp) })
            .collect(),
    };
    let mut summary = Summary {
        steps,
        forces: vec![Vec::with_capacity(steps); scene.devices.len()],
        last: state.output().clone(),
        status: StepStatus::default(),
        start_energy: state.output().energy.stored(),
        times_ns: Vec::with_capacity(steps),
        index: None,
        deformation: vec![0.0; scene.object_names.len()],
    };
    let look_every = (steps / LOOKS).max(1);
    if let Some(series) = &mut series {
        series.write_frame(&scene.model, &state)?;
    }
    let bar = if std::io::stderr().is_terminal() && steps > PROGRESS_FROM {
        ProgressBar::new(steps as u64)
    } else {
        ProgressBar::hidden()
    };
    for number in 1..=steps {
        if number % 1024 == 0 {
            bar.set_position(number as u64);
        }
        let time = number as f64 * step_s;
        for (device, entry) in scene.devices.iter().zip(&mut input.devices) {
            entry.position = device.path.at(time);
        }
        let before = Instant::now();
        let output = step(&scene.model, &mut state, &input);
        summary.times_ns.push(before.elapsed().as_nanos().min(u128::from(u32::MAX)) as u32);
        summary.take(output);
        check_status(scene, &input, output)?;
        if let Some(csv) = &mut csv {
            csv.write(&input, output)?;
        }
        if number % look_every == 0 {
            summary.look(scene, &state);
        }
        if let Some(series) =
            series.as_mut().filter(|series| time * arguments.fps >= series.frames() as f64 - 1e-9)
        {
            series.write_frame(&scene.model, &state)?;
        }
    }
    bar.finish_and_clear();
    summary.times_ns.sort_unstable();
    summary.last = state.output().clone();
    if let Some(csv) = csv {
        csv.finish()?;
    }
    summary.index = series.map(VtuSeries::finish).transpose()?;
    Ok(summary)
}

/// A step that could not be solved ends the run: its numbers would be those of an object let go.
fn check_status(scene: &Scene, input: &Input, output: &Output) -> Result<(), Failure> {
    let finite = output.objects.iter().all(|o| o.energy.stored().is_finite() && o.pose.position.is_finite());
    if output.status.unsolved_objects == 0 && output.status.rejected_devices == 0 && finite {
        return Ok(());
    }
    let apart =
        input.devices.iter().zip(&output.devices).map(|(hand, out)| (hand.position - out.point).length());
    let farthest = apart.zip(&scene.devices).max_by(|a, b| a.0.total_cmp(&b.0));
    let hint =
        farthest.filter(|(distance, _)| *distance > 0.0).map_or(String::new(), |(distance, device)| {
            format!("; the hand of {:?} is {distance:.3e} m from the point that it holds", device.name)
        });
    Err(Failure(format!(
        "at {:.6} s the held points can't be met: a hand moves, or a body turns, too far in one step of {} s{hint}. Use a \
         shorter step, and check that paths are in metres",
        output.time_s,
        scene.model.parameters().step_s
    )))
}

impl Summary {
    fn take(&mut self, output: &Output) {
        for (forces, device) in self.forces.iter_mut().zip(&output.devices) {
            forces.push(device.force_on_hand);
        }
        let (all, now) = (&mut self.status, &output.status);
        all.solver_residual_m = all.solver_residual_m.max(now.solver_residual_m);
        all.iterations = all.iterations.max(now.iterations);
        all.dependent_rows = all.dependent_rows.max(now.dependent_rows);
    }

    fn look(&mut self, scene: &Scene, state: &State) {
        for (object, (recording, largest)) in scene.model.recordings().zip(&mut self.deformation).enumerate()
        {
            let mut displacement = vec![DVec3::ZERO; recording.surface.positions.len()];
            state.surface_displacement(&scene.model, object, &mut displacement);
            *largest = displacement.iter().map(|u| u.length()).fold(*largest, f64::max);
        }
    }

    /// Compute time of a step [µs] at a share of all steps: 0.5 is the median.
    pub fn time_us(&self, share: f64) -> f64 {
        percentile_us(&self.times_ns, share)
    }

    /// Work done by the hands, energy kept and lost [J], and what the sum misses.
    fn json(&self, scene: &Scene) -> Value {
        let last_force = |forces: &Vec<DVec3>| forces.last().copied().unwrap_or_default();
        let devices: Vec<Value> = scene
            .devices
            .iter()
            .zip(&self.forces)
            .map(|(device, forces)| {
                json!({
                    "name": device.name,
                    "force_last_n": last_force(forces).length(),
                    "force_max_n": largest(forces),
                    "force_last_xyz_n": last_force(forces).to_array(),
                })
            })
            .collect();
        let objects: Vec<Value> = scene
            .object_names
            .iter()
            .zip(&self.last.objects)
            .zip(&self.deformation)
            .map(|((name, object), deformation)| {
                let q = object.pose.orientation;
                json!({
                    "name": name,
                    "position_m": object.pose.position.to_array(),
                    "orientation": [q.w, q.x, q.y, q.z],
                    "velocity_m_s": object.twist.linear.to_array(),
                    "angular_velocity_rad_s": object.twist.angular.to_array(),
                    "displacement_max_m": deformation,
                })
            })
            .collect();
        let energy = &self.last.energy;
        json!({
            "steps": self.steps,
            "step_s": scene.model.parameters().step_s,
            "devices": devices,
            "objects": objects,
            "energy_j": {
                "kinetic": energy.kinetic,
                "elastic": energy.elastic,
                "residual": energy.residual,
                "potential": energy.potential,
                "input": energy.input,
                "dissipated": energy.dissipated,
                "defect": energy.defect,
                "stored_at_start": self.start_energy,
            },
            "timing_us": {
                "p50": self.time_us(0.5),
                "p99": self.time_us(0.99),
                "p999": self.time_us(0.999),
                "max": self.time_us(1.0),
            },
            "solver": {
                "held_point_miss_max_m": self.status.solver_residual_m,
                "iterations_max": self.status.iterations,
                "dependent_rows": self.status.dependent_rows,
            },
        })
    }

    /// The same for a person.
    pub fn text(&self, scene: &Scene) -> String {
        let step_s = scene.model.parameters().step_s;
        let mut out = format!("{} steps of {} ms = {:.4} s\n", self.steps, 1000.0 * step_s, self.last.time_s);
        for (device, forces) in scene.devices.iter().zip(&self.forces) {
            let last = forces.last().copied().unwrap_or_default();
            out += &format!(
                "  {:<12} force on the hand {:.5} N at the end, {:.5} N at most\n",
                device.name,
                last.length(),
                largest(forces)
            );
        }
        for ((name, object), deformation) in
            scene.object_names.iter().zip(&self.last.objects).zip(&self.deformation)
        {
            // Adding 0 turns −0 into 0.
            let (p, v) = (object.pose.position + DVec3::ZERO, object.twist.linear + DVec3::ZERO);
            out += &format!(
                "  {name:<12} centre ({:.5}, {:.5}, {:.5}) m, velocity ({:.4}, {:.4}, {:.4}) m/s, deformed by up to {:.2} mm\n",
                p.x,
                p.y,
                p.z,
                v.x,
                v.y,
                v.z,
                1000.0 * deformation
            );
        }
        let energy = &self.last.energy;
        out += &format!(
            "  energy       {:+.3e} J stored since the start = {:+.3e} J from the hands - {:.3e} J dissipated, to {:.0e} J\n",
            energy.stored() - self.start_energy,
            energy.input,
            energy.dissipated,
            energy.defect.abs()
        );
        out += &format!(
            "  step time    {:.1} µs median; 99 % below {:.1}, 99.9 % below {:.1}, all below {:.1}\n",
            self.time_us(0.5),
            self.time_us(0.99),
            self.time_us(0.999),
            self.time_us(1.0)
        );
        let recordings = scene.model.recordings().zip(&scene.object_names).zip(&self.deformation);
        for ((recording, name), deformation) in recordings {
            let share = deformation / recording.surface.diagonal();
            if share > LARGE_DEFORMATION {
                out += &format!(
                    "  warning      {name} deforms by {:.0} % of its size; linear elasticity is meant for small strain\n",
                    100.0 * share
                );
            }
        }
        if self.status.dependent_rows > 0 {
            out += &format!(
                "  warning      {} held directions repeat others and were given no force\n",
                self.status.dependent_rows
            );
        }
        if let Some(index) = &self.index {
            out += &format!("  surfaces     {} (open it in ParaView)\n", index.display());
        }
        out
    }
}

/// Time [µs] at a share of sorted times [ns].
pub fn percentile_us(sorted_ns: &[u32], share: f64) -> f64 {
    let at = (share * sorted_ns.len() as f64).ceil() as usize;
    sorted_ns.get(at.clamp(1, sorted_ns.len().max(1)) - 1).map_or(0.0, |ns| f64::from(*ns) / 1000.0)
}

fn largest(forces: &[DVec3]) -> f64 {
    forces.iter().map(|force| force.length()).fold(0.0, f64::max)
}
