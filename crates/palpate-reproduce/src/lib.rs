//! Reproduction of the paper that palpate implements: its table and figures, measured again.
//!
//! [`reproduce`] records the paper's elastic cube, runs the measurements of each [`Part`], and writes `report.html`, a page that needs
//! nothing else, with the numbers as CSV, the logs of the runs and their images beside it.

mod bodies;
mod chapter;
mod chapters;
mod chart;
mod cholesky;
mod error;
mod findings;
mod html;
mod image_series;
mod log_steps;
mod machine;
mod medians;
mod options;
mod page;
mod powers;
mod processes;
mod progress;
mod statements;
mod surface_picture;
mod system_drawing;
mod verdict;

pub use error::ReproduceError;
pub use options::{Effort, Options, Part};
pub use progress::StageProgress;

use findings::{Finding, findings_table};
use machine::Machine;
use page::{Page, Section, code, paragraph};
use palpate_export::write_atomically;
use std::path::PathBuf;

/// Measures the parts that are asked for and writes the report; gives its path.
///
/// # Errors
/// The first measurement that fails, or file that can't be written.
pub fn reproduce(options: &Options, progress: &mut dyn StageProgress) -> Result<PathBuf, ReproduceError> {
    let output = &options.output;
    std::fs::create_dir_all(output).map_err(|e| ReproduceError::folder(output, e))?;
    let machine = Machine::read();
    let chapters = chapters::chapters(options, &machine, progress)?;
    progress.finish();
    for file in chapters.iter().flat_map(|chapter| &chapter.data) {
        write_atomically(&output.join(&file.name), file.text.as_bytes())?;
    }
    let findings: Vec<Finding> = chapters.iter().flat_map(|chapter| chapter.findings.clone()).collect();
    let mut sections: Vec<Section> = chapters.into_iter().map(|chapter| chapter.section).collect();
    sections.push(methods(&machine, options.commit));
    let page = Page {
        title: "The elastic cube of an extended impulse response deformation model, reproduced".into(),
        intro: intro(options, &findings)?,
        sections,
    };
    let report = output.join("report.html");
    write_atomically(&report, page.html().as_bytes())?;
    Ok(report)
}

/// Subject of the page, and the table of findings.
fn intro(options: &Options, findings: &[Finding]) -> Result<String, ReproduceError> {
    let text = paragraph(&format!(
        "“A Study on Haptic Interaction and Simulation of Motion and Deformation of Elastic Object” (“the paper” below) extends the impulse \
         response deformation model to objects that move. This report repeats its experiments on its cube (side 0.1 m, E = 2000 Pa, ν = 0.49, \
         ρ = 110 kg/m³) with palpate {}{}, and answers each of its statements and figures.",
        env!("CARGO_PKG_VERSION"),
        options.commit.map(|commit| format!(" (commit {commit})")).unwrap_or_default()
    )) + &paragraph(
        "The paper states no damping. Here it is C = αM + βK with α = 2 1/s and β = 2·10⁻⁴ s on the deformation, where nothing else is said. \
         R[s] is the displacement s steps after the one in which a unit force acted: the paper's recorded table, evaluated by direct \
         convolution. The modal form describes the same response by vibration modes and the static compliance of the modes that are left out. Beside \
         this page lie the numbers of every figure as CSV, and the runs of figure 5 as logs that palpate serve shows and palpate replay \
         computes again, bit for bit.",
    );
    let parts: Vec<&str> = options.parts.iter().map(|part| part.name()).collect();
    let only = if options.parts.len() == Part::ALL.len() {
        String::new()
    } else {
        format!(" --only {}", parts.join(","))
    };
    let Effort { cells, columns, steps } = options.effort;
    let command =
        format!("palpate reproduce --cells {cells} --columns {columns} --steps {steps}{only} -o DIR");
    Ok(text + &code(&command) + &findings_table(findings, &options.parts)?)
}

/// The last section: versions, machine, and what the numbers are uncertain by.
fn methods(machine: &Machine, commit: Option<&str>) -> Section {
    let body = machine.table(commit)
        + &paragraph(
            "Displacements, forces and energies are computed in double precision and repeat bit for bit on the same kind of machine; only the runs \
             of figure 5(b), whose hands are processes of their own, differ from run to run by when these begin. Their uncertainty is that of the model: the \
             mesh (the cube's lowest frequency is 3.7 % above the continuum's, since linear tetrahedra lock at ν = 0.49), the modes that are kept, \
             and the step.",
        )
        + &paragraph(
            "Times are wall-clock times. They depend on the machine and on what else it does: a time is the median over steps, with the range of \
             the medians of five equal parts of the run in brackets, or percentiles where that is said. Single steps that the operating system \
             interrupted are counted, not removed: they are in the percentiles, and marked in the curves of figure 5.",
        );
    Section { id: "methods".into(), heading: "Machine, versions, uncertainty".into(), body }
}
