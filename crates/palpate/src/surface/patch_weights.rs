//! Contact patches: distribution of a touch over the surrounding surface, so that its force does not depend on the mesh.
//!
//! About a surface node c with normal n_c, the weight of node i is the integral over the surface at rest
//!
//! ```text
//! wᵢ = ∫ k(|x − x_c|/a)·max(0, n·n_c)·Nᵢ(x) dA / ∫ k·max(0, n·n_c) dA,        k(s) = (1 − s²)² for s < 1
//! ```
//!
//! with the patch radius a [m] and the shape functions Nᵢ of the finite elements, over the part of the surface that is connected
//! with c. Displacement is averaged and force distributed with the same weights. As a → 0 the patch becomes the node.
//!
//! Equations: docs/theory.md (C26).

use super::cells::Cell;
use super::quadratic_face::QuadraticFaces;
use super::{Surface, area_normal, at_weights};
use alloc::vec;
use alloc::vec::Vec;
use glam::DVec3;

/// Weights of the patches about surface nodes.
#[derive(Debug, Clone)]
pub(crate) struct PatchWeights {
    offsets: Vec<u32>,
    nodes: Vec<u32>,
    weights: Vec<f64>,
}

/// Ratio of edge to patch radius up to which triangles are subdivided: the rule of edge midpoints then integrates the kernel
/// to about a thousandth.
const MAX_EDGE_RATIO: f64 = 0.25;

/// Upper limit of subdivisions: a patch a hundred times smaller than its triangle is its node.
const MAX_HALVINGS: u32 = 7;

impl PatchWeights {
    /// Patches of a radius [m] about nodes of a surface, with finite elements of an order.
    pub(crate) fn new(surface: &Surface, order: u32, radius: f64, centres: &[u32]) -> Self {
        let faces = QuadraticFaces::new(surface, order);
        let n = surface.positions.len();
        let around = triangles_around(surface);
        let normals: Vec<DVec3> = (0..surface.triangles.len()).map(|t| area_vector(surface, t)).collect();
        let mut patches = Self { offsets: vec![0], nodes: Vec::new(), weights: Vec::new() };
        let mut weight = vec![0.0; n];
        let mut seen = vec![u32::MAX; surface.triangles.len()];
        let mut is_touched = vec![u32::MAX; n];
        let (mut queue, mut touched) = (Vec::new(), Vec::new());
        for c in centres.iter().map(|&c| c as usize) {
            let centre = surface.positions[c];
            let normal = around[c].iter().map(|&t| normals[t as usize]).sum::<DVec3>().normalize_or_zero();
            queue.clear();
            touched.clear();
            let mut add = |node: u32, w: f64, weight: &mut Vec<f64>| {
                if is_touched[node as usize] != c as u32 {
                    is_touched[node as usize] = c as u32;
                    touched.push(node);
                }
                weight[node as usize] += w;
            };
            for &t in &around[c] {
                seen[t as usize] = c as u32;
                queue.push(t);
            }
            while let Some(t) = queue.pop() {
                let corners = surface.triangles[t as usize];
                let facing = normals[t as usize].normalize_or_zero().dot(normal);
                if facing <= 0.0 || radius <= 0.0 {
                    continue;
                }
                let positions = corners.map(|node| surface.positions[node as usize]);
                let area = 0.5 * normals[t as usize].length() * facing;
                let mut reached = false;
                integrate(positions, centre, radius, |w, share| {
                    reached = true;
                    faces.shapes(surface, t as usize, w, |node, w| add(node, w * share * area, &mut weight));
                });
                if reached {
                    for node in corners {
                        for &next in &around[node as usize] {
                            if seen[next as usize] != c as u32 {
                                seen[next as usize] = c as u32;
                                queue.push(next);
                            }
                        }
                    }
                }
            }
            let total: f64 = touched.iter().map(|&node| weight[node as usize]).sum();
            touched.sort_unstable();
            if total > 0.0 {
                for &node in &touched {
                    patches.nodes.push(node);
                    patches.weights.push(weight[node as usize] / total);
                }
            } else {
                patches.nodes.push(c as u32);
                patches.weights.push(1.0);
            }
            touched.iter().for_each(|&node| weight[node as usize] = 0.0);
            patches.offsets.push(patches.nodes.len() as u32);
        }
        patches
    }

