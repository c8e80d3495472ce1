//! R[0] between all surface nodes of a body, known before the first step.
//!
//! A face that lands on the floor makes contacts of all its nodes at once. What they do to one another is the paper's
//! R_cc[0] of equation (9): for a mesh of some size it is computed with the model, and a step looks it up.

use super::dot::dot9;
use super::modal::SampledModes;
use super::{Body, Reading};
use alloc::vec;
use alloc::vec::Vec;
use glam::DMat3;

/// Up to so many surface nodes all pairs are kept, 36 bytes times the square of their number.
const MOST_NODES: usize = 1024;

/// R[0] [m/N, body] between nodes: those not after the row, row by row.
#[derive(Debug)]
pub(crate) struct NodeCompliance {
    blocks: Vec<DMat3>,
}

impl NodeCompliance {
    /// Of a body with its modes; none where there are too many nodes.
    pub(super) fn new(body: &Body, modes: &SampledModes) -> Option<Self> {
        let nodes = body.recording.surface.positions.len();
        if nodes > MOST_NODES {
            return None;
        }
        let width = 3 * modes.len();
        let mut rows = vec![0.0; nodes * width];
        for (node, rows) in rows.chunks_exact_mut(width.max(1)).enumerate() {
            body.add_rows(Reading::Point, node, 1.0, rows);
        }
        let of = |node: usize| &rows[node * width..(node + 1) * width];
        let mut weighted = vec![0.0; width];
        let mut blocks = Vec::with_capacity(nodes * (nodes + 1) / 2);
        for a in 0..nodes {
            modes.weigh(of(a), &mut weighted);
            blocks.extend((0..=a).map(|b| dot9(&weighted, of(b)) + body.recording.residual.block(a, b)));
        }
        Some(Self { blocks })
    }

    /// Displacement of `a` per force on `b`.
    ///
    /// # Real time
    pub(super) fn between(&self, a: usize, b: usize) -> DMat3 {
        let of = |row: usize, column: usize| self.blocks[row * (row + 1) / 2 + column];
        if a >= b { of(a, b) } else { of(b, a).transpose() }
    }
}
