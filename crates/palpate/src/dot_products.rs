//! Dot products with several running sums, which the compiler vectorises. The order of addition is fixed, so results are
//! reproducible to the bit.

use glam::{DMat3, DVec3};

/// Outputs B of a block of a correlation: half the registers of SSE2 hold their sums.
pub(crate) const BLOCK: usize = 16;

/// Products per running sum of a correlation for which numbers are brought into double precision at once; B more of them are needed.
const CHUNK: usize = 64;

/// Running sums per product, in double precision.
const LANES: usize = 8;

/// Running sums per product, in single precision.
const SINGLE_LANES: usize = 16;

/// Running sums per product of three rows, of which three to nine run side by side.
const ROW_LANES: usize = 2;

/// Σ a·b over the shorter length; a in either precision.
///
/// # Real time
pub(crate) fn dot<X: Copy + Into<f64>>(a: &[X], b: &[f64]) -> f64 {
    let n = a.len().min(b.len());
    let ((heads, rest_a), (tails, rest_b)) = (a[..n].as_chunks::<LANES>(), b[..n].as_chunks::<LANES>());
    let mut sums = [0.0; LANES];
    for (x, y) in heads.iter().zip(tails) {
        for lane in 0..LANES {
            sums[lane] += x[lane].into() * y[lane];
        }
    }
    let rest: f64 = rest_a.iter().zip(rest_b).map(|(&x, y)| x.into() * y).sum();
    rest + ((sums[0] + sums[4]) + (sums[1] + sums[5])) + ((sums[2] + sums[6]) + (sums[3] + sums[7]))
}

/// Add Σ_a x[a + k]·f[a], k = 0 … B − 1, to sums: a block of outputs in one pass. The row x is given in two parts, in either precision, and is zero
/// beyond its end.
///
/// # Real time
pub(crate) fn correlate<X: Copy + Into<f64>>(row: [&[X]; 2], f: &[f64], sums: &mut [f64; BLOCK]) {
    let mut x = [0.0; CHUNK + BLOCK];
    for (at, f) in f.chunks(CHUNK).enumerate() {
        let (mut from, mut filled) = (at * CHUNK, 0);
        for part in row {
            let rest = &part[from.min(part.len())..];
            from = from.saturating_sub(part.len());
            let room = &mut x[filled..];
            room.iter_mut().zip(rest).for_each(|(x, &number)| *x = number.into());
            filled += rest.len().min(room.len());
        }
        x[filled..].fill(0.0);
        correlate_chunk(&x, f, sums);
    }
}

/// Correlation of a chunk; by itself, so that the sums stay in registers.
#[inline(never)]
fn correlate_chunk(x: &[f64; CHUNK + BLOCK], f: &[f64], sums: &mut [f64; BLOCK]) {
    let mut own = *sums;
    for (x, f) in x.array_windows::<BLOCK>().zip(f) {
        for k in 0..BLOCK {
            own[k] += x[k] * f;
        }
    }
    *sums = own;
}

/// Σ a·b over the shorter length in single precision, at half the time.
///
/// # Real time
fn dot_single(a: &[f32], b: &[f32]) -> f32 {
    let n = a.len().min(b.len());
    let ((heads, rest_a), (tails, rest_b)) =
        (a[..n].as_chunks::<SINGLE_LANES>(), b[..n].as_chunks::<SINGLE_LANES>());
    let mut sums = [0.0; SINGLE_LANES];
    for (x, y) in heads.iter().zip(tails) {
        for lane in 0..SINGLE_LANES {
            sums[lane] += x[lane] * y[lane];
        }
    }
    let rest: f32 = rest_a.iter().zip(rest_b).map(|(x, y)| x * y).sum();
    sums.iter().sum::<f32>() + rest
}

