//! Response of the truncated modes at a few loads, without computing these modes.
//!
//! The part of a load b that the kept modes do not carry, b' = b − M·Φ·Φᵀ·b, excites a response in the Krylov space of
//! b' under (K + σM)⁻¹·M with two shifts σ, started with the static response G·b'. Projected on that space the equations
//! of motion give a few dozen substitute modes for the thousands of truncated ones. They are exact in the static limit
//! and converge geometrically with the number of blocks, at a rate that does not depend on the mesh.
//! Reference: rational Krylov moment matching, Grimme 1997.

use crate::assembly::SystemMatrix;
use crate::modes::ElasticModes;
use crate::progress::Progress;
use crate::solve_error::SolveError;
use crate::system::System;
use faer::{Mat, Side};
use glam::DVec3;

/// Relative norm after orthogonalisation below which a column is linearly dependent.
const DEPENDENT: f64 = 1e-10;

/// A mode with its participation at one place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadedMode {
    /// Squared angular frequency ω² [rad²/s²].
    pub square: f64,
    /// Modal participation of unit loads along x, y, z [1/√kg].
    pub gain: DVec3,
}

/// Rational Krylov spaces of loads, three columns per place.
pub(crate) struct KrylovSpaces {
    /// Part of the loads that the kept modes do not carry [N].
    loads: Mat<f64>,
    blocks: Vec<Mat<f64>>,
}

impl KrylovSpaces {
    /// Spaces of `count` blocks for loads of three columns per place (a unit force along x, y, z), for steps of
    /// `step_s` [s].
    ///
    /// # Errors
    /// [`SolveError`] when a shifted factor fails, or on interruption.
    pub fn new(
        system: &System,
        modes: &ElasticModes,
        mut loads: Mat<f64>,
        step_s: f64,
        count: usize,
        progress: &mut dyn Progress,
    ) -> Result<Self, SolveError> {
        system.balance(&mut loads);
        let amplitudes = modes.shapes.transpose() * &loads;
        loads -= system.mass_times((&modes.shapes * amplitudes).as_ref());

        // Two alternating shifts: one for modes slower than the step, one for those as fast. Faster modes respond
        // quasi-statically.
        let last = modes.squares.last().copied().unwrap_or(1.0);
        let fastest = (std::f64::consts::PI / step_s).powi(2).max(16.0 * last);
        let factors = [system.shifted_factor(0.1 * fastest)?, system.shifted_factor(fastest)?];
        let mut block = without_kept_modes(system, modes, system.elastic_compliance(loads.clone()));
        let mut blocks = vec![block.clone()];
        progress.advance(1);
        for number in 1..count {
            if progress.is_interrupted() {
                return Err(SolveError::Interrupted);
            }
            block = system.mass_times(block.as_ref());
            factors[number % 2].solve(block.as_mut());
            block = without_kept_modes(system, modes, block);
            // The norms do not matter for the space, but must not underflow.
            for j in 0..block.ncols() {
                let size = block.col(j).norm_max();
                if size > 0.0 {
                    (0..block.nrows()).for_each(|i| block[(i, j)] /= size);
                }
            }
            blocks.push(block.clone());
            progress.advance(1);
        }
        Ok(Self { loads, blocks })
    }

    /// Substitutes of the truncated modes at one place, from the first `blocks` blocks.
    ///
    /// # Errors
    /// [`SolveError::DenseEigenproblem`].
    pub fn truncated_modes(
        &self,
        system: &System,
        place: usize,
        blocks: usize,
    ) -> Result<Vec<LoadedMode>, SolveError> {
        // M-orthonormal columns by Gram-Schmidt, twice.
        let n = self.loads.nrows();
        let mut basis = Mat::<f64>::zeros(n, 0);
        for (block, axis) in self.blocks[..blocks].iter().flat_map(|b| (0..3).map(move |axis| (b, axis))) {
            let mut column = block.subcols(3 * place + axis, 1).to_owned();
            let size = norm(system, &column);
            for _ in 0..2 {
                let coefficients = basis.transpose() * system.mass_times(column.as_ref());
                column -= &basis * coefficients;
            }
            let remainder = norm(system, &column);
            if remainder > DEPENDENT * size {
                let width = basis.ncols();
                basis.resize_with(n, width + 1, |i, _| column[(i, 0)] / remainder);
            }
        }
        let stiffness = basis.transpose() * system.assembly.multiply(SystemMatrix::Stiffness, basis.as_ref());
        let scale = stiffness.norm_max();
        if basis.ncols() == 0 || scale == 0.0 {
            return Ok(Vec::new());
        }
        let symmetric = |i: usize, j: usize| 0.5 * (stiffness[(i, j)] + stiffness[(j, i)]) / scale;
        let scaled = Mat::from_fn(basis.ncols(), basis.ncols(), symmetric);
        let eigen = scaled
            .self_adjoint_eigen(Side::Lower)
            .map_err(|e| SolveError::DenseEigenproblem(format!("{e:?}")))?;
        let gains = eigen.U().transpose() * (basis.transpose() * self.loads.subcols(3 * place, 3));
        let mode = |i: usize| LoadedMode {
            square: eigen.S()[i] * scale,
            gain: DVec3::new(gains[(i, 0)], gains[(i, 1)], gains[(i, 2)]),
        };
        Ok((0..basis.ncols()).map(mode).filter(|mode| mode.square > 0.0).collect())
    }
}

/// Component of a block that is M-orthogonal to rigid motions and kept modes.
fn without_kept_modes(system: &System, modes: &ElasticModes, mut block: Mat<f64>) -> Mat<f64> {
    system.remove_rigid(&mut block);
    let amplitudes = modes.shapes.transpose() * system.mass_times(block.as_ref());
    block -= &modes.shapes * amplitudes;
    block
}

/// Norm of a column in M.
fn norm(system: &System, column: &Mat<f64>) -> f64 {
    (column.transpose() * system.mass_times(column.as_ref()))[(0, 0)].max(0.0).sqrt()
}
