//! Reproduction of the paper that palpate implements: its table and figures, measured again.
//!
//! [`reproduce`] records the paper's elastic cube, runs the measurements of each [`Part`], and writes `report.html`, a page that needs
//! nothing else, with the numbers as CSV, the logs of the runs and their images beside it.

mod bodies;
mod chapter;
mod chapters;
mod chart;
mod error;
mod findings;
mod html;
mod image_series;
mod log_steps;
mod options;
mod page;
mod processes;
mod progress;
mod surface_picture;

pub use error::ReproduceError;
pub use options::{Effort, Options, Part};
pub use progress::StageProgress;

use findings::{Finding, findings_table};
use page::{Page, code, paragraph};
use palpate_export::write_atomically;
use std::path::PathBuf;

/// Measures the parts that are asked for and writes the report; gives its path.
///
/// # Errors
/// The first measurement that fails, or file that can't be written.
pub fn reproduce(options: &Options, progress: &mut dyn StageProgress) -> Result<PathBuf, ReproduceError> {
    let output = &options.output;
    std::fs::create_dir_all(output).map_err(|e| ReproduceError::folder(output, e))?;
    let chapters = chapters::chapters(options, progress)?;
    progress.finish();
    for file in chapters.iter().flat_map(|chapter| &chapter.data) {
        write_atomically(&output.join(&file.name), file.text.as_bytes())?;
    }
    let findings: Vec<Finding> = chapters.iter().flat_map(|chapter| chapter.findings.clone()).collect();
    let page = Page {
        title: "The paper's elastic cube, reproduced".into(),
        intro: intro(options.effort.cells, &findings),
        sections: chapters.into_iter().map(|chapter| chapter.section).collect(),
    };
    let report = output.join("report.html");
    write_atomically(&report, page.html().as_bytes())?;
    Ok(report)
}

/// Subject of the page, and the table of findings.
fn intro(cells: u32, findings: &[Finding]) -> String {
    let text = paragraph(&format!(
        "What “A Study on Haptic Interaction and Simulation of Motion and Deformation of Elastic Object” reports of its cube \
         (side 0.1 m, E = 2000 Pa, ν = 0.49, ρ = 110 kg/m³), measured with palpate {} by the command below. The paper states \
         no damping; here α = 2 1/s, β = 2·10⁻⁴ s where nothing else is said. The numbers behind the figures lie beside this page as CSV, the runs of figure 5 as \
         logs that palpate serve and palpate replay read.",
        env!("CARGO_PKG_VERSION")
    ));
    text + &code(&format!("palpate reproduce --cells {cells} -o DIR")) + &findings_table(findings)
}
