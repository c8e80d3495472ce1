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
//! A contact sample on a crease has one-sided patches as well: the same integral over the smooth part on each side, with that side's normal.
//! A face that rests on a floor touches it with its own side of the crease, not with the faces beside it.
//!
//! Equations: docs/theory.md (C26).

use super::cells::Cell;
use super::poisson_disk::covering_radii;
use super::quadratic_face::QuadraticFaces;
use super::smooth_parts::smooth_parts;
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

/// Least share of the patches about a node that a one-sided one has, by the integral of the kernel: a rough mesh has creases everywhere.
const MIN_SIDE: f64 = 0.1;

/// Patch about a sample on a crease that lies on one side of it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct OneSidedPatch {
    /// Index of the sample.
    pub(crate) sample: usize,
    /// Outward unit normal of the side at the sample.
    pub(crate) normal: DVec3,
}

impl PatchWeights {
    /// Patches of a radius [m] about nodes of a surface, with finite elements of an order.
    pub(crate) fn new(surface: &Surface, order: u32, radius: f64, centres: &[u32]) -> Self {
        let mut integrator = Integrator::new(surface, order);
        let mut patches = Self::empty();
        centres.iter().for_each(|&node| patches.push(&integrator.patch((node, radius), |_| true).weights));
        patches
    }

    /// Patches about samples with a spacing [m], and after them the one-sided ones of samples on creases. A patch reaches to the next sample, so that
    /// they cover the surface.
    pub(crate) fn of_samples(
        surface: &Surface,
        order: u32,
        spacing: f64,
        samples: &[u32],
    ) -> (Self, Vec<OneSidedPatch>) {
        let mut integrator = Integrator::new(surface, order);
        let mut patches = Self::empty();
        let radii = covering_radii(surface, spacing, samples);
        let of = || samples.iter().copied().zip(radii.iter().copied());
        of().for_each(|centre| patches.push(&integrator.patch(centre, |_| true).weights));
        let parts = smooth_parts(surface);
        let mut one_sided = Vec::new();
        for (sample, (node, radius)) in of().enumerate() {
            let mut around: Vec<u32> =
                integrator.around[node as usize].iter().map(|&t| parts[t as usize]).collect();
            around.sort_unstable();
            around.dedup();
            if around.len() < 2 {
                continue;
            }
            let side = |part: &u32| integrator.patch((node, radius), |t| parts[t as usize] == *part);
            let sides: Vec<Patch> = around.iter().map(side).collect();
            let total: f64 = sides.iter().map(|side| side.total).sum();
            for side in sides.iter().filter(|side| side.total > MIN_SIDE * total) {
                patches.push(&side.weights);
                one_sided.push(OneSidedPatch { sample, normal: side.normal });
            }
        }
        (patches, one_sided)
    }

    fn empty() -> Self {
        Self { offsets: vec![0], nodes: Vec::new(), weights: Vec::new() }
    }

    fn push(&mut self, patch: &Cell) {
        self.nodes.extend(patch.iter().map(|(node, _)| *node));
        self.weights.extend(patch.iter().map(|(_, weight)| *weight));
        self.offsets.push(self.nodes.len() as u32);
    }

    /// Patches with given nodes and weights.
    pub(crate) fn of_cells(cells: &[Cell]) -> Self {
        let mut patches = Self::empty();
        cells.iter().for_each(|cell| patches.push(cell));
        patches
    }

