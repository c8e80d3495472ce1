//! Residual compliance between contact patches anywhere on a surface, by a kernel.
//!
//! ```text
//! D_c = Σᵢⱼ wᵢ·Sᵢⱼ·wⱼ = A_c·A_cᵀ        K(x, y) = A(x)·ψ(|x − y|/L)·A(y)ᵀ
//! ```
//!
//! w are the weights of the patch about node c; A [√(m/N)] is interpolated between nodes. D [m/N] is exact at the nodes. The kernel
//! K [m/N] extends it to pairs of patches by Wendland's function ψ, whose range L [m] is fitted to S. K is positive semi-definite
//! for any set of patches (Schur's product theorem), and its cost does not depend on the mesh.
//!
//! Equations: docs/theory.md (C28), (C29).

use crate::recording::{NearField, Recording, ResidualCompliance};
use crate::spatial::frobenius_square;
use crate::surface::{PatchWeights, SurfacePoint};
use alloc::vec;
use alloc::vec::Vec;
use glam::{DMat3, DVec3};

/// Kernel of the residual compliance between patches about all surface nodes.
#[derive(Debug, Clone)]
pub(crate) struct ResidualKernel {
    /// Factor A of each patch [√(m/N)], lower triangular.
    factors: Vec<DMat3>,
    /// Range L of the kernel [m].
    range: f64,
}

/// Number of patches whose residual compliance with others determines the kernel's range.
const FIT_CENTRES: usize = 24;

impl ResidualKernel {
    /// Kernel of patches of a radius [m] about all surface nodes.
    pub(super) fn new(recording: &Recording, weights: &PatchWeights, radius: f64) -> Self {
        let surface = &recording.surface;
        let n = recording.model_nodes();
        let mut dense = vec![0.0; n];
        let own: Vec<DMat3> = (0..weights.len())
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
        let mut field = vec![0.0; n];
        let correlations = |c: usize, others: &[usize]| -> Vec<f64> {
            residual_trace_field(&recording.residual, weights.of(c), &mut field);
            let scale = |d: usize| libm::sqrt(trace(&own[c]) * trace(&own[d]));
            let between = |d: usize| weights.of(d).map(|(j, w)| field[j] * w).sum::<f64>();
            others.iter().map(|&d| between(d) / scale(d)).collect()
        };
        let range = fit_kernel_range(&surface.positions, recording.mean_element_edge(), radius, correlations);
        Self { factors, range }
    }

    /// √tr(D) of the patch about a node [√(m/N)].
    pub(super) fn size(&self, node: usize) -> f64 {
        libm::sqrt(frobenius_square(&self.factors[node]))
    }

    /// Factor A at a surface point [√(m/N)].
    ///
    /// # Real time
    pub(super) fn factor_at(&self, recording: &Recording, point: &SurfacePoint) -> DMat3 {
        self.factors_about(recording, point).map(|(factor, w)| factor * w).fold(DMat3::ZERO, |a, b| a + b)
    }

    /// Factors A of the nodes about a surface point, with their weights.
    fn factors_about(
        &self,
        recording: &Recording,
        point: &SurfacePoint,
    ) -> impl Iterator<Item = (DMat3, f64)> {
        let used = recording.surface.corners(point).into_iter().filter(|corner| corner.1 != 0.0);
        used.map(|(node, weight)| (self.factors[node], weight))
    }

    /// Largest factor A at the nodes about a surface point, over that at the point, in the Frobenius norm [1].
    ///
    /// # Real time
    pub(super) fn peak(&self, recording: &Recording, point: &SurfacePoint) -> f64 {
        let own = frobenius_square(&self.factor_at(recording, point));
        let at_nodes = self.factors_about(recording, point).map(|(factor, _)| frobenius_square(&factor));
        let largest = at_nodes.fold(own, f64::max);
        if own > 0.0 { libm::sqrt(largest / own) } else { 1.0 }
    }

    /// Residual displacement Σ K·f of the patch about a node [m, body] under forces with their rest positions and Aᵀ·f [√J], each constant
    /// within a radius [m] of the force.
    ///
    /// # Real time
    pub(super) fn displacement(
        &self,
        recording: &Recording,
        node: usize,
        forces: impl Iterator<Item = (DVec3, DVec3, f64)>,
    ) -> DVec3 {
        let position = recording.surface.positions[node];
        let mut sum = DVec3::ZERO;
        for (rest, factored, flat_radius) in forces {
            let square = (position - rest).length_squared();
            let reach = self.range + flat_radius;
            if square < reach * reach {
                let distance = (libm::sqrt(square) - flat_radius).max(0.0);
                sum += factored * NearField::taper(distance / self.range);
            }
        }
        self.factors[node] * sum
    }

    /// Steepest slope of ψ(r/L) [1/m].
    pub(super) fn slope(&self) -> f64 {
        // ψ′ = −20·s·(1 − s)³ is steepest at a quarter.
        2.11 / self.range
    }

    /// K [m/N] between the patches about two surface points.
    ///
    /// # Real time
    pub(super) fn between(&self, recording: &Recording, a: &SurfacePoint, b: &SurfacePoint) -> DMat3 {
        let distance = (recording.surface.rest_position(a) - recording.surface.rest_position(b)).length();
        if distance >= self.range {
            return DMat3::ZERO;
        }
        let (a, b) = (self.factor_at(recording, a), self.factor_at(recording, b));
        a * b.transpose() * NearField::taper(distance / self.range)
    }
}

fn trace(matrix: &DMat3) -> f64 {
    matrix.diagonal().element_sum()
}

/// Lower Cholesky factor of a positive semi-definite matrix; zero in directions without compliance.
fn semidefinite_cholesky(matrix: &DMat3) -> DMat3 {
    let mut lower = [[0.0; 3]; 3];
    let entry = |i: usize, j: usize| matrix.col(j)[i];
    // Where all modes are kept, S is round-off, and its trace may be negative.
    let small = 1e-12 * trace(matrix).max(0.0);
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
