//! What contact patches of one radius see of a body: mode shapes averaged over the patch about every surface node, or
//! about some that stand for all, and the residual compliance between patches.
//!
//! ```text
//! G_c = Σᵢ wᵢ·Φᵢ        D_c = Σᵢⱼ wᵢ·Sᵢⱼ·wⱼ = A_c·A_cᵀ        K(x, y) = A(x)·ψ(|x − y|/L)·A(y)ᵀ
//! ```
//!
//! w are the weights of the patch about node c; between nodes G and A are interpolated. D is exact at the nodes.
//! K carries it to other places with Wendland's function ψ, whose range L is fitted to S: so K is positive
//! semi-definite for any set of patches (Schur's product theorem), and costs the same on every mesh.

use crate::recording::{NearField, Recording, ResidualCompliance};
use crate::surface::{
    Bands, Bounds, PatchWeights, SphereTree, Surface, SurfacePoint, band, decimate, facing,
};
use alloc::vec;
use alloc::vec::Vec;
use core::ops::Range;
use glam::{DMat3, DVec3};

/// Patches of one radius on one body; immutable.
#[derive(Debug, Clone)]
pub(crate) struct PatchField {
    /// a [m].
    pub(crate) radius: f64,
    pub(crate) weights: PatchWeights,
    /// G [1/√kg], laid out as the mode shapes: (3·patch + axis)·m + mode. Single precision is what a search on a fine
    /// mesh reads in half the time.
    pub(crate) rows: Vec<f32>,
    /// A [√(m/N)], lower triangular, per patch.
    roots: Vec<DMat3>,
    /// L [m].
    range: f64,
    pub(crate) bounds: Bounds,
    /// The nodes that have a patch, where not all have one.
    pub(crate) some: Option<SampleSurface>,
}

/// Some of the surface nodes.
#[derive(Debug, Clone)]
pub(crate) struct SampleSurface {
    /// Which of them every surface node is; [`NONE`] for the others.
    numbers: Vec<u32>,
    nodes: Vec<u32>,
    /// Triangles between them; each as a triangle without extent where they make no surface.
    pub(crate) surface: Surface,
    pub(crate) is_surface: bool,
    /// Outward directions at rest; zero where there is none.
    facing: Vec<DVec3>,
    /// One of its triangles for each.
    triangle: Vec<u32>,
    pub(crate) tree: SphereTree,
}

/// No patch.
const NONE: u32 = u32::MAX;

impl SampleSurface {
    pub(crate) fn new(surface: &Surface, nodes: &[u32]) -> Self {
        let mut numbers = vec![NONE; surface.positions.len()];
        nodes.iter().enumerate().for_each(|(number, &node)| numbers[node as usize] = number as u32);
        let between = decimate(surface, nodes);
        let is_surface = between.is_some();
        let triangles = between.unwrap_or_else(|| nodes.iter().map(|&node| [node; 3]).collect());
        let mut triangle = vec![0; nodes.len()];
        for (t, corners) in triangles.iter().enumerate() {
            corners.iter().for_each(|node| triangle[numbers[*node as usize] as usize] = t as u32);
        }
        let facing = facing(surface);
        let facing = nodes.iter().map(|&node| facing[node as usize]).collect();
        let tree = SphereTree::new(&surface.positions, &triangles);
        let surface = Surface { triangles, ..surface.clone() };
        Self { numbers, nodes: nodes.to_vec(), surface, is_surface, facing, triangle, tree }
    }

    /// Their nodes.
    pub(super) fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    pub(super) fn facing(&self, node: usize) -> DVec3 {
        self.facing[self.numbers[node] as usize]
    }

    /// A node as a point of the surface between them.
    pub(super) fn node_point(&self, node: usize) -> SurfacePoint {
        let triangle = self.triangle[self.numbers[node] as usize];
        let corners = self.surface.triangles[triangle as usize];
        let first = corners.iter().position(|corner| *corner as usize == node);
        SurfacePoint { triangle, weights: [0, 1, 2].map(|k| if Some(k) == first { 1.0 } else { 0.0 }) }
    }
}

/// Pairs of nodes that the range is fitted to.
const FIT_CENTRES: usize = 24;

