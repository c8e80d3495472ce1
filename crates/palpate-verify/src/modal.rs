//! Modes of a mesh without a recording.

use crate::error::{VerifyError, numerics};
use palpate_fem::assembly::Assembly;
use palpate_fem::discretisation::Discretisation;
use palpate_fem::mesh::{Mesh, check};
use palpate_fem::modes::{Modes, lowest_modes};
use palpate_fem::progress::Silent;
use palpate_fem::record::RecordParameters;
use palpate_fem::system::System;

/// The assembled body and its lowest elastic modes.
pub fn lowest(mesh: Mesh, parameters: &RecordParameters) -> Result<(System, Modes), VerifyError> {
    let discretisation = Discretisation::new(&check(mesh)?, parameters.order);
    let assembly = Assembly::new(&discretisation, &parameters.materials);
    let system = System::new(discretisation, assembly, Vec::new()).map_err(numerics)?;
    let modes = lowest_modes(&system, parameters.modes, &mut Silent).map_err(numerics)?;
    Ok((system, modes))
}

/// Frequencies ω/2π [Hz].
pub fn frequencies_hz(modes: &Modes) -> Vec<f64> {
    modes.squares.iter().map(|square| square.sqrt() / std::f64::consts::TAU).collect()
}

/// Mean of a group of frequencies that are equal on the continuum and split by the mesh's lesser symmetry.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}
