//! Quantised numbers of compact recordings: 16-bit whole numbers with a step each.
//!
//! Residual compliance: S_ij = sᵢ·sⱼ·q_ij with whole numbers q of which all q_ii are equal, K. The correlation S_ij/√(S_ii·S_jj) is
//! rounded to a multiple of 1/K, so an entry is off by at most √(S_ii·S_jj)/2K. Most entries are near to zero; in files zlib (RFC 1950)
//! compresses them to about half a byte each.
//!
//! Mode shapes: a power of two as the step of each mode, so that rounding them again changes nothing.

use super::residual::{lower_block, product_in_triangle, transposed_product};
use crate::error::{RecordingError, RecordingPart};
use alloc::format;
use alloc::string::String;
use alloc::vec;
use alloc::vec::Vec;
use glam::{DMat3, DVec3};
use miniz_oxide::deflate::{CompressionLevel, compress_to_vec_zlib};
use miniz_oxide::inflate::decompress_to_vec_zlib_with_limit;

/// Residual compliance between all surface nodes, quantised.
#[derive(Debug, Clone, PartialEq)]
pub struct QuantisedCompliance {
    /// Scale s of each degree of freedom 3·node + axis [√(m/N)].
    pub scales: Vec<f32>,
    /// Node blocks q of the lower triangle, block (i, j ≤ i) at i(i+1)/2 + j, nine numbers each, row by row.
    pub blocks: Vec<i16>,
}

/// Upper limit of surface nodes whose compliance a file holds quantised: a file of some kilobytes could claim any number of zeros.
pub const MAX_QUANTISED_NODES: usize = 5461;

impl QuantisedCompliance {
    /// Node block (i, j ≤ i) [m/N].
    ///
    /// # Real time
    pub(super) fn lower_block(&self, i: usize, j: usize) -> DMat3 {
        let first = 9 * lower_block(i, j);
        let q = &self.blocks[first..first + 9];
        let (rows, columns) = (self.scales_of(i), self.scales_of(j));
        let column = |at: usize| {
            DVec3::new(f64::from(q[at]), f64::from(q[3 + at]), f64::from(q[6 + at])) * rows * columns[at]
        };
        DMat3::from_cols(column(0), column(1), column(2))
    }

    /// Displacement of a node under nodal forces [N]: u_i = s_i·Σ_j q_ij·(s_j·f_j) [m], with the scales outside the sum.
    ///
    /// # Real time
    /// Costs the forces.
    pub(super) fn displacement(&self, node: usize, loads: &[(u32, DVec3)]) -> DVec3 {
        let mut sum = DVec3::ZERO;
        for &(other, force) in loads {
            let other = other as usize;
            sum += product_in_triangle(&self.blocks, (node, other), self.scales_of(other) * force);
        }
        self.scales_of(node) * sum
    }

    /// Add the displacements of all nodes under nodal forces [N] to `out` [m]: u_i = s_i·Σ_j q_ij·(s_j·f_j), with the scales outside the sum.
    pub(crate) fn add_displacements(&self, loads: &[(u32, DVec3)], out: &mut [DVec3]) {
        let mut sums = vec![DVec3::ZERO; out.len()];
        for &(node, force) in loads {
            let node = node as usize;
            let scaled = self.scales_of(node) * force;
            let (below, above) = sums.split_at_mut(node);
            // The node's row, whose blocks are transposed, and then its column.
            let row = &self.blocks[9 * lower_block(node, 0)..];
            let (row, _) = row.as_chunks::<9>();
            for (sum, q) in below.iter_mut().zip(row) {
                *sum += transposed_product(q, scaled);
            }
            for (other, sum) in (node..).zip(above) {
                *sum += product_in_triangle(&self.blocks, (other, node), scaled);
            }
        }
        for (node, (u, sum)) in out.iter_mut().zip(sums).enumerate() {
            *u += self.scales_of(node) * sum;
        }
    }

    /// Scales of a node's three degrees of freedom [√(m/N)].
    fn scales_of(&self, node: usize) -> DVec3 {
        let s = &self.scales[3 * node..3 * node + 3];
        DVec3::new(f64::from(s[0]), f64::from(s[1]), f64::from(s[2]))
    }

    /// Whole number q between two degrees of freedom 3·node + axis.
    pub fn entry(&self, i: usize, j: usize) -> i16 {
        let (i, j) = (i.max(j), i.min(j));
        self.blocks[9 * lower_block(i / 3, j / 3) + 3 * (i % 3) + j % 3]
    }

