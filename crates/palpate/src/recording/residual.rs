//! Residual compliance S: static compliance of the modes that are not kept.
//!
//! S = G − Φ·Λ⁻¹·Φᵀ on the surface [m/N], symmetric and positive semi-definite. Whole for small surfaces, in single precision or
//! [quantised](super::quantised); for large ones its near field
//! S ∘ ψ(|xᵢ − xⱼ|/r), with Wendland's function ψ(s) = (1 − s)⁴(4s + 1) for s < 1, 0 beyond. ψ
//! is positive definite in space, so by Schur's product theorem the near field is positive
//! semi-definite too, and its diagonal is exact (Wendland 1995, Adv. Comput. Math. 4, 389).

use super::LARGEST;
use super::quantised::QuantisedCompliance;
use crate::error::{RecordingError, RecordingPart};
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use glam::{DMat3, DVec3};

/// Residual compliance between surface nodes.
#[derive(Debug, Clone, PartialEq)]
pub enum ResidualCompliance {
    /// Neglected: forces are then wrong by up to several times. For comparison only.
    None,
    /// Node blocks of the lower triangle, block (i, j ≤ i) at i(i+1)/2 + j, nine numbers each, row by row [m/N].
    Whole(Vec<f32>),
    /// Node blocks of the lower triangle as whole numbers of 16 bits.
    Quantised(QuantisedCompliance),
    /// Node blocks near the diagonal.
    NearField(NearField),
}

/// Node blocks of S within a cut-off radius, both triangles.
#[derive(Debug, Clone, PartialEq)]
pub struct NearField {
    /// Cut-off radius r [m].
    pub radius: f64,
    /// Index of each node's first block; length nodes + 1.
    pub offsets: Vec<u32>,
    /// Column node of each block, ascending within a row.
    pub nodes: Vec<u32>,
    /// Nine numbers per block [m/N], row by row.
    pub blocks: Vec<f32>,
}

impl ResidualCompliance {
    /// Block S_ij [m/N]: displacement of node i per force on node j.
    ///
    /// # Real time
    pub fn block(&self, i: usize, j: usize) -> DMat3 {
        match self {
            Self::None => DMat3::ZERO,
            Self::Whole(blocks) => {
                let block = block_at(blocks, lower_block(i.max(j), i.min(j)));
                if i >= j { block } else { block.transpose() }
            }
            Self::Quantised(quantised) => {
                let block = quantised.lower_block(i.max(j), i.min(j));
                if i >= j { block } else { block.transpose() }
            }
            Self::NearField(near) => {
                let row = near.offsets[i] as usize..near.offsets[i + 1] as usize;
                match near.nodes[row.clone()].binary_search(&(j as u32)) {
                    Ok(position) => near.block(row.start + position),
                    Err(_) => DMat3::ZERO,
                }
            }
        }
    }

    /// Displacement of a node under nodal forces [N]: Σ_j S_ij·f_j [m].
    ///
    /// # Real time
    /// Costs the forces.
    pub(crate) fn displacement(&self, node: usize, loads: &[(u32, DVec3)]) -> DVec3 {
        match self {
            Self::None => DVec3::ZERO,
            Self::Whole(blocks) => {
                let of = |&(other, force): &(u32, DVec3)| {
                    product_in_triangle(blocks, (node, other as usize), force)
                };
                loads.iter().map(of).sum()
            }
            Self::Quantised(quantised) => quantised.displacement(node, loads),
            Self::NearField(_) => {
                loads.iter().map(|&(other, force)| self.block(node, other as usize) * force).sum()
            }
        }
    }

    /// Whether every pair of nodes has a block.
    pub(crate) fn is_whole(&self) -> bool {
        matches!(self, Self::Whole(_) | Self::Quantised(_))
    }

    /// Trace of a block [m/N].
    pub(crate) fn trace(&self, i: usize, j: usize) -> f64 {
        match self {
            Self::Whole(blocks) => {
                let first = 9 * lower_block(i.max(j), i.min(j));
                (0..3).map(|axis| f64::from(blocks[first + 4 * axis])).sum()
            }
            _ => self.block(i, j).diagonal().element_sum(),
        }
    }

    /// Add the displacements of all nodes under nodal forces [N] to `out` [m]. Costs nodes × forces, or for a near field the blocks of the
    /// loaded nodes.
    pub(crate) fn add_displacements(&self, loads: &[(u32, DVec3)], out: &mut [DVec3]) {
        let loads_of_nodes = loads.iter().map(|&(node, force)| (node as usize, force));
        match self {
            Self::Quantised(quantised) => quantised.add_displacements(loads, out),
            // S is symmetric: the blocks of a column are those of the row, transposed.
            Self::NearField(near) => loads_of_nodes.for_each(|(node, force)| {
                near.row(node).for_each(|(other, block)| out[other] += block.transpose() * force);
            }),
            _ => loads_of_nodes.for_each(|(node, force)| {
                out.iter_mut().enumerate().for_each(|(i, u)| *u += self.block(i, node) * force);
            }),
        }
    }

