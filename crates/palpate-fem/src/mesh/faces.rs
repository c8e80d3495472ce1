//! Faces of tetrahedra, and the boundary of a mesh.

use super::volume_mesh::Mesh;
use glam::DVec3;

/// Faces of a tetrahedron of positive volume, counter-clockwise seen from outside.
const FACES: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

/// A face of a tetrahedron: sorted nodes, whether the permutation is even, number of the tetrahedron.
pub(super) type Face = ([u32; 3], bool, u32);

/// Signed volume of a tetrahedron [m³].
pub(super) fn tet_volume(nodes: &[DVec3], tet: &[u32; 4]) -> f64 {
    let [a, b, c, d] = tet.map(|n| nodes[n as usize]);
    (b - a).cross(c - a).dot(d - a) / 6.0
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
