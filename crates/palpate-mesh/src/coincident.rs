//! Nodes on one point: found by a grid of cells, and merged.

use super::volume_mesh::Mesh;
use glam::DVec3;
use std::collections::HashMap;

/// Distance below which nodes are coincident, as a share of the mesh's diagonal: a few times the rounding of a file
/// in f32.
pub(super) const COINCIDENT: f64 = 1e-6;

/// Pairs (first, other) of used nodes within `tolerance` [m]; every other node occurs once.
///
/// Nodes are sorted into cells of the size of the tolerance and compared with those of the neighbouring cells.
pub(super) fn coincident_pairs(positions: &[DVec3], used: &[bool], tolerance: f64) -> Vec<(u32, u32)> {
    if !(tolerance > 0.0 && tolerance.is_finite()) {
        return Vec::new();
    }
    let cell = |p: DVec3| (p / tolerance).floor();
    let key = |cell: DVec3| cell.to_array().map(f64::to_bits);
    let mut firsts: HashMap<[u64; 3], Vec<u32>> = HashMap::new();
    let mut pairs = Vec::new();
    let nodes =
        (0..positions.len() as u32).filter(|&n| used[n as usize] && positions[n as usize].is_finite());
    for node in nodes {
        let position = positions[node as usize];
        let home = cell(position);
        let neighbours =
            (0..27).map(|at: i32| DVec3::new(f64::from(at % 3), f64::from(at / 3 % 3), f64::from(at / 9)));
        let near = neighbours
            // Adding 0 turns −0 into 0, which has other bits.
            .filter_map(|shift| firsts.get(&key(home + shift - DVec3::ONE + DVec3::ZERO)))
            .flatten()
            .find(|&&first| (positions[first as usize] - position).length() <= tolerance);
        match near {
            Some(&first) => pairs.push((first, node)),
            None => firsts.entry(key(home + DVec3::ZERO)).or_default().push(node),
        }
    }
    pairs
}

/// Corners of the bounding box of the used nodes [m].
pub(super) fn bounding_box(mesh: &Mesh, used: &[bool]) -> (DVec3, DVec3) {
    let points = || mesh.nodes.iter().zip(used).filter(|(p, used)| **used && p.is_finite()).map(|(p, _)| *p);
    (points().reduce(DVec3::min).unwrap_or_default(), points().reduce(DVec3::max).unwrap_or_default())
}

impl Mesh {
    /// Makes nodes on one point one node, in tetrahedra and groups; gives the number of nodes that are no longer used.
    ///
    /// Nodes are on one point within 1e-6 of the mesh's diagonal.
    pub fn merge_coincident_nodes(&mut self) -> usize {
        let mut used = vec![false; self.nodes.len()];
        let known = self.tets.iter().flatten().filter(|&&node| (node as usize) < self.nodes.len());
        known.for_each(|&node| used[node as usize] = true);
        let (low, high) = bounding_box(self, &used);
        let mut first: Vec<u32> = (0..self.nodes.len() as u32).collect();
        let pairs = coincident_pairs(&self.nodes, &used, COINCIDENT * (high - low).length());
        let merged = pairs.len();
        for (a, b) in pairs {
            first[b as usize] = first[a as usize];
        }
        let renumber = |nodes: &mut [u32]| {
            nodes.iter_mut().for_each(|node| *node = first.get(*node as usize).copied().unwrap_or(*node));
        };
        self.tets.iter_mut().for_each(|tet| renumber(tet));
        // Edges that are one now keep one node.
        for found in &mut self.mid_edge_nodes {
            renumber(&mut found.ends);
            found.ends.sort_unstable();
        }
        self.mid_edge_nodes.sort_unstable();
        for same in self.mid_edge_nodes.chunk_by(|a, b| a.ends == b.ends) {
            same.iter().for_each(|found| first[found.node as usize] = same[0].node);
        }
        self.mid_edge_nodes.dedup_by_key(|found| found.ends);
        let renumber = |nodes: &mut [u32]| {
            nodes.iter_mut().for_each(|node| *node = first.get(*node as usize).copied().unwrap_or(*node));
        };
        for group in &mut self.groups {
            renumber(&mut group.nodes);
            group.nodes.sort_unstable();
            group.nodes.dedup();
        }
        merged
    }
}
