//! Poisson-disk subsampling of surface nodes: contact samples whose spacing is even, and finer where the mesh is.
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

/// Ratio of the mean edge of a surface to those at a node up to which a mesh counts as one of even size.
const EVEN_EDGES: f64 = 1.2;

/// Disk radius of every node as a share of the spacing [1]: 1 in a mesh of even size, less where its edges are finer.
fn disk_radii(surface: &Surface) -> Vec<f64> {
    let (mut sums, mut counts) = (vec![0.0; surface.positions.len()], vec![0.0; surface.positions.len()]);
    for corners in &surface.triangles {
        for (a, b) in [(0, 1), (1, 2), (2, 0)].map(|(a, b)| (corners[a] as usize, corners[b] as usize)) {
            let length = (surface.positions[a] - surface.positions[b]).length();
            for node in [a, b] {
                sums[node] += length;
                counts[node] += 1.0;
            }
        }
    }
    let even = EVEN_EDGES / surface.mean_edge();
    sums.iter().zip(&counts).map(|(sum, count)| f64::min(1.0, even * sum / f64::max(*count, 1.0))).collect()
}

/// Points on a surface in cells of a grid.
struct Grid {
    cell: f64,
    points: BTreeMap<[i64; 3], Vec<u32>>,
}

impl Grid {
    /// Empty grid whose cells have a size [m].
    fn new(cell: f64) -> Self {
        Self { cell, points: BTreeMap::new() }
    }

    fn cell_of(&self, position: DVec3) -> [i64; 3] {
        (position / self.cell).floor().to_array().map(|x| x as i64)
    }

    fn insert(&mut self, position: DVec3, node: u32) {
        self.points.entry(self.cell_of(position)).or_default().push(node);
    }

    /// Nodes in the cell of a position and those around it: all within the size of a cell.
    fn near(&self, position: DVec3) -> impl Iterator<Item = u32> {
        let [x, y, z] = self.cell_of(position);
        let offsets = (0..27).map(|k| [k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1]);
        // Cells of positions beyond 2⁶³ cells saturate.
        let cell =
            move |[dx, dy, dz]: [i64; 3]| [x.saturating_add(dx), y.saturating_add(dy), z.saturating_add(dz)];
        offsets.flat_map(move |offset| self.points.get(&cell(offset)).into_iter().flatten()).copied()
    }
}

/// Radii of disks about samples that cover all nodes [m]: the distance from the next sample on the same side of the surface, at most a spacing,
/// and more where a node is in no disk.
pub(crate) fn covering_radii(surface: &Surface, spacing: f64, samples: &[u32]) -> Vec<f64> {
    let normals = node_normals(surface);
    let position = |node: u32| surface.positions[node as usize];
    let mut grid = Grid::new(spacing);
    (0..).zip(samples).for_each(|(sample, &node)| grid.insert(position(node), sample));
    // Samples on the side of a node, with their distances.
    let beside = |node: u32| {
        let near = grid.near(position(node)).map(|sample| (sample as usize, samples[sample as usize]));
        let (normal, normals) = (normals[node as usize], &normals);
        let same_side = near.filter(move |&(_, other)| normals[other as usize].dot(normal) >= 0.0);
        same_side.map(move |(sample, other)| (sample, (position(other) - position(node)).length()))
    };
    let from_next = |(at, &node): (usize, &u32)| {
        let others = beside(node).filter(|(sample, _)| *sample != at);
        others.map(|(_, distance)| distance).fold(spacing, f64::min)
    };
    let mut radii: Vec<f64> = samples.iter().enumerate().map(from_next).collect();
    for node in 0..surface.positions.len() as u32 {
        let ratio = |(sample, distance): &(usize, f64)| distance / radii[*sample];
        let nearest = beside(node).min_by(|a, b| ratio(a).total_cmp(&ratio(b)));
        if let Some((sample, distance)) = nearest.filter(|(_, distance)| *distance <= spacing) {
            radii[sample] = radii[sample].max(distance);
        }
    }
    radii
}

/// Poisson-disk sample of the nodes: samples keep a spacing [m], and every node lies within it of a sample. Where the mesh is finer, so is the
/// spacing: two samples are as far apart as the mean of their disk radii. Corners come
/// first, then edges, so that a body rests on its samples as on its whole surface. The two sides of a thin part are sampled
/// separately; a node without normal counts for both.
pub(crate) fn poisson_disk_sample(surface: &Surface, spacing: f64) -> Vec<u32> {
    let radii = disk_radii(surface);
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
    let mut taken = Grid::new(spacing);
    nodes.retain(|&node| {
        let (position, normal) = (surface.positions[node as usize], normals[node as usize]);
        let blocks = |other: u32| {
            let (place, its) = (surface.positions[other as usize], normals[other as usize]);
            let apart = 0.5 * (radii[node as usize] + radii[other as usize]) * spacing;
            (place - position).length() < apart && its.dot(normal) >= 0.0
        };
        let stays = !taken.near(position).any(blocks);
        if stays {
            taken.insert(position, node);
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
    fn samples_are_as_much_finer_as_the_mesh_is_and_their_disks_cover_it() {
        // Edges at the middle are a sixth of those at the rim.
        let mut surface = slab(40, 0.2);
        for p in &mut surface.positions {
            let grade = |x: f64| 0.5 + 0.5 * libm::sinh(2.5 * (2.0 * x - 1.0)) / libm::sinh(2.5);
            *p = DVec3::new(grade(p.x), grade(p.y), p.z);
        }
        let radii = disk_radii(&surface);
        let spacing = 3.0 * surface.mean_edge();
        let nodes = poisson_disk_sample(&surface, spacing);
        let distances = covering_radii(&surface, spacing, &nodes);
        let position = |node: u32| surface.positions[node as usize];
        let near_middle = |radius: f64, among: &[u32]| {
            let middle = DVec3::new(0.5, 0.5, 0.2);
            among.iter().filter(|node| (position(**node) - middle).length() < radius).count() as f64
        };
        let (all, kept) = (near_middle(0.15, &surface.source_nodes), near_middle(0.15, &nodes));
        // The spacing is 3.6 edges: one in about 15 nodes stays, as in a mesh of even size. Of an even spacing here, one in 200.
        assert!(kept > all / 25.0, "{kept} of {all} nodes at the middle");
        for p in surface.source_nodes.iter().map(|&node| position(node)) {
            let covers = |(node, radius): (&u32, &f64)| (position(*node) - p).length() <= *radius;
            assert!(nodes.iter().zip(&distances).any(covers), "{p}");
        }
        for (a, own) in nodes.iter().zip(&distances) {
            assert!(*own >= 0.5 * radii[*a as usize] * spacing && *own <= spacing);
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