impl PatchField {
    /// About all surface nodes, over whose triangles there is a tree.
    pub(crate) fn new(recording: &Recording, tree: &SphereTree, radius: f64) -> Self {
        let all: Vec<u32> = (0..recording.surface.positions.len() as u32).collect();
        let field = Self::without_bounds(recording, &all, radius);
        let bounds = field.find_bounds(recording, tree, &recording.surface.triangles);
        Self { bounds, ..field }
    }

    /// About some of them.
    pub(crate) fn about(recording: &Recording, nodes: &[u32], radius: f64) -> Self {
        let some = SampleSurface::new(&recording.surface, nodes);
        let field = Self { some: Some(some), ..Self::without_bounds(recording, nodes, radius) };
        let some = field.some.as_ref();
        let bounds = some.map(|some| field.find_bounds(recording, &some.tree, &some.surface.triangles));
        Self { bounds: bounds.unwrap_or_default(), ..field }
    }

    fn without_bounds(recording: &Recording, nodes: &[u32], radius: f64) -> Self {
        let (surface, modes) = (&recording.surface, &recording.modes);
        let (n, m) = (nodes.len(), modes.len());
        let weights = PatchWeights::new(surface, recording.metadata.mesh.order, radius, nodes);
        let mut rows = Vec::with_capacity(3 * n * m);
        let mut sums = vec![0.0; 3 * m];
        for c in 0..n {
            sums.fill(0.0);
            for (node, w) in weights.of(c) {
                let from = &modes.mode_shapes[3 * node * m..3 * (node + 1) * m];
                sums.iter_mut().zip(from).for_each(|(sum, phi)| *sum += w * phi);
            }
            rows.extend(sums.iter().map(|&sum| sum as f32));
        }
        let mut spread = vec![0.0; surface.positions.len()];
        let own: Vec<DMat3> = (0..n)
            .map(|c| match &recording.residual {
                // Row by row: most nodes of a large patch are too far apart to answer each other.
                ResidualCompliance::NearField(near) => {
                    weights.of(c).for_each(|(node, w)| spread[node] = w);
                    let mut sum = DMat3::ZERO;
                    for (i, wi) in weights.of(c) {
                        let row = near.row(i).filter(|(j, _)| spread[*j] != 0.0);
                        sum += row.map(|(j, block)| block * spread[j]).fold(DMat3::ZERO, |a, b| a + b) * wi;
                    }
                    weights.of(c).for_each(|(node, _)| spread[node] = 0.0);
                    sum
                }
                residual => {
                    let of_lower = |(i, wi): (usize, f64)| {
                        let below = weights.of(c).filter(move |(j, _)| *j < i);
                        let half = residual.block(i, i) * (0.5 * wi);
                        let sum =
                            below.map(|(j, wj)| residual.block(i, j) * wj).fold(half, |a, b| a + b) * wi;
                        sum + sum.transpose()
                    };
                    weights.of(c).map(of_lower).sum()
                }
            })
            .collect();
        let roots = own.iter().map(root).collect();
        let places: Vec<DVec3> = nodes.iter().map(|&node| surface.positions[node as usize]).collect();
        let mut field = vec![0.0; surface.positions.len()];
        let shares = |c: usize, others: &[usize]| -> Vec<f64> {
            answer(&recording.residual, weights.of(c), &mut field);
            let scale = |d: usize| libm::sqrt(trace(&own[c]) * trace(&own[d]));
            let between = |d: usize| weights.of(d).map(|(j, w)| field[j] * w).sum::<f64>();
            others.iter().map(|&d| between(d) / scale(d)).collect()
        };
        let range = fit_range(&places, surface.mean_edge(), radius, shares);
        Self { radius, weights, rows, roots, range, bounds: Bounds::default(), some: None }
    }

    fn find_bounds(&self, recording: &Recording, tree: &SphereTree, triangles: &[[u32; 3]]) -> Bounds {
        let distances = ModalDistances::new(recording, &self.rows);
        tree.bounds(
            triangles,
            |i, c| distances.between(self.number(i), c.map(|c| self.number(c))),
            |i| {
                let root = self.roots[self.number(i)];
                libm::sqrt(trace(&(root * root.transpose())))
            },
        )
    }

    /// The patch about a surface node that has one.
    ///
    /// # Real time
    pub(crate) fn number(&self, node: usize) -> usize {
        self.some.as_ref().map_or(node, |some| some.numbers[node] as usize)
    }

