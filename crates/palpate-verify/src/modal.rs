//! Modes of a mesh without a recording.

use crate::error::VerifyError;
use palpate_fem::{RecordExtent, RecordParameters, RecordedBody, ResidualChoice, SilentProgress};
use palpate_mesh::Mesh;

/// The assembled body and its lowest elastic modes.
pub fn lowest(mesh: Mesh, parameters: &RecordParameters) -> Result<RecordedBody, VerifyError> {
    let parameters = RecordParameters {
        residual: ResidualChoice::None,
        extent: RecordExtent::NoCertificate,
        ..parameters.clone()
    };
    Ok(RecordedBody::new(mesh, &parameters, &mut SilentProgress)?)
}

/// Frequencies ω/2π [Hz].
pub fn frequencies_hz(body: &RecordedBody) -> Vec<f64> {
    body.unreduced().kept_modes().frequencies_hz()
}

/// Mean of a group of frequencies that are equal on the continuum and split by the mesh's lesser symmetry.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}