    /// Whole S between a number of nodes from its lower triangle, entry (i, j ≤ i) at i(i+1)/2 + j [m/N], as files hold it.
    ///
    /// # Errors
    /// [`RecordingError::Inconsistent`] when the entries are not that many.
    pub fn from_lower_triangle(nodes: usize, entries: &[f32]) -> Result<Self, RecordingError> {
        let needed = 3 * nodes * (3 * nodes + 1) / 2;
        if entries.len() != needed {
            let what =
                format!("residual compliance holds {} numbers, {nodes} nodes need {needed}", entries.len());
            return Err(RecordingError::Inconsistent { part: RecordingPart::Residual, what });
        }
        let mut blocks = Vec::with_capacity(9 * nodes * (nodes + 1) / 2);
        for (i, j) in (0..nodes).flat_map(|i| (0..=i).map(move |j| (i, j))) {
            for (row, column) in (0..9).map(|at| (3 * i + at / 3, 3 * j + at % 3)) {
                let (row, column) = (row.max(column), row.min(column));
                blocks.push(entries[row * (row + 1) / 2 + column]);
            }
        }
        Ok(Self::Whole(blocks))
    }

    /// Check lengths, indices, finite numbers and symmetry.
    pub(super) fn validate(&self, nodes: usize) -> Result<(), RecordingError> {
        let fail = |what| Err(RecordingError::Inconsistent { part: RecordingPart::Residual, what });
        let (name, values): (_, &[f32]) = match self {
            Self::None => return Ok(()),
            Self::Whole(blocks) => {
                let needed = 9 * nodes * (nodes + 1) / 2;
                if blocks.len() != needed {
                    return fail(format!(
                        "residual compliance holds {} numbers, {nodes} nodes need {needed}",
                        blocks.len()
                    ));
                }
                ("residual.packed", blocks)
            }
            Self::Quantised(quantised) => {
                quantised.validate(nodes).or_else(fail)?;
                ("residual.scales", &quantised.scales)
            }
            Self::NearField(near) => {
                near.validate(nodes).or_else(fail)?;
                ("residual.blocks", &near.blocks)
            }
        };
        if let Some(at) = values.iter().position(|v| v.is_nan() || f64::from(v.abs()) >= LARGEST) {
            return fail(format!(
                "{name} holds {:e} m/N at {at}, expected numbers below {LARGEST:e}",
                values[at]
            ));
        }
        for node in 0..nodes {
            let block = self.block(node, node);
            if block != block.transpose() {
                return fail(format!("residual compliance of surface node {node} is not symmetric"));
            }
            if (0..3).any(|axis| block.col(axis)[axis] < 0.0) {
                return fail(format!("residual compliance of surface node {node} is negative"));
            }
        }
        Ok(())
    }
}

impl NearField {
    /// Blocks of a node's row, with their column nodes.
    pub(crate) fn row(&self, node: usize) -> impl Iterator<Item = (usize, DMat3)> + '_ {
        let range = self.offsets[node] as usize..self.offsets[node + 1] as usize;
        range.map(|at| (self.nodes[at] as usize, self.block(at)))
    }

    /// Column nodes of each row; valid after the check of the offsets.
    fn rows(&self) -> impl Iterator<Item = &[u32]> {
        self.offsets.windows(2).map(|pair| &self.nodes[pair[0] as usize..pair[1] as usize])
    }

    fn block(&self, at: usize) -> DMat3 {
        block_at(&self.blocks, at)
    }

    /// Check lengths and indices, and that every block has its transpose on the other side of the diagonal.
    fn validate(&self, nodes: usize) -> Result<(), String> {
        let blocks = self.nodes.len();
        if !(self.radius > 0.0 && self.radius < LARGEST) {
            return Err(format!(
                "residual.radius is {:e} m, expected above 0 and below {LARGEST:e}",
                self.radius
            ));
        }
        if self.offsets.len() != nodes + 1
            || self.offsets[0] != 0
            || self.offsets[nodes] as usize != blocks
            || !self.offsets.is_sorted()
        {
            return Err(format!("residual.offsets do not divide {blocks} blocks between {nodes} nodes"));
        }
        if self.blocks.len() != 9 * blocks {
            return Err(format!(
                "residual.blocks hold {} numbers, expected {}",
                self.blocks.len(),
                9 * blocks
            ));
        }
        if let Some(node) = self.nodes.iter().find(|node| **node as usize >= nodes) {
            return Err(format!("residual.nodes name node {node}, beyond the surface's {nodes} nodes"));
        }
        if let Some(node) = self.rows().position(|row| !row.is_sorted_by(|a, b| a < b)) {
            return Err(format!("residual.nodes of surface node {node} do not ascend"));
        }
        for (i, row) in self.rows().enumerate() {
            for (at, j) in (self.offsets[i] as usize..).zip(row.iter().map(|&j| j as usize)) {
                let mirrored = self.rows_of(j).binary_search(&(i as u32));
                let mirrored = mirrored.ok().map(|position| self.block(self.offsets[j] as usize + position));
                let own = self.block(at);
                if !own.is_nan() && mirrored != Some(own.transpose()) {
                    return Err(format!(
                        "residual compliance of the surface nodes {i} and {j} is not symmetric"
                    ));
                }
            }
        }
        Ok(())
    }

    fn rows_of(&self, node: usize) -> &[u32] {
        &self.nodes[self.offsets[node] as usize..self.offsets[node + 1] as usize]
    }

    /// Wendland's function ψ at the ratio s ≥ 0 of distance and radius [1].
    pub fn taper(s: f64) -> f64 {
        if s >= 1.0 {
            return 0.0;
        }
        let square = (1.0 - s) * (1.0 - s);
        square * square * (4.0 * s + 1.0)
    }
}

