//! Recipes: recordings that are made when they are needed, and cached.

use crate::error::{SceneError, SceneErrorKind};
use crate::mesh_source::{is_primitive, read_body, source_name};
use crate::progress::WithoutRemarks;
use crate::recording_file::read_recording;
use crate::supports::read_supports;
use palpate::{Damping, Material, Recording, Support};
use palpate_export::write_atomically;
use palpate_fem::{ElementOrder, Precision, Progress, RecordParameters, ResidualChoice, record};
use palpate_mesh::{Mesh, MeshingParameters, Region, Repair};
use std::path::{Path, PathBuf};

/// Mesh, material and parameters from which an object is recorded: of one material, or with inclusions that are stiffer.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordingRecipe {
    /// Primitive or mesh file.
    pub source: String,
    /// Scale from the units of the mesh to metres.
    pub scale: f64,
    /// Cells that a surface is filled with.
    pub meshing: MeshingParameters,
    /// Material, isotropic; its own region is ignored.
    pub material: Material,
    /// Young's modulus of the regions after the first, over that of the material.
    pub inclusion_stiffness: f64,
    /// Fixed nodes, as `--fix`.
    pub fix: Vec<String>,
    /// Order of the elements.
    pub order: ElementOrder,
    /// Number of modes.
    pub modes: usize,
    /// Damping of the modes.
    pub damping: Damping,
    /// Precision of the numbers.
    pub precision: Precision,
}

/// Radius within which the residual compliance of an instrument is kept [m]: about the thickness of its parts. None for other bodies.
fn near_field_radius_m(source: &str) -> Option<f64> {
    match source {
        "instrument:bar" => Some(0.008),
        "instrument:fork" => Some(0.0032),
        "instrument:bell" => Some(0.005),
        _ => None,
    }
}

impl RecordingRecipe {
    /// Recipe of a free body of one material, with a mesh in metres and all digits.
    pub fn new(
        source: impl Into<String>,
        material: Material,
        order: ElementOrder,
        modes: usize,
        damping: Damping,
    ) -> Self {
        Self {
            source: source.into(),
            scale: 1.0,
            meshing: MeshingParameters::default(),
            material,
            inclusion_stiffness: 1.0,
            fix: Vec::new(),
            order,
            modes,
            damping,
            precision: Precision::Full,
        }
    }

    /// Recipe of a recording of a free primitive of one material; none for others, and for an embedded surface.
    pub fn of(recording: &Recording) -> Option<Self> {
        let metadata = &recording.metadata;
        let source = &metadata.provenance.source;
        let primitive = is_primitive(source) && recording.embedding.is_none();
        let [material] = metadata.materials.as_slice() else { return None };
        (primitive && metadata.support == Support::Free && material.stiffness_pa.is_none()).then(|| {
            let material = Material { region: String::new(), ..material.clone() };
            let order = if metadata.mesh.order == 1 { ElementOrder::Linear } else { ElementOrder::Quadratic };
            Self::new(source.as_str(), material, order, recording.modes.len(), metadata.damping)
        })
    }

    /// File name in a cache, unique for the recipe and the version.
    fn file_name(&self) -> String {
        let Material { young_pa: young, poisson, density_kg_m3: density, .. } = &self.material;
        let order = if self.order == ElementOrder::Linear { 1 } else { 2 };
        let damping = match self.damping {
            Damping::Rayleigh { alpha, beta } => format!("a{alpha}-b{beta}"),
            Damping::Ratio(ratio) => format!("z{ratio}"),
        };
        let source = source_name(&self.source).replace(['/', ':'], "_");
        let cells = match self.meshing {
            MeshingParameters { cell_size: Some(size), .. } => format!("-c{size}"),
            MeshingParameters { nodes: Some(nodes), .. } => format!("-k{nodes}"),
            _ => String::new(),
        };
        let inclusion = match self.inclusion_stiffness {
            1.0 => String::new(),
            stiffness => format!("-i{stiffness}"),
        };
        let plain = |text: &String| {
            format!("-f{}", text.replace(|c: char| !c.is_ascii_alphanumeric() && c != '.' && c != '-', "_"))
        };
        let fixed: String = self.fix.iter().map(plain).collect();
        let precision = if self.precision == Precision::Compact { "-compact" } else { "" };
        let (scale, modes, version) = (self.scale, self.modes, env!("CARGO_PKG_VERSION"));
        format!(
            "{source}-{scale}{cells}-E{young}-n{poisson}-r{density}{inclusion}{fixed}-o{order}-m{modes}-{damping}{precision}-{version}.palp"
        )
    }

