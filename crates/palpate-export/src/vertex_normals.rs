//! Vertex normals with creases: angle-weighted sums of face normals, n = Σ αᵢ nᵢ / |…|, over smoothing groups.
//!
//! A node becomes one vertex per smoothing group: the triangles around it that are connected by edges whose dihedral angle at
//! rest is below the crease angle. Reference: Thürmer and Wüthrich, Computing vertex normals from polygonal facets (1998).

use glam::DVec3;

/// Surface with a vertex per node and smoothing group.
#[derive(Debug, Clone, PartialEq)]
pub struct ShadedSurface {
    /// Surface node of each vertex.
    pub nodes: Vec<u32>,
    /// Vertices of each triangle.
    pub triangles: Vec<[u32; 3]>,
}

/// Crease angle [rad]: 40°.
const CREASE: f64 = 0.7;

impl ShadedSurface {
    /// Splits the nodes of a surface at rest.
    pub fn new(positions: &[DVec3], triangles: &[[u32; 3]]) -> Self {
        let faces: Vec<DVec3> =
            triangles.iter().map(|corners| normal(corners.map(|n| positions[n as usize]))).collect();
        let mut around: Vec<Vec<usize>> = vec![Vec::new(); positions.len()];
        for (triangle, corners) in triangles.iter().enumerate() {
            corners.iter().for_each(|&node| around[node as usize].push(triangle));
        }
        let mut shaded = Self { nodes: Vec::new(), triangles: triangles.to_vec() };
        for (node, around) in around.iter().enumerate() {
            let node = node as u32;
            let smooth = |&a: &usize, &b: &usize| {
                let shared = triangles[a].iter().filter(|n| **n != node && triangles[b].contains(n)).count();
                shared > 0 && faces[a].dot(faces[b]) >= CREASE.cos()
            };
            let mut left = around.clone();
            while let Some(first) = left.pop() {
                let vertex = shaded.nodes.len() as u32;
                shaded.nodes.push(node);
                let mut group = vec![first];
                while let Some(triangle) = group.pop() {
                    let corners = &mut shaded.triangles[triangle];
                    for (corner, known) in corners.iter_mut().zip(triangles[triangle]) {
                        if known == node {
                            *corner = vertex;
                        }
                    }
                    let (near, far) = left.iter().partition(|&other| smooth(&triangle, other));
                    left = far;
                    group.extend::<Vec<usize>>(near);
                }
            }
        }
        shaded
    }

    /// Unit normals of the vertices, for node positions [m].
    pub fn normals(&self, positions: &[DVec3]) -> Vec<DVec3> {
        let mut normals = vec![DVec3::ZERO; self.nodes.len()];
        for vertices in &self.triangles {
            let corners = vertices.map(|v| positions[self.nodes[v as usize] as usize]);
            let face = normal(corners);
            if face == DVec3::ZERO {
                continue;
            }
            for at in 0..3 {
                let [a, b, c] = [corners[at], corners[(at + 1) % 3], corners[(at + 2) % 3]];
                normals[vertices[at] as usize] += face * (b - a).angle_between(c - a);
            }
        }
        // Any unit vector will do where all triangles have no area.
        normals.into_iter().map(|n| n.try_normalize().unwrap_or(DVec3::Z)).collect()
    }
}

fn normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a).normalize_or_zero()
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_mesh::{SurfaceMesh, ball_mesh, box_mesh};

    #[test]
    fn a_box_breaks_at_its_edges_and_is_flat_between_them() {
        let surface =
            SurfaceMesh::from_boundary(box_mesh([0.2, 0.1, 0.1], [2, 2, 2]).expect("a box")).expect("closed");
        let shaded = ShadedSurface::new(&surface.positions, &surface.triangles);
        // Of 26 nodes 8 corners are drawn thrice, 12 middles of edges twice, 6 middles of faces once.
        assert_eq!((surface.positions.len(), shaded.nodes.len()), (26, 8 * 3 + 12 * 2 + 6));
        let normals = shaded.normals(&surface.positions);
        assert!(normals.iter().all(|n| (n.abs().max_element() - 1.0).abs() < 1e-12));
        for (drawn, known) in shaded.triangles.iter().zip(&surface.triangles) {
            assert_eq!(drawn.map(|v| shaded.nodes[v as usize]), *known);
        }
    }

    #[test]
    fn a_ball_is_smooth_and_its_normals_point_outwards() {
        let surface = SurfaceMesh::from_boundary(ball_mesh(0.05, 4).expect("a ball")).expect("closed");
        let shaded = ShadedSurface::new(&surface.positions, &surface.triangles);
        assert_eq!(shaded.nodes.len(), surface.positions.len());
        for (normal, node) in shaded.normals(&surface.positions).iter().zip(&shaded.nodes) {
            assert!(normal.dot(surface.positions[*node as usize].normalize()) > 0.99);
        }
    }
}
