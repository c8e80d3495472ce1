//! Distances of surface nodes in the norm of the elastic energy, for bounds of their displacement.
//!
//! Equations: docs/theory.md (C14), (C15).

use crate::recording::Recording;
use crate::surface::{Bands, band};
use alloc::vec::Vec;
use core::ops::Range;

/// Distances of surface nodes in the norm of the elastic energy, by rows laid out as the mode shapes.
pub(crate) struct ModalDistances<'a, X> {
    rows: &'a [X],
    /// 1/ω² [s²].
    weights: Vec<f64>,
}

impl<'a, X: Copy + Into<f64>> ModalDistances<'a, X> {
    pub(crate) fn new(recording: &Recording, rows: &'a [X]) -> Self {
        let omegas = &recording.modes.angular_frequencies;
        Self { rows, weights: omegas.iter().map(|omega| 1.0 / (omega * omega)).collect() }
    }

    /// √(Σ|rowᵢ − row_c|²/ω²) over axes and the modes of each band, or √(Σ|rowᵢ|²/ω²) without c [m/√J].
    pub(crate) fn between(&self, i: usize, c: Option<usize>) -> Bands {
        let m = self.weights.len();
        let row = |node: usize, axis: usize| &self.rows[(3 * node + axis) * m..][..m];
        let square = |axis: usize, modes: Range<usize>| -> f64 {
            let (own, weights) = (&row(i, axis)[modes.clone()], &self.weights[modes.clone()]);
            match c {
                None => own.iter().zip(weights).map(|(&x, w)| x.into() * x.into() * w).sum(),
                Some(c) => {
                    let pairs = own.iter().zip(&row(c, axis)[modes]).zip(weights);
                    let apart = |x: X, y: X| x.into() - y.into();
                    pairs.map(|((&x, &y), w)| apart(x, y) * apart(x, y) * w).sum()
                }
            }
        };
        core::array::from_fn(|at| libm::sqrt((0..3).map(|axis| square(axis, band(m, at))).sum()))
    }
}

/// √tr(Sᵢᵢ) of a node [√(m/N)].
pub(crate) fn residual_size(recording: &Recording, node: usize) -> f64 {
    if recording.embedding.is_none() {
        return libm::sqrt(recording.residual.trace(node, node));
    }
    libm::sqrt(recording.residual_between(node, node).diagonal().element_sum().max(0.0))
}
