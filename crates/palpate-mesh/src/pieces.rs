//! Pieces of a mesh: tetrahedra that are connected through faces, by union-find.

use crate::faces::{Face, Sets, sorted_faces, tet_volume};
use crate::volume_mesh::Mesh;
use glam::DVec3;

/// Connected component of a mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct Piece {
    /// Numbers of its tetrahedra, ascending.
    pub tets: Vec<u32>,
    /// Volume [m³].
    pub volume: f64,
    /// Centroid of its first tetrahedron [m].
    pub near: DVec3,
}

/// Number of the first tetrahedron of each tetrahedron's piece.
pub(crate) fn roots(tets: usize, faces: &[Face]) -> Vec<u32> {
    let mut sets = Sets::new(tets);
    for same in faces.chunk_by(|a, b| a.0 == b.0) {
        same.windows(2).for_each(|pair| sets.join(pair[0].2, pair[1].2));
    }
    (0..tets as u32).map(|tet| sets.root(tet)).collect()
}

impl Mesh {
    /// Pieces that share no face, the largest volume first.
    pub fn pieces(&self) -> Vec<Piece> {
        let roots = roots(self.tets.len(), &sorted_faces(&self.tets));
        let mut position = vec![u32::MAX; self.tets.len()];
        let mut pieces: Vec<Piece> = Vec::new();
        for (tet, &root) in roots.iter().enumerate() {
            let corners = &self.tets[tet];
            let at = &mut position[root as usize];
            if *at == u32::MAX {
                *at = pieces.len() as u32;
                let near = corners.iter().map(|&node| self.nodes[node as usize]).sum::<DVec3>() * 0.25;
                pieces.push(Piece { tets: Vec::new(), volume: 0.0, near });
            }
            let piece = &mut pieces[*at as usize];
            piece.tets.push(tet as u32);
            piece.volume += tet_volume(&self.nodes, corners).abs();
        }
        pieces.sort_by(|a, b| b.volume.total_cmp(&a.volume));
        pieces
    }

    /// The mesh of one piece. Nodes keep their numbers; groups and regions keep what the piece has.
    pub fn piece(&self, piece: &Piece) -> Self {
        let at = |tet: &u32| *tet as usize;
        let tets: Vec<_> = piece.tets.iter().map(|tet| self.tets[at(tet)]).collect();
        let mut used = vec![false; self.nodes.len()];
        tets.iter().flatten().for_each(|&node| used[node as usize] = true);
        let mut mid_edge_nodes = self.mid_edge_nodes.clone();
        mid_edge_nodes.retain(|found| found.ends.iter().all(|&end| used[end as usize]));
        mid_edge_nodes.iter().for_each(|found| used[found.node as usize] = true);
        let mut groups = self.groups.clone();
        groups.iter_mut().for_each(|group| group.nodes.retain(|&node| used[node as usize]));
        let mut mesh = Self {
            tets,
            tet_regions: piece.tets.iter().map(|tet| self.tet_regions[at(tet)]).collect(),
            groups,
            nodes: self.nodes.clone(),
            regions: self.regions.clone(),
            mid_edge_nodes,
            mid_side_nodes: self.mid_side_nodes.clone(),
            is_unit_asked: self.is_unit_asked,
            warnings: self.warnings.clone(),
        };
        mesh.drop_empty_regions();
        mesh
    }

    /// Leaves out regions without tetrahedra.
    fn drop_empty_regions(&mut self) {
        let mut number = vec![None; self.regions.len()];
        self.tet_regions.iter().for_each(|&region| number[region as usize] = Some(0));
        (0..).zip(number.iter_mut().flatten()).for_each(|(kept, slot)| *slot = kept);
        let mut each = number.iter();
        self.regions.retain(|_| each.next().is_some_and(Option::is_some));
        let renumber = |region: &mut u32| *region = number[*region as usize].unwrap_or(0);
        self.tet_regions.iter_mut().for_each(renumber);
    }
}
