//! Residual compliance S = G − Φ·Λ⁻¹·Φᵀ on the touchable (surface) degrees of freedom.
//!
//! Of G the entries between touchable nodes alone are computed, in blocks. Stored in f32: rounding moves an entry by at most 2⁻²⁴ of
//! itself, so each diagonal entry is raised by 2⁻²⁴ of its row's absolute sum, which keeps S positive
//! semi-definite (Gershgorin) and changes it by less than a millionth.
//!
//! Equations: docs/theory.md (C4), (C91).

use crate::kernels::multiply;
use crate::modes::ElasticModes;
use crate::progress::Progress;
use crate::quantise::quantised;
use crate::selected_inverse::SelectedInverse;
use crate::solve_error::SolveError;
use crate::system::{SelectedCompliance, System};
use faer::{Accum, Mat};
use glam::{DMat3, DVec3};
use palpate::{GravityResponse, MAX_QUANTISED_NODES, NearField, ResidualCompliance};
use rayon::prelude::*;
use std::ops::Range;

/// Part of the residual compliance that a recording keeps.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum ResidualChoice {
    /// The whole matrix up to 12,000 touchable degrees of freedom (288 MB), the near field beyond.
    #[default]
    Automatic,
    /// The whole matrix: 2·n² bytes for n touchable degrees of freedom.
    Whole,
    /// Entries between nodes within a radius [m], tapered.
    NearField(f64),
    /// Nothing: the modes alone.
    None,
}

/// Precision of the numbers that a recording keeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Precision {
    /// Mode shapes of 64 bits, residual compliance of 32 bits.
    #[default]
    Full,
    /// Mode shapes and whole residual compliance of 16 bits; files are four to five times smaller.
    Compact,
}

/// Touchable degrees of freedom up to which S is kept whole: 288 MB.
const WHOLE_UP_TO: usize = 12_000;

/// Radius of the automatic near field in mean edges of the surface. By 4 cells S has fallen below 5 % of its
/// diagonal; the taper keeps 94 % of an entry one edge away.
const NEAR_EDGES: f64 = 12.0;

/// Nodes whose three columns one thread solves together.
const NODES_PER_SOLVE: usize = 32;

/// Largest relative rounding error of f32.
const F32_ROUNDING: f64 = 1.0 / (1_u64 << 24) as f64;

/// Residual compliance S [m/N] on the surface nodes, given by their numbers in the discretisation.
///
/// # Errors
/// [`SolveError::Interrupted`].
pub fn residual_compliance(
    system: &System,
    modes: &ElasticModes,
    surface_nodes: &[u32],
    mean_edge: f64,
    choice: ResidualChoice,
    precision: Precision,
    progress: &mut dyn Progress,
) -> Result<ResidualCompliance, SolveError> {
    match choice {
        ResidualChoice::None => Ok(ResidualCompliance::None),
        ResidualChoice::Automatic => match automatic_radius(surface_nodes.len(), || mean_edge) {
            Some(radius) => near_field(system, modes, surface_nodes, radius, progress),
            None => whole(system, modes, surface_nodes, precision, progress),
        },
        ResidualChoice::NearField(radius) => near_field(system, modes, surface_nodes, radius, progress),
        ResidualChoice::Whole => whole(system, modes, surface_nodes, precision, progress),
    }
}

/// Radius [m] of the automatic near field for so many surface nodes and a mean edge [m]; none where S is kept whole.
pub(crate) fn automatic_radius(surface_nodes: usize, mean_edge: impl FnOnce() -> f64) -> Option<f64> {
    (3 * surface_nodes > WHOLE_UP_TO).then(|| NEAR_EDGES * mean_edge())
}

/// Degree of freedom of the system for a touchable degree of freedom of the surface.
fn dof(surface_nodes: &[u32], touchable: usize) -> usize {
    3 * surface_nodes[touchable / 3] as usize + touchable % 3
}