/// Products of three rows, stored one after the other, with the first entries q, in single precision.
///
/// # Real time
pub(crate) fn dot3_single(rows: &[f32], q: &[f32]) -> DVec3 {
    let m = rows.len() / 3;
    let part = |axis: usize| f64::from(dot_single(&rows[axis * m..(axis + 1) * m], q));
    DVec3::new(part(0), part(1), part(2))
}

/// Products of three rows, stored one after the other, with q.
///
/// # Real time
pub(crate) fn dot3(rows: &[f64], q: &[f64]) -> DVec3 {
    dots(rows, [q])[0]
}

/// Products of three rows, stored one after the other, with each of several q, in one pass.
///
/// # Real time
pub(crate) fn dots<const N: usize>(rows: &[f64], several: [&[f64]; N]) -> [DVec3; N] {
    let m = several.iter().fold(rows.len() / 3, |m, q| m.min(q.len()));
    let row = chunks(rows, rows.len() / 3);
    let tails = several.map(|q| q.as_chunks::<ROW_LANES>().0);
    let mut sums = [[[0.0; ROW_LANES]; 3]; N];
    for k in 0..m / ROW_LANES {
        let row = row.map(|row| row[k]);
        for (sums, q) in sums.iter_mut().zip(tails) {
            for (sums, x) in sums.iter_mut().zip(&row) {
                (0..ROW_LANES).for_each(|lane| sums[lane] += x[lane] * q[k][lane]);
            }
        }
    }
    let (length, rest) = (rows.len() / 3, m / ROW_LANES * ROW_LANES);
    core::array::from_fn(|of| {
        let part = |axis: usize| {
            let tail = (rest..m).map(|k| rows[axis * length + k] * several[of][k]);
            sums[of][axis].into_iter().chain(tail).sum()
        };
        DVec3::new(part(0), part(1), part(2))
    })
}

/// Three rows of m numbers in whole chunks, without remainders.
fn chunks(rows: &[f64], m: usize) -> [&[[f64; ROW_LANES]]; 3] {
    core::array::from_fn(|axis| rows[axis * m..(axis + 1) * m].as_chunks().0)
}

/// Matrix of the nine products of three rows with three others, its rows by the first.
///
/// # Real time
pub(crate) fn dot9(a: &[f64], b: &[f64]) -> DMat3 {
    let m = (a.len() / 3).min(b.len() / 3);
    let (x, y) = (chunks(a, m), chunks(b, m));
    let mut sums = [[[0.0; ROW_LANES]; 3]; 3];
    for k in 0..m / ROW_LANES {
        let (x, y) = (x.map(|row| row[k]), y.map(|row| row[k]));
        for (sums, x) in sums.iter_mut().zip(&x) {
            for (sums, y) in sums.iter_mut().zip(&y) {
                (0..ROW_LANES).for_each(|lane| sums[lane] += x[lane] * y[lane]);
            }
        }
    }
    let rest = m / ROW_LANES * ROW_LANES;
    let product = |i: usize, j: usize| {
        let tail = (rest..m).map(|k| a[i * m + k] * b[j * m + k]);
        sums[i][j].into_iter().chain(tail).sum()
    };
    DMat3::from_cols_array_2d(&[0, 1, 2].map(|j| [0, 1, 2].map(|i| product(i, j))))
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
            let single = |of: &[f64]| of.iter().map(|&x| x as f32).collect::<Vec<_>>();
            assert_eq!(f64::from(dot_single(&single(&a), &single(&b))), plain);
        }
    }

    #[test]
    fn nine_products_are_those_of_the_rows() {
        for m in 0..20 {
            let rows = |k: i32| -> Vec<f64> { (0..3 * m).map(|i| f64::from((i * k) % 7) - 2.5).collect() };
            let (a, b) = (rows(3), rows(5));
            let of = |x: &[f64], axis: usize| x[axis * m as usize..(axis + 1) * m as usize].to_vec();
            let all = dot9(&a, &b);
            for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
                assert_eq!(all.col(j)[i], dot(&of(&a, i), &of(&b, j)), "{m}");
            }
        }
    }
}
