//! Kernels of dense linear algebra, with the same bits on any number of threads.
//!
//! faer's parallel kernels divide sums by the number of threads, and round-off then turns the basis of a degenerate mode: a cube recorded on
//! two threads had other mode shapes than on one. So every kernel runs on one thread, and what is worth it is divided into blocks of
//! rows whose sizes depend on the matrix alone.

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::{Accum, Mat, MatMut, MatRef, Par};
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

/// Result of work with faer's kernels, with the upper halves of the vector registers zero after it.
///
/// faer's matrix products on x86 (private-gemm-x86 0.1) leave them in use, against the calling convention. Until something zeroes them, SSE code
/// of the thread, and of each thread that it starts, waits for its own registers at every instruction: recordings took 15 % longer, and
/// steps on new threads twice as long.
pub(crate) fn avx_section<T>(work: impl FnOnce() -> T) -> T {
    let result = work();
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx") {
        // SAFETY: the processor has AVX.
        unsafe { std::arch::x86_64::_mm256_zeroupper() };
    }
    result
}

/// target ← left·right·factor, or target + that.
pub(crate) fn multiply(
    target: MatMut<'_, f64>,
    accumulation: Accum,
    left: MatRef<'_, f64>,
    right: MatRef<'_, f64>,
    factor: f64,
) {
    avx_section(|| matmul(target, accumulation, left, right, factor, SEQUENTIAL));
}

/// x ← L⁻¹·x with a lower triangle L.
pub(crate) fn solve_lower(lower: MatRef<'_, f64>, x: MatMut<'_, f64>) {
    avx_section(|| solve_lower_triangular_in_place(lower, x, SEQUENTIAL));
}

/// x ← U⁻¹·x with an upper triangle U.
pub(crate) fn solve_upper(upper: MatRef<'_, f64>, x: MatMut<'_, f64>) {
    avx_section(|| solve_upper_triangular_in_place(upper, x, SEQUENTIAL));
}

/// Blocks of rows, the last with what is left, for work in parallel.
pub(crate) fn row_blocks(matrix: MatMut<'_, f64>, rows: usize) -> Vec<MatMut<'_, f64>> {
    let mut rest = matrix;
    let mut blocks = Vec::with_capacity(rest.nrows().div_ceil(rows));
    while rest.nrows() > rows {
        let (block, below) = rest.split_at_row_mut(rows);
        blocks.push(block);
        rest = below;
    }
    blocks.push(rest);
    blocks
}

/// Product of two matrices, blocks of rows in parallel.
pub(crate) fn product(left: MatRef<'_, f64>, right: MatRef<'_, f64>) -> Mat<f64> {
    let mut result = Mat::zeros(left.nrows(), right.ncols());
    let rows = left.nrows().div_ceil(BLOCKS).max(LEAST_ROWS);
    row_blocks(result.as_mut(), rows).into_par_iter().enumerate().for_each(|(at, block)| {
        let own = left.subrows(at * rows, block.nrows());
        multiply(block, Accum::Replace, own, right, 1.0);
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

    /// Whether the upper halves of vector registers are in use, where the processor tells it.
    #[cfg(target_arch = "x86_64")]
    fn upper_halves_are_in_use() -> Option<bool> {
        use std::arch::x86_64::{__cpuid_count, _xgetbv};
        // Bits of XINUSE: the upper halves of YMM0 to 15, and of ZMM0 to 15.
        const UPPER_HALVES: u64 = 1 << 2 | 1 << 6;
        // Bit of CPUID leaf 13, subleaf 1: XGETBV reads XINUSE.
        const TELLS: u32 = 1 << 2;
        if !(std::arch::is_x86_feature_detected!("avx") && std::arch::is_x86_feature_detected!("xsave")) {
            return None;
        }
        if __cpuid_count(0xd, 1).eax & TELLS == 0 {
            return None;
        }
        // SAFETY: the processor has XSAVE, and XGETBV for register 1.
        Some(unsafe { _xgetbv(1) } & UPPER_HALVES != 0)
    }

    #[cfg(target_arch = "x86_64")]
    #[test]
    fn kernels_leave_the_upper_halves_zero() {
        let lower = Mat::from_fn(64, 64, |i, j| if i >= j { 1.0 + i as f64 } else { 0.0 });
        let mut x = lower.clone();
        // A system that restores the registers as a whole has them in use after each switch of threads.
        let mut is_zero_after = |kernel: &mut dyn FnMut(MatMut<'_, f64>)| {
            (0..100).any(|_| {
                x.copy_from(&lower);
                kernel(x.as_mut());
                upper_halves_are_in_use() != Some(true)
            })
        };
        let own = lower.as_ref();
        assert!(is_zero_after(&mut |x| multiply(x, Accum::Replace, own, own, 1.0)));
        assert!(is_zero_after(&mut |x| solve_lower(own, x)));
        assert!(is_zero_after(&mut |x| solve_upper(own.transpose(), x)));
        assert!(is_zero_after(&mut |mut x| avx_section(|| x *= faer::Scale((own * own)[(0, 0)]))));
    }
}
