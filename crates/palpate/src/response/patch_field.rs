//! Contact patches of one radius on a body: mode shapes averaged over the patch about every surface node, or about every
//! contact sample, and the residual compliance between patches.
//!
//! ```text
//! G_c = Σᵢ wᵢ·Φᵢ        D_c = Σᵢⱼ wᵢ·Sᵢⱼ·wⱼ = A_c·A_cᵀ        K(x, y) = A(x)·ψ(|x − y|/L)·A(y)ᵀ
//! ```
//!
//! w are the weights of the patch about node c; G [1/√kg] and A [√(m/N)] are interpolated between nodes. D [m/N] is exact at
//! the nodes. The kernel K [m/N] extends it to pairs of patches by Wendland's function ψ, whose range L [m] is fitted to S.
//! K is positive semi-definite for any set of patches (Schur's product theorem), and its cost does not depend on the mesh.
//!
//! Equations: docs/theory.md (C27), (C28), (C29).

use crate::recording::{NearField, Recording, ResidualCompliance};
use crate::surface::{Bands, Bounds, PatchWeights, SampleLevel, SphereTree, Surface, SurfacePoint, band};
use alloc::vec;
use alloc::vec::Vec;
use core::ops::Range;
use glam::{DMat3, DVec3};

/// Contact patches of one radius on one body; immutable.
#[derive(Debug, Clone)]
pub(crate) struct PatchField {
    /// Patch radius a [m].
    pub(crate) radius: f64,
    pub(crate) weights: PatchWeights,
    /// Averaged mode shapes G [1/√kg]: (3·patch + axis)·m + mode. Single precision halves the time of queries on a fine
    /// mesh.
    pub(crate) rows: Vec<f32>,
    /// Factor A of each patch [√(m/N)], lower triangular.
    factors: Vec<DMat3>,
    /// Range L of the kernel [m].
    range: f64,
    pub(crate) bounds: Bounds,
    /// Contact samples; none where every surface node has a patch.
    pub(crate) samples: Option<SampleSurface>,
}

/// Factored force Aᵀ·f of a patch.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct FactoredForce {
    /// Rest position [m, body].
    rest: DVec3,
    /// Aᵀ·f [√J].
    pub(super) value: DVec3,
}

/// Contact samples of a surface, with the decimated surface between them.
#[derive(Debug, Clone)]
pub(crate) struct SampleSurface {
    /// Sample index of each surface node; [`NONE`] for the others.
    indices: Vec<u32>,
    /// Surface node of each sample.
    nodes: Vec<u32>,
    /// Decimated surface; a degenerate triangle per sample where the level has none.
    pub(crate) surface: Surface,
    /// Whether the level has a decimated surface.
    pub(crate) is_surface: bool,
    /// One triangle of each sample.
    triangle: Vec<u32>,
    pub(crate) tree: SphereTree,
}

/// Sample index of a surface node without sample.
const NONE: u32 = u32::MAX;

impl SampleSurface {
    pub(crate) fn new(surface: &Surface, level: &SampleLevel) -> Self {
        let nodes = &level.nodes;
        let mut indices = vec![NONE; surface.positions.len()];
        nodes.iter().enumerate().for_each(|(index, &node)| indices[node as usize] = index as u32);
        let is_surface = !level.triangles.is_empty();
        let triangles =
            if is_surface { level.triangles.clone() } else { nodes.iter().map(|&node| [node; 3]).collect() };
        let mut triangle = vec![0; nodes.len()];
        for (t, corners) in triangles.iter().enumerate() {
            corners.iter().for_each(|node| triangle[indices[*node as usize] as usize] = t as u32);
        }
        let tree = SphereTree::new(&surface.positions, &triangles);
        let surface = Surface { triangles, ..surface.clone() };
        Self { indices, nodes: nodes.clone(), surface, is_surface, triangle, tree }
    }

    /// Surface nodes of the samples.
    pub(super) fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    /// Sample as a point of the decimated surface.
    pub(super) fn node_point(&self, node: usize) -> SurfacePoint {
        let triangle = self.triangle[self.indices[node] as usize];
        let corners = self.surface.triangles[triangle as usize];
        let first = corners.iter().position(|corner| *corner as usize == node);
        SurfacePoint { triangle, weights: [0, 1, 2].map(|k| if Some(k) == first { 1.0 } else { 0.0 }) }
    }
}

/// Number of patches whose residual compliance with others determines the kernel's range.
const FIT_CENTRES: usize = 24;

