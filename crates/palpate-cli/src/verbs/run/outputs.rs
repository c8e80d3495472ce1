//! What a run leaves: files, and a summary.

use super::summary::Summary;
use crate::Failure;
use crate::outputs::{OutputFiles, Wanted, Window};
use crate::scene_file::Scene;
use clap::Args;
use palpate::{Input, State};
use std::path::PathBuf;
use std::time::Duration;

/// What a run should leave.
#[derive(Args, Debug, Clone)]
pub struct OutputArguments {
    /// Write every step: device positions, forces and proxies, object poses and velocities, energies
    #[arg(long, value_name = "OUT.csv")]
    pub csv: Option<PathBuf>,
    /// Write every contact of every step: what touches what, where, with which force, gap and slip
    #[arg(long, value_name = "OUT.csv")]
    pub contacts: Option<PathBuf>,
    /// Write objects, obstacles, contacts and devices for ParaView (VTU files and scene.pvd)
    #[arg(long, value_name = "DIR")]
    pub vtu: Option<PathBuf>,
    /// Frames of --vtu per second of simulated time
    #[arg(long, default_value_t = 50.0, value_name = "FPS", allow_negative_numbers = true)]
    pub fps: f64,
    /// One JSON object on standard output
    #[arg(long)]
    pub json: bool,
}

/// How often the deformation is looked at: seldom enough to cost nothing beside the steps.
const LOOKS: usize = 100;

/// The files that are being written, and the summary that is being made.
pub struct Outputs {
    files: OutputFiles,
    summary: Summary,
    steps: usize,
    look_every: usize,
}

impl OutputArguments {
    /// Whether a file is asked for.
    pub fn writes_files(&self) -> bool {
        self.csv.is_some() || self.contacts.is_some() || self.vtu.is_some()
    }

    fn wanted(&self) -> Wanted<'_> {
        Wanted {
            csv: self.csv.as_deref(),
            contacts: self.contacts.as_deref(),
            vtu: self.vtu.as_deref(),
            gltf: None,
            window: Window { fps: self.fps, ..Window::default() },
        }
    }
}

impl Outputs {
    /// Begin, with the scene at its start, where `input` is, and so many steps before it.
    pub fn new(
        arguments: &OutputArguments,
        scene: &Scene,
        state: &State,
        input: &Input,
        steps: usize,
    ) -> Result<Self, Failure> {
        let files = OutputFiles::new(&arguments.wanted(), scene, state, input, steps)?;
        let summary = Summary::new(scene, steps, state.output());
        let look_every = (steps / LOOKS).max(1);
        Ok(Self { files, summary, steps: 0, look_every })
    }

    /// Take in a step, and how long it took.
    pub fn take(
        &mut self,
        scene: &Scene,
        input: &Input,
        state: &State,
        took: Duration,
    ) -> Result<(), Failure> {
        self.steps += 1;
        self.summary.take(state.output(), took);
        if self.steps.is_multiple_of(self.look_every) {
            self.summary.look(scene, state);
        }
        self.files.take(scene, input, state)
    }

    /// Finish all files.
    pub fn finish(mut self, state: &State) -> Result<Summary, Failure> {
        let written = self.files.finish()?;
        let index = written.into_iter().find(|file| file.kind == "vtu").map(|file| file.path);
        self.summary.finish(state.output(), index);
        Ok(self.summary)
    }
}