/// Static displacements of the truncated modes [m] under loads B [N], (G − Φ·Λ⁻¹·Φᵀ)·B; `gains` is Φᵀ·B.
pub(crate) fn truncated_displacements(
    system: &System,
    modes: &ElasticModes,
    loads: Mat<f64>,
    gains: &Mat<f64>,
) -> Mat<f64> {
    let amplitudes = Mat::from_fn(gains.nrows(), gains.ncols(), |i, j| gains[(i, j)] / modes.squares[i]);
    system.elastic_compliance(loads) - &modes.shapes * amplitudes
}

/// S between the touchable nodes, block by block.
struct SurfaceResidual<'a> {
    surface_nodes: &'a [u32],
    inverse: SelectedInverse<'a>,
    /// S is the inverse less left·rightᵀ, which have a row per touchable degree of freedom: rigid motions and kept modes.
    left: Mat<f64>,
    right: Mat<f64>,
    /// Touchable nodes in the order in which the factor eliminates them, so that those of a block share most of their paths.
    order: Vec<u32>,
}

/// S between two touchable nodes [m/N]: that of a row and that of a load, whose axes are rows and columns.
struct NodeBlock {
    row: usize,
    load: usize,
    entries: DMat3,
}

impl<'a> SurfaceResidual<'a> {
    fn new(system: &'a System, modes: &ElasticModes, surface_nodes: &'a [u32]) -> Self {
        let SelectedCompliance { inverse, left, right } = system.selected_compliance();
        let (count, rigid) = (modes.squares.len(), left.ncols());
        let beside = |mode: &dyn Fn(usize, usize) -> f64, rest: &Mat<f64>| {
            Mat::from_fn(3 * surface_nodes.len(), count + rigid, |touchable, j| {
                let dof = dof(surface_nodes, touchable);
                if j < count { mode(dof, j) } else { rest[(dof, j - count)] }
            })
        };
        let left = beside(&|dof, j| modes.shapes[(dof, j)] / modes.squares[j], &left);
        let right = beside(&|dof, j| modes.shapes[(dof, j)], &right);
        let mut order: Vec<u32> = (0..surface_nodes.len() as u32).collect();
        order.sort_by_key(|&node| inverse.place(dof(surface_nodes, 3 * node as usize)));
        Self { surface_nodes, inverse, left, right, order }
    }

    /// Blocks between a part of the order and the nodes that it wants, from the first of the part on.
    fn blocks(&self, part: Range<usize>, is_wanted: impl Fn(usize, usize) -> bool) -> Vec<NodeBlock> {
        let own = &self.order[part.clone()];
        let is_near = |row: &u32| own.iter().any(|&load| is_wanted(*row as usize, load as usize));
        let rows: Vec<u32> = self.order[part.start..].iter().copied().filter(is_near).collect();
        let touchable = |nodes: &[u32]| -> Vec<usize> {
            nodes.iter().flat_map(|&node| (0..3).map(move |axis| 3 * node as usize + axis)).collect()
        };
        let (loads_at, rows_at) = (touchable(own), touchable(&rows));
        let dofs =
            |at: &[usize]| -> Vec<usize> { at.iter().map(|&at| dof(self.surface_nodes, at)).collect() };
        let mut entries = self.inverse.block(&dofs(&loads_at), &dofs(&rows_at));
        let of =
            |side: &Mat<f64>, at: &[usize]| Mat::from_fn(at.len(), side.ncols(), |i, j| side[(at[i], j)]);
        let (right, left) = (of(&self.right, &loads_at), of(&self.left, &rows_at));
        multiply(entries.as_mut(), Accum::Add, right.as_ref(), left.transpose(), -1.0);
        let block = |(i, j): (usize, usize)| {
            let columns = [0, 1, 2].map(|b| [0, 1, 2].map(|a| entries[(3 * j + b, 3 * i + a)]));
            let entries = DMat3::from_cols_array_2d(&columns);
            let (row, load) = (rows[i] as usize, own[j] as usize);
            let symmetric = if row == load { (entries + entries.transpose()) * 0.5 } else { entries };
            NodeBlock { row, load, entries: symmetric }
        };
        // The first rows are the part itself: of its pairs, those of a row that comes before the load are the others mirrored.
        let pairs = (0..rows.len()).flat_map(|i| (0..own.len().min(i + 1)).map(move |j| (i, j)));
        pairs.map(block).filter(|block| is_wanted(block.row, block.load)).collect()
    }