    /// Patches with given nodes and weights.
    pub(crate) fn of_cells(cells: &[Cell]) -> Self {
        let mut patches = Self { offsets: vec![0], nodes: Vec::new(), weights: Vec::new() };
        for cell in cells {
            patches.nodes.extend(cell.iter().map(|(node, _)| *node));
            patches.weights.extend(cell.iter().map(|(_, weight)| *weight));
            patches.offsets.push(patches.nodes.len() as u32);
        }
        patches
    }

    /// Number of patches.
    pub(crate) fn len(&self) -> usize {
        self.offsets.len() - 1
    }

    /// Nodes and weights of a patch; the weights sum to 1.
    pub(crate) fn of(&self, patch: usize) -> impl Iterator<Item = (usize, f64)> + Clone + '_ {
        let range = self.offsets[patch] as usize..self.offsets[patch + 1] as usize;
        self.nodes[range.clone()].iter().map(|&n| n as usize).zip(self.weights[range].iter().copied())
    }
}

/// Triangles around each surface node.
pub(crate) fn triangles_around(surface: &Surface) -> Vec<Vec<u32>> {
    let mut around = vec![Vec::new(); surface.positions.len()];
    for (t, corners) in surface.triangles.iter().enumerate() {
        corners.iter().for_each(|&node| around[node as usize].push(t as u32));
    }
    around
}

/// Normal of a triangle with twice its area as length [m²].
pub(super) fn area_vector(surface: &Surface, triangle: usize) -> DVec3 {
    area_normal(surface.triangles[triangle].map(|node| surface.positions[node as usize]))
}

/// Kernel of patches times a scale: scale·(1 − s²)², for the ratio s of distance and radius [1].
pub(crate) fn patch_kernel(scale: f64, s_squared: f64) -> f64 {
    if s_squared < 1.0 { scale * (1.0 - s_squared) * (1.0 - s_squared) } else { 0.0 }
}

