//! Residual compliance of the subtrees of a sphere tree: bounds of the residual displacement that fall off with the distance from the
//! forces.
//!
//! ```text
//! max_{i∈T} |uᵢ| ≤ Σⱼ c_Tj·|fⱼ|        c_Tj = max_{i∈T} √(‖Sᵢⱼ‖₁·‖Sᵢⱼ‖_∞)
//! ```
//!
//! with the surface nodes or contact samples i below the subtree T and the model's nodes j. Kept for subtrees of about ten
//! nodes; the subtrees above take the largest of theirs.
//!
//! Equations: docs/theory.md (C93).

use super::sample_surface::{PatchNodeCompliance, one_sided_vertices};
use crate::recording::{Recording, ResidualCompliance};
use crate::spatial::spectral_bound;
use crate::surface::{SphereTree, Surface, UpperPart};
use alloc::vec;
use alloc::vec::Vec;

/// Upper limit of triangles of the subtrees that are not divided.
const MAX_TRIANGLES: usize = 16;

/// Gap between the entries of a row up to which they are kept as one run, filled with zeros.
const MAX_GAP: u32 = 8;

/// Residual compliance of the subtrees of one sphere tree.
#[derive(Debug, Clone)]
pub(crate) struct SubtreeCompliance {
    upper: UpperPart,
    /// A leaf of the upper part above each vertex.
    leaf_of_vertex: Vec<u32>,
    /// First run of each of the model's nodes; length nodes + 1.
    rows: Vec<u32>,
    /// Consecutive leaves of a row: the first leaf, and where their entries begin; one more at the end.
    runs: Vec<(u32, u32)>,
    /// Entries c [m/N], rounded up.
    entries: Vec<f32>,
}

impl SubtreeCompliance {
    /// Subtrees over the surface nodes.
    pub(super) fn of_surface(recording: &Recording, tree: &SphereTree) -> Self {
        let Surface { positions, triangles, .. } = &recording.surface;
        let residual = &recording.residual;
        let row = |vertex: usize, largest: &mut dyn FnMut(usize, f64)| {
            // An embedded node moves at most as its carriers do together.
            for (node, weight) in recording.model_nodes_of(vertex) {
                let mut give = |other, block| largest(other, weight.abs() * spectral_bound(&block));
                match residual {
                    ResidualCompliance::None => {}
                    ResidualCompliance::NearField(near) => {
                        near.row(node).for_each(|(other, block)| give(other, block));
                    }
                    ResidualCompliance::Whole(_) | ResidualCompliance::Quantised(_) => {
                        (0..recording.model_nodes())
                            .for_each(|other| give(other, residual.block(node, other)));
                    }
                }
            }
        };
        let vertices = |corner: u32, give: &mut dyn FnMut(usize)| give(corner as usize);
        Self::new(tree, (triangles, positions.len()), recording.model_nodes(), vertices, row)
    }

    /// Subtrees over contact samples; a sample on a crease moves at most as the largest of its patches.
    pub(super) fn of_samples(
        tree: &SphereTree,
        surface: &Surface,
        (samples, one_sided): (usize, &[u32]),
        to_nodes: &PatchNodeCompliance,
    ) -> Self {
        let vertices = |corner: u32, give: &mut dyn FnMut(usize)| {
            give(corner as usize);
            one_sided_vertices((samples, one_sided), corner as usize).for_each(give);
        };
        let row = |vertex: usize, largest: &mut dyn FnMut(usize, f64)| {
            to_nodes.row(vertex).for_each(|(node, block)| largest(node, spectral_bound(&block)));
        };
        Self::new(tree, (&surface.triangles, surface.positions.len()), to_nodes.node_count(), vertices, row)
    }

