//! Export of a run: rows of numbers per step, and frames at a frame rate.

use crate::atomic_file::check_distinct;
use crate::csv::{ContactsCsv, StepsCsv};
use crate::error::ExportError;
use crate::frame::{Frame, TimeWindow};
use crate::glb_scene::{GlbScene, GlbWarning};
use crate::labels::SceneLabels;
use crate::sound_file::SoundFile;
use crate::vtu_scene::VtuScene;
use glam::DVec3;
use palpate::{Input, Model, State};
use palpate_sound::SoundParameters;
use std::path::{Path, PathBuf};

/// Files to write, and the steps that they show.
#[derive(Debug, Clone, Default)]
pub struct ExportOptions<'a> {
    /// CSV file with a row per step; `-` is standard output.
    pub csv: Option<&'a Path>,
    /// CSV file with a row per contact and step; `-` is standard output.
    pub contacts: Option<&'a Path>,
    /// Folder for VTU files.
    pub vtu: Option<&'a Path>,
    /// Animated GLB file.
    pub gltf: Option<&'a Path>,
    /// WAV file with the sound.
    pub sound: Option<&'a Path>,
    /// Listener and full scale of the sound.
    pub sound_parameters: SoundParameters,
    /// Steps and frame rate.
    pub window: TimeWindow,
}

/// Written file.
pub struct WrittenFile {
    /// Kind: `csv`, `contacts`, `vtu`, `gltf` or `sound`.
    pub kind: &'static str,
    /// Path; of a series its index.
    pub path: PathBuf,
}

/// Writer of the files of a run.
pub struct SceneExporter {
    csv: Option<StepsCsv>,
    contacts: Option<ContactsCsv>,
    vtu: Option<VtuScene>,
    glb: Option<GlbScene>,
    sound: Option<SoundFile>,
    labels: SceneLabels,
    warning: Option<GlbWarning>,
    window: TimeWindow,
    frames: usize,
    displacements: Vec<Vec<DVec3>>,
}

impl ExportOptions<'_> {
    /// Checks the options before anything is run.
    ///
    /// # Errors
    /// [`ExportError::TimeWindow`] and [`ExportError::SameFile`].
    pub fn check(&self) -> Result<(), ExportError> {
        self.window.check()?;
        check_distinct(&[
            ("csv", self.csv),
            ("contacts", self.contacts),
            ("gltf", self.gltf),
            ("sound", self.sound),
        ])
    }
}

impl SceneExporter {
    /// Creates the files, for a run of `steps` steps from an initial state and input.
    ///
    /// # Errors
    /// When the options are refused, or a file cannot be created.
    pub fn new(
        options: &ExportOptions,
        model: &Model,
        labels: SceneLabels,
        state: &State,
        input: &Input,
        steps: usize,
    ) -> Result<Self, ExportError> {
        options.check()?;
        let frames = options.window.frames(steps, model.parameters().step_s);
        let parts = (model, &labels);
        // First the file that may be refused for its size.
        let glb = options.gltf.map(|path| GlbScene::new(path, parts, state, input, frames)).transpose()?;
        let (glb, warning) = glb.map_or((None, None), |(glb, warning)| (Some(glb), warning));
        let mut files = Self {
            glb,
            warning,
            csv: options.csv.map(|path| StepsCsv::new(path, &labels)).transpose()?,
            contacts: options.contacts.map(|path| ContactsCsv::new(path, &labels)).transpose()?,
            vtu: options.vtu.map(|folder| VtuScene::new(folder, parts, state, input)).transpose()?,
            sound: options
                .sound
                .map(|path| {
                    let of_run = (model, state);
                    SoundFile::new(path, &labels.input_paths(), of_run, &options.sound_parameters, steps)
                })
                .transpose()?,
            window: options.window,
            frames: 0,
            displacements: model
                .recordings()
                .map(|recording| vec![DVec3::ZERO; recording.surface.positions.len()])
                .collect(),
            labels,
        };
        files.write_frame_if_due(model, input, state)?;
        Ok(files)
    }

    /// Warning about the expected size of the GLB file.
    pub fn warning(&self) -> Option<&GlbWarning> {
        self.warning.as_ref()
    }

    /// Largest size of a sample of the sound so far [1, of full scale]; none without a file for it.
    pub fn sound_peak(&self) -> Option<f32> {
        self.sound.as_ref().map(SoundFile::peak)
    }

    /// Number of frames so far.
    pub fn frames(&self) -> usize {
        self.frames
    }

    /// Writes the result of a step.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn write(&mut self, model: &Model, input: &Input, state: &State) -> Result<(), ExportError> {
        let output = state.output();
        if !self.window.contains(output.time_s, model.parameters().step_s) {
            return Ok(());
        }
        if let Some(csv) = &mut self.csv {
            csv.write(&self.labels, (model, state), input)?;
        }
        if let Some(contacts) = &mut self.contacts {
            contacts.write(&self.labels, output)?;
        }
        if let Some(sound) = &mut self.sound {
            sound.write(state)?;
        }
        self.write_frame_if_due(model, input, state)
    }

    fn write_frame_if_due(&mut self, model: &Model, input: &Input, state: &State) -> Result<(), ExportError> {
        let no_frames = self.vtu.is_none() && self.glb.is_none();
        if no_frames || !self.window.due(state.output().time_s, self.frames) {
            return Ok(());
        }
        for (object, displacement) in self.displacements.iter_mut().enumerate() {
            state.surface_displacement(model, object, displacement);
        }
        let frame = Frame {
            model,
            labels: &self.labels,
            input,
            output: state.output(),
            displacements: &self.displacements,
        };
        if let Some(vtu) = &mut self.vtu {
            vtu.write(&frame)?;
        }
        if let Some(glb) = &mut self.glb {
            glb.write(&frame)?;
        }
        self.frames += 1;
        Ok(())
    }

    /// Completes all files.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn finish(self) -> Result<Vec<WrittenFile>, ExportError> {
        let mut written = Vec::new();
        let mut note = |kind, path| written.push(WrittenFile { kind, path });
        if let Some(csv) = self.csv {
            note("csv", csv.finish()?);
        }
        if let Some(contacts) = self.contacts {
            note("contacts", contacts.finish()?);
        }
        if let Some(vtu) = self.vtu {
            note("vtu", vtu.finish()?);
        }
        if let Some(glb) = self.glb {
            note("gltf", glb.finish()?);
        }
        if let Some(sound) = self.sound {
            note("sound", sound.finish()?);
        }
        Ok(written)
    }
}
