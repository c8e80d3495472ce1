//! The paper's cube as it is measured.

use crate::error::ReproduceError;
use glam::DVec3;
use palpate::{ColumnsInMemory, Damping, ImpulseResponse, Sampling};
use palpate_fem::table::{COLUMN_BLOCK, TableMethod, TableParameters, TableRecorder};
use palpate_fem::{Progress, RecordExtent, RecordParameters, RecordedBody, paper_cube};

/// The paper's cube with a number of cells along each side, without certificate.
pub fn cube(cells: u32, modes: usize, progress: &mut dyn Progress) -> Result<RecordedBody, ReproduceError> {
    damped_cube(cells, modes, paper_cube::DAMPING, progress)
}

/// The cube with another damping.
pub fn damped_cube(
    cells: u32,
    modes: usize,
    damping: Damping,
    progress: &mut dyn Progress,
) -> Result<RecordedBody, ReproduceError> {
    let extent = RecordExtent::NoCertificate;
    let parameters = RecordParameters { damping, extent, ..paper_cube::parameters(cells, modes) };
    Ok(RecordedBody::new(paper_cube::mesh(cells)?, &parameters, progress)?)
}

/// Positions of the surface nodes [m], and triangles of their numbers among them.
pub fn surface_mesh(body: &RecordedBody) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let surface = body.surface_nodes();
    let mut number = vec![0_u32; body.nodes().len()];
    surface.iter().enumerate().for_each(|(at, &node)| number[node as usize] = at as u32);
    let triangles = body.surface_triangles().iter().map(|t| t.map(|node| number[node as usize]));
    (surface.iter().map(|&node| body.nodes()[node as usize]).collect(), triangles.collect())
}

/// A table in closed form of a free body, end of step, in memory; `change` maps every number of it.
pub fn table_in_memory(
    body: &RecordedBody,
    step_s: f64,
    samples: usize,
    touchable_nodes: Vec<u32>,
    change: impl Fn(f64) -> f64,
) -> Result<ImpulseResponse, ReproduceError> {
    let parameters = TableParameters {
        step_s,
        samples,
        sampling: Sampling::End,
        method: TableMethod::ClosedForm,
        touchable_nodes,
        observed_nodes: body.surface_nodes(),
    };
    let recorder = TableRecorder::new(body, &parameters)?;
    let touchable_dofs = recorder.touchable_dofs();
    let columns = recorder.columns(0..touchable_dofs.len(), COLUMN_BLOCK, &|_| {});
    let values: Vec<f64> = columns.into_iter().flatten().map(change).collect();
    Ok(ImpulseResponse {
        step_s,
        samples,
        sampling: Sampling::End,
        touchable_dofs,
        observed_dofs: recorder.observed_dofs(),
        gravity: None,
        columns: Box::new(ColumnsInMemory::new(&values, recorder.column_length(), parameters.samples)),
    })
}
