//! Cells of a part of the surface: a centroidal Voronoi partition of its triangles, over which displacement is averaged.
//!
//! With the shape functions Nᵢ of the finite elements, the weight of node i in cell c is
//!
//! ```text
//! wᵢ = ∫_c Nᵢ(x) dA / ∫_c dA
//! ```
//!
//! so that equal tractions on all cells are a uniform traction. Cells are made by Lloyd's algorithm (1982, IEEE Trans. Inf. Theory
//! 28, 129) from farthest-point seeds. A part with no more nodes than cells has its nodes as cells.
//!
//! Equations: docs/theory.md (C63).

use super::quadratic_face::QuadraticFaces;
use super::{Surface, area_normal};
use alloc::collections::BTreeSet;
use alloc::vec;
use alloc::vec::Vec;
use glam::DVec3;

/// Iterations of Lloyd's algorithm: it has moved by less than a triangle long before.
const MAX_ITERATIONS: usize = 50;

/// Nodes with their weights, which sum to 1.
pub(crate) type Cell = Vec<(u32, f64)>;

/// Cells of some triangles of a surface with finite elements of an order: at most `max_cells`, and half as many as nodes.
pub(crate) fn cells(surface: &Surface, order: u32, triangles: &[u32], max_cells: usize) -> Vec<Cell> {
    let nodes: BTreeSet<u32> = triangles.iter().flat_map(|&t| surface.triangles[t as usize]).collect();
    if nodes.len() <= max_cells {
        return nodes.into_iter().map(|node| vec![(node, 1.0)]).collect();
    }
    let corners = |t: u32| surface.triangles[t as usize].map(|node| surface.positions[node as usize]);
    let centroid = |&t: &u32| corners(t).into_iter().sum::<DVec3>() / 3.0;
    let centroids: Vec<DVec3> = triangles.iter().map(centroid).collect();
    let areas: Vec<f64> = triangles.iter().map(|&t| 0.5 * area_normal(corners(t)).length()).collect();
    // More cells than half of the nodes would not be independent.
    let groups = partition(&centroids, &areas, max_cells.min(nodes.len() / 2).max(1));
    let faces = QuadraticFaces::new(surface, order);
    let mut all = Vec::new();
    let mut weight = vec![0.0; surface.positions.len()];
    for cell in 0..=groups.iter().copied().max().unwrap_or(0) {
        let members = (0..triangles.len()).filter(|&at| groups[at] == cell);
        let mut total = 0.0;
        let mut touched = BTreeSet::new();
        for at in members {
            // The midpoints of the edges integrate quadratic shape functions exactly.
            for point in [[0.5, 0.5, 0.0], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5]] {
                faces.shapes(surface, triangles[at] as usize, point, |node, shape| {
                    weight[node as usize] += shape * areas[at] / 3.0;
                    touched.insert(node);
                });
            }
            total += areas[at];
        }
        if total > 0.0 {
            let share = |&node: &u32| (node, weight[node as usize] / total);
            all.push(touched.iter().map(share).filter(|(_, w)| *w != 0.0).collect());
        }
        touched.into_iter().for_each(|node| weight[node as usize] = 0.0);
    }
    all
}

/// Number of the group of each point [m] with an area [m²]: at most `count` centroidal Voronoi cells.
fn partition(points: &[DVec3], areas: &[f64], count: usize) -> Vec<usize> {
    let total: f64 = areas.iter().sum();
    let middle: DVec3 = points.iter().zip(areas).map(|(p, area)| *p * (area / total)).sum();
    // Farthest-point seeds, from the point that is farthest from the middle.
    let mut distance: Vec<f64> = points.iter().map(|p| -(*p - middle).length()).collect();
    let mut centres: Vec<DVec3> = Vec::with_capacity(count);
    for _ in 0..count.min(points.len()) {
        let sign = if centres.is_empty() { -1.0 } else { 1.0 };
        let farthest =
            (0..points.len()).max_by(|&a, &b| (sign * distance[a]).total_cmp(&(sign * distance[b])));
        let Some(farthest) = farthest else { break };
        let first = centres.is_empty();
        centres.push(points[farthest]);
        for (d, p) in distance.iter_mut().zip(points) {
            let own = (*p - points[farthest]).length();
            *d = if first { own } else { d.min(own) };
        }
    }
    let mut groups = vec![usize::MAX; points.len()];
    for _ in 0..MAX_ITERATIONS {
        let mut changed = false;
        for (group, p) in groups.iter_mut().zip(points) {
            let to = |c: &usize| (centres[*c] - *p).length_squared();
            let nearest = (0..centres.len()).min_by(|a, b| to(a).total_cmp(&to(b))).unwrap_or(0);
            changed |= core::mem::replace(group, nearest) != nearest;
        }
        if !changed {
            break;
        }
        for (c, centre) in centres.iter_mut().enumerate() {
            let own = || groups.iter().zip(points).zip(areas).filter(move |((group, _), _)| **group == c);
            let area: f64 = own().map(|(_, area)| area).sum();
            if area > 0.0 {
                *centre = own().map(|((_, p), own)| *p * (own / area)).sum();
            }
        }
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Square of 6 × 6 cells with side 1.
    fn square() -> Surface {
        let at = |i: u32, j: u32| i * 7 + j;
        let mut triangles = Vec::new();
        for (i, j) in (0..6).flat_map(|i| (0..6).map(move |j| (i, j))) {
            triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
        let positions = (0..49).map(|k| DVec3::new(f64::from(k / 7), f64::from(k % 7), 0.0) / 6.0).collect();
        Surface { positions, triangles, source_nodes: (0..49).collect() }
    }

    #[test]
    fn cells_cover_a_part_of_the_surface_with_its_area() {
        let surface = square();
        let triangles: Vec<u32> = (0..72).collect();
        for count in [1, 4, 9, 16, 40] {
            let all = cells(&surface, 1, &triangles, count);
            // At most half as many as nodes, and no cell is empty.
            assert!(all.len() <= count.min(24) && 2 * all.len() > count.min(24), "{}", all.len());
            for cell in &all {
                assert!((cell.iter().map(|(_, w)| w).sum::<f64>() - 1.0).abs() < 1e-14);
                assert!(cell.iter().all(|(_, w)| *w > 0.0));
            }
            // One cell has the weights of the uniform traction: a third of the triangles around each node.
            if count == 1 {
                let corner = all[0].iter().find(|(node, _)| *node == 6).map_or(0.0, |(_, w)| *w);
                assert!((corner - 1.0 / 3.0 / 72.0).abs() < 1e-15, "{corner}");
            }
        }
    }

    #[test]
    fn a_part_with_no_more_nodes_than_cells_has_its_nodes_as_cells() {
        let nodes = cells(&square(), 1, &[0, 1], 4);
        assert_eq!(nodes, [0, 1, 7, 8].map(|node| vec![(node, 1.0)]));
    }
}