/// Number of the block (i, j ≤ i) in a lower triangle.
pub(super) fn lower_block(i: usize, j: usize) -> usize {
    i * (i + 1) / 2 + j
}

/// Lower triangle of whole blocks, entry (i, j ≤ i) at i(i+1)/2 + j.
pub(super) fn lower_triangle(blocks: &[f32]) -> Vec<f32> {
    let mut entries = Vec::with_capacity(blocks.len());
    let mut row = 0;
    while 9 * lower_block(row / 3, 0) < blocks.len() {
        let of = |column: usize| blocks[9 * lower_block(row / 3, column / 3) + 3 * (row % 3) + column % 3];
        entries.extend((0..=row).map(of));
        row += 1;
    }
    entries
}

/// Block of a list of blocks, each row by row.
pub(crate) fn block_at(blocks: &[f32], at: usize) -> DMat3 {
    let b = &blocks[9 * at..9 * at + 9];
    let row = |r: usize| DVec3::new(f64::from(b[3 * r]), f64::from(b[3 * r + 1]), f64::from(b[3 * r + 2]));
    DMat3::from_cols(row(0), row(1), row(2)).transpose()
}

/// Product of the node block (i, j) of a symmetric matrix, whose lower triangle is given, and a vector.
///
/// # Real time
pub(super) fn product_in_triangle<X: Copy + Into<f64>>(
    lower: &[X],
    (i, j): (usize, usize),
    v: DVec3,
) -> DVec3 {
    let first = 9 * lower_block(i.max(j), i.min(j));
    match lower[first..].first_chunk() {
        Some(block) if i < j => transposed_product(block, v),
        Some(block) => product(block, v),
        None => DVec3::ZERO,
    }
}

/// Product of a node block, given row by row, and a vector.
fn product<X: Copy + Into<f64>>(block: &[X; 9], v: DVec3) -> DVec3 {
    let [a, b, c, d, e, f, g, h, i] = block.map(X::into);
    DVec3::new(a * v.x + b * v.y + c * v.z, d * v.x + e * v.y + f * v.z, g * v.x + h * v.y + i * v.z)
}

/// Product of the transpose of a node block and a vector.
pub(super) fn transposed_product<X: Copy + Into<f64>>(block: &[X; 9], v: DVec3) -> DVec3 {
    let [a, b, c, d, e, f, g, h, i] = block.map(X::into);
    DVec3::new(a * v.x + d * v.y + g * v.z, b * v.x + e * v.y + h * v.z, c * v.x + f * v.y + i * v.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::Recording;
    use alloc::vec;

    #[test]
    fn displacements_are_the_sums_of_blocks() {
        let bytes = include_bytes!("../../../../data/recordings/v1/free.palp");
        let recording = Recording::from_bytes(bytes).expect("a released recording");
        let (whole, n) = (recording.residual, recording.surface.positions.len());
        // A near field of rows of blocks without every third one.
        let kept = |i: usize, j: usize| (i + j) % 3 != 1;
        let mut near = NearField { radius: 1.0, offsets: vec![0], nodes: Vec::new(), blocks: Vec::new() };
        for i in 0..n {
            for j in (0..n).filter(|&j| kept(i, j)) {
                near.nodes.push(j as u32);
                let block = whole.block(i, j);
                near.blocks.extend((0..3).flat_map(|row| block.row(row).to_array()).map(|x| x as f32));
            }
            near.offsets.push(near.nodes.len() as u32);
        }
        let loads =
            [(0, DVec3::X), (5, DVec3::new(0.3, -1.0, 2.0)), (n as u32 - 1, DVec3::new(-1.0, 0.5, 0.1))];
        let scales = (0..3 * n).map(|dof| 1e-3 * (1.0 + dof as f32)).collect();
        let numbers = (0..9 * n * (n + 1) / 2).map(|at| (at * 7919 % 65_536) as u16 as i16).collect();
        let quantised = ResidualCompliance::Quantised(QuantisedCompliance { scales, blocks: numbers });
        for residual in [whole, quantised, ResidualCompliance::NearField(near), ResidualCompliance::None] {
            let mut out = vec![DVec3::Y; n];
            residual.add_displacements(&loads, &mut out);
            for (i, u) in out.into_iter().enumerate() {
                let sum: DVec3 = loads.iter().map(|&(j, f)| residual.block(i, j as usize) * f).sum();
                let near = |u: DVec3| (u - sum).length() < 1e-14 * (1.0 + sum.length());
                assert!(near(u - DVec3::Y) && near(residual.displacement(i, &loads)), "{i}: {u} {sum}");
            }
        }
    }
}