    /// The surface between the nodes that have a patch.
    ///
    /// # Real time
    pub(crate) fn surface<'a>(&'a self, recording: &'a Recording) -> &'a Surface {
        self.some.as_ref().map_or(&recording.surface, |some| &some.surface)
    }

    /// A at a surface point.
    ///
    /// # Real time
    pub(crate) fn root_at(&self, recording: &Recording, point: &SurfacePoint) -> DMat3 {
        let corners = self.surface(recording).corners(point);
        let used = corners.iter().filter(|corner| corner.1 != 0.0);
        used.map(|&(node, w)| self.roots[self.number(node)] * w).fold(DMat3::ZERO, |a, b| a + b)
    }

    /// K·f [m] at the patch about a node, for pulls Aᵀ·f with their places at rest, around which it is flat.
    ///
    /// # Real time
    pub(crate) fn residual_displacement(
        &self,
        recording: &Recording,
        node: usize,
        pulls: &[(DVec3, DVec3); 3],
        flat: f64,
    ) -> DVec3 {
        let mut sum = DVec3::ZERO;
        for &(rest, pull) in pulls.iter().filter(|(_, pull)| *pull != DVec3::ZERO) {
            let distance = ((recording.surface.positions[node] - rest).length() - flat).max(0.0);
            if distance < self.range {
                sum += self.roots[self.number(node)] * pull * NearField::taper(distance / self.range);
            }
        }
        sum
    }

    /// Aᵀ·f for a force at a point with this rest position, and where: of a surface between some nodes at its corners.
    ///
    /// # Real time
    pub(super) fn pulls(
        &self,
        recording: &Recording,
        point: &SurfacePoint,
        rest: DVec3,
        force: DVec3,
    ) -> [(DVec3, DVec3); 3] {
        if let Some(some) = &self.some {
            return some.surface.corners(point).map(|(node, weight)| {
                let pull = self.roots[self.number(node)].transpose() * (force * weight);
                (some.surface.positions[node], pull)
            });
        }
        let none = (rest, DVec3::ZERO);
        [(rest, self.root_at(recording, point).transpose() * force), none, none]
    }

    /// Steepest slope of ψ [1/m].
    pub(crate) fn residual_slope(&self) -> f64 {
        // ψ′ = −20·s·(1 − s)³ is steepest at a quarter.
        2.11 / self.range
    }

    /// K [m/N] between the patches about two nodes.
    fn between_nodes(&self, surface: &Surface, a: usize, b: usize) -> DMat3 {
        let distance = (surface.positions[a] - surface.positions[b]).length();
        if distance >= self.range {
            return DMat3::ZERO;
        }
        let root = |node| self.roots[self.number(node)];
        root(a) * root(b).transpose() * NearField::taper(distance / self.range)
    }

    /// K [m/N] between two places. Between some nodes a place is its corners, as far as the modes go as well.
    ///
    /// # Real time
    pub(crate) fn residual(&self, recording: &Recording, a: &SurfacePoint, b: &SurfacePoint) -> DMat3 {
        if let Some(SampleSurface { surface, .. }) = &self.some {
            let used = |point| surface.corners(point).into_iter().filter(|corner| corner.1 != 0.0);
            let mut sum = DMat3::ZERO;
            for (i, wi) in used(a) {
                for (j, wj) in used(b) {
                    sum += self.between_nodes(surface, i, j) * (wi * wj);
                }
            }
            return sum;
        }
        let distance = (recording.surface.rest_position(a) - recording.surface.rest_position(b)).length();
        if distance >= self.range {
            return DMat3::ZERO;
        }
        let (a, b) = (self.root_at(recording, a), self.root_at(recording, b));
        a * b.transpose() * NearField::taper(distance / self.range)
    }
}

/// How differently surface nodes can move, by rows laid out as the mode shapes.
pub(crate) struct ModalDistances<'a, X> {
    rows: &'a [X],
    /// 1/ω² [s²].
    weights: Vec<f64>,
}

impl<'a, X: Copy + Into<f64>> ModalDistances<'a, X> {
    pub(crate) fn new(recording: &Recording, rows: &'a [X]) -> Self {
        let omegas = &recording.modes.angular_frequencies;
        Self { rows, weights: omegas.iter().map(|omega| 1.0 / (omega * omega)).collect() }
    }

