//! Mesh that somebody gives a page, to be recorded for a scene of its own.

use crate::error::{SceneError, SceneErrorKind};
use crate::material_choice::MaterialChoice;
use crate::record_options::{BodySource, RecordOptions};
use palpate::{Damping, Material, Recording};
use palpate_fem::Progress;
use palpate_mesh::MeshingParameters;

/// Damping of bodies whose material states none: soft, and at rest within a second or two.
pub(super) const UPLOAD_DAMPING: Damping = Damping::Rayleigh { alpha: 2.0, beta: 2e-4 };

/// Mesh to be recorded for a new scene.
#[derive(Debug, Clone)]
pub struct MeshUpload {
    /// File name; the content tells the format.
    pub name: String,
    /// Content of the file.
    pub bytes: Vec<u8>,
    /// Scale to metres.
    pub scale: f64,
    /// Cells that a surface is filled with.
    pub meshing: MeshingParameters,
    /// Material of the whole mesh.
    pub material: Material,
    /// Number of modes.
    pub modes: usize,
}

impl MeshUpload {
    /// Records the mesh in memory; the second part is what was repaired.
    ///
    /// # Errors
    /// When it cannot be read or recorded, or the listener interrupts.
    pub fn record(&self, progress: &mut dyn Progress) -> Result<(Recording, Vec<String>), SceneError> {
        let options = RecordOptions {
            materials: MaterialChoice::Uniform(self.material.clone()),
            damping: Some(UPLOAD_DAMPING),
            modes: self.modes,
            scale: self.scale,
            meshing: self.meshing,
            ..RecordOptions::default()
        };
        let mut body = options.prepare(BodySource::Bytes(&self.bytes, &self.name), progress)?;
        let refused = |error| SceneError::new(SceneErrorKind::Mesh, format!("{}: {error}", self.name));
        body.mesh = body.mesh.checked().map_err(refused)?;
        let repairs = body.mesh.warnings.clone();
        Ok((body.record(progress)?.recording, repairs))
    }
}
