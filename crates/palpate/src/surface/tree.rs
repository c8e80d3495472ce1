//! A tree of spheres over the surface that follows the deformation without being refitted.
//!
//! Every tree node has a surface node c as its centre. With the mode shapes φ, ω [rad/s] and the elastic
//! energy E of the modes, Cauchy and Schwarz bound what any surface node i below does:
//!
//! ```text
//! |uᵢ − u_c| ≤ √(Σ|φᵢ − φ_c|²/ω²) · √(2E)         |uᵢ| ≤ √(Σ|φᵢ|²/ω²) · √(2E)
//! ```
//!
//! and likewise |uᵢ| ≤ √tr(Sᵢᵢ)·√(fᵀ·S·f) for the residual compliance S. So a sphere about the *moved* centre
//! needs one number per energy, found once. This takes the place of the bounds on |q| of James & Pai's bounded
//! deformation tree (2004, ACM Trans. Graph. 23, 393). The modes go in bands, each twice as wide as the one before,
//! with an energy of its own: low modes carry most of it, and high ones most of what is different from node to node.

use super::Surface;
use alloc::vec;
use alloc::vec::Vec;
use core::ops::Range;
use glam::DVec3;

/// Triangles in a leaf: so many that their nodes are worth one test.
const LEAF: usize = 4;

/// Bands of modes, and how many of them make a centre that is nearly right and soon found.
pub(crate) const BANDS: usize = 8;
const LOW: usize = 5;

/// More than the stack of a walk needs for any tree of 2³¹ triangles, and what marks a sphere whose inside was walked.
const DEEPEST: usize = 128;
const DONE: u32 = 1 << 31;

/// A sphere is much smaller than another that is so many times as large.
const MUCH: f64 = 1.3;

/// Where a walk through a tree stands.
#[derive(Debug, Clone)]
pub(crate) struct Walk {
    stack: [u32; DEEPEST],
    depth: usize,
}

impl Walk {
    /// Nothing is left of it.
    pub(crate) const OVER: Self = Self { stack: [0; DEEPEST], depth: 0 };

    /// All is before it.
    pub(crate) const BEGUN: Self = Self { depth: 1, ..Self::OVER };

    pub(crate) fn is_over(&self) -> bool {
        self.depth == 0
    }
}

/// A number for every band.
pub(crate) type Bands = [f64; BANDS];

/// The modes of a band, of so many in all.
pub(crate) fn band(modes: usize, at: usize) -> Range<usize> {
    let end = |at: usize| modes.div_ceil(1 << (BANDS - 1 - at));
    if at == 0 { 0..end(0) } else { end(at - 1)..end(at) }
}

/// The modes whose displacement makes a centre nearly right.
pub(crate) fn low_modes(modes: usize) -> usize {
    band(modes, LOW - 1).end
}

/// A tree over the triangles; immutable.
#[derive(Debug, Clone)]
pub(crate) struct SurfaceTree {
    nodes: Vec<TreeNode>,
    triangles: Vec<u32>,
}

#[derive(Debug, Clone, Copy)]
struct TreeNode {
    /// The surface node at the centre.
    centre: u32,
    /// Largest distance [m] at rest of a surface node below from the centre.
    radius: f64,
    /// Triangles below, in [`SurfaceTree::triangles`].
    first: u32,
    count: u32,
    /// The second child; the first comes right after its parent. 0 for a leaf.
    second: u32,
}

/// How far the surface nodes below a tree node can go: per √(2·energy) of each band of modes and of the residual
/// compliance [m/√J].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Spread {
    /// From where they are at rest.
    modal: [f32; BANDS],
    residual: f32,
    /// From the way that the centre goes.
    apart: [f32; BANDS],
}

/// Spreads of all tree nodes, for one way to read the displacement.
#[derive(Debug, Clone, Default)]
pub(crate) struct Bounds {
    spreads: Vec<Spread>,
}

/// How far a deformation can move surface nodes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Visit {
    /// √(2·energy) [√J] of the bands of modes, and of the residual compliance.
    pub(crate) modal: Bands,
    pub(crate) residual: f64,
    /// The most [m] that the residual compliance moves any node, where that is known.
    pub(crate) most_residual: f64,
    /// What of it can change over a distance, as a share per metre; infinite where a node tells nothing of the next.
    pub(crate) slope: f64,
}

impl Visit {
    /// Nothing moves.
    pub(crate) const STILL: Self =
        Self { modal: [0.0; BANDS], residual: 0.0, most_residual: 0.0, slope: f64::INFINITY };

    fn dent(&self, spread: &Spread) -> f64 {
        (f64::from(spread.residual) * self.residual).min(self.most_residual)
    }

    /// From rest.
    fn reach(&self, spread: &Spread) -> f64 {
        self.sum(&spread.modal, 0..BANDS) + self.dent(spread)
    }

    /// From the centre as the low modes move it.
    fn beside_low(&self, spread: &Spread, radius: f64) -> f64 {
        let modal = self.sum(&spread.apart, 0..LOW) + self.sum(&spread.modal, LOW..BANDS);
        modal + self.dent_apart(spread, radius)
    }

