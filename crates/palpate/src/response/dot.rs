//! Sums of products with several running sums, which the compiler turns into vector instructions; the order of
//! addition is fixed, so the bits are.

use glam::DVec3;

/// Running sums per product.
const LANES: usize = 8;

/// Σ a·b over the shorter length.
///
/// # Real time
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len().min(b.len());
    let (a, b) = (&a[..n], &b[..n]);
    let mut sums = [0.0; LANES];
    let (heads, tails) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let rest: f64 = heads.remainder().iter().zip(tails.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in heads.zip(tails) {
        for lane in 0..LANES {
            sums[lane] += x[lane] * y[lane];
        }
    }
    rest + ((sums[0] + sums[4]) + (sums[1] + sums[5])) + ((sums[2] + sums[6]) + (sums[3] + sums[7]))
}

/// Three rows, one after the other, times q.
///
/// # Real time
pub(crate) fn dot3(rows: &[f64], q: &[f64]) -> DVec3 {
    let m = rows.len() / 3;
    DVec3::new(dot(&rows[..m], q), dot(&rows[m..2 * m], q), dot(&rows[2 * m..], q))
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::vec::Vec;

    #[test]
    fn lanes_add_up_to_the_sum_for_every_length() {
        for n in 0..40 {
            let a: Vec<f64> = (0..n).map(|i| f64::from(i) - 3.5).collect();
            let b: Vec<f64> = (0..n).map(|i| f64::from(i * i) * 0.25).collect();
            let plain: f64 = a.iter().zip(&b).map(|(x, y)| x * y).sum();
            // All terms are multiples of an eighth below 2⁵³: the sums are exact.
            assert_eq!(dot(&a, &b), plain);
        }
    }
}
