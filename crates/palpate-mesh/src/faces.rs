//! Faces of tetrahedra, and the boundary of a mesh.

use super::volume_mesh::Mesh;
use glam::DVec3;

/// Faces of a tetrahedron of positive volume, counter-clockwise seen from outside.
const FACES: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

/// Edges of a tetrahedron, by its corners.
pub(super) const EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]];

/// Disjoint sets of numbers (union-find); the smallest number of a set is its root.
pub(super) struct Sets(Vec<u32>);

impl Sets {
    pub fn new(count: usize) -> Self {
        Self((0..count as u32).collect())
    }

    pub fn root(&mut self, mut at: u32) -> u32 {
        while self.0[at as usize] != at {
            self.0[at as usize] = self.0[self.0[at as usize] as usize];
            at = self.0[at as usize];
        }
        at
    }

    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }
}

/// A face of a tetrahedron: sorted nodes, whether the permutation is even, number of the tetrahedron.
pub(super) type Face = ([u32; 3], bool, u32);

/// Signed volume of a tetrahedron [m³].
pub(super) fn tet_volume(nodes: &[DVec3], tet: &[u32; 4]) -> f64 {
    let [a, b, c, d] = tet.map(|n| nodes[n as usize]);
    (b - a).cross(c - a).dot(d - a) / 6.0
}

/// Dihedral angles of a tetrahedron at its six edges [rad]; zero where it is flat.
pub(super) fn dihedral_angles(nodes: &[DVec3], tet: &[u32; 4]) -> [f64; 6] {
    let corners = tet.map(|n| nodes[n as usize]);
    EDGES.map(|[a, b]| {
        let mut others = (0..4).filter(|corner| *corner != a && *corner != b).map(|corner| corners[corner]);
        let (Some(c), Some(d)) = (others.next(), others.next()) else { return 0.0 };
        let edge = (corners[b] - corners[a]).normalize_or_zero();
        let across = |point: DVec3| (point - corners[a]).reject_from_normalized(edge).normalize_or_zero();
        // The sine and the cosine together keep small angles exact.
        let (u, v) = (across(c), across(d));
        u.cross(v).length().atan2(u.dot(v))
    })
}

/// All faces of all tetrahedra, sorted, so that the two copies of an interior face are neighbours.
pub(super) fn sorted_faces(tets: &[[u32; 4]]) -> Vec<Face> {
    let mut faces = Vec::with_capacity(4 * tets.len());
    for (number, tet) in tets.iter().enumerate() {
        for corners in FACES {
            let [mut a, mut b, mut c] = corners.map(|corner| tet[corner]);
            let mut even = true;
            if a > b {
                (a, b, even) = (b, a, !even);
            }
            if b > c {
                (b, c, even) = (c, b, !even);
            }
            if a > b {
                (a, b, even) = (b, a, !even);
            }
            faces.push(([a, b, c], even, number as u32));
        }
    }
    faces.sort_unstable();
    faces
}

impl Mesh {
    /// Boundary triangles: the faces of one tetrahedron only, counter-clockwise seen from outside if the tetrahedra
    /// have positive volume, sorted by their nodes.
    pub fn boundary(&self) -> Vec<[u32; 3]> {
        let faces = sorted_faces(&self.tets);
        let boundary = faces.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() == 1);
        boundary
            .map(|same| {
                let ([a, b, c], even, _) = same[0];
                if even { [a, b, c] } else { [a, c, b] }
            })
            .collect()
    }
}
