//! Residual compliance S = G − Φ·Λ⁻¹·Φᵀ on the touchable (surface) degrees of freedom.
//!
//! Column by column from the factor, in blocks. Stored in f32: rounding moves an entry by at most 2⁻²⁴ of
//! itself, so each diagonal entry is raised by 2⁻²⁴ of its row's absolute sum, which keeps S positive
//! semi-definite (Gershgorin) and changes it by less than a millionth.
//!
//! Equations: docs/theory.md (C4).

use crate::kernels::avx_section;
use crate::modes::ElasticModes;
use crate::progress::Progress;
use crate::quantise::quantised;
use crate::solve_error::SolveError;
use crate::system::System;
use faer::Mat;
use glam::DVec3;
use palpate::{GravityResponse, MAX_QUANTISED_NODES, NearField, ResidualCompliance};
use rayon::prelude::*;

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

/// Columns that one thread solves together.
const COLUMNS_PER_SOLVE: usize = 48;

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

/// Columns of S at the surface for a range of touchable degrees of freedom: columns[j][i] = S_ij.
fn columns(
    system: &System,
    modes: &ElasticModes,
    surface_nodes: &[u32],
    range: std::ops::Range<usize>,
) -> Vec<Vec<f64>> {
    let n = system.discretisation.dofs();
    let mut loads = Mat::zeros(n, range.len());
    for (column, touchable) in range.clone().enumerate() {
        loads[(dof(surface_nodes, touchable), column)] = 1.0;
    }
    let gains = Mat::from_fn(modes.squares.len(), range.len(), |i, column| {
        modes.shapes[(dof(surface_nodes, range.start + column), i)]
    });
    let solved = truncated_displacements(system, modes, loads, &gains);
    let at_surface = |column: usize| {
        (0..3 * surface_nodes.len()).map(|row| solved[(dof(surface_nodes, row), column)]).collect()
    };
    (0..range.len()).map(at_surface).collect()
}

/// Visits every column of S once, a block per thread at a time.
fn for_each_column(
    system: &System,
    modes: &ElasticModes,
    surface_nodes: &[u32],
    progress: &mut dyn Progress,
    mut visit: impl FnMut(usize, &[f64]),
) -> Result<(), SolveError> {
    let touchable = 3 * surface_nodes.len();
    progress.begin("residual compliance", touchable as u64);
    let starts: Vec<usize> = (0..touchable).step_by(COLUMNS_PER_SOLVE).collect();
    for batch in starts.chunks(rayon::current_num_threads()) {
        if progress.is_interrupted() {
            return Err(SolveError::Interrupted);
        }
        let solved: Vec<_> = batch
            .par_iter()
            .map(|&start| {
                let range = start..(start + COLUMNS_PER_SOLVE).min(touchable);
                avx_section(|| columns(system, modes, surface_nodes, range))
            })
            .collect();
        for (&start, block) in batch.iter().zip(&solved) {
            block.iter().enumerate().for_each(|(at, column)| visit(start + at, column));
            progress.advance(block.len() as u64);
        }
    }
    Ok(())
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

/// Node blocks of the lower triangle, nine numbers each [m/N].
fn lower_blocks(
    system: &System,
    modes: &ElasticModes,
    surface_nodes: &[u32],
    progress: &mut dyn Progress,
) -> Result<Vec<f32>, SolveError> {
    let nodes = surface_nodes.len();
    let mut blocks = vec![0.0_f32; 9 * nodes * (nodes + 1) / 2];
    // Both triangles of the blocks on the diagonal.
    let mut set = |i: usize, j: usize, value: f64| {
        let first = 9 * (i / 3 * (i / 3 + 1) / 2 + j / 3);
        blocks[first + 3 * (i % 3) + j % 3] = value as f32;
        if i / 3 == j / 3 {
            blocks[first + 3 * (j % 3) + i % 3] = value as f32;
        }
    };
    for_each_column(system, modes, surface_nodes, progress, |j, column| {
        column.iter().enumerate().skip(j + 1).for_each(|(i, &value)| set(i, j, value));
        let raised = column[j].max(0.0) + F32_ROUNDING * column.iter().map(|v| v.abs()).sum::<f64>();
        set(j, j, raised);
    })?;
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
    let mut near = NearField { radius, offsets: vec![0], nodes: Vec::new(), blocks: Vec::new() };
    // S is symmetric: column j is row j. Blocks above the diagonal are copied from below at the end, so
    // that both triangles are the same numbers.
    for_each_column(system, modes, surface_nodes, progress, |j, column| {
        let (node, axis) = (j / 3, j % 3);
        if axis == 0 {
            let within = (0..positions.len()).filter(|&i| (positions[i] - positions[node]).length() < radius);
            near.nodes.extend(within.map(|i| i as u32));
            near.blocks.resize(9 * near.nodes.len(), 0.0);
            near.offsets.push(near.nodes.len() as u32);
        }
        let row = near.offsets[node] as usize..near.nodes.len();
        let mut sum = 0.0;
        for at in row.clone() {
            let other = near.nodes[at] as usize;
            let taper = NearField::taper((positions[other] - positions[node]).length() / radius);
            for part in 0..3 {
                let value = column[3 * other + part] * taper;
                near.blocks[9 * at + 3 * axis + part] = value as f32;
                sum += value.abs();
            }
        }
        if let Some(own) = row.into_iter().find(|&at| near.nodes[at] as usize == node) {
            near.blocks[9 * own + 4 * axis] = (column[j].max(0.0) + F32_ROUNDING * sum) as f32;
        }
    })?;
    for node in 0..positions.len() {
        for at in near.offsets[node] as usize..near.offsets[node + 1] as usize {
            let other = near.nodes[at] as usize;
            let row = near.offsets[other] as usize..near.offsets[other + 1] as usize;
            if other > node {
                continue;
            }
            if let Ok(mirror) = near.nodes[row.clone()].binary_search(&(node as u32)) {
                for (a, b) in (0..3).flat_map(|a| (0..3).map(move |b| (a, b))) {
                    if other < node || a > b {
                        near.blocks[9 * (row.start + mirror) + 3 * b + a] = near.blocks[9 * at + 3 * a + b];
                    }
                }
            }
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
