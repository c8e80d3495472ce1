//! Bounding-sphere tree over the surface, valid under deformation without refitting.
//!
//! The sphere of a tree node is centred at a surface node c. With the mode shapes φ, ω [rad/s] and the elastic
//! energy E of the modes, Cauchy and Schwarz bound the displacement of any surface node i below:
//!
//! ```text
//! |uᵢ − u_c| ≤ √(Σ|φᵢ − φ_c|²/ω²) · √(2E)         |uᵢ| ≤ √(Σ|φᵢ|²/ω²) · √(2E)
//! ```
//!
//! and likewise |uᵢ| ≤ √tr(Sᵢᵢ)·√(fᵀ·S·f) for the residual compliance S. So a sphere about the *displaced* centre
//! needs one precomputed number per energy. This replaces the bounds on |q| of James & Pai's bounded
//! deformation tree (2004, ACM Trans. Graph. 23, 393). Modes are grouped in bands, each twice as wide as the one before,
//! with an energy of its own: low modes carry most of the energy, high modes most of the difference between neighbours.
//!
//! Equations: docs/theory.md (C14), (C15), (C16).

use super::{Surface, at_weights, nearest_on_triangle};
use alloc::vec;
use alloc::vec::Vec;
use core::ops::Range;
use glam::DVec3;

/// Upper limit of triangles in a leaf.
const LEAF: usize = 4;

/// Number of bands of modes.
pub(crate) const BANDS: usize = 8;

/// Depth of a traversal's stack, enough for 2³¹ triangles.
const MAX_DEPTH: usize = 128;

/// Resumable traversal of a tree: its stack.
#[derive(Debug, Clone)]
pub(crate) struct Traversal {
    stack: [u32; MAX_DEPTH],
    depth: usize,
    /// Spheres and triangles visited so far.
    pub(crate) visits: usize,
}

impl Traversal {
    /// Finished traversal.
    pub(crate) const FINISHED: Self = Self { stack: [0; MAX_DEPTH], depth: 0, visits: 0 };

    /// Traversal at its start.
    pub(crate) const START: Self = Self { depth: 1, ..Self::FINISHED };

    pub(crate) fn is_finished(&self) -> bool {
        self.depth == 0
    }
}

/// Number per band of modes.
pub(crate) type Bands = [f64; BANDS];

/// Modes of a band, by the number of modes.
pub(crate) fn band(modes: usize, at: usize) -> Range<usize> {
    let end = |at: usize| modes.div_ceil(1 << (BANDS - 1 - at));
    if at == 0 { 0..end(0) } else { end(at - 1)..end(at) }
}

/// Sphere tree over the triangles; immutable.
#[derive(Debug, Clone)]
pub(crate) struct SphereTree {
    nodes: Vec<TreeNode>,
    triangles: Vec<u32>,
}

#[derive(Debug, Clone, Copy)]
struct TreeNode {
    /// Surface node at the centre.
    centre: u32,
    /// Largest distance [m] at rest of a surface node below from the centre.
    radius: f64,
    /// Triangles below, in [`SphereTree::triangles`].
    first: u32,
    count: u32,
    /// Second child; the first follows its parent. 0 for a leaf.
    second: u32,
}

/// Upper part of a sphere tree: its subtrees, down to those that are not divided, its leaves.
#[derive(Debug, Clone)]
pub(crate) struct UpperPart {
    /// Subtree that each tree node is or lies in: the leaves come first.
    pub(crate) of_node: Vec<u32>,
    pub(crate) leaves: usize,
    /// Halves of every other subtree, which come before it.
    pub(crate) halves: Vec<[u32; 2]>,
}

/// Displacement bounds of the surface nodes below a tree node, per √(2·energy) of each band of modes and of the residual
/// compliance [m/√J].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct SubtreeBound {
    /// From the rest position.
    modal: [f32; BANDS],
    residual: f32,
    /// Relative to the displacement of the centre.
    apart: [f32; BANDS],
}

/// Displacement bounds of all subtrees, for one contact footprint.
#[derive(Debug, Clone, Default)]
pub(crate) struct Bounds {
    subtrees: Vec<SubtreeBound>,
}

/// Norms of a deformation that bound the displacement of surface nodes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DeformationBound {
    /// √(2·energy) [√J] of the bands of modes, and of the residual compliance.
    pub(crate) modal: Bands,
    pub(crate) residual: f64,
    /// Upper bound of the residual displacement of any node [m], where it is known.
    pub(crate) max_residual: f64,
    /// Largest relative change of residual displacement per distance [1/m]; infinite where neighbours are unrelated.
    pub(crate) slope: f64,
}

