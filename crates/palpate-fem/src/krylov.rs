//! Response of the truncated modes at a few loads, without computing these modes.
//!
//! The part of a load b that the kept modes do not carry, b' = b − M·Φ·Φᵀ·b, excites a response in the Krylov space of
//! b' under (K + σM)⁻¹·M with two shifts σ, started with the static response G·b'. Projected on that space the equations
//! of motion give a few dozen substitute modes for the thousands of truncated ones. They are exact in the static limit
//! and converge geometrically with the number of blocks, at a rate that does not depend on the mesh.
//! Reference: rational Krylov moment matching, Grimme 1997.

use crate::assembly::SystemMatrix;
use crate::kernels::avx_section;
use crate::modes::ElasticModes;
use crate::progress::Progress;
use crate::solve_error::SolveError;
use crate::system::System;
use faer::{Mat, Side};
use glam::DVec3;
use std::ops::Range;

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

/// A mode with its participation at several places.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ModeAtPlaces {
    /// Squared angular frequency ω² [rad²/s²].
    pub square: f64,
    /// Modal participation of unit loads along x, y, z at every place [1/√kg].
    pub gains: Vec<DVec3>,
}

/// Equations of motion of the truncated modes, q̈ + K·q = B·f, in an M-orthonormal basis.
pub(crate) struct ProjectedSystem {
    /// K [1/s²].
    stiffness: Mat<f64>,
    /// B [1/√kg].
    loads: Mat<f64>,
    /// Number of basis columns after each block.
    columns_of_blocks: Vec<usize>,
}

impl ModeAtPlaces {
    /// The mode at one place.
    pub fn at(&self, place: usize) -> LoadedMode {
        LoadedMode { square: self.square, gain: self.gains[place] }
    }
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
        let (slow, fast) =
            rayon::join(|| system.shifted_factor(0.1 * fastest), || system.shifted_factor(fastest));
        let factors = [slow?, fast?];
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

    /// Equations of motion of the truncated modes for loads on some of the places, projected on the spaces of these loads.
    pub fn projected(&self, system: &System, places: Range<usize>) -> ProjectedSystem {
        let (first, width) = (3 * places.start, 3 * places.len());
        // M-orthonormal columns by block Gram-Schmidt, twice.
        let mut basis = Mat::<f64>::zeros(self.loads.nrows(), width * self.blocks.len());
        let mut columns = 0;
        let mut columns_of_blocks = Vec::with_capacity(self.blocks.len());
        for block in &self.blocks {
            let mut block = block.subcols(first, width).to_owned();
            let weighted = system.mass_times(block.as_ref());
            let sizes: Vec<f64> =
                (0..width).map(|j| (block.col(j).transpose() * weighted.col(j)).max(0.0).sqrt()).collect();
            let before = columns;
            for _ in 0..2 {
                let coefficients = basis.subcols(0, before).transpose() * system.mass_times(block.as_ref());
                block -= basis.subcols(0, before) * coefficients;
            }
            for (j, size) in sizes.into_iter().enumerate() {
                let mut column = block.subcols(j, 1).to_owned();
                for _ in 0..2 {
                    let own = basis.subcols(before, columns - before);
                    let coefficients = own.transpose() * system.mass_times(column.as_ref());
                    column -= own * coefficients;
                }
                let remainder = norm(system, &column);
                if remainder > DEPENDENT * size {
                    (0..column.nrows()).for_each(|i| basis[(i, columns)] = column[(i, 0)] / remainder);
                    columns += 1;
                }
            }
            columns_of_blocks.push(columns);
        }
        let basis = basis.subcols(0, columns);
        ProjectedSystem {
            stiffness: basis.transpose() * system.assembly.multiply(SystemMatrix::Stiffness, basis),
            loads: basis.transpose() * self.loads.subcols(first, width),
            columns_of_blocks,
        }
    }
}

impl ProjectedSystem {
    /// Substitutes of the truncated modes, from the first `blocks` blocks.
    ///
    /// # Errors
    /// [`SolveError::DenseEigenproblem`].
    pub fn truncated_modes(&self, blocks: usize) -> Result<Vec<ModeAtPlaces>, SolveError> {
        let columns = blocks.checked_sub(1).map_or(0, |last| self.columns_of_blocks[last]);
        let stiffness = self.stiffness.submatrix(0, 0, columns, columns);
        let scale = stiffness.norm_max();
        if columns == 0 || scale == 0.0 {
            return Ok(Vec::new());
        }
        let symmetric = |i: usize, j: usize| 0.5 * (stiffness[(i, j)] + stiffness[(j, i)]) / scale;
        let symmetric = Mat::from_fn(columns, columns, symmetric);
        let eigen = avx_section(|| symmetric.self_adjoint_eigen(Side::Lower))
            .map_err(|e| SolveError::DenseEigenproblem(format!("{e:?}")))?;
        let gains = avx_section(|| eigen.U().transpose() * self.loads.subrows(0, columns));
        let mode = |i: usize| ModeAtPlaces {
            square: eigen.S()[i] * scale,
            gains: (0..gains.ncols() / 3)
                .map(|place| DVec3::from_array(std::array::from_fn(|axis| gains[(i, 3 * place + axis)])))
                .collect(),
        };
        Ok((0..columns).map(mode).filter(|mode| mode.square > 0.0).collect())
    }
}

/// Component of a block that is M-orthogonal to rigid motions and kept modes.
fn without_kept_modes(system: &System, modes: &ElasticModes, mut block: Mat<f64>) -> Mat<f64> {
    system.remove_rigid(&mut block);
    let weighted = system.mass_times(block.as_ref());
    avx_section(|| block -= &modes.shapes * (modes.shapes.transpose() * weighted));
    block
}

/// Norm of a column in M.
fn norm(system: &System, column: &Mat<f64>) -> f64 {
    (column.transpose() * system.mass_times(column.as_ref()))[(0, 0)].max(0.0).sqrt()
}
