//! What a run leaves: files, and a summary.

use super::summary::Summary;
use crate::Failure;
use crate::csv::{ContactsCsv, StepsCsv};
use crate::scene_file::Scene;
use crate::vtu::VtuSeries;
use crate::whole_file::is_same_file;
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

/// How often the deformation is looked at: seldom enough to cost nothing beside the steps.
const LOOKS: usize = 100;

/// The files that are being written, and the summary that is being made.
pub struct Outputs {
    csv: Option<StepsCsv>,
    contacts: Option<ContactsCsv>,
    series: Option<VtuSeries>,
    fps: f64,
    summary: Summary,
    steps: usize,
    look_every: usize,
}

impl OutputArguments {
    /// Whether a file is asked for.
    pub fn writes_files(&self) -> bool {
        self.csv.is_some() || self.contacts.is_some() || self.vtu.is_some()
    }

    /// Refuse what can't be written before anything is run.
    pub fn check(&self) -> Result<(), Failure> {
        if !(self.fps.is_finite() && self.fps > 0.0) {
            return Err(Failure(format!("--fps is {}, expected a positive number", self.fps)));
        }
        if let (Some(csv), Some(contacts)) = (&self.csv, &self.contacts)
            && is_same_file(csv, contacts)
        {
            return Err(Failure(format!(
                "cannot write {}: --csv and --contacts name the same file",
                contacts.display()
            )));
        }
        Ok(())
    }
}

impl Outputs {
    /// Begin, with the scene at its start and so many steps before it.
    pub fn new(
        arguments: &OutputArguments,
        scene: &Scene,
        state: &State,
        steps: usize,
    ) -> Result<Self, Failure> {
        arguments.check()?;
        let csv = arguments.csv.as_deref().map(|path| StepsCsv::new(path, scene)).transpose()?;
        let contacts = arguments.contacts.as_deref().map(|path| ContactsCsv::new(path, scene)).transpose()?;
        let series = arguments.vtu.as_deref().map(|dir| VtuSeries::new(dir, scene.object_names.clone()));
        let mut series = series.transpose()?;
        if let Some(series) = &mut series {
            series.write_frame(&scene.model, state)?;
        }
        let summary = Summary::new(scene, steps, state.output());
        let look_every = (steps / LOOKS).max(1);
        Ok(Self { csv, contacts, series, fps: arguments.fps, summary, steps: 0, look_every })
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
        let output = state.output();
        self.summary.take(output, took);
        if let Some(csv) = &mut self.csv {
            csv.write(input, output)?;
        }
        if let Some(contacts) = &mut self.contacts {
            contacts.write(scene, output)?;
        }
        if self.steps.is_multiple_of(self.look_every) {
            self.summary.look(scene, state);
        }
        let due = |series: &&mut VtuSeries| output.time_s * self.fps >= series.frames() as f64 - 1e-9;
        if let Some(series) = self.series.as_mut().filter(due) {
            series.write_frame(&scene.model, state)?;
        }
        Ok(())
    }

    /// Finish all files.
    pub fn finish(mut self, state: &State) -> Result<Summary, Failure> {
        if let Some(csv) = self.csv {
            csv.finish()?;
        }
        if let Some(contacts) = self.contacts {
            contacts.finish()?;
        }
        let index = self.series.map(VtuSeries::finish).transpose()?;
        self.summary.finish(state.output(), index);
        Ok(self.summary)
    }
}
