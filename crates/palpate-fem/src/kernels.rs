//! Kernels of dense linear algebra, with the same bits on any number of threads.
//!
//! faer's parallel kernels divide sums by the number of threads, and round-off then turns the basis of a degenerate mode: a cube recorded on
//! two threads had other mode shapes than on one. So every kernel runs on one thread, and what is worth it is divided into blocks of
//! rows whose sizes depend on the matrix alone.

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};
use rayon::prelude::*;

/// Threads of a kernel: one.
pub(crate) const SEQUENTIAL: Par = Par::Seq;

/// Upper limit of row blocks of a product: enough for the cores of a workstation.
const BLOCKS: usize = 64;

/// Lower limit of the rows of a block, below which a thread costs more than it gains.
const LEAST_ROWS: usize = 16;

/// Let faer's operators and decompositions of this process use one thread each.
pub(crate) fn use_sequential_kernels() {
    faer::set_global_parallelism(SEQUENTIAL);
}

/// Product of two matrices, blocks of rows in parallel.
pub(crate) fn product(left: MatRef<'_, f64>, right: MatRef<'_, f64>) -> Mat<f64> {
    let mut result = Mat::zeros(left.nrows(), right.ncols());
    let rows = left.nrows().div_ceil(BLOCKS).max(LEAST_ROWS);
    result.as_mut().par_row_chunks_mut(rows).enumerate().for_each(|(at, block)| {
        let own = left.subrows(at * rows, block.nrows());
        matmul(block, Accum::Replace, own, right, 1.0, SEQUENTIAL);
    });
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_product_is_that_of_one_kernel_to_round_off_and_the_same_bits_on_any_threads() {
        let entry = |i: usize, j: usize| ((7 * i + 13 * j) % 101) as f64 / 101.0 - 0.5;
        let (left, right) = (Mat::from_fn(1500, 70, entry), Mat::from_fn(70, 16, entry));
        let of = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            pool.install(|| {
                let tall = product(left.as_ref(), right.as_ref());
                (product(left.transpose(), tall.as_ref()), tall)
            })
        };
        let (inner, tall) = of(1);
        let difference = (&tall - &left * &right).norm_max();
        // Sums of 70 numbers below a quarter.
        assert!(difference < 1e-14, "{difference:e}");
        for threads in [2, 3, 4] {
            assert!(of(threads) == (inner.clone(), tall.clone()), "{threads} threads");
        }
    }
}
