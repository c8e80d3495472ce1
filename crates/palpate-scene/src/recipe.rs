//! Recipes: recordings that are made when they are needed, and cached.

use crate::error::{SceneError, SceneErrorKind};
use crate::mesh_source::{read_mesh, source_name};
use crate::progress::WithoutRemarks;
use crate::recording_file::read_recording;
use palpate::{Damping, Material, Recording, Support};
use palpate_export::write_atomically;
use palpate_fem::{ElementOrder, Progress, RecordExtent, RecordParameters, ResidualChoice, record};
use std::path::{Path, PathBuf};

/// Mesh, material and parameters from which an object of one material is recorded.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordingRecipe {
    /// Primitive or mesh file.
    pub source: String,
    /// Scale from the units of the mesh to metres.
    pub scale: f64,
    /// Material of all regions; its own region is ignored.
    pub material: Material,
    /// Order of the elements.
    pub order: ElementOrder,
    /// Number of modes.
    pub modes: usize,
    /// Damping of the modes.
    pub damping: Damping,
}

impl RecordingRecipe {
    /// Recipe of a recording of a free primitive of one material; none for others.
    pub fn of(recording: &Recording) -> Option<Self> {
        let metadata = &recording.metadata;
        let source = &metadata.provenance.source;
        let primitive = source.starts_with("box:") || source.starts_with("sphere:");
        let [material] = metadata.materials.as_slice() else { return None };
        (primitive && metadata.support == Support::Free).then(|| Self {
            source: source.clone(),
            scale: 1.0,
            material: Material { region: String::new(), ..material.clone() },
            order: if metadata.mesh.order == 1 { ElementOrder::Linear } else { ElementOrder::Quadratic },
            modes: recording.modes.len(),
            damping: metadata.damping,
        })
    }

    /// File name in a cache, unique for the recipe and the version.
    fn file_name(&self) -> String {
        let Material { young_pa: young, poisson, density_kg_m3: density, .. } = self.material;
        let order = if self.order == ElementOrder::Linear { 1 } else { 2 };
        let damping = match self.damping {
            Damping::Rayleigh { alpha, beta } => format!("a{alpha}-b{beta}"),
            Damping::Ratio(ratio) => format!("z{ratio}"),
        };
        let source = source_name(&self.source).replace(['/', ':'], "_");
        let (scale, modes, version) = (self.scale, self.modes, env!("CARGO_PKG_VERSION"));
        format!("{source}-{scale}-E{young}-n{poisson}-r{density}-o{order}-m{modes}-{damping}-{version}.palp")
    }

    /// Parameters of [`record`], for a mesh with `regions` regions.
    pub fn parameters(&self, regions: usize) -> RecordParameters {
        let material = Material { region: String::new(), ..self.material.clone() };
        RecordParameters {
            materials: vec![material; regions],
            order: self.order,
            modes: self.modes,
            damping: self.damping,
            residual: ResidualChoice::Automatic,
            fixed_nodes: Vec::new(),
            source: source_name(&self.source),
            extent: RecordExtent::Full,
        }
    }

    /// Records the object.
    ///
    /// # Errors
    /// When the mesh cannot be read, or cannot be recorded.
    pub fn record(&self, progress: &mut dyn Progress) -> Result<Recording, SceneError> {
        let refused = |error: &dyn std::fmt::Display| SceneError::new(SceneErrorKind::Record, error);
        let mut mesh = read_mesh(&self.source)?;
        mesh.scale(self.scale).map_err(|error| refused(&error))?;
        let parameters = self.parameters(mesh.regions.len());
        let recorded = record(mesh, &parameters, &mut WithoutRemarks(progress));
        recorded.map_err(|error| refused(&format!("{}: {error}", source_name(&self.source))))
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