    /// Parameters of [`record`] for a mesh.
    ///
    /// # Errors
    /// When the text of a support is not understood, or selects no node.
    fn parameters(&self, mesh: &Mesh) -> Result<RecordParameters, SceneError> {
        let material = |(number, region): (usize, &Region)| {
            let stiffness = if number == 0 { 1.0 } else { self.inclusion_stiffness };
            let name = region.name.clone().unwrap_or_default();
            Material { region: name, young_pa: self.material.young_pa * stiffness, ..self.material.clone() }
        };
        let materials = mesh.regions.iter().enumerate().map(material).collect();
        let (fixed_nodes, _) = read_supports(mesh, &self.fix, &[])?;
        // Bodies that ring are thin, and have many nodes: of their residual compliance what is near, in a small file.
        let (residual, precision) = match near_field_radius_m(&self.source) {
            Some(radius) => (ResidualChoice::NearField(radius), Precision::Compact),
            None => (ResidualChoice::Automatic, self.precision),
        };
        Ok(RecordParameters {
            source: source_name(&self.source),
            residual,
            precision,
            fixed_nodes,
            ..RecordParameters::new(materials, self.order, self.modes, self.damping)
        })
    }

    /// Mesh of the object in metres, repaired.
    ///
    /// # Errors
    /// When it cannot be read.
    pub fn mesh(&self, progress: &mut dyn Progress) -> Result<Mesh, SceneError> {
        let meshing = MeshingParameters { curved: self.order == ElementOrder::Quadratic, ..self.meshing };
        let mut mesh = read_body(&self.source, self.scale, &meshing, progress)?;
        mesh.repair(&Repair::default()).map_err(|error| self.refused(error))?;
        if self.order == ElementOrder::Quadratic && !self.fix.is_empty() {
            mesh.add_mid_edge_nodes();
        }
        Ok(mesh)
    }

    pub(crate) fn refused(&self, error: impl std::fmt::Display) -> SceneError {
        let message = format!("{}: {error}", source_name(&self.source));
        SceneError::new(SceneErrorKind::Record, message)
    }

    /// Records the object.
    ///
    /// # Errors
    /// When the mesh cannot be read, or cannot be recorded.
    pub fn record(&self, progress: &mut dyn Progress) -> Result<Recording, SceneError> {
        let mesh = self.mesh(progress)?;
        self.record_mesh(mesh, progress)
    }

    /// Records a mesh that [`mesh`](Self::mesh) gave.
    ///
    /// # Errors
    /// When it cannot be recorded.
    pub fn record_mesh(&self, mesh: Mesh, progress: &mut dyn Progress) -> Result<Recording, SceneError> {
        let parameters = self.parameters(&mesh)?;
        let recorded = record(mesh, &parameters, &mut WithoutRemarks(progress));
        recorded.map_err(|error| self.refused(error))
    }

    /// Recording from a cache folder, if it is there.
    pub fn cached(&self, folder: &Path) -> Option<Recording> {
        read_recording(&folder.join(self.file_name())).ok()
    }

    /// Writes a recording to a cache folder; returns its path.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn store(&self, recording: &Recording, folder: &Path) -> Result<PathBuf, SceneError> {
        let path = folder.join(self.file_name());
        let bytes =
            recording.to_bytes().map_err(|error| SceneError::new(SceneErrorKind::Recording, error))?;
        write_atomically(&path, &bytes)?;
        Ok(path)
    }

    /// Path of the recording in a cache folder, where it is made if it is missing.
    ///
    /// # Errors
    /// As [`record`](Self::record) and [`store`](Self::store).
    pub fn record_cached(&self, folder: &Path, progress: &mut dyn Progress) -> Result<PathBuf, SceneError> {
        match self.cached(folder) {
            Some(_) => Ok(folder.join(self.file_name())),
            None => self.store(&self.record(progress)?, folder),
        }
    }
}

/// Cache folder of recordings: the given one, or `palpate` in the user's cache; created if missing, as an absolute path, since
/// scenes elsewhere name its files. None where it cannot be created.
pub fn cache_folder(given: Option<&Path>) -> Option<PathBuf> {
    let variable = |name: &str| std::env::var_os(name).filter(|v| !v.is_empty()).map(PathBuf::from);
    let user_cache = || variable("XDG_CACHE_HOME").or_else(|| Some(variable("HOME")?.join(".cache")));
    let folder = given.map(Path::to_path_buf).or_else(|| Some(user_cache()?.join("palpate")))?;
    let folder = std::path::absolute(folder).ok()?;
    std::fs::create_dir_all(&folder).is_ok().then_some(folder)
}
