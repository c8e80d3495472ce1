//! The unreduced finite element response at a few loads, without all its modes.
//!
//! What the kept modes leave out of a load b, b' = b − M·Φ·Φᵀ·b, answers in the Krylov space of b' under
//! (K + σM)⁻¹·M with two shifts σ, started with the static answer G·b'. Projected on that space the equations of motion give a few
//! dozen modes that stand for the thousands left out, exact in the static limit and converging geometrically in
//! the number of blocks, at a rate that does not depend on the mesh.
//! Reference: rational Krylov moment matching, Grimme 1997.

use crate::assembly::Which;
use crate::factor::FactorError;
use crate::modes::{Modes, ModesError};
use crate::progress::Progress;
use crate::system::System;
use faer::{Mat, Side};
use glam::DVec3;

/// A column that keeps less than this share of itself beside the ones before adds nothing.
const DEPENDENT_BELOW: f64 = 1e-10;

/// One mode as a load in three directions meets it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadedMode {
    /// ω² [rad²/s²].
    pub square: f64,
    /// Participation of the three directions [1/√kg].
    pub gain: DVec3,
}

/// Krylov spaces of the loads, three columns per place.
pub struct Reference {
    /// Loads that the modes leave out.
    loads: Mat<f64>,
    blocks: Vec<Mat<f64>>,
}

impl Reference {
    /// Set up for loads of three columns per place (a unit force along x, y, z), for steps of `step_s` [s], with
    /// `count` blocks.
    ///
    /// # Errors
    /// When the shifted factor fails.
    pub fn new(
        system: &System,
        modes: &Modes,
        mut loads: Mat<f64>,
        step_s: f64,
        count: usize,
        progress: &mut dyn Progress,
    ) -> Result<Self, FactorError> {
        system.balance(&mut loads);
        let share = modes.shapes.transpose() * &loads;
        loads -= system.mass_times((&modes.shapes * share).as_ref());

        // Two shifts in turn: one for modes slower than the step, one for those as fast; what lies
        // beyond answers as a spring.
        let last = modes.squares.last().copied().unwrap_or(1.0);
        let fastest = (std::f64::consts::PI / step_s).powi(2).max(16.0 * last);
        let factors = [system.shifted_factor(0.1 * fastest)?, system.shifted_factor(fastest)?];
        let mut block = without_kept(system, modes, system.elastic_compliance(loads.clone()));
        let mut blocks = vec![block.clone()];
        progress.advance(1);
        for number in 1..count {
            block = system.mass_times(block.as_ref());
            factors[number % 2].solve(block.as_mut());
            block = without_kept(system, modes, block);
            // Sizes don't matter for the space, but must not underflow.
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

    /// Modes that stand for those left out, at one place, from the first `blocks` blocks.
    ///
    /// # Errors
    /// When the small eigenproblem fails.
    pub fn left_out(
        &self,
        system: &System,
        place: usize,
        blocks: usize,
    ) -> Result<Vec<LoadedMode>, ModesError> {
        // M-orthonormal columns by Gram-Schmidt, twice.
        let n = self.loads.nrows();
        let mut basis = Mat::<f64>::zeros(n, 0);
        for (block, axis) in self.blocks[..blocks].iter().flat_map(|b| (0..3).map(move |axis| (b, axis))) {
            let mut column = block.subcols(3 * place + axis, 1).to_owned();
            let size = norm(system, &column);
            for _ in 0..2 {
                let share = basis.transpose() * system.mass_times(column.as_ref());
                column -= &basis * share;
            }
            let left = norm(system, &column);
            if left > DEPENDENT_BELOW * size {
                let width = basis.ncols();
                basis.resize_with(n, width + 1, |i, _| column[(i, 0)] / left);
            }
        }
        let stiffness = basis.transpose() * system.assembly.multiply(Which::Stiffness, basis.as_ref());
        let scale = stiffness.norm_max();
        if basis.ncols() == 0 || scale == 0.0 {
            return Ok(Vec::new());
        }
        let symmetric = |i: usize, j: usize| 0.5 * (stiffness[(i, j)] + stiffness[(j, i)]) / scale;
        let scaled = Mat::from_fn(basis.ncols(), basis.ncols(), symmetric);
        let eigen =
            scaled.self_adjoint_eigen(Side::Lower).map_err(|e| ModesError::Dense(format!("{e:?}")))?;
        let gains = eigen.U().transpose() * (basis.transpose() * self.loads.subcols(3 * place, 3));
        let mode = |i: usize| LoadedMode {
            square: eigen.S()[i] * scale,
            gain: DVec3::new(gains[(i, 0)], gains[(i, 1)], gains[(i, 2)]),
        };
        Ok((0..basis.ncols()).map(mode).filter(|mode| mode.square > 0.0).collect())
    }
}

/// Without rigid motions and kept modes, in M.
fn without_kept(system: &System, modes: &Modes, mut block: Mat<f64>) -> Mat<f64> {
    system.remove_rigid(&mut block);
    let share = modes.shapes.transpose() * system.mass_times(block.as_ref());
    block -= &modes.shapes * share;
    block
}

fn norm(system: &System, column: &Mat<f64>) -> f64 {
    (column.transpose() * system.mass_times(column.as_ref()))[(0, 0)].max(0.0).sqrt()
}