    /// Visits the block of every wanted pair of nodes once, a part of the order per thread at a time.
    fn for_each_block(
        &self,
        is_wanted: impl Fn(usize, usize) -> bool + Sync,
        progress: &mut dyn Progress,
        mut visit: impl FnMut(NodeBlock),
    ) -> Result<(), SolveError> {
        progress.begin("residual compliance", 3 * self.order.len() as u64);
        let starts: Vec<usize> = (0..self.order.len()).step_by(NODES_PER_SOLVE).collect();
        for batch in starts.chunks(rayon::current_num_threads()) {
            if progress.is_interrupted() {
                return Err(SolveError::Interrupted);
            }
            let part = |start: usize| start..(start + NODES_PER_SOLVE).min(self.order.len());
            let solved: Vec<_> =
                batch.par_iter().map(|&start| self.blocks(part(start), &is_wanted)).collect();
            for (&start, blocks) in batch.iter().zip(solved) {
                blocks.into_iter().for_each(&mut visit);
                progress.advance(3 * part(start).len() as u64);
            }
        }
        Ok(())
    }
}

/// Diagonal of S [m/N], raised by what rounding to f32 moves the entries of its rows by.
struct RaisedDiagonal {
    own: Vec<f64>,
    sums: Vec<f64>,
}

impl RaisedDiagonal {
    fn new(nodes: usize) -> Self {
        Self { own: vec![0.0; 3 * nodes], sums: vec![0.0; 3 * nodes] }
    }

    fn add(&mut self, block: &NodeBlock) {
        for (a, b) in (0..3).flat_map(|a| (0..3).map(move |b| (a, b))) {
            let value = block.entries.col(b)[a];
            self.sums[3 * block.row + a] += value.abs();
            if block.row != block.load {
                self.sums[3 * block.load + b] += value.abs();
            } else if a == b {
                self.own[3 * block.row + a] = value;
            }
        }
    }

    /// Raised entry of a degree of freedom.
    fn raised(&self, dof: usize) -> f32 {
        (self.own[dof].max(0.0) + F32_ROUNDING * self.sums[dof]) as f32
    }
}

/// Whole S; quantised where it is compact and not too large.
fn whole(
    system: &System,
    modes: &ElasticModes,
    surface_nodes: &[u32],
    precision: Precision,
    progress: &mut dyn Progress,
) -> Result<ResidualCompliance, SolveError> {
    let blocks = lower_blocks(system, modes, surface_nodes, progress)?;
    Ok(match precision {
        Precision::Compact if surface_nodes.len() <= MAX_QUANTISED_NODES => {
            ResidualCompliance::Quantised(quantised(&blocks, surface_nodes.len()))
        }
        _ => ResidualCompliance::Whole(blocks),
    })
}

/// Entries of a block, row by row.
fn by_rows(entries: DMat3) -> [f32; 9] {
    entries.transpose().to_cols_array().map(|entry| entry as f32)
}