    /// `vertices` gives the vertices that stand for a corner of a triangle, `row` the compliance of a vertex per force on the model's nodes,
    /// whose parts add up where a node comes more than once.
    fn new(
        tree: &SphereTree,
        (triangles, vertex_count): (&[[u32; 3]], usize),
        model_nodes: usize,
        vertices: impl Fn(u32, &mut dyn FnMut(usize)),
        row: impl Fn(usize, &mut dyn FnMut(usize, f64)),
    ) -> Self {
        let upper = tree.upper_part(MAX_TRIANGLES);
        let mut leaf_of_vertex = vec![0; vertex_count];
        let mut of_nodes: Vec<Vec<(u32, f32)>> = vec![Vec::new(); model_nodes];
        let (mut sums, mut largest) = (vec![0.0; model_nodes], vec![0.0_f64; model_nodes]);
        let (mut below, mut touched): (Vec<usize>, Vec<usize>) = (Vec::new(), Vec::new());
        for (leaf, triangles_of_leaf) in tree.triangles_of_leaves(&upper).into_iter().enumerate() {
            below.clear();
            for corner in triangles_of_leaf.into_iter().flat_map(|t| triangles[t as usize]) {
                vertices(corner, &mut |vertex| below.push(vertex));
            }
            below.sort_unstable();
            below.dedup();
            for &vertex in &below {
                leaf_of_vertex[vertex] = leaf as u32;
                row(vertex, &mut |node, size| {
                    if sums[node] == 0.0 && size > 0.0 {
                        touched.push(node);
                    }
                    sums[node] += size;
                });
                for node in touched.drain(..) {
                    largest[node] = largest[node].max(core::mem::take(&mut sums[node]));
                }
            }
            for (of_node, largest) in of_nodes.iter_mut().zip(&mut largest).filter(|(_, c)| **c > 0.0) {
                of_node.push((leaf as u32, (core::mem::take(largest) as f32).next_up()));
            }
        }
        let (mut rows, mut runs, mut entries): (Vec<u32>, Vec<(u32, u32)>, Vec<f32>) =
            (vec![0], Vec::new(), Vec::new());
        for of_node in of_nodes {
            let mut last: Option<u32> = None;
            for (leaf, entry) in of_node {
                match last {
                    Some(last) if leaf - last <= MAX_GAP => {
                        entries.extend((last + 1..leaf).map(|_| 0.0));
                    }
                    _ => runs.push((leaf, entries.len() as u32)),
                }
                entries.push(entry);
                last = Some(leaf);
            }
            rows.push(runs.len() as u32);
        }
        runs.push((0, entries.len() as u32));
        Self { upper, leaf_of_vertex, rows, runs, entries }
    }

    /// Number of subtrees.
    pub(crate) fn len(&self) -> usize {
        self.upper.leaves + self.upper.halves.len()
    }

    /// Subtree that a node of the sphere tree is or lies in.
    ///
    /// # Real time
    pub(crate) fn of_tree_node(&self, at: usize) -> usize {
        self.upper.of_node[at] as usize
    }

    /// A subtree above a vertex.
    ///
    /// # Real time
    pub(crate) fn of_vertex(&self, vertex: usize) -> usize {
        self.leaf_of_vertex[vertex] as usize
    }