    /// Patches of the nodes that every surface node's weight is distributed to, of which there are `count`.
    pub(crate) fn distributed<I: Iterator<Item = (usize, f64)>>(
        &self,
        count: usize,
        of_node: impl Fn(usize) -> I,
    ) -> Self {
        let mut sums = vec![0.0; count];
        let mut patches = Self::empty();
        for patch in 0..self.len() {
            let mut touched: Vec<u32> = Vec::new();
            for (node, weight) in self.of(patch) {
                of_node(node).for_each(|(other, share)| {
                    touched.push(other as u32);
                    sums[other] += weight * share;
                });
            }
            touched.sort_unstable();
            touched.dedup();
            let weight = |&node: &u32| (node, core::mem::take(&mut sums[node as usize]));
            patches.push(&touched.iter().map(weight).collect());
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

/// Patch about a node.
struct Patch {
    /// Weights of its nodes, which sum to 1.
    weights: Cell,
    /// Integral of the kernel [m²].
    total: f64,
    /// Outward unit normal at its centre.
    normal: DVec3,
}

/// Integration of the kernel about one node after another.
struct Integrator<'a> {
    surface: &'a Surface,
    faces: QuadraticFaces,
    /// Triangles around every node, and normals of all with twice the area as length [m²].
    around: Vec<Vec<u32>>,
    normals: Vec<DVec3>,
    weight: Vec<f64>,
    /// Number of the last patch that has seen a triangle, or touched a node.
    seen: Vec<u32>,
    touched_by: Vec<u32>,
    number: u32,
}

impl<'a> Integrator<'a> {
    fn new(surface: &'a Surface, order: u32) -> Self {
        Self {
            surface,
            faces: QuadraticFaces::new(surface, order),
            around: triangles_around(surface),
            normals: (0..surface.triangles.len()).map(|t| area_vector(surface, t)).collect(),
            weight: vec![0.0; surface.positions.len()],
            seen: vec![0; surface.triangles.len()],
            touched_by: vec![0; surface.positions.len()],
            number: 0,
        }
    }

    /// Patch of a radius [m] about a node, over the triangles that are connected with it and belong to the patch.
    fn patch(&mut self, (node, radius): (u32, f64), belongs: impl Fn(u32) -> bool) -> Patch {
        let Self { surface, faces, around, normals, weight, seen, touched_by, number } = self;
        *number += 1;
        let centre = surface.positions[node as usize];
        let mut queue: Vec<u32> = around[node as usize].iter().copied().filter(|t| belongs(*t)).collect();
        let normal = queue.iter().map(|&t| normals[t as usize]).sum::<DVec3>().normalize_or_zero();
        queue.iter().for_each(|&t| seen[t as usize] = *number);
        let mut touched = Vec::new();
        let mut add = |node: u32, w: f64| {
            if core::mem::replace(&mut touched_by[node as usize], *number) != *number {
                touched.push(node);
            }
            weight[node as usize] += w;
        };
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
                faces.shapes(surface, t as usize, w, |node, w| add(node, w * share * area));
            });
            if reached {
                for &next in corners.iter().flat_map(|&node| &around[node as usize]) {
                    if seen[next as usize] != *number && belongs(next) {
                        seen[next as usize] = *number;
                        queue.push(next);
                    }
                }
            }
        }
        let total: f64 = touched.iter().map(|&node| weight[node as usize]).sum();
        touched.sort_unstable();
        let of = |&node: &u32| (node, core::mem::take(&mut weight[node as usize]) / total);
        let weights: Cell = touched.iter().map(of).collect();
        Patch { weights: if total > 0.0 { weights } else { vec![(node, 1.0)] }, total, normal }
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

/// Kernel of patches times a scale: scale·(1 − s²)², for the ratio s of distance and radius [1]. Patches of fingers and of contact samples
/// have it, and forces that move to another level of detail (C61). That it ends at s = 1 is assumed where tips exclude their own
/// indentation (`collision/narrow_phase/tip.rs`), and by the range that is fitted to it (`response/residual_kernel.rs`).
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
                for corners in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]] {
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

    #[test]
    fn samples_on_the_creases_of_a_block_have_one_patch_for_each_face() {
        let bytes = include_bytes!("../../../../data/recordings/v1/free.palp");
        let recording = crate::recording::Recording::from_bytes(bytes).expect("a released recording");
        let block = super::super::test_surfaces::cut_in_four(&recording.surface);
        let (low, high) = block.extent();
        let all: Vec<u32> = (0..block.positions.len() as u32).collect();
        let (patches, one_sided) = PatchWeights::of_samples(&block, 1, 0.05, &all);
        let faces_at = |p: DVec3| -> usize {
            let on = |x: f64, a: f64, b: f64| usize::from((x - a).abs().min((x - b).abs()) < 1e-9);
            on(p.x, low.x, high.x) + on(p.y, low.y, high.y) + on(p.z, low.z, high.z)
        };
        for (sample, &position) in block.positions.iter().enumerate() {
            let sides = one_sided.iter().filter(|side| side.sample == sample).count();
            assert_eq!(sides, if faces_at(position) > 1 { faces_at(position) } else { 0 }, "{position}");
        }
        assert_eq!(patches.len(), all.len() + one_sided.len());
        for (at, side) in one_sided.iter().enumerate() {
            let centre = block.positions[side.sample];
            let mut sum = 0.0;
            for (node, weight) in patches.of(all.len() + at) {
                let height = side.normal.dot(block.positions[node] - centre);
                assert!(weight > 0.0 && height.abs() < 1e-9, "on the face: {height}");
                sum += weight;
            }
            assert!((sum - 1.0).abs() < 1e-12);
        }
        let ball = super::super::test_surfaces::ball(4);
        assert!(PatchWeights::of_samples(&ball, 1, 0.3, &[0, 5, 40]).1.is_empty());
    }
}
