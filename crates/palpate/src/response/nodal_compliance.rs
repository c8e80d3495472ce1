//! Precomputed nodal compliance: R[0] between all surface nodes of a body, or between its contact samples.
//!
//! A face that lands on the floor brings all its nodes into contact at once. Their R_cc[0] of equation (9) is computed with
//! the model, up to a number of nodes, and looked up in a step.
//!
//! Equations: docs/theory.md (C7).

use super::dot_products::dot9;
use super::modal::SampledModes;
use super::{Body, ContactLocation, Footprint};
use alloc::vec;
use alloc::vec::Vec;
use glam::DMat3;

/// Location by its surface nodes and their weights.
type Corners = [(usize, f64); 3];

/// Upper limit of nodes whose pairs are precomputed: 36 bytes times the square of their number.
const MAX_NODES: usize = 1024;

/// R[0] between the nodes of a footprint [m/N, body]: lower triangle of blocks, row by row.
#[derive(Debug)]
pub(crate) struct NodalCompliance {
    pub(super) footprint: Footprint,
    blocks: Vec<DMat3>,
}

impl NodalCompliance {
    /// Nodal compliance of a body with its modes; none beyond the limit of nodes.
    pub(super) fn new(body: &Body, modes: &SampledModes, footprint: Footprint) -> Option<Self> {
        let count = body.vertices(footprint);
        if count > MAX_NODES {
            return None;
        }
        let width = 3 * modes.len();
        let mut rows = vec![0.0; count * width];
        for (vertex, rows) in (0..count).zip(rows.chunks_exact_mut(width.max(1))) {
            body.add_rows(footprint, vertex, 1.0, rows);
        }
        let location =
            |vertex: usize| ContactLocation { point: body.node_point(footprint, vertex), footprint };
        let of = |index: usize| &rows[index * width..(index + 1) * width];
        let mut weighted = vec![0.0; width];
        let mut blocks = Vec::with_capacity(count * (count + 1) / 2);
        for a in 0..count {
            modes.weigh(of(a), &mut weighted);
            let residual = |b: usize| body.residual(&location(a), &location(b));
            let share = modes.residual_share();
            blocks.extend((0..=a).map(|b| dot9(&weighted, of(b)) + residual(b) * share));
        }
        Some(Self { footprint, blocks })
    }

    /// Displacement at one location per force at another [m/N], both by the weights of surface nodes.
    ///
    /// # Real time
    pub(super) fn between(&self, a: &Corners, b: &Corners) -> DMat3 {
        let mut sum = DMat3::ZERO;
        for &(a, of_a) in a.iter().filter(|corner| corner.1 != 0.0) {
            for &(b, of_b) in b.iter().filter(|corner| corner.1 != 0.0) {
                sum += self.of(a, b) * (of_a * of_b);
            }
        }
        sum
    }

    fn of(&self, a: usize, b: usize) -> DMat3 {
        let of = |row: usize, column: usize| self.blocks[row * (row + 1) / 2 + column];
        if a >= b { of(a, b) } else { of(b, a).transpose() }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Response, ResponseForm, ResponseView};
    use super::*;
    use crate::recording::Recording;
    use crate::response::ContactPoints;
    use crate::surface::SurfacePoint;
    use alloc::sync::Arc;
    use glam::DVec3;

    #[test]
    fn precomputed_compliance_is_that_of_modes_and_residual_compliance() {
        let bytes = include_bytes!("../../../../data/recordings/v1/free.palp");
        let recording = Arc::new(Recording::from_bytes(bytes).expect("a released recording"));
        let body = Body::new(recording.clone(), &[], usize::MAX, &[]);
        let computed = Response::new(&recording, ResponseForm::Modal, 1e-3).expect("a response");
        let mut precomputed = computed.clone();
        precomputed.precompute_nodal_compliance(&body, core::iter::empty());
        let blocks = |response: &Response| {
            let mut state = response.at_rest(recording.surface.positions.len(), 4);
            let mut points = ContactPoints::new(4);
            let mut view = ResponseView { response, body: &body, state: &mut state, gravity: DVec3::ZERO };
            let node = |node| body.node_point(Footprint::Point, node);
            let between = SurfacePoint { triangle: 3, weights: [0.2, 0.3, 0.5] };
            for point in [node(7), between, node(2), node(11)] {
                points.add(&mut view, ContactLocation { point, footprint: Footprint::Point }).expect("room");
            }
            (0..16).map(|k| points.block(k / 4, k % 4)).collect::<Vec<_>>()
        };
        for (a, b) in blocks(&computed).iter().zip(blocks(&precomputed)) {
            assert!(a.abs_diff_eq(b, 1e-14 * a.x_axis.length()), "{a} {b}");
        }
        let of = |response: &Response| matches!(response, Response::Modal(modes) if !modes.nodal_compliance.is_empty());
        assert!(of(&precomputed) && !of(&computed));
    }
}
