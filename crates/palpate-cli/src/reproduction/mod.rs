//! The paper's table and figures, made again: what `palpate reproduce` measures and writes.

mod agreement;
mod cost;
mod fall;
mod findings;
mod impulses;
mod logged;
mod passivity;
mod processes;
mod recording;
mod series;
mod shake;
mod shaken;

pub use findings::{Finding, findings_table};

use crate::Failure;
use crate::commands::demo::paper_cube;
use crate::progress::Bars;
use crate::report::Section;
use clap::ValueEnum;
use palpate::{ColumnsInMemory, Damping, ImpulseResponse, Sampling};
use palpate_export::write_atomically as write_whole;
use palpate_fem::mesh::box_mesh;
use palpate_fem::progress::Progress;
use palpate_fem::record::{Extent, RecordParameters, Recorded, record};
use palpate_fem::table::{BLOCK, Method, TableParameters, TableRecorder};
use palpate_scene::WithoutRemarks;
use series::Artist;
use std::fmt::Write;
use std::path::{Path, PathBuf};

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
    /// Rows of the table at the top of the page.
    pub findings: Vec<Finding>,
}

/// What can be made by itself; in the order of the paper.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Part {
    /// Table 1.
    Recording,
    /// Figures 2 and 3, and the arrival of the wave.
    Impulses,
    /// Passivity of the samples.
    Passivity,
    /// Both forms of the response, both ways of recording.
    Agreement,
    /// Section 2.5.
    Cost,
    /// Figure 5(a).
    Fall,
    /// Figure 5(b).
    Shake,
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

/// Where it is done.
pub struct Desk<'a> {
    /// Where everything is written.
    pub output: &'a Path,
    /// The browser that draws; by default the first known one.
    pub browser: Option<&'a Path>,
    /// How thoroughly.
    pub effort: Effort,
}

impl Desk<'_> {
    /// Scenes of the runs, with all that they need.
    fn scenes(&self) -> PathBuf {
        self.output.join("scenes")
    }

    /// Put the recording where the scenes are.
    fn lay_out(&self, body: &Recorded) -> Result<(), Failure> {
        let folder = self.scenes();
        std::fs::create_dir_all(&folder).map_err(|e| Failure::file("make the folder", &folder, &e))?;
        Ok(write_whole(&folder.join("cube.palp"), &body.recording.to_bytes()?)?)
    }
}

/// The chapters that are asked for, in the order of the paper.
pub fn chapters(desk: &Desk, parts: &[Part], progress: &mut Bars) -> Result<Vec<Chapter>, Failure> {
    let effort = desk.effort;
    let body = cube(effort.cells, 200, &mut WithoutRemarks(progress))?;
    let artist = if parts.contains(&Part::Fall) || parts.contains(&Part::Shake) {
        desk.lay_out(&body)?;
        Some(Artist::new(desk.browser)?)
    } else {
        None
    };
    let chapter = |part: &Part| match (part, &artist) {
        (Part::Recording, _) => Some(recording::chapter(&body, effort, progress)),
        (Part::Impulses, _) => Some(impulses::chapter(&body, progress)),
        (Part::Passivity, _) => Some(passivity::chapter(&body, progress)),
        (Part::Agreement, _) => Some(agreement::chapter(progress)),
        (Part::Cost, _) => Some(cost::chapter(effort, progress)),
        (Part::Fall, Some(artist)) => Some(fall::chapter(desk, artist, progress)),
        (Part::Shake, Some(artist)) => Some(shake::chapter(desk, artist, progress)),
        (Part::Fall | Part::Shake, None) => None,
    };
    Part::value_variants().iter().filter(|part| parts.contains(part)).filter_map(chapter).collect()
}

/// The paper's cube with so many cells along a side, without certificate.
fn cube(cells: u32, modes: usize, progress: &mut dyn Progress) -> Result<Recorded, Failure> {
    damped_cube(cells, modes, paper_cube(cells, modes).damping, progress)
}

/// The same with a damping of its own.
fn damped_cube(
    cells: u32,
    modes: usize,
    damping: Damping,
    progress: &mut dyn Progress,
) -> Result<Recorded, Failure> {
    let parameters = RecordParameters { damping, extent: Extent::Uncertified, ..paper_cube(cells, modes) };
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
