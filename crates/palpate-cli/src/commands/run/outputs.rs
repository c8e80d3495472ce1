//! Outputs of a run: files, and a summary.

use super::summary::Summary;
use crate::failure::Failure;
use clap::Args;
use palpate::{Input, State};
use palpate_export::{ExportOptions, SceneExporter, TimeWindow};
use palpate_scene::Scene;
use palpate_sound::SoundParameters;
use std::path::PathBuf;
use std::time::Duration;

/// Outputs of a run.
#[derive(Args, Debug, Clone)]
pub struct OutputArguments {
    /// Write every step: device positions, forces and proxies, object poses and velocities, net forces, energies; `-` for standard output
    #[arg(long, value_name = "OUT.csv")]
    pub csv: Option<PathBuf>,
    /// Write every contact of every step: what touches what, where, with which force, gap and slip; `-` for standard output
    #[arg(long, value_name = "OUT.csv")]
    pub contacts: Option<PathBuf>,
    /// Write objects, obstacles, contacts and devices for ParaView (VTU files and scene.pvd)
    #[arg(long, value_name = "DIR")]
    pub vtu: Option<PathBuf>,
    /// Frames of --vtu per second of simulated time
    #[arg(long, default_value_t = 50.0, value_name = "FPS", allow_negative_numbers = true)]
    pub fps: f64,
    /// Write the sound of the objects: WAV, 16 bits, one channel, 48 kHz (docs/sound.md)
    #[arg(long, value_name = "OUT.wav")]
    pub sound: Option<PathBuf>,
    /// Sound pressure of full scale half a metre from every object [Pa]; a smaller one makes --sound louder
    #[arg(long, default_value_t = SoundParameters::default().full_scale_pa, value_name = "PA", allow_negative_numbers = true)]
    pub sound_full_scale: f64,
    /// One JSON object on standard output
    #[arg(long)]
    pub json: bool,
}

/// Number of samples of all surfaces in a run: few enough to cost nothing beside the steps.
const SAMPLES: usize = 100;

/// Writer of the files and the summary of a run.
pub struct Outputs {
    files: SceneExporter,
    summary: Summary,
    steps: usize,
    sample_every: usize,
}

impl OutputArguments {
    /// Whether a file is asked for.
    pub fn writes_files(&self) -> bool {
        self.csv.is_some() || self.contacts.is_some() || self.vtu.is_some() || self.sound.is_some()
    }

    /// Refuses a full scale of the sound that is no positive number.
    fn check_sound(&self) -> Result<(), Failure> {
        let pressure = self.sound_full_scale;
        if pressure > 0.0 && pressure.is_finite() {
            return Ok(());
        }
        Err(Failure(format!("--sound-full-scale is {pressure} Pa, expected a positive number")))
    }

    fn options(&self) -> ExportOptions<'_> {
        ExportOptions {
            csv: self.csv.as_deref(),
            contacts: self.contacts.as_deref(),
            vtu: self.vtu.as_deref(),
            gltf: None,
            sound: self.sound.as_deref(),
            sound_parameters: SoundParameters {
                full_scale_pa: self.sound_full_scale,
                ..SoundParameters::default()
            },
            window: TimeWindow { fps: self.fps, ..TimeWindow::default() },
        }
    }
}

impl Outputs {
    /// Creates the files, for `steps` steps from an initial state and input.
    pub fn new(
        arguments: &OutputArguments,
        scene: &Scene,
        state: &State,
        input: &Input,
        steps: usize,
    ) -> Result<Self, Failure> {
        arguments.check_sound()?;
        let files =
            SceneExporter::new(&arguments.options(), &scene.model, scene.labels(), state, input, steps)?;
        let summary = Summary::new(scene, steps, state.output());
        let sample_every = (steps / SAMPLES).max(1);
        Ok(Self { files, summary, steps: 0, sample_every })
    }

    /// Adds a step and its compute time.
    pub fn take(
        &mut self,
        scene: &Scene,
        input: &Input,
        state: &State,
        took: Duration,
    ) -> Result<(), Failure> {
        self.steps += 1;
        self.summary.take(input, state, took);
        if self.steps.is_multiple_of(self.sample_every) {
            self.summary.sample_surfaces(scene, input, state);
        }
        Ok(self.files.write(&scene.model, input, state)?)
    }

    /// Completes all files.
    pub fn finish(mut self, scene: &Scene, state: &State) -> Result<Summary, Failure> {
        let peak = self.files.sound_peak();
        let written = self.files.finish()?;
        let path_of =
            |kind: &str| written.iter().find(|file| file.kind == kind).map(|file| file.path.clone());
        self.summary.finish(scene, state, path_of("vtu"), path_of("sound").zip(peak));
        Ok(self.summary)
    }
}
