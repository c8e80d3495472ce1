//! Quantised residual compliance that stays positive semi-definite.
//!
//! Rounding moves the correlations N_ij = S_ij/√(S_ii·S_jj) by a matrix E with entries of at most half a step. Where N + E has a negative
//! eigenvalue, the diagonal of S is raised by a share ε: a Cholesky factorisation proves (N + ε·1)/(1 + ε) + E positive definite.

use crate::kernels::{avx_section, multiply, row_blocks, solve_lower};
use faer::{Accum, Mat, Side};
use palpate::QuantisedCompliance;
use rayon::prelude::*;

/// Steps K of a correlation between 0 and 1: near to the largest whole number of 16 bits.
const STEPS: f64 = 16384.0;

/// Steps that a correlation between different nodes is a multiple of, so that files are small: the compliance between two nodes is off by
/// at most 0.012 % of that at them. Twice as many double the force error at two held places of the paper's cube (0.6 to 1.0 %), for 7 %
/// of its file. Within a node, the compliances along and across an edge of the body are too unlike for it.
const STEPS_BETWEEN_NODES: f64 = 4.0;

/// Columns that the factorisation eliminates together.
const BLOCK: usize = 192;

/// Quantises node blocks of a lower triangle, each of nine numbers row by row [m/N], for a number of nodes.
pub(crate) fn quantised(blocks: &[f32], nodes: usize) -> QuantisedCompliance {
    let diagonal = diagonal(blocks, nodes);
    // Finer steps, then what they move an entry by, doubled until it is enough.
    let raises = std::iter::successors(Some(0.5 / STEPS), |share| Some(2.0 * share));
    let attempts =
        [(STEPS_BETWEEN_NODES, 0.0), (1.0, 0.0)].into_iter().chain(raises.map(|raise| (1.0, raise)));
    attempts
        .map(|(between_nodes, raise)| rounded(blocks, &diagonal, between_nodes, raise))
        .find(is_positive_definite)
        .unwrap_or_else(|| unreachable!("correlations vanish as the diagonal is raised"))
}

/// Diagonal of S [m/N].
fn diagonal(blocks: &[f32], nodes: usize) -> Vec<f64> {
    let own = |node: usize| &blocks[9 * (node * (node + 1) / 2 + node)..][..9];
    (0..3 * nodes).map(|i| f64::from(own(i / 3)[4 * (i % 3)])).collect()
}

/// Rounded blocks, in multiples of some steps between nodes, with a diagonal that is raised by a share of it.
fn rounded(blocks: &[f32], diagonal: &[f64], between_nodes: f64, raise: f64) -> QuantisedCompliance {
    let scales: Vec<f32> =
        diagonal.iter().map(|own| (own.max(0.0) * (1.0 + raise) / STEPS).sqrt() as f32).collect();
    let nodes = diagonal.len() / 3;
    let pairs = (0..nodes).flat_map(|i| (0..=i).map(move |j| (i, j)));
    let whole = |((i, j), block): ((usize, usize), &[f32; 9])| -> [i16; 9] {
        let multiple = if i == j { 1.0 } else { between_nodes };
        std::array::from_fn(|at| {
            let (row, column) = (3 * i + at / 3, 3 * j + at % 3);
            let unit = f64::from(scales[row]) * f64::from(scales[column]);
            match (row == column, unit > 0.0) {
                (_, false) => 0,
                (true, _) => STEPS as i16,
                _ => (multiple * (f64::from(block[at]) / (unit * multiple)).round()).clamp(-STEPS, STEPS)
                    as i16,
            }
        })
    };
    let quantised = pairs.zip(blocks.as_chunks::<9>().0).flat_map(whole).collect();
    QuantisedCompliance { scales, blocks: quantised }
}

