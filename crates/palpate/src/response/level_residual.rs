//! Residual compliance between contact samples of two levels, W₁·S·W₂ᵀ, precomputed: a body that touches two others has samples of both.

use super::patch_field::PatchField;
use crate::recording::block_at;
use alloc::vec::Vec;
use glam::DMat3;

/// Upper limit of contact samples of a level whose residual compliance with other levels is precomputed: 36 bytes for each pair.
const MAX_SAMPLES: usize = 512;

/// Residual compliance between the samples of a level and those of a coarser one [m/N].
#[derive(Debug, Clone)]
pub(super) struct LevelResidual {
    levels: [usize; 2],
    columns: usize,
    /// Blocks, row by row.
    blocks: Vec<f32>,
}

impl LevelResidual {
    /// Residual compliance between all pairs of levels with few enough samples.
    pub(super) fn of_pairs(levels: &[PatchField]) -> Vec<Self> {
        let few = |level: &usize| levels[*level].weights.len() <= MAX_SAMPLES;
        let pairs = (0..levels.len()).flat_map(|a| (a + 1..levels.len()).map(move |b| [a, b]));
        pairs.filter(|pair| pair.iter().all(few)).filter_map(|pair| Self::new(levels, pair)).collect()
    }

    fn new(fields: &[PatchField], levels: [usize; 2]) -> Option<Self> {
        let [first, second] = levels.map(|level| &fields[level]);
        let (samples, columns) = (first.samples()?, second.weights.len());
        let pairs = (0..first.weights.len()).flat_map(|a| (0..columns).map(move |b| (a, b)));
        let block = |(a, b)| samples.averaged_residual(a, second.weights.of(b));
        let blocks = pairs.flat_map(|pair| block(pair).transpose().to_cols_array().map(|x| x as f32));
        Some(Self { levels, columns, blocks: blocks.collect() })
    }
}

/// Residual compliance between the samples of two levels in either order.
pub(super) struct LevelPair<'a> {
    known: &'a LevelResidual,
    is_reversed: bool,
}

impl<'a> LevelPair<'a> {
    /// That of two levels among those that are precomputed.
    pub(super) fn find(all: &'a [LevelResidual], [a, b]: [usize; 2]) -> Option<Self> {
        let levels = [a.min(b), a.max(b)];
        let known = all.iter().find(|known| known.levels == levels)?;
        Some(Self { known, is_reversed: a > b })
    }

    /// Displacement of a sample of the first level per force at one of the second [m/N].
    ///
    /// # Real time
    pub(super) fn between(&self, a: usize, b: usize) -> DMat3 {
        let of = |row: usize, column: usize| block_at(&self.known.blocks, row * self.known.columns + column);
        if self.is_reversed { of(b, a).transpose() } else { of(a, b) }
    }
}