    /// Write the bounds of all subtrees [m] under forces on the model's nodes, given by their sizes [N].
    ///
    /// # Real time
    /// Costs the forces times the subtrees, or for a near field those near each.
    pub(crate) fn displacements(&self, loads: impl Iterator<Item = (usize, f32)>, out: &mut [f32]) {
        let (leaves, others) = out.split_at_mut(self.upper.leaves);
        leaves.fill(0.0);
        for (node, size) in loads {
            for at in self.rows[node] as usize..self.rows[node + 1] as usize {
                let ((first, from), (_, to)) = (self.runs[at], self.runs[at + 1]);
                let entries = &self.entries[from as usize..to as usize];
                let sums = &mut leaves[first as usize..];
                sums.iter_mut().zip(entries).for_each(|(sum, c)| *sum += c * size);
            }
        }
        for (at, [a, b]) in self.upper.halves.iter().enumerate() {
            let of = |half: u32| match (half as usize).checked_sub(leaves.len()) {
                None => leaves[half as usize],
                Some(other) => others[other],
            };
            others[at] = of(*a).max(of(*b));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Body, ContactLimits, ContactLocation, Footprint};
    use super::*;
    use crate::recording::NearField;
    use alloc::sync::Arc;
    use glam::DVec3;

    /// Copy of a recording with the near field of its residual compliance alone, within a radius [m].
    fn with_near_field(recording: &Recording, radius: f64) -> Recording {
        let positions = &recording.surface.positions;
        let mut near = NearField { radius, offsets: vec![0], nodes: Vec::new(), blocks: Vec::new() };
        for (i, p) in positions.iter().enumerate() {
            for (j, _) in positions.iter().enumerate().filter(|(_, q)| (*q - *p).length() < radius) {
                near.nodes.push(j as u32);
                let block = recording.residual.block(i, j).transpose().to_cols_array();
                near.blocks.extend(block.map(|x| x as f32));
            }
            near.offsets.push(near.nodes.len() as u32);
        }
        Recording { residual: ResidualCompliance::NearField(near), ..recording.clone() }
    }

    #[test]
    fn no_vertex_below_a_subtree_moves_farther_than_its_bound() {
        let files = [
            &include_bytes!("../../../../data/recordings/v1_levels/ball.palp")[..],
            include_bytes!("../../../../data/recordings/v1/free.palp"),
        ];
        let mut tightest = 0.0_f64;
        for bytes in files {
            let whole = Recording::from_bytes(bytes).expect("a released recording");
            let near = with_near_field(&whole, 0.6 * whole.surface.radius());
            for recording in [whole, near].map(Arc::new) {
                let limits = ContactLimits { max_samples: 8, max_points: 512 };
                let body = Body::new(recording.clone(), &[], Some(limits), &[]);
                for level in 0..=body.coarsest_level() {
                    tightest = tightest.max(check_level(&body, body.footprint_at_level(level)));
                }
            }
        }
        // Exact for a node with a compliance that is a multiple of the identity, and no neighbour.
        assert!(tightest > 0.5, "the bounds are {:.1} times too wide at best", 1.0 / tightest);
    }

    /// Check the bounds of a footprint's subtrees under single forces and under forces on all nodes; gives the largest ratio of a displacement
    /// to its bound.
    fn check_level(body: &Body, footprint: Footprint) -> f64 {
        let subtrees = body.subtrees(footprint).expect("subtrees of a level");
        let (tree, triangles) = (body.tree(footprint), &body.surface(footprint).triangles);
        let nodes = body.recording.surface.positions.len();
        let wave = |at: usize| libm::sin(1.7 * at as f64 + 0.3);
        let force = |node: usize| DVec3::new(wave(node), wave(node + 5), wave(node + 11));
        let single = (0..nodes).step_by(nodes.div_ceil(8)).map(|node| vec![(node, force(node))]);
        let all = (0..nodes).map(|node| (node, force(node))).collect();
        let (mut bounds, mut tightest) = (vec![0.0; subtrees.len()], 0.0_f64);
        for loads in single.chain([all]) {
            let sizes = loads.iter().map(|(node, force)| (*node, force.length() as f32));
            subtrees.displacements(sizes, &mut bounds);
            let displacement = |vertex: usize| -> DVec3 {
                let of = |&(node, force): &(usize, DVec3)| {
                    let point = body.node_point(Footprint::Point, node);
                    let location = ContactLocation { point, footprint: Footprint::Point };
                    body.residual_at(footprint, vertex, &location) * force
                };
                loads.iter().map(of).sum()
            };
            let mut check = |subtree: usize, vertex: usize| {
                let (moved, bound) = (displacement(vertex).length(), f64::from(bounds[subtree]));
                assert!(moved <= bound * (1.0 + 1e-6), "vertex {vertex}: {moved} m for {bound} m at most");
                tightest = tightest.max(if bound > 0.0 { moved / bound } else { 0.0 });
            };
            for (leaf, below) in tree.triangles_of_leaves(&subtrees.upper).into_iter().enumerate() {
                let corners = below.into_iter().flat_map(|t| triangles[t as usize]);
                corners.for_each(|vertex| check(leaf, vertex as usize));
            }
            (0..body.vertices(footprint)).for_each(|vertex| check(subtrees.of_vertex(vertex), vertex));
            for (at, halves) in subtrees.upper.halves.iter().enumerate() {
                let larger = halves.iter().map(|&half| bounds[half as usize]).fold(0.0, f32::max);
                assert_eq!(bounds[subtrees.upper.leaves + at], larger);
            }
        }
        assert_eq!(subtrees.of_tree_node(0), subtrees.len() - 1, "the root comes last");
        tightest
    }
}
