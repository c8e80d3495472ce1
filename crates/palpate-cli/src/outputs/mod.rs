//! Files that the steps of a scene leave: rows of numbers, and frames to look at.

mod csv;
mod frame;
mod glb;
mod glb_parts;
mod glb_scene;
mod shading;
mod solid;
mod vtu;
mod vtu_scene;

use crate::Failure;
use crate::scene_file::Scene;
use crate::whole_file::check_apart;
use csv::{ContactsCsv, StepsCsv};
use frame::Frame;
pub use frame::Window;
use glam::DVec3;
pub use glb::{Glb, check_size};
pub use glb_parts::{Animation, Deforming, root};
use glb_scene::GlbScene;
use palpate::{Input, State};
use std::path::{Path, PathBuf};
pub use vtu::VtuSeries;
use vtu_scene::VtuScene;
pub use vtu_scene::deformed;

/// What steps should leave.
#[derive(Debug, Clone, Default)]
pub struct Wanted<'a> {
    /// A row per step.
    pub csv: Option<&'a Path>,
    /// A row per contact and step.
    pub contacts: Option<&'a Path>,
    /// A folder of surfaces for ParaView.
    pub vtu: Option<&'a Path>,
    /// An animation.
    pub gltf: Option<&'a Path>,
    /// Which steps, and how many frames of them.
    pub window: Window,
}

/// A file that was written.
pub struct Written {
    /// What it is: `csv`, `contacts`, `vtu` or `gltf`.
    pub kind: &'static str,
    /// The file; of a series its index.
    pub path: PathBuf,
}

/// The files that are being written.
pub struct OutputFiles {
    csv: Option<StepsCsv>,
    contacts: Option<ContactsCsv>,
    vtu: Option<VtuScene>,
    glb: Option<GlbScene>,
    window: Window,
    frames: usize,
    displacements: Vec<Vec<DVec3>>,
}

impl Wanted<'_> {
    /// Refuse what can't be written before anything is run.
    pub fn check(&self) -> Result<(), Failure> {
        self.window.check()?;
        check_apart(&[("--csv", self.csv), ("--contacts", self.contacts), ("--gltf", self.gltf)])
    }
}

impl OutputFiles {
    /// Begin, with the scene at its start, where `input` is, and so many steps before it.
    pub fn new(
        wanted: &Wanted,
        scene: &Scene,
        state: &State,
        input: &Input,
        steps: usize,
    ) -> Result<Self, Failure> {
        wanted.check()?;
        let frames = wanted.window.frames(steps, scene.model.parameters().step_s);
        let mut files = Self {
            // What may be refused for its size comes first.
            glb: wanted.gltf.map(|path| GlbScene::new(path, scene, state, input, frames)).transpose()?,
            csv: wanted.csv.map(|path| StepsCsv::new(path, scene)).transpose()?,
            contacts: wanted.contacts.map(|path| ContactsCsv::new(path, scene)).transpose()?,
            vtu: wanted.vtu.map(|folder| VtuScene::new(folder, scene, state, input)).transpose()?,
            window: wanted.window,
            frames: 0,
            displacements: scene
                .model
                .recordings()
                .map(|recording| vec![DVec3::ZERO; recording.surface.positions.len()])
                .collect(),
        };
        files.frame_if_due(scene, input, state)?;
        Ok(files)
    }

    /// Frames so far.
    pub fn frames(&self) -> usize {
        self.frames
    }

    /// Take in a step.
    pub fn take(&mut self, scene: &Scene, input: &Input, state: &State) -> Result<(), Failure> {
        let output = state.output();
        if !self.window.holds(output.time_s, scene.model.parameters().step_s) {
            return Ok(());
        }
        if let Some(csv) = &mut self.csv {
            csv.write(input, output)?;
        }
        if let Some(contacts) = &mut self.contacts {
            contacts.write(scene, output)?;
        }
        self.frame_if_due(scene, input, state)
    }

    fn frame_if_due(&mut self, scene: &Scene, input: &Input, state: &State) -> Result<(), Failure> {
        let nothing_to_draw = self.vtu.is_none() && self.glb.is_none();
        if nothing_to_draw || !self.window.due(state.output().time_s, self.frames) {
            return Ok(());
        }
        for (object, displacement) in self.displacements.iter_mut().enumerate() {
            state.surface_displacement(&scene.model, object, displacement);
        }
        let frame = Frame { scene, input, output: state.output(), displacements: &self.displacements };
        if let Some(vtu) = &mut self.vtu {
            vtu.write(&frame)?;
        }
        if let Some(glb) = &mut self.glb {
            glb.write(&frame)?;
        }
        self.frames += 1;
        Ok(())
    }

    /// Finish all files.
    pub fn finish(self) -> Result<Vec<Written>, Failure> {
        let mut written = Vec::new();
        let mut note = |kind, path| written.push(Written { kind, path });
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
        Ok(written)
    }
}