impl DeformationBound {
    /// No deformation.
    pub(crate) const STILL: Self =
        Self { modal: [0.0; BANDS], residual: 0.0, max_residual: 0.0, slope: f64::INFINITY };

    fn residual_of(&self, subtree: &SubtreeBound) -> f64 {
        (f64::from(subtree.residual) * self.residual).min(self.max_residual)
    }

    /// Displacement bound from rest [m].
    fn reach(&self, subtree: &SubtreeBound) -> f64 {
        self.sum(&subtree.modal) + self.residual_of(subtree)
    }

    /// Distance bound from the deformed centre, less the radius at rest [m].
    fn apart(&self, subtree: &SubtreeBound, radius: f64) -> f64 {
        self.sum(&subtree.apart) + self.residual_apart(subtree, radius)
    }

    fn residual_apart(&self, subtree: &SubtreeBound, radius: f64) -> f64 {
        let change = self.max_residual * (self.slope * radius).min(1.0);
        (f64::from(subtree.residual) * self.residual).min(change)
    }

    fn sum(&self, subtree: &[f32; BANDS]) -> f64 {
        subtree.iter().zip(&self.modal).map(|(bound, norm)| f64::from(*bound) * norm).sum()
    }
}

/// Kind of a sphere's centre.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Centre {
    /// Rest position of a surface node.
    Rest,
    /// Deformed position of a surface node.
    Deformed(usize),
}

/// Node positions of a deforming surface at a moment.
pub(crate) trait DeformingNodes {
    fn rest(&self, node: usize) -> DVec3;
    fn position(&mut self, node: usize) -> DVec3;

    /// Upper bound of the residual displacement of the surface nodes below a tree node [m], beside the bound of all.
    fn residual_bound(&self, _tree_node: usize) -> f64 {
        f64::INFINITY
    }
}

/// Node positions of a rigid surface.
pub(crate) struct RigidNodes<'a>(pub(crate) &'a Surface);

impl DeformingNodes for RigidNodes<'_> {
    fn rest(&self, node: usize) -> DVec3 {
        self.0.positions[node]
    }

    fn position(&mut self, node: usize) -> DVec3 {
        self.rest(node)
    }
}

/// Raise every band to the larger value, rounded up.
fn raise(of: &mut [f32; BANDS], by: impl Fn(usize) -> f64) {
    for (at, of) in of.iter_mut().enumerate() {
        *of = of.max((by(at) as f32).next_up());
    }
}

impl SphereTree {
    /// Tree over triangles between positions [m]; a single node is a degenerate triangle.
    pub(crate) fn new(positions: &[DVec3], triangles: &[[u32; 3]]) -> Self {
        let count = triangles.len();
        let mut tree = Self { nodes: Vec::new(), triangles: (0..count as u32).collect() };
        let middle = |corners: &[u32; 3]| corners.iter().map(|&n| positions[n as usize]).sum::<DVec3>() / 3.0;
        let centres: Vec<DVec3> = triangles.iter().map(middle).collect();
        if count > 0 {
            tree.build((positions, triangles), &centres, 0, count);
        }
        tree
    }

    fn build(&mut self, surface: (&[DVec3], &[[u32; 3]]), centres: &[DVec3], first: usize, count: usize) {
        let (positions, triangles) = surface;
        let below = &mut self.triangles[first..first + count];
        let corners = |t: &u32| triangles[*t as usize].map(|n| positions[n as usize]);
        let points = || below.iter().flat_map(corners);
        let low = points().reduce(DVec3::min).unwrap_or_default();
        let high = points().reduce(DVec3::max).unwrap_or_default();
        let middle = (low + high) * 0.5;
        let nodes = below.iter().flat_map(|t| triangles[*t as usize]);
        let off = |node: &u32| (positions[*node as usize] - middle).length_squared();
        let centre = nodes.min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or_default();
        let at = positions[centre as usize];
        let radius = points().map(|p| (p - at).length()).fold(0.0, f64::max);
        let index = self.nodes.len();
        self.nodes.push(TreeNode { centre, radius, first: first as u32, count: count as u32, second: 0 });
        if count > LEAF {
            // Halves along the longest side.
            let extent = high - low;
            let axis = (0..3).max_by(|&a, &b| extent[a].total_cmp(&extent[b])).unwrap_or_default();
            let half = count / 2;
            let key = |t: &u32| centres[*t as usize][axis];
            // Sorted, so that the order, in which centres are summed, is the same whatever the algorithm.
            below.sort_unstable_by(|a, b| key(a).total_cmp(&key(b)).then(a.cmp(b)));
            self.build(surface, centres, first, half);
            self.nodes[index].second = self.nodes.len() as u32;
            self.build(surface, centres, first + half, count - half);
        }
    }