    /// Whole numbers of the lower triangle, entry (i, j ≤ i) at i(i+1)/2 + j.
    fn entries(&self) -> impl Iterator<Item = i16> + '_ {
        let pairs = (0..self.scales.len()).flat_map(|i| (0..=i).map(move |j| (i, j)));
        pairs.map(|(i, j)| self.entry(i, j))
    }

    /// Compressed lower triangle: all low bytes, then all high bytes, of 2·q for q ≥ 0 and −2·q − 1 for q < 0.
    pub(super) fn compressed(&self) -> Vec<u8> {
        let folded = self.entries().map(|q| ((q << 1) ^ (q >> 15)).to_le_bytes());
        let (mut bytes, high): (Vec<u8>, Vec<u8>) = folded.map(|[low, high]| (low, high)).unzip();
        bytes.extend(high);
        compress_to_vec_zlib(&bytes, CompressionLevel::DefaultLevel as u8)
    }

    /// Residual compliance from scales and a compressed lower triangle.
    ///
    /// # Errors
    /// [`RecordingError::Inconsistent`] when the triangle does not fit the scales, or they are too many.
    pub(super) fn from_compressed(scales: Vec<f32>, compressed: &[u8]) -> Result<Self, RecordingError> {
        let fail = |what| Err(RecordingError::Inconsistent { part: RecordingPart::Residual, what });
        let (n, nodes) = (scales.len(), scales.len() / 3);
        if nodes > MAX_QUANTISED_NODES {
            return fail(format!(
                "residual.quantised is that of {nodes} nodes, expected {MAX_QUANTISED_NODES} at most"
            ));
        }
        let count = n * (n + 1) / 2;
        let bytes = decompress_to_vec_zlib_with_limit(compressed, 2 * count).unwrap_or_default();
        if bytes.len() != 2 * count {
            return fail(format!("residual.quantised is damaged, or holds other than {count} numbers"));
        }
        let (low, high) = bytes.split_at(count);
        let entry = |(row, column): (usize, usize)| {
            let (row, column) = (row.max(column), row.min(column));
            let at = row * (row + 1) / 2 + column;
            let folded = u16::from_le_bytes([low[at], high[at]]);
            (folded >> 1) as i16 ^ -((folded & 1) as i16)
        };
        let blocks = (0..nodes).flat_map(|i| (0..=i).map(move |j| (i, j)));
        let places = blocks.flat_map(|(i, j)| (0..9).map(move |at| (3 * i + at / 3, 3 * j + at % 3)));
        let mut quantised = Self { scales, blocks: Vec::with_capacity(9 * nodes * (nodes + 1) / 2) };
        quantised.blocks.extend(places.map(entry));
        Ok(quantised)
    }

    /// Check lengths and scales.
    pub(super) fn validate(&self, nodes: usize) -> Result<(), String> {
        let (scales, blocks) = (3 * nodes, 9 * nodes * (nodes + 1) / 2);
        if self.scales.len() != scales || self.blocks.len() != blocks {
            return Err(format!(
                "residual compliance holds {} scales and {} numbers, {nodes} nodes need {scales} and {blocks}",
                self.scales.len(),
                self.blocks.len()
            ));
        }
        match self.scales.iter().position(|s| !(0.0..=LARGEST_SCALE).contains(s)) {
            Some(at) => Err(format!(
                "residual.scales hold {:e} √(m/N) at {at}, expected 0 to {LARGEST_SCALE:e}",
                self.scales[at]
            )),
            None => Ok(()),
        }
    }
}

/// Upper limit of scales [√(m/N)]: the largest compliance at the largest whole number.
const LARGEST_SCALE: f32 = 5e6;

/// Largest whole number of a mode shape.
const LARGEST_SHAPE_STEPS: f64 = i16::MAX as f64;

/// Step of a mode's shapes [1/√kg]: the smallest power of two with which the largest of them has at most 15 bits.
fn shape_step(largest: f64) -> f64 {
    if largest == 0.0 {
        return 1.0;
    }
    let (_, exponent) = libm::frexp(largest / LARGEST_SHAPE_STEPS);
    let above = libm::ldexp(1.0, exponent);
    if largest / (0.5 * above) <= LARGEST_SHAPE_STEPS { 0.5 * above } else { above }
}

/// Steps of all modes [1/√kg] for mode shapes, row by row.
pub(super) fn shape_steps(shapes: &[f64], modes: usize) -> Vec<f64> {
    let mut largest = alloc::vec![0.0_f64; modes];
    for row in shapes.chunks_exact(modes.max(1)) {
        largest.iter_mut().zip(row).for_each(|(most, shape)| *most = most.max(shape.abs()));
    }
    largest.into_iter().map(shape_step).collect()
}

/// Rounds the shapes of one mode to whole steps of 16 bits.
pub fn round_mode_shape(shapes: &mut [f64]) {
    let step = shape_step(shapes.iter().fold(0.0, |most: f64, shape| most.max(shape.abs())));
    shapes.iter_mut().for_each(|shape| *shape = libm::rint(*shape / step) * step);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_mode_shapes_again_changes_nothing() {
        for largest in [1e-300, 32767.0, 32767.4, 32768.0, 0.1, 1.0, 16383.5, 16384.0, 1e12] {
            let mut shapes = [largest, -0.3 * largest, 0.777 * largest, 0.0];
            let exact = shapes;
            round_mode_shape(&mut shapes);
            let once = shapes;
            round_mode_shape(&mut shapes);
            assert_eq!(once, shapes);
            let [step] = shape_steps(&shapes, 1)[..] else { panic!("one mode") };
            for (rounded, exact) in shapes.iter().zip(exact) {
                let steps = rounded / step;
                assert!(steps == libm::rint(steps) && steps.abs() <= LARGEST_SHAPE_STEPS, "{largest}");
                assert!((rounded - exact).abs() <= 0.5 * step && step <= largest / 16383.5, "{largest}");
            }
        }
    }

    #[test]
    fn compressed_triangles_come_back() {
        let nodes = 7;
        let mut blocks = Vec::new();
        for (i, j) in (0..nodes).flat_map(|i| (0..=i).map(move |j| (i, j))) {
            for (row, column) in (0..9).map(|at| (3 * i + at / 3, 3 * j + at % 3)) {
                let (row, column) = (row.max(column) as i64, row.min(column) as i64);
                blocks.push(((row * 7919 + column * 104_729) % 65_536 - 32_768) as i16);
            }
        }
        let own = QuantisedCompliance { scales: (0..3 * nodes).map(|i| i as f32).collect(), blocks };
        let back = QuantisedCompliance::from_compressed(own.scales.clone(), &own.compressed());
        assert_eq!(back.expect("it fits"), own);
        let other = QuantisedCompliance::from_compressed(own.scales[..18].to_vec(), &own.compressed());
        let error = alloc::format!("{}", other.expect_err("other scales"));
        assert!(error.contains("holds other than 171 numbers"), "{error}");
    }
}