/// Quadrature over a triangle: `add` takes the barycentric weights of a point, and its fraction of the area times the kernel.
fn integrate(corners: [DVec3; 3], centre: DVec3, radius: f64, mut add: impl FnMut([f64; 3], f64)) {
    let [a, b, c] = corners;
    let longest = (a - b).length().max((b - c).length()).max((c - a).length());
    let mut halvings = 0;
    while longest / f64::from(1_u32 << halvings) > MAX_EDGE_RATIO * radius && halvings < MAX_HALVINGS {
        halvings += 1;
    }
    let n = 1_u32 << halvings;
    let share = 1.0 / (f64::from(n) * f64::from(n));
    let mut point = |w: [f64; 3], share: f64| {
        let s = (at_weights(corners, w) - centre).length_squared() / (radius * radius);
        let k = patch_kernel(share, s);
        if k > 0.0 {
            add(w, k);
        }
    };
    let step = 1.0 / f64::from(n);
    for (i, j) in (0..n).flat_map(|i| (0..n - i).map(move |j| (i, j))) {
        let (u, v) = (f64::from(i) * step, f64::from(j) * step);
        let mut small = |corners: [(f64, f64); 3]| {
            for k in 0..3 {
                let (p, q) = (corners[k], corners[(k + 1) % 3]);
                let (x, y) = (0.5 * (p.0 + q.0), 0.5 * (p.1 + q.1));
                point([1.0 - x - y, x, y], share / 3.0);
            }
        };
        small([(u, v), (u + step, v), (u, v + step)]);
        if i + j + 1 < n {
            small([(u + step, v), (u + step, v + step), (u, v + step)]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A flat square of n × n cells with side 1 in the plane z = 0.
    fn sheet(n: u32) -> Surface {
        let node = |i: u32, j: u32| i * (n + 1) + j;
        let mut triangles = Vec::new();
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            triangles.push([node(i, j), node(i + 1, j), node(i + 1, j + 1)]);
            triangles.push([node(i, j), node(i + 1, j + 1), node(i, j + 1)]);
        }
        let position =
            |k: u32| DVec3::new(f64::from(k / (n + 1)), f64::from(k % (n + 1)), 0.0) / f64::from(n);
        let positions: Vec<DVec3> = (0..(n + 1) * (n + 1)).map(position).collect();
        let source_nodes = (0..positions.len() as u32).collect();
        Surface { positions, triangles, source_nodes }
    }

    #[test]
    fn a_patch_in_a_plane_has_the_moments_of_its_kernel() {
        // ∫k·r²/∫k = a²/4; the hat functions add a sixth of an edge squared per axis, and a bit across the diagonals.
        let (a, n) = (0.3, 40);
        let surface = sheet(n);
        let patches = PatchWeights::new(&surface, 1, a, &surface.source_nodes);
        let c = (n / 2 * (n + 1) + n / 2) as usize;
        let (mut sum, mut mean, mut square) = (0.0, DVec3::ZERO, 0.0);
        for (node, w) in patches.of(c) {
            let arm = surface.positions[node] - surface.positions[c];
            sum += w;
            mean += arm * w;
            square += w * arm.length_squared();
        }
        let hats = 1.0 / 3.0 / f64::from(n * n);
        assert!((sum - 1.0).abs() < 1e-12);
        assert!(mean.length() < 1e-3 * a, "{mean}");
        assert!((square / (0.25 * a * a + hats) - 1.0).abs() < 5e-3, "{square}");
    }

    #[test]
    fn a_small_patch_is_its_node() {
        let surface = sheet(4);
        for radius in [0.0, 1e-5] {
            let patches = PatchWeights::new(&surface, 1, radius, &surface.source_nodes);
            let most = patches.of(12).fold(0.0, |most: f64, (node, w)| if node == 12 { w } else { most });
            assert!(most > 0.999, "{most}");
        }
    }

    /// Sheet as the surface of quadratic elements: faces of 2 × 2 cells, with mid-edge nodes numbered last.
    fn quadratic_sheet(n: u32) -> Surface {
        let mut surface = sheet(n);
        let node = |i: u32, j: u32| i * (n + 1) + j;
        surface.triangles.clear();
        for (i, j) in (0..n / 2).flat_map(|i| (0..n / 2).map(move |j| (2 * i, 2 * j))) {
            for [a, b, c] in [[[0, 0], [2, 0], [2, 2]], [[0, 0], [2, 2], [0, 2]]] {
                let middle = |p: [u32; 2], q: [u32; 2]| [(p[0] + q[0]) / 2, (p[1] + q[1]) / 2];
                let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                for corners in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [bc, ca, ab]] {
                    surface.triangles.push(corners.map(|[x, y]| node(i + x, j + y)));
                }
            }
        }
        let is_corner = |k: u32| (k / (n + 1)).is_multiple_of(2) && (k % (n + 1)).is_multiple_of(2);
        let count = (n + 1) * (n + 1);
        surface.source_nodes = (0..count).map(|k| if is_corner(k) { k } else { count + k }).collect();
        surface
    }

    #[test]
    fn patches_of_quadratic_elements_average_quadratic_fields_exactly() {
        // ∫k·x²/∫k = a²/8, with nothing added by the mesh, however coarse.
        let n = 8;
        let surface = quadratic_sheet(n);
        let all: Vec<u32> = (0..surface.positions.len() as u32).collect();
        for (a, centre) in [(0.4, [4, 4]), (0.3, [4, 5]), (0.25, [5, 4]), (0.2, [5, 5])] {
            let patches = PatchWeights::new(&surface, 2, a, &all);
            let c = (centre[0] * (n + 1) + centre[1]) as usize;
            let centre = surface.positions[c];
            let field = |of: fn(DVec3) -> f64| -> f64 {
                patches.of(c).map(|(node, w)| w * of(surface.positions[node] - centre)).sum()
            };
            assert!((field(|_| 1.0) - 1.0).abs() < 1e-12);
            assert!(field(|p| p.x).abs().max(field(|p| p.x * p.y).abs()) < 1e-3 * a);
            assert!((field(|p| p.x * p.x) / (a * a / 8.0) - 1.0).abs() < 5e-3, "{}", field(|p| p.x * p.x));
            assert!((field(|p| p.y * p.y) / (a * a / 8.0) - 1.0).abs() < 5e-3, "{}", field(|p| p.y * p.y));
        }
    }
}
