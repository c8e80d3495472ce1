//! Export of a recording: the surface at rest, and its mode shapes.

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

/// Default number of modes: the lowest are those that are felt and seen.
const MODES: usize = 10;

/// Largest displacement of a shown mode, as a share of the object's diagonal.
const AMPLITUDE: f64 = 0.1;

/// Period of the animation of a mode [s], whatever its frequency.
const PERIOD_S: f64 = 2.0;

/// Key times per period; weights are linear between them.
const KEYS: usize = 24;

const COLOUR: [f32; 3] = [0.75, 0.22, 0.13];

/// Recording and export options.
struct Export<'a> {
    recording: &'a Recording,
    /// Number of modes with shapes, and with rows.
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
                100.0 * AMPLITUDE
            ),
        }
    }

    /// Name of a mode.
    fn name(&self, mode: usize) -> String {
        format!("mode {}: {:.2} Hz", mode + 1, self.frequency_hz(mode))
    }

    /// Mode shape: displacements of the surface nodes [m].
    fn shape(&self, mode: usize) -> Vec<DVec3> {
        let nodes = self.recording.surface.positions.len();
        let at = |node, axis| self.recording.modes.row(node, axis)[mode];
        let shape = (0..nodes).map(|node| DVec3::new(at(node, 0), at(node, 1), at(node, 2)));
        let shape: Vec<DVec3> = shape.collect();
        let largest = shape.iter().map(|u| u.length()).fold(f64::MIN_POSITIVE, f64::max);
        let scale = AMPLITUDE * self.recording.surface.diagonal() / largest;
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

    /// VTU series with the surface at rest at time 0 and a mode at each time from 1.
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

    /// GLB file with a morph target and an animation per mode.
    fn gltf(&self, path: &Path) -> Result<PathBuf, Failure> {
        let surface = &self.recording.surface;
        // A surface node has at least one vertex.
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
            self.animate(&mut glb, object.node());
        }
        object.finish(&mut glb.content, &vec![0.0; self.drawn]);
        Ok(glb.finish()?)
    }

    /// Adds an animation per mode: one period of its weight.
    fn animate(&self, glb: &mut Glb, node: usize) {
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
