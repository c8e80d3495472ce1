//! A recording as files: the surface at rest, and the shapes that its modes give it.

use super::{Arguments, print_written};
use crate::failure::Failure;
use glam::DVec3;
use palpate::{Pose, Recording};
use palpate_export::{
    AtomicFile, DeformingSurface, Glb, GlbAnimation, VtuSeries, WrittenFile, check_distinct, check_glb_size,
    deformed_surface, root_node,
};
use palpate_scene::read_recording;
use serde_json::json;
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

/// Modes are many, and the low ones tell most.
const MODES: usize = 10;

/// A mode's largest displacement, as a share of the object's diagonal: enough to be seen.
const SWING: f64 = 0.1;

/// An animation swings its mode once in this time [s], whatever its frequency is.
const PERIOD_S: f64 = 2.0;

/// Between the times of such a swing weights are linear.
const KEYS: usize = 24;

const COLOUR: [f32; 3] = [0.75, 0.22, 0.13];

/// The recording, and what is wanted of it.
struct Export<'a> {
    recording: &'a Recording,
    /// How many modes are drawn, and how many have a row.
    drawn: usize,
    rows: usize,
    inputs: Vec<PathBuf>,
}

pub(super) fn export(arguments: &Arguments) -> Result<(), Failure> {
    check_distinct(&[("csv", arguments.csv.as_deref()), ("gltf", arguments.gltf.as_deref())])?;
    let recording = read_recording(&arguments.source)?;
    let kept = recording.modes.len();
    if arguments.modes == Some(0) {
        return Err(Failure("--modes is 0, expected at least 1".to_string()));
    }
    let export = Export {
        recording: &recording,
        drawn: arguments.modes.unwrap_or(MODES).min(kept),
        rows: arguments.modes.unwrap_or(kept).min(kept),
        inputs: vec![arguments.source.clone()],
    };
    let mut written = Vec::new();
    if let Some(path) = &arguments.csv {
        written.push(WrittenFile { kind: "csv", path: export.csv(path)? });
    }
    if let Some(folder) = &arguments.vtu {
        written.push(WrittenFile { kind: "vtu", path: export.vtu(folder)? });
    }
    if let Some(path) = &arguments.gltf {
        written.push(WrittenFile { kind: "gltf", path: export.gltf(path)? });
    }
    let frequencies: Vec<f64> = (0..export.drawn).map(|mode| export.frequency_hz(mode)).collect();
    let facts = json!({ "modes": kept, "modes_drawn": export.drawn, "frequencies_hz": frequencies });
    print_written(arguments, &written, facts, &export.line())
}

impl Export<'_> {
    fn frequency_hz(&self, mode: usize) -> f64 {
        self.recording.modes.angular_frequencies[mode] / TAU
    }

    fn line(&self) -> String {
        let kept = self.recording.modes.len();
        match self.drawn {
            0 => "the recording keeps no modes: its surface at rest".to_string(),
            drawn => format!(
                "{drawn} of {kept} modes, {:.2} to {:.2} Hz; their largest displacement is drawn as {:.0} % of the diagonal",
                self.frequency_hz(0),
                self.frequency_hz(drawn - 1),
                100.0 * SWING
            ),
        }
    }

    /// What a mode is called.
    fn name(&self, mode: usize) -> String {
        format!("mode {}: {:.2} Hz", mode + 1, self.frequency_hz(mode))
    }

    /// A mode's displacement of every surface node [m].
    fn shape(&self, mode: usize) -> Vec<DVec3> {
        let nodes = self.recording.surface.positions.len();
        let at = |node, axis| self.recording.modes.row(node, axis)[mode];
        let shape = (0..nodes).map(|node| DVec3::new(at(node, 0), at(node, 1), at(node, 2)));
        let shape: Vec<DVec3> = shape.collect();
        let largest = shape.iter().map(|u| u.length()).fold(f64::MIN_POSITIVE, f64::max);
        let scale = SWING * self.recording.surface.diagonal() / largest;
        shape.into_iter().map(|u| scale * u).collect()
    }

    fn csv(&self, path: &Path) -> Result<PathBuf, Failure> {
        let inputs: Vec<&Path> = self.inputs.iter().map(PathBuf::as_path).collect();
        let mut file = AtomicFile::create(path, &inputs)?;
        file.write(b"mode,frequency_hz,damping_ratio\n")?;
        for mode in 0..self.rows {
            let damping = self.recording.modes.damping_ratios[mode];
            file.write(format!("{},{:?},{damping:?}\n", mode + 1, self.frequency_hz(mode)).as_bytes())?;
        }
        Ok(file.finish()?)
    }

    /// A time for each mode, from 1, and the surface at rest at time 0.
    fn vtu(&self, folder: &Path) -> Result<PathBuf, Failure> {
        let surface = &self.recording.surface;
        let mut series = VtuSeries::new(folder, "modes.pvd", &self.inputs)?;
        for number in 0..=self.drawn {
            let (shape, facts) = match number.checked_sub(1) {
                None => (vec![DVec3::ZERO; surface.positions.len()], Vec::new()),
                Some(mode) => {
                    let damping = self.recording.modes.damping_ratios[mode];
                    let facts = vec![("frequency_hz", self.frequency_hz(mode)), ("damping_ratio", damping)];
                    (self.shape(mode), facts)
                }
            };
            let mut grid = deformed_surface(&surface.positions, &surface.triangles, &shape, Pose::IDENTITY);
            grid.facts = facts;
            let name = series.write("mode", number, &grid)?;
            series.show(number as f64, 0, name);
        }
        Ok(series.finish()?)
    }

    /// A morph target and an animation for each mode.
    fn gltf(&self, path: &Path) -> Result<PathBuf, Failure> {
        let surface = &self.recording.surface;
        // A node of the surface is drawn as one vertex at least.
        check_glb_size((24 * surface.positions.len() as u64).saturating_mul(1 + self.drawn as u64), path)?;
        let mut glb = Glb::new(path, &self.inputs)?;
        glb.content.nodes.push(root_node(DVec3::ZERO));
        let name = self.recording.metadata.provenance.source.clone();
        let mut object =
            DeformingSurface::new(&mut glb, &name, &surface.positions, &surface.triangles, COLOUR)?;
        for mode in 0..self.drawn {
            object.add_shape(&mut glb, &self.shape(mode), self.name(mode))?;
        }
        if self.drawn > 0 {
            self.swing(&mut glb, object.node());
        }
        object.finish(&mut glb.content, &vec![0.0; self.drawn]);
        Ok(glb.finish()?)
    }

    /// Let a mode after the other swing once, alone: an animation for each.
    fn swing(&self, glb: &mut Glb, node: usize) {
        let times: Vec<f64> = (0..=KEYS).map(|key| PERIOD_S * key as f64 / KEYS as f64).collect();
        let times = glb.times(&times);
        let weight = |key: usize| (TAU * key as f64 / KEYS as f64).sin() as f32;
        for mode in 0..self.drawn {
            let row = |key| (0..self.drawn).map(move |other| if other == mode { weight(key) } else { 0.0 });
            let mut animation = GlbAnimation::new(times);
            animation.channel(glb, node, "weights", (0..=KEYS).flat_map(row), ("SCALAR", 1));
            glb.content.animations.push(animation.json(&self.name(mode)));
        }
    }
}
