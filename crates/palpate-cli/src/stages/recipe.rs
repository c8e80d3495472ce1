//! Recordings that are made when they are needed, and kept.

use crate::Failure;
use crate::progress::WithoutRemarks;
use crate::source;
use crate::verbs::{read_recording, write_whole};
use palpate::{Damping, Material, Recording};
use palpate_fem::element::Order;
use palpate_fem::progress::Progress;
use palpate_fem::record::{Extent, RecordParameters, record};
use palpate_fem::residual::ResidualChoice;
use palpate_viewer::MaterialDescription;
use std::path::{Path, PathBuf};

/// How an object of one material is recorded.
#[derive(Debug, Clone, PartialEq)]
pub struct Recipe {
    /// A primitive, or a mesh file.
    pub source: String,
    /// To metres.
    pub scale: f64,
    /// Of all of it.
    pub material: MaterialDescription,
    /// Order of the elements.
    pub order: Order,
    /// Modes to keep.
    pub modes: usize,
    /// Damping of the modes.
    pub damping: Damping,
}

impl Recipe {
    /// A file name of its own.
    fn file_name(&self) -> String {
        let MaterialDescription { young, poisson, density } = self.material;
        let order = if self.order == Order::Linear { 1 } else { 2 };
        let damping = match self.damping {
            Damping::Rayleigh { alpha, beta } => format!("a{alpha}-b{beta}"),
            Damping::Ratio(ratio) => format!("z{ratio}"),
        };
        let source = source::name(&self.source).replace(['/', ':'], "_");
        let (scale, modes, version) = (self.scale, self.modes, env!("CARGO_PKG_VERSION"));
        format!("{source}-{scale}-E{young}-n{poisson}-r{density}-o{order}-m{modes}-{damping}-{version}.palp")
    }

    /// What `record` takes, for a mesh of so many regions.
    pub fn parameters(&self, regions: usize) -> RecordParameters {
        let MaterialDescription { young, poisson, density } = self.material;
        let material = Material { region: String::new(), young_pa: young, poisson, density_kg_m3: density };
        RecordParameters {
            materials: vec![material; regions],
            order: self.order,
            modes: self.modes,
            damping: self.damping,
            residual: ResidualChoice::Automatic,
            fixed_nodes: Vec::new(),
            source: source::name(&self.source),
            extent: Extent::Whole,
        }
    }

    /// Record it.
    pub fn record(&self, progress: &mut dyn Progress) -> Result<Recording, Failure> {
        let mut mesh = source::mesh(&self.source)?;
        mesh.scale(self.scale)?;
        let parameters = self.parameters(mesh.regions.len());
        let recorded = record(mesh, &parameters, &mut WithoutRemarks(progress));
        recorded
            .map(|recorded| recorded.recording)
            .map_err(|e| Failure(format!("{}: {e}", source::name(&self.source))))
    }

    /// From a folder, if it is kept there.
    pub fn cached(&self, folder: &Path) -> Option<Recording> {
        read_recording(&folder.join(self.file_name())).ok()
    }

    /// Keep it in a folder; gives its place there.
    pub fn keep(&self, recording: &Recording, folder: &Path) -> Result<PathBuf, Failure> {
        let path = folder.join(self.file_name());
        write_whole(&path, &recording.to_bytes()?)?;
        Ok(path)
    }

    /// From a folder, or recorded into it; gives its place there.
    pub fn recorded_in(&self, folder: &Path, progress: &mut dyn Progress) -> Result<PathBuf, Failure> {
        match self.cached(folder) {
            Some(_) => Ok(folder.join(self.file_name())),
            None => self.keep(&self.record(progress)?, folder),
        }
    }
}

/// Where recordings are kept between runs: the folder that is given, or the user's cache; made if it is not there. None
/// where there is no place for them.
pub fn cache_folder(given: Option<&Path>) -> Option<PathBuf> {
    let variable = |name: &str| std::env::var_os(name).filter(|v| !v.is_empty()).map(PathBuf::from);
    let users = || variable("XDG_CACHE_HOME").or_else(|| Some(variable("HOME")?.join(".cache")));
    let folder = given.map(Path::to_path_buf).or_else(|| Some(users()?.join("palpate")))?;
    std::fs::create_dir_all(&folder).is_ok().then_some(folder)
}