    /// √(Σ|rowᵢ − row_c|²/ω²) over axes and the modes of every band, or of row i alone.
    pub(crate) fn between(&self, i: usize, c: Option<usize>) -> Bands {
        let m = self.weights.len();
        let row = |node: usize, axis: usize| &self.rows[(3 * node + axis) * m..][..m];
        let square = |axis: usize, modes: Range<usize>| -> f64 {
            let (own, weights) = (&row(i, axis)[modes.clone()], &self.weights[modes.clone()]);
            match c {
                None => own.iter().zip(weights).map(|(&x, w)| x.into() * x.into() * w).sum(),
                Some(c) => {
                    let pairs = own.iter().zip(&row(c, axis)[modes]).zip(weights);
                    let apart = |x: X, y: X| x.into() - y.into();
                    pairs.map(|((&x, &y), w)| apart(x, y) * apart(x, y) * w).sum()
                }
            }
        };
        core::array::from_fn(|at| libm::sqrt((0..3).map(|axis| square(axis, band(m, at))).sum()))
    }
}

/// √tr(Sᵢᵢ) of a node.
pub(crate) fn residual_size(recording: &Recording, node: usize) -> f64 {
    libm::sqrt(trace(&recording.residual.block(node, node)))
}

fn trace(matrix: &DMat3) -> f64 {
    matrix.diagonal().element_sum()
}

/// Lower Cholesky factor of a positive semi-definite matrix; directions without compliance get none.
fn root(matrix: &DMat3) -> DMat3 {
    let mut lower = [[0.0; 3]; 3];
    let entry = |i: usize, j: usize| matrix.col(j)[i];
    let small = 1e-12 * trace(matrix);
    for i in 0..3 {
        for j in 0..=i {
            let dot: f64 = (0..j).map(|k| lower[i][k] * lower[j][k]).sum();
            let rest = 0.5 * (entry(i, j) + entry(j, i)) - dot;
            lower[i][j] = match (i == j, lower[j][j]) {
                (true, _) => libm::sqrt(rest.max(0.0)),
                (false, pivot) if pivot * pivot > small => rest / pivot,
                _ => 0.0,
            };
        }
    }
    DMat3::from_cols_array_2d(&lower).transpose()
}

/// What a force that is spread over a patch does to every node by the residual compliance, on average over its directions,
/// times three: Σᵢ wᵢ·tr Sᵢⱼ.
fn answer(residual: &ResidualCompliance, patch: impl Iterator<Item = (usize, f64)>, field: &mut [f64]) {
    field.fill(0.0);
    for (i, w) in patch {
        match residual {
            ResidualCompliance::NearField(near) => {
                near.row(i).for_each(|(j, block)| field[j] += trace(&block) * w);
            }
            _ => field.iter_mut().enumerate().for_each(|(j, sum)| *sum += residual.trace(i, j) * w),
        }
    }
}

/// The range with which ψ comes nearest to how S falls off between patches about places: `shares(c, others)` tells it of
/// patch c and others, as shares of what it is in their own places.
fn fit_range(
    places: &[DVec3],
    edge: f64,
    radius: f64,
    mut shares: impl FnMut(usize, &[usize]) -> Vec<f64>,
) -> f64 {
    let widest = 6.0 * (radius + edge);
    let n = places.len();
    let mut samples = Vec::new();
    for c in (0..n).step_by((n / FIT_CENTRES).max(1)) {
        // A few places at growing distances.
        let distance = |d: usize| (places[d] - places[c]).length();
        let mut wanted = 0.5 * edge;
        let mut others = Vec::new();
        for d in (0..n).filter(|&d| d != c && distance(d) < widest) {
            if distance(d) > wanted {
                others.push(d);
                wanted = if distance(d) > 0.9 * widest { 0.5 * edge } else { distance(d) };
            }
        }
        let shares = shares(c, &others).into_iter().zip(others).filter(|(share, _)| share.is_finite());
        samples.extend(shares.map(|(share, d)| (distance(d), share)));
    }
    let error = |range: f64| -> f64 {
        let miss = |&(distance, share): &(f64, f64)| NearField::taper(distance / range) - share;
        samples.iter().map(|sample| miss(sample) * miss(sample)).sum()
    };
    let candidates = (1..=48).map(|k| f64::from(k) / 48.0 * 2.0 * widest);
    let least = (radius + edge).max(f64::MIN_POSITIVE);
    candidates.map(|range| range.max(least)).min_by(|a, b| error(*a).total_cmp(&error(*b))).unwrap_or(least)
}