/// Whether the whole numbers of the degrees of freedom with a scale are a positive definite matrix: it has a Cholesky factor, with the
/// same round-off on any number of threads.
fn is_positive_definite(quantised: &QuantisedCompliance) -> bool {
    let movable: Vec<usize> = (0..quantised.scales.len()).filter(|&i| quantised.scales[i] > 0.0).collect();
    let entry = |i: usize, j: usize| f64::from(quantised.entry(movable[i], movable[j]));
    let n = movable.len();
    let mut rest = Mat::from_fn(n, n, |i, j| if i >= j { entry(i, j) } else { 0.0 });
    // A pivot within the round-off of the factorisation proves nothing.
    let round_off = STEPS * (n * n) as f64 * f64::EPSILON;
    (0..n).for_each(|i| rest[(i, i)] -= round_off);
    for first in (0..n).step_by(BLOCK) {
        let width = BLOCK.min(n - first);
        let block = rest.submatrix(first, first, width, width);
        let Ok(factor) = avx_section(|| block.llt(Side::Lower)) else { return false };
        let below = first + width;
        let mut panel = rest.submatrix(below, first, n - below, width).to_owned();
        row_blocks(panel.as_mut(), BLOCK).into_par_iter().for_each(|rows| {
            solve_lower(factor.L(), rows.transpose_mut());
        });
        let trailing = rest.as_mut().submatrix_mut(below, below, n - below, n - below);
        row_blocks(trailing, BLOCK).into_par_iter().enumerate().for_each(|(at, rows)| {
            let (height, columns) = (rows.nrows(), at * BLOCK + rows.nrows());
            let own = panel.subrows(at * BLOCK, height);
            let lower = rows.subcols_mut(0, columns);
            multiply(lower, Accum::Add, own, panel.subrows(0, columns).transpose(), -1.0);
        });
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Blocks of a matrix whose correlations fall with the distance of the degrees of freedom on a line.
    fn blocks(nodes: usize, correlation: impl Fn(f64) -> f64) -> Vec<f32> {
        let pairs = (0..nodes).flat_map(|i| (0..=i).map(move |j| (i, j)));
        let places = pairs.flat_map(|(i, j)| (0..9).map(move |at| (3 * i + at / 3, 3 * j + at % 3)));
        let size = |i: usize| 1e-3 * (1.0 + (i % 7) as f64);
        places.map(|(i, j)| (size(i) * size(j) * correlation(i.abs_diff(j) as f64)) as f32).collect()
    }

    fn least_eigenvalue(quantised: &QuantisedCompliance) -> f64 {
        let n = quantised.scales.len();
        let matrix = Mat::from_fn(n, n, |i, j| {
            let (i, j) = (i.max(j), i.min(j));
            let block = i / 3 * (i / 3 + 1) / 2 + j / 3;
            f64::from(quantised.blocks[9 * block + 3 * (i % 3) + j % 3]) / STEPS
        });
        matrix.self_adjoint_eigenvalues(Side::Lower).expect("it is symmetric")[0]
    }

    #[test]
    fn well_conditioned_compliances_keep_their_diagonal() {
        let exact = blocks(120, |distance| (-distance / 3.0).exp());
        let own = quantised(&exact, 120);
        assert!(least_eigenvalue(&own) > 0.0);
        for (i, scale) in own.scales.iter().enumerate() {
            let expected = 1e-3 * (1.0 + (i % 7) as f64) / STEPS.sqrt();
            assert!((f64::from(*scale) / expected - 1.0).abs() < 1e-6, "{i}");
        }
    }

    #[test]
    fn smooth_compliances_are_raised_until_they_are_positive_definite() {
        // A Gaussian has eigenvalues far below what rounding moves them by.
        let exact = blocks(150, |distance| (-distance * distance / 200.0).exp());
        let plain = rounded(&exact, &diagonal(&exact, 150), STEPS_BETWEEN_NODES, 0.0);
        assert!(least_eigenvalue(&plain) < -1e-4, "{}", least_eigenvalue(&plain));
        let own = quantised(&exact, 150);
        let least = least_eigenvalue(&own);
        assert!((0.0..0.02).contains(&least), "{least}");
    }
}