    /// From the centre as it moves.
    fn apart(&self, spread: &Spread, radius: f64) -> f64 {
        self.sum(&spread.apart, 0..BANDS) + self.dent_apart(spread, radius)
    }

    fn dent_apart(&self, spread: &Spread, radius: f64) -> f64 {
        let change = self.most_residual * (self.slope * radius).min(1.0);
        (f64::from(spread.residual) * self.residual).min(change)
    }

    fn sum(&self, spread: &[f32; BANDS], bands: Range<usize>) -> f64 {
        bands.map(|at| f64::from(spread[at]) * self.modal[at]).sum()
    }
}

/// What the centre of a sphere is.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Centre {
    /// A place at rest.
    Rest,
    /// A surface node as the low modes move it.
    Low(usize),
    /// A surface node where it is.
    Moved(usize),
}

/// A surface that a walk goes over, as it is at a moment: its nodes, and the spheres of its tree about where their
/// centres are, dents apart, as far as walks have found them out.
pub(crate) trait Moving {
    fn rest(&self, node: usize) -> DVec3;
    /// Where the low modes move a node; none where it is known by all of them.
    fn low(&self, node: usize) -> Option<DVec3>;
    fn moved(&mut self, node: usize) -> DVec3;
    /// Whether what walks find out of spheres is kept: the three below mean something.
    fn keeps(&self) -> bool;
    /// Where a node is, if it is known already.
    fn known(&self, node: usize) -> Option<DVec3>;
    fn tight(&self, sphere: usize) -> Option<f64>;
    fn set_tight(&mut self, sphere: usize, radius: f64);
    fn corners_of(&self, triangle: u32) -> [usize; 3];
}

/// A surface that is rigid.
pub(crate) struct Still<'a>(pub(crate) &'a Surface);

impl Moving for Still<'_> {
    fn rest(&self, node: usize) -> DVec3 {
        self.0.positions[node]
    }

    fn low(&self, _: usize) -> Option<DVec3> {
        None
    }

    fn moved(&mut self, node: usize) -> DVec3 {
        self.rest(node)
    }

    /// Its spheres are as small as they are from the beginning.
    fn keeps(&self) -> bool {
        false
    }

    fn known(&self, _: usize) -> Option<DVec3> {
        None
    }

    fn corners_of(&self, triangle: u32) -> [usize; 3] {
        self.0.triangles[triangle as usize].map(|node| node as usize)
    }

    fn tight(&self, _: usize) -> Option<f64> {
        None
    }

    fn set_tight(&mut self, _: usize, _: f64) {}
}

/// The larger of each pair, rounded up.
fn widen(of: &mut [f32; BANDS], by: impl Fn(usize) -> f64) {
    for (at, of) in of.iter_mut().enumerate() {
        *of = of.max((by(at) as f32).next_up());
    }
}

