//! Precomputed nodal compliance: R[0] between all surface nodes of a body, and between its contact samples.
//!
//! A face that lands on the floor brings all its nodes into contact at once. Their R_cc[0] of equation (9) is computed with
//! the model, up to a number of nodes, and looked up in a step. So is that between contact samples of two levels, which meet where a body
//! touches two others.
//!
//! Equations: docs/theory.md (C7).

use super::modal::SampledModes;
use super::{Body, ContactLocation};
use crate::dot_products::dot9;
use alloc::vec;
use alloc::vec::Vec;
use glam::DMat3;

/// Location by its surface nodes and their weights.
type Corners = [(usize, f64); 3];

/// Upper limits of nodes whose pairs are precomputed, at 36 bytes times the square of their number; and of contact samples of a level whose
/// pairs with those of other levels are, at 72 bytes each.
const MAX_NODES: usize = 1024;
const MAX_SAMPLES: usize = 320;

/// R[0] between the nodes and contact samples of all levels of a body [m/N, body].
#[derive(Debug)]
pub(crate) struct NodalCompliance {
    /// Number of levels, and the table of every pair of them, row by row.
    levels: usize,
    tables: Vec<Option<Table>>,
}

/// Blocks of R[0] between the vertices of two levels: the lower triangle of a level with itself, else all, row by row.
#[derive(Debug)]
struct Table {
    /// Number of vertices of the second level; none of a level with itself.
    columns: Option<usize>,
    blocks: Vec<DMat3>,
}

impl NodalCompliance {
    /// Nodal compliance of a body with its modes.
    pub(super) fn new(body: &Body, modes: &SampledModes) -> Self {
        let levels = body.coarsest_level() + 1;
        let rows: Vec<Vec<f64>> = (0..levels).map(|level| rows(body, modes, level)).collect();
        let count = |level| body.vertices(body.footprint_at_level(level));
        let table = |(first, second): (usize, usize)| {
            let room = if first == second { MAX_NODES } else { MAX_SAMPLES };
            let fits = first <= second && count(first).max(count(second)) <= room;
            fits.then(|| Table::new((body, modes), [first, second], [&rows[first], &rows[second]]))
        };
        let pairs = (0..levels).flat_map(|first| (0..levels).map(move |second| (first, second)));
        Self { levels, tables: pairs.map(table).collect() }
    }

    /// Displacement at a location per force at another [m/N], by the levels of their footprints; none where it is not precomputed.
    ///
    /// # Real time
    pub(super) fn between(
        &self,
        [first, second]: [Option<usize>; 2],
        [a, b]: [&Corners; 2],
    ) -> Option<DMat3> {
        let (first, second) = (first?, second?);
        if first > second {
            return Some(self.between([Some(second), Some(first)], [b, a])?.transpose());
        }
        let table = self.tables[first * self.levels + second].as_ref()?;
        let mut sum = DMat3::ZERO;
        for &(a, of_a) in a.iter().filter(|corner| corner.1 != 0.0) {
            for &(b, of_b) in b.iter().filter(|corner| corner.1 != 0.0) {
                sum += table.of(a, b) * (of_a * of_b);
            }
        }
        Some(sum)
    }
}

/// Rows Φ of the vertices of a level; none where there are too many.
fn rows(body: &Body, modes: &SampledModes, level: usize) -> Vec<f64> {
    let footprint = body.footprint_at_level(level);
    let (count, width) = (body.vertices(footprint), 3 * modes.len());
    if count > MAX_NODES {
        return Vec::new();
    }
    let mut rows = vec![0.0; count * width];
    for (vertex, rows) in (0..count).zip(rows.chunks_exact_mut(width.max(1))) {
        body.add_rows(footprint, vertex, 1.0, rows);
    }
    rows
}

