//! The paper's table and figures, made again: what `palpate reproduce` measures and writes.

mod agreement;
mod cost;
mod impulses;
mod live;
mod passivity;
mod recording;

use crate::Failure;
use crate::progress::{Bars, WithoutRemarks};
use crate::report::Section;
use crate::verbs::demo::paper_cube;
use palpate::{ColumnsInMemory, ImpulseResponse, Sampling};
use palpate_fem::mesh::box_mesh;
use palpate_fem::progress::Progress;
use palpate_fem::record::{Extent, RecordParameters, Recorded, record};
use palpate_fem::table::{BLOCK, Method, TableParameters, TableRecorder};
use std::fmt::Write;
use std::path::Path;

/// A file of numbers beside the report.
pub struct DataFile {
    /// Its name.
    pub name: String,
    /// Its text.
    pub text: String,
}

/// One part of the report.
pub struct Chapter {
    /// What the page shows.
    pub section: Section,
    /// The numbers behind it.
    pub data: Vec<DataFile>,
}

/// How thorough the measurements are.
#[derive(Debug, Clone, Copy)]
pub struct Effort {
    /// Cells along a side of the cube; the paper's has 12.
    pub cells: u32,
    /// Columns of the table that are timed.
    pub columns: usize,
    /// Steps that are timed per point of a curve.
    pub steps: usize,
}

/// All chapters, in the order of the paper; `folder` is for what a live run needs.
pub fn chapters(effort: Effort, folder: &Path, progress: &mut Bars) -> Result<Vec<Chapter>, Failure> {
    let body = cube(effort.cells, 200, &mut WithoutRemarks(progress))?;
    Ok(vec![
        recording::chapter(&body, effort, progress)?,
        impulses::chapter(&body, progress)?,
        passivity::chapter(&body, progress)?,
        agreement::chapter(progress)?,
        cost::chapter(effort, progress)?,
        live::chapter(&body, &folder.join("live"), progress)?,
    ])
}

/// The paper's cube with so many cells along a side, without certificate.
fn cube(cells: u32, modes: usize, progress: &mut dyn Progress) -> Result<Recorded, Failure> {
    let parameters = RecordParameters { extent: Extent::Uncertified, ..paper_cube(cells, modes) };
    Ok(record(box_mesh([0.1; 3], [cells; 3])?, &parameters, progress)?)
}

/// A table in closed form of a free body, end of step, in memory; `change` is done to every number.
fn table_in_memory(
    body: &Recorded,
    step_s: f64,
    samples: usize,
    touchable_nodes: Vec<u32>,
    change: impl Fn(f64) -> f64,
) -> Result<ImpulseResponse, Failure> {
    let parameters = TableParameters {
        step_s,
        samples,
        sampling: Sampling::End,
        method: Method::ClosedForm,
        touchable_nodes,
        observed_nodes: body.system.discretisation.surface_nodes(),
    };
    let recorder = TableRecorder::new(body, &parameters).map_err(|e| Failure(e.to_string()))?;
    let touchable_dofs = recorder.touchable_dofs();
    let columns = recorder.columns(0..touchable_dofs.len(), BLOCK, &|_| {});
    let values: Vec<f64> = columns.into_iter().flatten().map(change).collect();
    Ok(ImpulseResponse {
        step_s,
        samples,
        sampling: Sampling::End,
        touchable_dofs,
        observed_dofs: recorder.observed_dofs(),
        gravity: None,
        columns: Box::new(ColumnsInMemory::new(&values, recorder.column_length())),
    })
}

/// Lines of comma-separated numbers under a header.
fn csv(name: &str, header: &str, rows: impl Iterator<Item = Vec<f64>>) -> DataFile {
    let mut text = format!("{header}\n");
    for row in rows {
        let numbers: Vec<String> = row.iter().map(f64::to_string).collect();
        let _ = writeln!(text, "{}", numbers.join(","));
    }
    DataFile { name: name.into(), text }
}