impl SurfaceTree {
    /// Over triangles between positions [m]; a node alone is a triangle of three times itself.
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
        let place = self.nodes.len();
        self.nodes.push(TreeNode { centre, radius, first: first as u32, count: count as u32, second: 0 });
        if count > LEAF {
            // Halves along the longest side.
            let extent = high - low;
            let axis = (0..3).max_by(|&a, &b| extent[a].total_cmp(&extent[b])).unwrap_or_default();
            let half = count / 2;
            let key = |t: &u32| centres[*t as usize][axis];
            below.select_nth_unstable_by(half, |a, b| key(a).total_cmp(&key(b)).then(a.cmp(b)));
            self.build(surface, centres, first, half);
            self.nodes[place].second = self.nodes.len() as u32;
            self.build(surface, centres, first + half, count - half);
        }
    }

    /// Spreads for a way to read the displacement: `modal(i, c)` gives √(Σ|φᵢ − φ_c|²/ω²) for every band, or
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
        let mut spreads = vec![Spread::default(); self.nodes.len()];
        // Children come after their parents.
        for at in (0..self.nodes.len()).rev() {
            let node = self.nodes[at];
            let c = node.centre as usize;
            let mut spread = Spread::default();
            if node.count as usize <= 16 * LEAF {
                for triangle in self.triangles_of(&node) {
                    for i in triangles[triangle as usize] {
                        let i = i as usize;
                        let (moves, dent) = own[i].unwrap_or_default();
                        widen(&mut spread.modal, |band| moves[band]);
                        spread.residual = spread.residual.max(dent);
                        if i != c {
                            let apart = modal(i, Some(c));
                            widen(&mut spread.apart, |band| apart[band]);
                        }
                    }
                }
            } else {
                // Higher up, by way of the children's centres.
                for child in [at + 1, node.second as usize] {
                    let (below, middle) = (spreads[child], self.nodes[child].centre as usize);
                    let far = if middle == c { Bands::default() } else { modal(middle, Some(c)) };
                    widen(&mut spread.modal, |band| below.modal[band].into());
                    spread.residual = spread.residual.max(below.residual);
                    widen(&mut spread.apart, |band| far[band] + f64::from(below.apart[band]));
                }
            }
            spreads[at] = spread;
        }
        Bounds { spreads }
    }

    fn triangles_of(&self, node: &TreeNode) -> impl Iterator<Item = u32> + '_ {
        self.triangles[node.first as usize..(node.first + node.count) as usize].iter().copied()
    }

    /// Spheres of the tree.
    pub(crate) fn spheres(&self) -> usize {
        self.nodes.len()
    }

    /// Walk through the tree: a sphere (what its centre is, centre, radius) is entered where `near` says so, first about
    /// the rest position of a surface node, then about where the low modes move it, then about where it is, and the
    /// triangles of the leaves that are reached are given to `found`, with how far their nodes are from where the low
    /// modes move them at most. All in one frame.
    ///
    /// # Real time
    pub(crate) fn walk<S: Moving>(
        &self,
        visit: (&Bounds, &Visit),
        surface: &mut S,
        near: impl Fn(&mut S, Centre, DVec3, f64) -> bool,
        found: impl FnMut(&mut S, u32, f64),
    ) {
        self.walk_on((&mut Walk::BEGUN.clone(), usize::MAX), visit, surface, near, found);
    }

    /// Go on with a walk, past so many spheres and triangles, or as many triangles more as a leaf has. Gives how many they
    /// were.
    ///
    /// # Real time
    pub(crate) fn walk_on<S: Moving>(
        &self,
        (walk, most): (&mut Walk, usize),
        (bounds, visit): (&Bounds, &Visit),
        surface: &mut S,
        near: impl Fn(&mut S, Centre, DVec3, f64) -> bool,
        mut found: impl FnMut(&mut S, u32, f64),
    ) -> usize {
        let Walk { stack, depth } = walk;
        if self.nodes.is_empty() {
            *depth = 0;
        }
        let mut passed = 0;
        while *depth > 0 && passed < most {
            passed += 1;
            *depth -= 1;
            let (at, done) = ((stack[*depth] & !DONE) as usize, stack[*depth] & DONE != 0);
            let (node, spread) = (&self.nodes[at], &bounds.spreads[at]);
            if done {
                self.tighten(at, surface);
                continue;
            }
            let tight = surface.tight(at);
            if !Self::enter(node, spread, visit, tight, surface, &near) {
                continue;
            }
            if node.second == 0 {
                let high = visit.sum(&spread.modal, LOW..BANDS) + visit.dent(spread);
                self.triangles_of(node).for_each(|triangle| found(surface, triangle, high));
                passed += node.count as usize;
            }
            if tight.is_none() && surface.keeps() {
                stack[*depth] = at as u32 | DONE;
                *depth += 1;
            }
            if node.second != 0 {
                stack[*depth] = node.second;
                stack[*depth + 1] = at as u32 + 1;
                *depth += 2;
            }
        }
        passed
    }

    /// Whether a sphere is entered.
    fn enter<S: Moving>(
        node: &TreeNode,
        spread: &Spread,
        visit: &Visit,
        tight: Option<f64>,
        surface: &mut S,
        near: &impl Fn(&mut S, Centre, DVec3, f64) -> bool,
    ) -> bool {
        let c = node.centre as usize;
        if let Some(radius) = tight {
            let centre = surface.moved(c);
            return near(surface, Centre::Moved(c), centre, radius + visit.dent_apart(spread, node.radius));
        }
        let at_rest = surface.rest(c);
        if !near(surface, Centre::Rest, at_rest, node.radius + visit.reach(spread)) {
            return false;
        }
        let within = node.radius + visit.apart(spread, node.radius);
        let nearly = node.radius + visit.beside_low(spread, node.radius);
        let low = surface.low(c);
        if low.is_some_and(|centre| !near(surface, Centre::Low(c), centre, nearly)) {
            return false;
        }
        // The sphere about where it is costs all modes: only where that is much smaller.
        if low.is_some() && nearly <= MUCH * within {
            return true;
        }
        let centre = surface.moved(c);
        near(surface, Centre::Moved(c), centre, within)
    }

    /// What a walk has found out of a sphere's nodes makes it as small as it is.
    fn tighten<S: Moving>(&self, at: usize, surface: &mut S) {
        let node = &self.nodes[at];
        let Some(centre) = surface.known(node.centre as usize) else { return };
        let mut radius = 0.0_f64;
        let mut hold = |place: Option<DVec3>, around: Option<f64>| {
            let far = place.zip(around).map(|(place, around)| (place - centre).length() + around);
            radius = radius.max(far?);
            Some(())
        };
        let all = match node.second {
            0 => self.triangles_of(node).try_for_each(|t| {
                surface.corners_of(t).into_iter().try_for_each(|i| hold(surface.known(i), Some(0.0)))
            }),
            second => [at + 1, second as usize].into_iter().try_for_each(|child| {
                hold(surface.known(self.nodes[child].centre as usize), surface.tight(child))
            }),
        };
        if all.is_some() {
            surface.set_tight(at, radius);
        }
    }
}

impl Bounds {
    /// How far any surface node can be from rest [m].
    pub(crate) fn reach(&self, visit: &Visit) -> f64 {
        let root = self.spreads.first().copied().unwrap_or_default();
        visit.reach(&root)
    }
}
