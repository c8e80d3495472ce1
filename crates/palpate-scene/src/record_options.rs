//! Recording of a body with the options of `palpate record`: mesh, repair, materials, supports, modes.
//!
//! ```text
//! RecordOptions, BodySource → prepare → PreparedBody { mesh, parameters } → record → Recording
//! ```

use crate::error::{SceneError, SceneErrorKind};
use crate::material_choice::MaterialChoice;
use crate::mesh_source::{UnscaledBody, source_name};
use crate::supports::read_supports;
use palpate::{Damping, Recording};
use palpate_fem::{
    ElementOrder, ErrorTarget, Precision, Progress, RecordParameters, RecordedBody, ResidualChoice,
};
use palpate_mesh::{Mesh, MeshError, MeshingParameters, Repair, SurfaceMesh, closed_surface, read_surface};
use std::fmt::Display;
use std::path::{Path, PathBuf};

/// Options of a recording.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordOptions {
    /// Materials.
    pub materials: MaterialChoice,
    /// Damping of the modes; none for that of the named material, or else no damping.
    pub damping: Option<Damping>,
    /// Number of modes to keep.
    pub modes: usize,
    /// Errors that the certificate has to keep, instead of a number of modes.
    pub target: ErrorTarget,
    /// Order of the elements.
    pub order: ElementOrder,
    /// Metres per unit of the mesh.
    pub scale: f64,
    /// Cells that a surface is filled with.
    pub meshing: MeshingParameters,
    /// Mesh file of the surface to be seen and touched, which is embedded in the tetrahedra; none for their boundary.
    pub surface: Option<PathBuf>,
    /// Repairs of the mesh.
    pub repair: Repair,
    /// Fixed nodes, as `--fix`.
    pub fix: Vec<String>,
    /// Faces on springs, as `--spring`.
    pub spring: Vec<String>,
    /// Part of the residual compliance to keep.
    pub residual: ResidualChoice,
    /// Precision of the numbers to keep.
    pub precision: Precision,
}

impl Default for RecordOptions {
    /// Options of `palpate record` without any: materials of the mesh file, no damping, 200 modes, quadratic elements, metres, a free body,
    /// compact.
    fn default() -> Self {
        Self {
            materials: MaterialChoice::OfMesh,
            damping: None,
            modes: 200,
            target: ErrorTarget::default(),
            order: ElementOrder::Quadratic,
            scale: 1.0,
            meshing: MeshingParameters::default(),
            surface: None,
            repair: Repair::default(),
            fix: Vec::new(),
            spring: Vec::new(),
            residual: ResidualChoice::Automatic,
            precision: Precision::Compact,
        }
    }
}