    /// Displacement bounds for a contact footprint: `modal(i, c)` gives √(Σ|φᵢ − φ_c|²/ω²) for every band, or
    /// √(Σ|φᵢ|²/ω²) without c, and `residual(i)` √tr(Sᵢᵢ).
    pub(crate) fn bounds(
        &self,
        triangles: &[[u32; 3]],
        modal: impl Fn(usize, Option<usize>) -> Bands,
        residual: impl Fn(usize) -> f64,
    ) -> Bounds {
        let nodes = triangles.iter().flatten().max().map_or(0, |node| *node as usize + 1);
        let mut own: Vec<Option<(Bands, f32)>> = vec![None; nodes];
        for i in triangles.iter().flatten().map(|node| *node as usize) {
            own[i].get_or_insert_with(|| (modal(i, None), (residual(i) as f32).next_up()));
        }
        let mut subtrees = vec![SubtreeBound::default(); self.nodes.len()];
        // Children come after their parents.
        for at in (0..self.nodes.len()).rev() {
            let node = self.nodes[at];
            let c = node.centre as usize;
            let mut subtree = SubtreeBound::default();
            if node.count as usize <= 16 * LEAF {
                for triangle in self.triangles_of(&node) {
                    for i in triangles[triangle as usize] {
                        let i = i as usize;
                        let (modal_bound, residual_bound) = own[i].unwrap_or_default();
                        raise(&mut subtree.modal, |band| modal_bound[band]);
                        subtree.residual = subtree.residual.max(residual_bound);
                        if i != c {
                            let apart = modal(i, Some(c));
                            raise(&mut subtree.apart, |band| apart[band]);
                        }
                    }
                }
            } else {
                // Higher up: triangle inequality over the children's centres.
                for child in [at + 1, node.second as usize] {
                    let (below, middle) = (subtrees[child], self.nodes[child].centre as usize);
                    let far = if middle == c { Bands::default() } else { modal(middle, Some(c)) };
                    raise(&mut subtree.modal, |band| below.modal[band].into());
                    subtree.residual = subtree.residual.max(below.residual);
                    raise(&mut subtree.apart, |band| far[band] + f64::from(below.apart[band]));
                }
            }
            subtrees[at] = subtree;
        }
        Bounds { subtrees }
    }

    /// Upper part of the tree, down to subtrees of at most so many triangles.
    pub(crate) fn upper_part(&self, most: usize) -> UpperPart {
        let mut of_node = vec![u32::MAX; self.nodes.len()];
        let mut leaves = 0;
        // Children come after their parents.
        for (at, node) in self.nodes.iter().enumerate() {
            if of_node[at] == u32::MAX && (node.count as usize <= most || node.second == 0) {
                of_node[at] = leaves;
                leaves += 1;
            }
            if of_node[at] != u32::MAX && node.second != 0 {
                (of_node[at + 1], of_node[node.second as usize]) = (of_node[at], of_node[at]);
            }
        }
        let mut halves = Vec::new();
        for at in (0..self.nodes.len()).rev() {
            if of_node[at] == u32::MAX {
                halves.push([at + 1, self.nodes[at].second as usize].map(|half| of_node[half]));
                of_node[at] = leaves + halves.len() as u32 - 1;
            }
        }
        UpperPart { of_node, leaves: leaves as usize, halves }
    }

    /// Triangles of every leaf of the upper part.
    pub(crate) fn triangles_of_leaves(&self, upper: &UpperPart) -> Vec<Vec<u32>> {
        let mut triangles = vec![Vec::new(); upper.leaves];
        for (node, &leaf) in self.nodes.iter().zip(&upper.of_node).filter(|(node, _)| node.second == 0) {
            triangles[leaf as usize].extend(self.triangles_of(node));
        }
        triangles
    }