/// Node blocks of the lower triangle, nine numbers each [m/N].
fn lower_blocks(
    system: &System,
    modes: &ElasticModes,
    surface_nodes: &[u32],
    progress: &mut dyn Progress,
) -> Result<Vec<f32>, SolveError> {
    let nodes = surface_nodes.len();
    let first = |row: usize, column: usize| 9 * (row * (row + 1) / 2 + column);
    let mut blocks = vec![0.0_f32; first(nodes, 0)];
    let mut diagonal = RaisedDiagonal::new(nodes);
    let residual = SurfaceResidual::new(system, modes, surface_nodes);
    residual.for_each_block(
        |_, _| true,
        progress,
        |block| {
            diagonal.add(&block);
            let NodeBlock { row, load, entries } = block;
            let lower = if row >= load { entries } else { entries.transpose() };
            blocks[first(row.max(load), row.min(load))..][..9].copy_from_slice(&by_rows(lower));
        },
    )?;
    for (node, axis) in (0..nodes).flat_map(|node| (0..3).map(move |axis| (node, axis))) {
        blocks[first(node, node) + 4 * axis] = diagonal.raised(3 * node + axis);
    }
    Ok(blocks)
}

fn near_field(
    system: &System,
    modes: &ElasticModes,
    surface_nodes: &[u32],
    radius: f64,
    progress: &mut dyn Progress,
) -> Result<ResidualCompliance, SolveError> {
    let positions: Vec<DVec3> =
        surface_nodes.iter().map(|&node| system.discretisation.nodes[node as usize]).collect();
    let distance = |a: usize, b: usize| (positions[a] - positions[b]).length();
    let is_near = |a: usize, b: usize| distance(a, b) < radius;
    let mut near = NearField { radius, offsets: vec![0], nodes: Vec::new(), blocks: Vec::new() };
    for node in 0..positions.len() {
        near.nodes
            .extend((0..positions.len()).filter(|&other| is_near(node, other)).map(|other| other as u32));
        near.offsets.push(near.nodes.len() as u32);
    }
    near.blocks.resize(9 * near.nodes.len(), 0.0);
    let NearField { offsets, nodes, blocks, .. } = &mut near;
    let place = |row: usize, column: usize| {
        let own = offsets[row] as usize..offsets[row + 1] as usize;
        nodes[own.clone()].binary_search(&(column as u32)).ok().map(|at| 9 * (own.start + at))
    };
    let mut diagonal = RaisedDiagonal::new(positions.len());
    let residual = SurfaceResidual::new(system, modes, surface_nodes);
    residual.for_each_block(is_near, progress, |NodeBlock { row, load, entries }| {
        let entries = entries * NearField::taper(distance(row, load) / radius);
        diagonal.add(&NodeBlock { row, load, entries });
        for (own, other, entries) in [(row, load, entries), (load, row, entries.transpose())] {
            if let Some(first) = place(own, other) {
                blocks[first..][..9].copy_from_slice(&by_rows(entries));
            }
        }
    })?;
    for (node, axis) in (0..positions.len()).flat_map(|node| (0..3).map(move |axis| (node, axis))) {
        if let Some(first) = place(node, node) {
            blocks[first + 4 * axis] = diagonal.raised(3 * node + axis);
        }
    }
    Ok(ResidualCompliance::NearField(near))
}

/// Response of a body with fixed nodes to a uniform unit acceleration: modal forces Φᵀ·M·e and the static
/// displacement (G − Φ·Λ⁻¹·Φᵀ)·M·e of the truncated modes, for the three axes e.
pub fn gravity_response(system: &System, modes: &ElasticModes, surface_nodes: &[u32]) -> GravityResponse {
    let weight = system.uniform_weight();
    let forces = modes.shapes.transpose() * &weight;
    let residual = truncated_displacements(system, modes, weight, &forces);
    GravityResponse {
        modal_forces: (0..3)
            .flat_map(|axis| (0..forces.nrows()).map(move |i| (i, axis)))
            .map(|at| forces[at])
            .collect(),
        residual_displacements: (0..3 * surface_nodes.len())
            .flat_map(|row| (0..3).map(move |axis| (row, axis)))
            .map(|(row, axis)| residual[(dof(surface_nodes, row), axis)])
            .collect(),
    }
}
