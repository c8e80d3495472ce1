//! `palpate reproduce`: the paper's table and figures, made again.

use crate::Failure;
use crate::progress::Bars;
use crate::report::{Page, paragraph};
use crate::reproduction::{Effort, chapters};
use crate::verbs::{print, write_whole};
use clap::Args;
use std::path::PathBuf;

/// Make the paper's table and figures again, and measure what it claims
///
/// Records the paper's cube, and writes a page (report.html, which needs nothing else) with Table 1, figures 2 and 3, the
/// arrival of the wave over its threshold, the passivity of the samples, the agreement of both forms of the response, and
/// the cost of direct convolution, and figure 5(b) live: two devices in processes of their own that shake the cube over links
/// for 10 s. Beside it the numbers as CSV. Takes a few minutes.
#[derive(Args)]
pub struct Arguments {
    /// Folder for the report and its numbers
    #[arg(short, long, default_value = "palpate-reproduction", value_name = "DIR")]
    output: PathBuf,
    /// Cells along a side of the cube; the paper's has 12
    #[arg(long, default_value_t = 12, value_parser = clap::value_parser!(u32).range(2..=40))]
    cells: u32,
    /// Columns of the table that are timed for Table 1
    #[arg(long, default_value_t = 96, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    columns: u32,
    /// Steps that are timed per point of a curve
    #[arg(long, default_value_t = 4000, value_parser = clap::value_parser!(u32).range(10..=10_000_000))]
    steps: u32,
}

/// Run the verb.
pub fn reproduce(arguments: &Arguments) -> Result<(), Failure> {
    let output = &arguments.output;
    std::fs::create_dir_all(output).map_err(|e| Failure::file("make the folder", output, &e))?;
    let effort = Effort {
        cells: arguments.cells,
        columns: arguments.columns as usize,
        steps: arguments.steps as usize,
    };
    let mut progress = Bars::new();
    let chapters = chapters(effort, output, &mut progress)?;
    progress.finish();
    let mut written = Vec::new();
    for file in chapters.iter().flat_map(|chapter| &chapter.data) {
        write_whole(&output.join(&file.name), file.text.as_bytes())?;
        written.push(file.name.as_str());
    }
    let page = Page {
        title: "The paper's elastic cube, reproduced".into(),
        intro: paragraph(&format!(
            "What “A Study on Haptic Interaction and Simulation of Motion and Deformation of Elastic Object” reports of its cube \
             (side 0.1 m, E = 2000 Pa, ν = 0.49, ρ = 110 kg/m³), measured with palpate {} by the command below. The paper states \
             no damping; here α = 2 1/s, β = 2·10⁻⁴ s. The numbers behind the figures lie beside this page as CSV.",
            env!("CARGO_PKG_VERSION")
        )) + &crate::report::code(&format!("palpate reproduce --cells {} -o DIR", arguments.cells)),
        sections: chapters.into_iter().map(|chapter| chapter.section).collect(),
    };
    let report = output.join("report.html");
    write_whole(&report, page.html().as_bytes())?;
    print(&format!("{}\n", report.display()))
}
