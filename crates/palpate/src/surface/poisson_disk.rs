//! Poisson-disk subsampling of surface nodes: contact samples of an even spacing.
//!
//! Equations: docs/theory.md (C30).

use super::patch_weights::area_vector;
use super::{Surface, area_normal, triangles_around};
use alloc::collections::BTreeMap;
use alloc::vec;
use alloc::vec::Vec;
use glam::DVec3;

/// Smallest cosine between a node's normal and those of its triangles below which it is a corner, or an edge.
const CORNER_COSINE: f64 = 0.65;
pub(crate) const EDGE_COSINE: f64 = 0.85;

/// Outward unit normal of every node at rest, angle-weighted: the mean of its triangles' normals by their angles at the node,
/// whatever the triangulation of a face (Thürmer & Wüthrich 1998, J. Graph. Tools 3, 43); zero where they cancel.
pub(crate) fn node_normals(surface: &Surface) -> Vec<DVec3> {
    let mut normals = vec![DVec3::ZERO; surface.positions.len()];
    for corners in &surface.triangles {
        let positions = corners.map(|node| surface.positions[node as usize]);
        let Some(normal) = area_normal(positions).try_normalize() else { continue };
        for (at, node) in corners.iter().enumerate() {
            let [own, next, last] = [0, 1, 2].map(|k| positions[(at + k) % 3]);
            normals[*node as usize] += normal * (next - own).angle_between(last - own);
        }
    }
    normals.into_iter().map(|sum| if sum.length() > 1e-9 { sum.normalize() } else { DVec3::ZERO }).collect()
}

/// Poisson-disk sample of the nodes: samples keep a spacing [m], and every node lies within it of a sample. Corners come
/// first, then edges, so that a body rests on its samples as on its whole surface. The two sides of a thin part are sampled
/// separately; a node without normal counts for both.
pub(crate) fn poisson_disk_sample(surface: &Surface, spacing: f64) -> Vec<u32> {
    let around = triangles_around(surface);
    let unit = |t: &u32| area_vector(surface, *t as usize).normalize_or_zero();
    let normals = node_normals(surface);
    let rank = |node: &u32| {
        let (own, normal) = (&around[*node as usize], normals[*node as usize]);
        let least = own.iter().map(|t| unit(t).dot(normal)).fold(1.0, f64::min);
        (u32::from(least >= CORNER_COSINE) + u32::from(least >= EDGE_COSINE), *node)
    };
    let mut nodes: Vec<u32> =
        (0..surface.positions.len() as u32).filter(|n| !around[*n as usize].is_empty()).collect();
    nodes.sort_by_cached_key(rank);
    let cell = |p: DVec3| (p / spacing).floor().to_array().map(|x| x as i64);
    let mut taken: BTreeMap<[i64; 3], Vec<u32>> = BTreeMap::new();
    nodes.retain(|&node| {
        let (position, normal) = (surface.positions[node as usize], normals[node as usize]);
        let [x, y, z] = cell(position);
        let beside = |[dx, dy, dz]: [i64; 3]| taken.get(&[x + dx, y + dy, z + dz]).into_iter().flatten();
        let blocks = |other: &u32| {
            let (other, its) = (surface.positions[*other as usize], normals[*other as usize]);
            (other - position).length() < spacing && its.dot(normal) >= 0.0
        };
        let mut offsets = (0..27).map(|k| [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1]);
        let stays = !offsets.any(|offset| beside(offset).any(blocks));
        if stays {
            taken.entry([x, y, z]).or_default().push(node);
        }
        stays
    });
    nodes
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two large faces of a slab with side 1, n × n cells and a thickness.
    fn slab(n: u32, thickness: f64) -> Surface {
        let side = (n + 1) * (n + 1);
        let node = |i: u32, j: u32, face: u32| face * side + i * (n + 1) + j;
        let mut triangles = Vec::new();
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let corners = |face: u32| [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(x, y)| node(i + x, j + y, face));
            let ([a, b, c, d], [e, f, g, h]) = (corners(0), corners(1));
            triangles.extend([[a, c, b], [a, d, c], [e, f, g], [e, g, h]]);
        }
        let position = |k: u32| {
            let (face, k) = (k / side, k % side);
            DVec3::new(f64::from(k / (n + 1)), f64::from(k % (n + 1)), 0.0) / f64::from(n)
                + DVec3::Z * (f64::from(face) * thickness)
        };
        let positions: Vec<DVec3> = (0..2 * side).map(position).collect();
        Surface { source_nodes: (0..positions.len() as u32).collect(), positions, triangles }
    }

    #[test]
    fn samples_keep_their_spacing_and_cover_both_sides_of_a_thin_part() {
        let surface = slab(20, 0.01);
        for spacing in [0.07, 0.15, 0.4] {
            let nodes = poisson_disk_sample(&surface, spacing);
            let position = |node: &u32| surface.positions[*node as usize];
            let same_side = |a: DVec3, b: DVec3| (a.z - b.z).abs() < 1e-9;
            for (at, a) in nodes.iter().map(position).enumerate() {
                let others = nodes[..at].iter().map(position).filter(|b| same_side(a, *b));
                assert!(others.map(|b| (a - b).length()).fold(1.0, f64::min) >= spacing);
            }
            for p in &surface.positions {
                let near = nodes.iter().map(position).filter(|b| same_side(*p, *b));
                assert!(near.map(|b| (*p - b).length()).fold(1.0, f64::min) < spacing, "{p}");
            }
        }
    }

    #[test]
    fn a_sheet_of_no_thickness_is_subsampled() {
        let mut surface = slab(10, 0.0);
        // Both faces share their nodes: no node has a normal.
        let nodes = surface.positions.len() as u32 / 2;
        surface.triangles.iter_mut().flatten().for_each(|node| *node %= nodes);
        assert!(poisson_disk_sample(&surface, 0.3).len() < 30);
    }

    #[test]
    fn samples_include_the_corners_of_a_block() {
        let bytes = include_bytes!("../../../../data/recordings/v1/free.palp");
        let surface = crate::recording::Recording::from_bytes(bytes).expect("a released recording").surface;
        let nodes = poisson_disk_sample(&surface, 0.099);
        let is_corner = |node: &u32| surface.positions[*node as usize].x.abs() > 0.099;
        assert_eq!(nodes.iter().filter(|node| is_corner(node)).count(), 8, "{nodes:?}");
    }
}