    fn triangles_of(&self, node: &TreeNode) -> impl Iterator<Item = u32> + '_ {
        self.triangles[node.first as usize..(node.first + node.count) as usize].iter().copied()
    }

    /// Distance [m] at rest of a point from the nearest triangle, or from the first one found within `enough` [m].
    pub(crate) fn distance(
        &self,
        (positions, triangles): (&[DVec3], &[[u32; 3]]),
        point: DVec3,
        enough: f64,
    ) -> f64 {
        let gap = |at: u32| {
            let node = &self.nodes[at as usize];
            (point - positions[node.centre as usize]).length() - node.radius
        };
        let mut least = f64::INFINITY;
        let Traversal { mut stack, mut depth, .. } =
            if self.nodes.is_empty() { Traversal::FINISHED } else { Traversal::START };
        while depth > 0 && least > enough {
            depth -= 1;
            let at = stack[depth];
            if gap(at) >= least {
                continue;
            }
            let node = &self.nodes[at as usize];
            if node.second == 0 {
                for triangle in self.triangles_of(node) {
                    let corners = triangles[triangle as usize].map(|n| positions[n as usize]);
                    let nearest = at_weights(corners, nearest_on_triangle(corners, point));
                    least = least.min((point - nearest).length());
                }
            } else {
                // The nearer child is visited first.
                let (first, second) = (at + 1, node.second);
                let nearer_first = gap(first) <= gap(second);
                (stack[depth], stack[depth + 1]) =
                    if nearer_first { (second, first) } else { (first, second) };
                depth += 2;
            }
        }
        least
    }

    /// Traverse the tree. `near` decides by kind of centre, centre [m] and radius [m] whether a sphere is entered: about the
    /// rest position, then about the deformed position. `found` takes the triangles of the leaves. All in one frame.
    ///
    /// # Real time
    pub(crate) fn traverse<S: DeformingNodes>(
        &self,
        bounds: (&Bounds, &DeformationBound),
        surface: &mut S,
        near: impl Fn(&mut S, Centre, DVec3, f64) -> bool,
        found: impl FnMut(&mut S, u32),
    ) {
        self.resume_traversal((&mut Traversal::START.clone(), usize::MAX), bounds, surface, near, found);
    }

    /// Resume a traversal until `max_visits` spheres and triangles were visited, or up to a leaf's triangles more.
    ///
    /// # Real time
    pub(crate) fn resume_traversal<S: DeformingNodes>(
        &self,
        (traversal, max_visits): (&mut Traversal, usize),
        (bounds, bound): (&Bounds, &DeformationBound),
        surface: &mut S,
        near: impl Fn(&mut S, Centre, DVec3, f64) -> bool,
        mut found: impl FnMut(&mut S, u32),
    ) {
        let Traversal { stack, depth, visits } = traversal;
        if self.nodes.is_empty() {
            *depth = 0;
        }
        let end = visits.saturating_add(max_visits);
        while *depth > 0 && *visits < end {
            *visits += 1;
            *depth -= 1;
            let at = stack[*depth] as usize;
            let (node, subtree) = (&self.nodes[at], &bounds.subtrees[at]);
            let max_residual = bound.max_residual.min(surface.residual_bound(at));
            let bound = &DeformationBound { max_residual, ..*bound };
            if !Self::enter(node, subtree, bound, surface, &near) {
                continue;
            }
            if node.second == 0 {
                self.triangles_of(node).for_each(|triangle| found(surface, triangle));
                *visits += node.count as usize;
            }
            if node.second != 0 {
                stack[*depth] = node.second;
                stack[*depth + 1] = at as u32 + 1;
                *depth += 2;
            }
        }
    }

    /// Whether a traversal enters a sphere.
    fn enter<S: DeformingNodes>(
        node: &TreeNode,
        subtree: &SubtreeBound,
        bound: &DeformationBound,
        surface: &mut S,
        near: &impl Fn(&mut S, Centre, DVec3, f64) -> bool,
    ) -> bool {
        let c = node.centre as usize;
        let at_rest = surface.rest(c);
        if !near(surface, Centre::Rest, at_rest, node.radius + bound.reach(subtree)) {
            return false;
        }
        let within = node.radius + bound.apart(subtree, node.radius);
        let centre = surface.position(c);
        near(surface, Centre::Deformed(c), centre, within)
    }
}

impl Bounds {
    /// Upper bound of the displacement of any surface node from rest [m].
    pub(crate) fn max_displacement(&self, bound: &DeformationBound) -> f64 {
        let whole = self.subtrees.first().copied().unwrap_or_default();
        bound.reach(&whole)
    }
}
