//! Distance between the boundary of a mesh and the surface that it was made of, both ways, at points of either.

use super::prepare::Prepared;
use super::tree::SurfaceTree;
use crate::volume_mesh::Mesh;
use glam::DVec3;
use rayon::prelude::*;

/// Points that are taken of either side at most.
const MAX_POINTS: usize = 40_000;

/// Distance from the surface, in cells, at which a point of it is asked whether it lies inside on both sides.
const BESIDE: f64 = 0.02;

/// 95th percentile and maximum of the distance [m]. Triangles of the surface inside other parts of it are no boundary, and left out; holes have no triangles to be far from.
pub(super) fn distances(mesh: &Mesh, prepared: &Prepared, cell: f64) -> [f64; 2] {
    let boundary: Vec<[DVec3; 3]> =
        mesh.boundary().iter().flat_map(|&face| triangles_of(mesh, face)).collect();
    let surface = prepared.surface.corners();
    let is_outer = |&(point, normal): &(DVec3, DVec3)| {
        let beside = |side: f64| prepared.tree.has_inside(point + normal * (side * BESIDE * cell));
        !(prepared.overlaps && beside(1.0) && beside(-1.0))
    };
    let all = points(&surface);
    let outer: Vec<_> = all.par_iter().filter(|point| is_outer(point)).collect();
    let own = points(&boundary);
    let tree = SurfaceTree::new(boundary);
    let mut all_distances: Vec<f64> = outer.par_iter().map(|(point, _)| tree.closest(*point).1).collect();
    all_distances.par_extend(own.par_iter().map(|(point, _)| prepared.tree.closest(*point).1));
    all_distances.sort_unstable_by(f64::total_cmp);
    let last = all_distances.len().saturating_sub(1);
    let at = |share: f64| all_distances.get((share * last as f64) as usize).copied().unwrap_or(0.0);
    [at(0.95), at(1.0)]
}

/// The triangle of a face, or four between the middles of its edges where one of them is curved.
fn triangles_of(mesh: &Mesh, face: [u32; 3]) -> Vec<[DVec3; 3]> {
    let at = |node: u32| mesh.nodes[node as usize];
    let [a, b, c] = face.map(at);
    let nodes = [[0, 1], [1, 2], [2, 0]].map(|[i, j]| mesh.mid_edge_node(face[i], face[j]));
    if nodes == [None; 3] {
        return vec![[a, b, c]];
    }
    let [ab, bc, ca] = nodes.map(|node| node.map(at));
    let (ab, bc, ca) =
        (ab.unwrap_or((a + b) * 0.5), bc.unwrap_or((b + c) * 0.5), ca.unwrap_or((c + a) * 0.5));
    vec![[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
}

/// Corners, middles of edges and centroids of triangles, and the normal there.
fn points(triangles: &[[DVec3; 3]]) -> Vec<(DVec3, DVec3)> {
    const SHARES: [[f64; 3]; 7] = [
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.5, 0.5, 0.0],
        [0.0, 0.5, 0.5],
        [0.5, 0.0, 0.5],
        [1.0 / 3.0; 3],
    ];
    let every = (SHARES.len() * triangles.len()).div_ceil(MAX_POINTS);
    let of_triangle = |&[a, b, c]: &[DVec3; 3]| {
        let normal = (b - a).cross(c - a).normalize_or_zero();
        SHARES.map(|[u, v, w]| (a * u + b * v + c * w, normal))
    };
    triangles.iter().flat_map(of_triangle).step_by(every.max(1)).collect()
}