impl Table {
    fn new((body, modes): (&Body, &SampledModes), levels: [usize; 2], rows: [&[f64]; 2]) -> Self {
        let footprints = levels.map(|level| body.footprint_at_level(level));
        let [count, columns] = footprints.map(|footprint| body.vertices(footprint));
        let location = |side: usize, vertex: usize| {
            let footprint = footprints[side];
            ContactLocation { point: body.node_point(footprint, vertex), footprint }
        };
        let width = 3 * modes.len();
        let of = |side: usize, vertex: usize| &rows[side][vertex * width..(vertex + 1) * width];
        let mut weighted = vec![0.0; width];
        let columns = (levels[0] != levels[1]).then_some(columns);
        let share = modes.residual_share();
        let mut blocks =
            Vec::with_capacity(columns.map_or(count * (count + 1) / 2, |columns| count * columns));
        for a in 0..count {
            modes.weigh(of(0, a), &mut weighted);
            let residual = |b: usize| body.residual(&location(0, a), &location(1, b));
            let columns = columns.unwrap_or(a + 1);
            blocks.extend((0..columns).map(|b| dot9(&weighted, of(1, b)) + residual(b) * share));
        }
        Self { columns, blocks }
    }

    fn of(&self, a: usize, b: usize) -> DMat3 {
        let of = |row: usize, column: usize| self.blocks[row * (row + 1) / 2 + column];
        match self.columns {
            Some(columns) => self.blocks[a * columns + b],
            None if a >= b => of(a, b),
            None => of(b, a).transpose(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Footprint, Response, ResponseForm, ResponseView};
    use super::*;
    use crate::recording::Recording;
    use crate::response::{ContactLimits, ContactPoints};
    use crate::surface::SurfacePoint;
    use alloc::sync::Arc;
    use glam::DVec3;

    #[test]
    fn compliance_between_samples_of_two_levels_is_the_computed_one() {
        let bytes = include_bytes!("../../../../data/recordings/v1_levels/ball.palp");
        let recording = Arc::new(Recording::from_bytes(bytes).expect("a released recording"));
        let body =
            Body::new(recording.clone(), &[], Some(ContactLimits { max_samples: 8, max_points: 512 }), &[]);
        let Response::Modal(modes) =
            Response::new(&recording, ResponseForm::Modal, 1e-3).expect("a modal response")
        else {
            panic!("no modes")
        };
        let precomputed = NodalCompliance::new(&body, &modes);
        let coarsest = body.coarsest_level();
        assert!(coarsest >= 1);
        let row = |location: &ContactLocation| {
            let mut row = vec![0.0; 3 * modes.len()];
            let corners = body.corners(location).into_iter().filter(|(_, weight)| *weight != 0.0);
            corners.for_each(|(vertex, weight)| body.add_rows(location.footprint, vertex, weight, &mut row));
            row
        };
        for (first, second) in [(0, coarsest), (coarsest, 0), (1, coarsest), (coarsest, 1), (0, 0)] {
            let location = |level: usize, vertex: usize| {
                let footprint = body.footprint_at_level(level);
                ContactLocation { point: body.node_point(footprint, vertex), footprint }
            };
            let (a, b) = (location(first, 1), location(second, 4));
            let mut weighted = row(&a);
            modes.weigh(&row(&a), &mut weighted);
            let computed = dot9(&weighted, &row(&b)) + body.residual(&a, &b) * modes.residual_share();
            let levels = [Some(first), Some(second)];
            let known =
                precomputed.between(levels, [&body.corners(&a), &body.corners(&b)]).expect("precomputed");
            assert!(known.abs_diff_eq(computed, 1e-12 * computed.x_axis.length()), "{known} {computed}");
        }
    }

    #[test]
    fn precomputed_compliance_is_that_of_modes_and_residual_compliance() {
        let bytes = include_bytes!("../../../../data/recordings/v1/free.palp");
        let recording = Arc::new(Recording::from_bytes(bytes).expect("a released recording"));
        let body = Body::new(recording.clone(), &[], None, &[]);
        let computed = Response::new(&recording, ResponseForm::Modal, 1e-3).expect("a response");
        let mut precomputed = computed.clone();
        precomputed.precompute_nodal_compliance(&body, core::iter::empty());
        let blocks = |response: &Response| {
            let mut state = response.at_rest(&recording, 4);
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
        let of = |response: &Response| matches!(response, Response::Modal(modes) if modes.nodal_compliance.is_some());
        assert!(of(&precomputed) && !of(&computed));
    }
}