impl PatchField {
    /// Patches about all surface nodes, with the sphere tree over the surface.
    pub(crate) fn new(recording: &Recording, tree: &SphereTree, radius: f64) -> Self {
        let all: Vec<u32> = (0..recording.surface.positions.len() as u32).collect();
        let field = Self::without_bounds(recording, &all, radius);
        let bounds = field.bounds(recording, tree, &recording.surface.triangles);
        Self { bounds, ..field }
    }

    /// Patches about the contact samples of a level.
    pub(crate) fn at_samples(recording: &Recording, level: &SampleLevel, radius: f64) -> Self {
        let samples = SampleSurface::new(&recording.surface, level);
        let field = Self { samples: Some(samples), ..Self::without_bounds(recording, &level.nodes, radius) };
        let samples = field.samples.as_ref();
        let bounds =
            samples.map(|samples| field.bounds(recording, &samples.tree, &samples.surface.triangles));
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
        let mut dense = vec![0.0; surface.positions.len()];
        let own: Vec<DMat3> = (0..n)
            .map(|c| match &recording.residual {
                // Row by row: most node pairs of a large patch lie beyond the near field.
                ResidualCompliance::NearField(near) => {
                    weights.of(c).for_each(|(node, w)| dense[node] = w);
                    let mut sum = DMat3::ZERO;
                    for (i, wi) in weights.of(c) {
                        let row = near.row(i).filter(|(j, _)| dense[*j] != 0.0);
                        sum += row.map(|(j, block)| block * dense[j]).fold(DMat3::ZERO, |a, b| a + b) * wi;
                    }
                    weights.of(c).for_each(|(node, _)| dense[node] = 0.0);
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
        let factors = own.iter().map(semidefinite_cholesky).collect();
        let centres: Vec<DVec3> = nodes.iter().map(|&node| surface.positions[node as usize]).collect();
        let mut field = vec![0.0; surface.positions.len()];
        let correlations = |c: usize, others: &[usize]| -> Vec<f64> {
            residual_trace_field(&recording.residual, weights.of(c), &mut field);
            let scale = |d: usize| libm::sqrt(trace(&own[c]) * trace(&own[d]));
            let between = |d: usize| weights.of(d).map(|(j, w)| field[j] * w).sum::<f64>();
            others.iter().map(|&d| between(d) / scale(d)).collect()
        };
        let range = fit_kernel_range(&centres, surface.mean_edge(), radius, correlations);
        Self { radius, weights, rows, factors, range, bounds: Bounds::default(), samples: None }
    }

    fn bounds(&self, recording: &Recording, tree: &SphereTree, triangles: &[[u32; 3]]) -> Bounds {
        let distances = ModalDistances::new(recording, &self.rows);
        tree.bounds(
            triangles,
            |i, c| distances.between(self.index(i), c.map(|c| self.index(c))),
            |i| {
                let factor = self.factors[self.index(i)];
                libm::sqrt(trace(&(factor * factor.transpose())))
            },
        )
    }

    /// Index of the patch about a surface node that has one.
    ///
    /// # Real time
    pub(crate) fn index(&self, node: usize) -> usize {
        self.samples.as_ref().map_or(node, |samples| samples.indices[node] as usize)
    }

    /// Surface between the nodes that have a patch.
    ///
    /// # Real time
    pub(crate) fn surface<'a>(&'a self, recording: &'a Recording) -> &'a Surface {
        self.samples.as_ref().map_or(&recording.surface, |samples| &samples.surface)
    }

    /// Factor A at a surface point [√(m/N)].
    ///
    /// # Real time
    pub(crate) fn factor_at(&self, recording: &Recording, point: &SurfacePoint) -> DMat3 {
        let corners = self.surface(recording).corners(point);
        let used = corners.iter().filter(|corner| corner.1 != 0.0);
        used.map(|&(node, w)| self.factors[self.index(node)] * w).fold(DMat3::ZERO, |a, b| a + b)
    }

    /// Residual displacement K·f of the patch about a node [m, body], constant within `flat_radius` [m] of each force.
    ///
    /// # Real time
    pub(crate) fn residual_displacement(
        &self,
        recording: &Recording,
        node: usize,
        forces: &[FactoredForce; 3],
        flat_radius: f64,
    ) -> DVec3 {
        let mut sum = DVec3::ZERO;
        for force in forces.iter().filter(|force| force.value != DVec3::ZERO) {
            let distance = ((recording.surface.positions[node] - force.rest).length() - flat_radius).max(0.0);
            if distance < self.range {
                sum += self.factors[self.index(node)] * force.value * NearField::taper(distance / self.range);
            }
        }
        sum
    }

    /// Factored forces Aᵀ·f of a force at a surface point with this rest position; on a decimated surface at the corners.
    ///
    /// # Real time
    pub(super) fn factored(
        &self,
        recording: &Recording,
        point: &SurfacePoint,
        rest: DVec3,
        force: DVec3,
    ) -> [FactoredForce; 3] {
        if let Some(samples) = &self.samples {
            return samples.surface.corners(point).map(|(node, weight)| {
                let value = self.factors[self.index(node)].transpose() * (force * weight);
                FactoredForce { rest: samples.surface.positions[node], value }
            });
        }
        let value = self.factor_at(recording, point).transpose() * force;
        let none = FactoredForce { rest, value: DVec3::ZERO };
        [FactoredForce { rest, value }, none, none]
    }

    /// Steepest slope of ψ(r/L) [1/m].
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
        let factor = |node| self.factors[self.index(node)];
        factor(a) * factor(b).transpose() * NearField::taper(distance / self.range)
    }

    /// K [m/N] between the patches about two surface points; on a decimated surface interpolated between its corners, as the
    /// modes are.
    ///
    /// # Real time
    pub(crate) fn residual(&self, recording: &Recording, a: &SurfacePoint, b: &SurfacePoint) -> DMat3 {
        if let Some(SampleSurface { surface, .. }) = &self.samples {
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
        let (a, b) = (self.factor_at(recording, a), self.factor_at(recording, b));
        a * b.transpose() * NearField::taper(distance / self.range)
    }
}

/// Distances of surface nodes in the norm of the elastic energy, by rows laid out as the mode shapes.
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

    /// √(Σ|rowᵢ − row_c|²/ω²) over axes and the modes of each band, or √(Σ|rowᵢ|²/ω²) without c [m/√J].
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

/// √tr(Sᵢᵢ) of a node [√(m/N)].
pub(crate) fn residual_size(recording: &Recording, node: usize) -> f64 {
    libm::sqrt(trace(&recording.residual.block(node, node)))
}

fn trace(matrix: &DMat3) -> f64 {
    matrix.diagonal().element_sum()
}

/// Lower Cholesky factor of a positive semi-definite matrix; zero in directions without compliance.
fn semidefinite_cholesky(matrix: &DMat3) -> DMat3 {
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

/// Trace of the residual compliance between a patch and every node [m/N]: Σᵢ wᵢ·tr Sᵢⱼ.
fn residual_trace_field(
    residual: &ResidualCompliance,
    patch: impl Iterator<Item = (usize, f64)>,
    field: &mut [f64],
) {
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

/// Range L [m] of the least-squares fit of ψ(r/L) to the correlation of patches: `correlations(c, others)` gives
/// tr S_cd/√(tr S_cc·tr S_dd) of patch c and others.
fn fit_kernel_range(
    centres: &[DVec3],
    edge: f64,
    radius: f64,
    mut correlations: impl FnMut(usize, &[usize]) -> Vec<f64>,
) -> f64 {
    let widest = 6.0 * (radius + edge);
    let n = centres.len();
    let mut samples = Vec::new();
    for c in (0..n).step_by((n / FIT_CENTRES).max(1)) {
        // A few patches at growing distances.
        let distance = |d: usize| (centres[d] - centres[c]).length();
        let mut least = 0.5 * edge;
        let mut others = Vec::new();
        for d in (0..n).filter(|&d| d != c && distance(d) < widest) {
            if distance(d) > least {
                others.push(d);
                least = if distance(d) > 0.9 * widest { 0.5 * edge } else { distance(d) };
            }
        }
        let found = correlations(c, &others).into_iter().zip(others);
        let finite = found.filter(|(correlation, _)| correlation.is_finite());
        samples.extend(finite.map(|(correlation, d)| (distance(d), correlation)));
    }
    let error = |range: f64| -> f64 {
        let residual =
            |&(distance, correlation): &(f64, f64)| NearField::taper(distance / range) - correlation;
        samples.iter().map(|sample| residual(sample) * residual(sample)).sum()
    };
    let candidates = (1..=48).map(|k| f64::from(k) / 48.0 * 2.0 * widest);
    let least = (radius + edge).max(f64::MIN_POSITIVE);
    candidates.map(|range| range.max(least)).min_by(|a, b| error(*a).total_cmp(&error(*b))).unwrap_or(least)
}