/// Source of a body's mesh.
#[derive(Debug, Clone, PartialEq)]
pub enum BodySource<'a> {
    /// Primitive (`box:0.1x0.1x0.1/6x6x6`, `sphere:0.05/4`) or path of a mesh file.
    Text(&'a str),
    /// Content of a mesh file, with a name for messages and the recording.
    Bytes(&'a [u8], &'a str),
    /// Mesh, with a name for messages and the file.
    Mesh(Mesh, &'a str),
}

/// Body that is ready to be recorded.
#[derive(Debug, Clone)]
pub struct PreparedBody {
    /// Repaired mesh [m]; with its mid-edge nodes where elements are quadratic.
    pub mesh: Mesh,
    /// Parameters of the recording.
    pub parameters: RecordParameters,
    /// Errors that the certificate has to keep.
    pub target: ErrorTarget,
}

impl RecordOptions {
    /// Reads or takes the mesh, repairs it, and finds materials and supports.
    ///
    /// # Errors
    /// When the mesh cannot be read or repaired, a region has no material, or a support selects no node.
    pub fn prepare(
        &self,
        source: BodySource<'_>,
        progress: &mut dyn Progress,
    ) -> Result<PreparedBody, SceneError> {
        let (body, name) = match source {
            BodySource::Text(text) => (UnscaledBody::read(text)?, source_name(text)),
            BodySource::Bytes(bytes, name) => (UnscaledBody::of_bytes(bytes, name)?, name.to_string()),
            BodySource::Mesh(mesh, name) => (UnscaledBody::of_mesh(mesh, name), name.to_string()),
        };
        body.ask_unit(self.scale, progress);
        let curved = self.order == ElementOrder::Quadratic;
        let meshing = MeshingParameters { curved, ..self.meshing };
        let mut mesh = body.into_mesh(self.scale, &meshing, progress)?;
        mesh.is_unit_asked = true;
        mesh.repair(&self.repair).map_err(|error| refused(SceneErrorKind::Mesh, &name, error))?;
        if self.order == ElementOrder::Quadratic {
            mesh.add_mid_edge_nodes();
        }
        let (materials, named_damping) = self.materials.of(&mesh)?;
        let damping = self.damping.or(named_damping).unwrap_or(Damping::Ratio(0.0));
        let (fixed_nodes, supports) = read_supports(&mesh, &self.fix, &self.spring)?;
        let parameters = RecordParameters {
            residual: self.residual,
            precision: self.precision,
            fixed_nodes,
            supports,
            surface: self.surface.as_deref().map(|path| self.read_surface(path, progress)).transpose()?,
            source: name,
            ..RecordParameters::new(materials, self.order, self.modes, damping)
        };
        Ok(PreparedBody { mesh, parameters, target: self.target })
    }

    /// Surface to be embedded [m], repaired.
    fn read_surface(&self, path: &Path, progress: &mut dyn Progress) -> Result<SurfaceMesh, SceneError> {
        let name = path.display().to_string();
        let mesh_error = |error: MeshError| refused(SceneErrorKind::Mesh, &name, error);
        let mut surface = read_surface(path).map_err(mesh_error)?;
        surface.scale(self.scale).map_err(mesh_error)?;
        let (closed, repairs) = closed_surface(&surface).map_err(mesh_error)?;
        repairs.iter().for_each(|repair| progress.warn(&format!("{name}: {repair}")));
        Ok(closed)
    }

    /// Records a body.
    ///
    /// # Errors
    /// As [`Self::prepare`] and [`PreparedBody::record`].
    pub fn record(
        &self,
        source: BodySource<'_>,
        progress: &mut dyn Progress,
    ) -> Result<Recording, SceneError> {
        self.prepare(source, progress)?.record(progress).map(|body| body.recording)
    }
}

impl PreparedBody {
    /// Records the body, and keeps its finite element model, for tables.
    ///
    /// # Errors
    /// When it cannot be recorded, or the listener interrupts.
    pub fn record(self, progress: &mut dyn Progress) -> Result<RecordedBody, SceneError> {
        let Self { mesh, parameters, target } = self;
        let recorded = if target == ErrorTarget::default() {
            RecordedBody::new(mesh, &parameters, progress)
        } else {
            RecordedBody::within(&mesh, &parameters, &target, progress)
        };
        recorded.map_err(|error| refused(SceneErrorKind::Record, &parameters.source, error))
    }
}

fn refused(kind: SceneErrorKind, name: &str, error: impl Display) -> SceneError {
    SceneError::new(kind, format!("{name}: {error}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate::{Material, Support};
    use palpate_fem::SilentProgress;
    use palpate_mesh::{SurfaceMesh, box_mesh};

    fn options() -> RecordOptions {
        let material = Material::isotropic(2e4, 0.3, 1000.0);
        RecordOptions {
            materials: MaterialChoice::Uniform(material),
            modes: 6,
            order: ElementOrder::Linear,
            ..RecordOptions::default()
        }
    }

    #[test]
    fn text_and_mesh_of_one_body_give_one_recording() {
        let text = "box:0.2x0.1x0.1/2x2x2";
        let by_text = options().record(BodySource::Text(text), &mut SilentProgress).expect("a recording");
        // In millimetres.
        let mesh = box_mesh([200.0, 100.0, 100.0], [2; 3]).expect("a box");
        let scaled = RecordOptions { scale: 1e-3, ..options() };
        let by_mesh =
            scaled.record(BodySource::Mesh(mesh, "mine"), &mut SilentProgress).expect("a recording");
        assert_eq!((by_text.modes.len(), by_mesh.modes.len()), (6, 6));
        let difference = (by_text.mass() - by_mesh.mass()).abs();
        assert!(difference < 1e-12 * by_text.mass(), "{difference}");
        let sources = [by_text, by_mesh].map(|recording| recording.metadata.provenance.source);
        assert_eq!(sources, [text, "mine"]);
    }

    /// Listener that keeps what is told, in its order.
    #[derive(Default)]
    struct Told(Vec<String>);

    impl Progress for Told {
        fn begin(&mut self, stage: &str, _: u64) {
            self.0.push(stage.to_string());
        }
        fn advance(&mut self, _: u64) {}
        fn warn(&mut self, text: &str) {
            self.0.push(format!("warning: {text}"));
        }
    }

    #[test]
    fn a_body_in_millimetres_is_asked_about_once_and_first() {
        let question = "warning: the body is 200 m large; if the file is in millimetres, use --scale 0.001";
        let mesh = box_mesh([200.0, 100.0, 100.0], [2; 3]).expect("a box");
        let surface = SurfaceMesh::from_boundary(mesh.clone()).expect("a surface");
        let mut off = String::from("OFF\n");
        off += &format!("{} {} 0\n", surface.positions.len(), surface.triangles.len());
        surface.positions.iter().for_each(|p| off += &format!("{} {} {}\n", p.x, p.y, p.z));
        surface.triangles.iter().for_each(|[a, b, c]| off += &format!("3 {a} {b} {c}\n"));
        let modes_by_error = ErrorTarget { force_error: Some(0.5), ..ErrorTarget::default() };
        let coarse = RecordOptions {
            meshing: MeshingParameters { cell_size: Some(50.0), nodes: None, curved: false },
            ..options()
        };
        for (source, options) in [
            (BodySource::Mesh(mesh.clone(), "mine"), options()),
            (BodySource::Mesh(mesh, "mine"), RecordOptions { target: modes_by_error, ..options() }),
            (BodySource::Bytes(off.as_bytes(), "box.off"), coarse),
        ] {
            let mut told = Told::default();
            let recorded = options.record(source, &mut told);
            assert_eq!(
                told.0.first().map(String::as_str),
                Some(question),
                "{:?}: {:?}",
                recorded.err(),
                told.0
            );
            assert_eq!(told.0.iter().filter(|text| text.contains("m large")).count(), 1, "{:?}", told.0);
            assert!(told.0.len() > 3, "{:?}", told.0);
        }
    }

    #[test]
    fn a_body_that_would_sag_by_more_than_its_size_is_asked_about() {
        // By hand: 1000·9.81·0.2/(2·50) = 19.62.
        let text = "warning: Young's modulus is 50 Pa, and the density 1000 kg/m³: under its own weight the body, 0.200 m large, would sag by 19.6 times its size. \
                    The unit is Pa, as for fat 500 to 25000, liver 600 to 20000 and rubber 920000 to 7400000; give 1000 times as much \
                    for kPa";
        for (young, expected) in [(50.0, Some(text)), (1000.0, None)] {
            let materials = MaterialChoice::Uniform(Material::isotropic(young, 0.3, 1000.0));
            let mut told = Told::default();
            let options = RecordOptions { materials, ..options() };
            options.record(BodySource::Text("box:0.2x0.1x0.1/2x2x2"), &mut told).expect("a recording");
            assert_eq!(told.0.iter().find(|text| text.contains("Young")).map(String::as_str), expected);
            let advice = told.0.iter().find(|text| text.contains("certificate):"));
            assert_eq!(
                advice.is_some_and(|text| text.contains("more modes")),
                expected.is_none(),
                "{advice:?}"
            );
        }
    }

    #[test]
    fn damping_in_per_cent_and_density_in_grams_are_asked_about() {
        let told = |options: &RecordOptions| {
            let mut told = Told::default();
            options.record(BodySource::Text("box:0.2x0.1x0.1/2x2x2"), &mut told).expect("a recording");
            told.0
                .into_iter()
                .filter(|text| text.contains("damping ratio") || text.contains("density"))
                .collect::<Vec<_>>()
        };
        let damped = |damping: Damping| told(&RecordOptions { damping: Some(damping), ..options() });
        assert_eq!(
            damped(Damping::Ratio(5.0)),
            [
                "warning: the damping ratio of the lowest mode is 5.000: above 1 the body creeps back in place of vibrating; give 0.05 for 5 %"
            ]
        );
        let swapped = damped(Damping::Rayleigh { alpha: 2e-4, beta: 2.0 });
        assert!(
            swapped[0].ends_with("in place of vibrating; Rayleigh's α is in 1/s and comes first, β is in s"),
            "{swapped:?}"
        );
        assert!(
            damped(Damping::Rayleigh { alpha: 2.0, beta: 2e-4 }).is_empty()
                && damped(Damping::Ratio(1.0)).is_empty()
        );
        let light = MaterialChoice::Uniform(Material::isotropic(2e4, 0.3, 1.0));
        assert_eq!(
            told(&RecordOptions { materials: light, ..options() }),
            [
                "warning: the density is 1 kg/m³, little more than that of air: the unit is kg/m³, as for foam 30, water 1000 and steel \
              7850; give 1000 times as much for g/cm³"
            ]
        );
    }

    #[test]
    fn supports_damping_and_targets_are_kept() {
        let fixed = RecordOptions {
            fix: vec!["x<-0.099".into()],
            damping: Some(Damping::Ratio(0.1)),
            target: ErrorTarget { bandwidth_hz: Some(1.0), ..ErrorTarget::default() },
            ..options()
        };
        let recording = fixed
            .record(BodySource::Text("box:0.2x0.1x0.1/2x2x2"), &mut SilentProgress)
            .expect("a recording");
        assert_eq!(recording.metadata.support, Support::Fixed);
        assert_eq!(recording.metadata.damping, Damping::Ratio(0.1));
        // The first number of modes that is tried, in place of the given one.
        assert_eq!(recording.modes.len(), 25);
        let without = RecordOptions { materials: MaterialChoice::OfMesh, ..options() };
        let error =
            without.prepare(BodySource::Text("box:1x1x1/1x1x1"), &mut SilentProgress).expect_err("none");
        assert!(error.message.starts_with("region '0' has no material in the mesh file: "), "{error}");
    }
}
