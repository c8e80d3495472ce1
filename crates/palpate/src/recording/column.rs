//! Column of a table R[s] in memory: the responses [m/N] to one touchable degree of freedom, in the order that a convolution reads them in.
//!
//! A blocked convolution needs the first samples of all series in every step, and the others in every B-th. So the first B samples of each
//! observed degree of freedom come first, one after the other, and then the rest of each series.

use crate::dot_products::{BLOCK, correlate, dot};
use alloc::boxed::Box;
use alloc::vec::Vec;

/// Column of a table, ordered by [`arrange_column`] [m/N].
#[derive(Debug, Clone, Copy)]
pub enum Column<'a> {
    /// Single precision.
    F32(&'a [f32]),
    /// Double precision.
    F64(&'a [f64]),
}

/// Series of T samples of one observed degree of freedom [m/N].
#[derive(Debug, Clone, Copy)]
pub struct ResponseSeries<'a>(Split<'a>);

/// First samples of a series, and its rest.
#[derive(Debug, Clone, Copy)]
enum Split<'a> {
    F32([&'a [f32]; 2]),
    F64([&'a [f64]; 2]),
}

/// Column of T samples, given sample after sample, in the order of a [`Column`].
pub fn arrange_column<X: Copy>(column: &[X], samples: usize) -> Box<[X]> {
    let (observed, first) = (column.len() / samples, BLOCK.min(samples));
    let mut arranged = Vec::with_capacity(column.len());
    for range in [0..first, first..samples] {
        for dof in 0..observed {
            arranged.extend(range.clone().map(|sample| column[sample * observed + dof]));
        }
    }
    arranged.into()
}

impl<'a> Column<'a> {
    /// Series of an observed degree of freedom, of T samples.
    ///
    /// # Real time
    #[inline]
    pub fn series(&self, dof: usize, samples: usize) -> ResponseSeries<'a> {
        ResponseSeries(match *self {
            Self::F32(numbers) => Split::F32(parts(numbers, dof, samples)),
            Self::F64(numbers) => Split::F64(parts(numbers, dof, samples)),
        })
    }

    /// Add Σ_a R[from + a + k]·f[a], k = 0 … B − 1, of the series of three observed degrees of freedom to sums [m]; R is zero beyond its T samples.
    ///
    /// # Real time
    pub(crate) fn correlate(
        &self,
        (dofs, samples): ([u32; 3], usize),
        from: usize,
        forces: &[f64],
        sums: &mut [[f64; BLOCK]; 3],
    ) {
        for (dof, sums) in dofs.into_iter().zip(sums) {
            match self.series(dof as usize, samples).0 {
                Split::F32(parts) => correlate(after(parts, from), forces, sums),
                Split::F64(parts) => correlate(after(parts, from), forces, sums),
            }
        }
    }
}

/// First samples and rest of a series.
#[inline]
fn parts<X>(numbers: &[X], dof: usize, samples: usize) -> [&[X]; 2] {
    let first = BLOCK.min(samples);
    let (firsts, rests) = numbers.split_at(numbers.len() / samples * first);
    let rest = samples - first;
    [&firsts[dof * first..(dof + 1) * first], &rests[dof * rest..(dof + 1) * rest]]
}

impl ResponseSeries<'_> {
    /// Number [m/N] of a sample.
    ///
    /// # Real time
    #[inline]
    pub fn at(&self, sample: usize) -> f64 {
        fn at<X: Copy + Into<f64>>([first, rest]: [&[X]; 2], sample: usize) -> f64 {
            let number = if sample < first.len() { first[sample] } else { rest[sample - first.len()] };
            number.into()
        }
        match self.0 {
            Split::F32(parts) => at(parts, sample),
            Split::F64(parts) => at(parts, sample),
        }
    }

    /// Σ_a R[from + a]·f[a] [m].
    ///
    /// # Real time
    #[inline]
    pub(crate) fn dot(&self, from: usize, forces: &[f64]) -> f64 {
        #[inline]
        fn dot_parts<X: Copy + Into<f64>>([first, rest]: [&[X]; 2], forces: &[f64]) -> f64 {
            let (of_first, of_rest) = forces.split_at(first.len().min(forces.len()));
            // Too few for running sums.
            let sum: f64 = first.iter().zip(of_first).map(|(&r, f)| r.into() * f).sum();
            if of_rest.is_empty() { sum } else { sum + dot(rest, of_rest) }
        }
        match self.0 {
            Split::F32(parts) => dot_parts(after(parts, from), forces),
            Split::F64(parts) => dot_parts(after(parts, from), forces),
        }
    }
}

/// Parts of a series from a sample on.
#[inline]
fn after<X>([first, rest]: [&[X]; 2], from: usize) -> [&[X]; 2] {
    let of_first = from.min(first.len());
    [&first[of_first..], &rest[(from - of_first).min(rest.len())..]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn series_of_a_column_are_those_that_it_was_made_of_for_every_length() {
        for samples in [1, 5, BLOCK, BLOCK + 1, 12 * BLOCK] {
            let numbers: Vec<f64> = (0..3 * samples).map(|at| at as f64).collect();
            let arranged = arrange_column(&numbers, samples);
            for (dof, sample) in (0..3).flat_map(|dof| (0..samples).map(move |sample| (dof, sample))) {
                let series = Column::F64(&arranged).series(dof, samples);
                assert_eq!(series.at(sample), (3 * sample + dof) as f64);
                // Sums of integers are exact.
                let forces: Vec<f64> = (0..samples - sample).map(|at| (at * at % 7) as f64).collect();
                let at = |age: usize| numbers.get(3 * (sample + age) + dof).copied().unwrap_or(0.0);
                let plain =
                    |k: usize| -> f64 { forces.iter().enumerate().map(|(age, f)| at(age + k) * f).sum() };
                assert_eq!(series.dot(sample, &forces), plain(0), "{dof}, {sample} of {samples}");
                let mut sums = [[0.0; BLOCK]; 3];
                Column::F64(&arranged).correlate(([dof as u32; 3], samples), sample, &forces, &mut sums);
                assert_eq!(sums, [core::array::from_fn(plain); 3], "{dof}, {sample} of {samples}");
            }
        }
    }
}
