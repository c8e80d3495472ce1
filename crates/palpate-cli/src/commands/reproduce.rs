//! `palpate reproduce`: the paper's table and figures, made again.

use crate::failure::Failure;
use crate::progress::Bars;
use crate::report::{Page, code, paragraph};
use crate::reproduction::{Desk, Effort, Finding, Part, chapters, findings_table};
use crate::terminal::print;
use clap::{Args, ValueEnum};
use palpate_export::write_atomically;
use std::path::PathBuf;

/// Make the paper's table and figures again, and measure what it claims
///
/// Records the paper's cube, and writes a page (report.html, which needs nothing else) that begins with what the paper reports beside
/// what was measured: Table 1, figures 2 and 3, the arrival of the wave over its threshold, the passivity of the samples, the agreement
/// of both forms of the response, the cost of direct convolution, figure 5(a), a fall in real time, and figure 5(b), two devices in
/// processes of their own that shake the cube over links for 10 s; both as pictures from their logs, which a browser draws. Beside it
/// the numbers as CSV, the logs, the pictures and the scenes. Takes a few minutes.
#[derive(Args)]
#[command(after_help = "For example:
  palpate reproduce -o report                      # everything
  palpate reproduce --only fall,shake -o report    # figure 5
  palpate serve report/figure5a.mcap               # the same fall in the viewer")]
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
    /// These parts only, with commas between them
    #[arg(long, value_enum, value_delimiter = ',', value_name = "PARTS")]
    only: Vec<Part>,
    /// The browser that draws pictures; by default the first of chromium, chromium-browser, google-chrome, chrome that is found
    #[arg(long, value_name = "PROGRAM")]
    browser: Option<PathBuf>,
}

/// Runs the command.
pub fn reproduce(arguments: &Arguments) -> Result<(), Failure> {
    let output = &arguments.output;
    std::fs::create_dir_all(output).map_err(|e| Failure::file("make the folder", output, &e))?;
    let effort = Effort {
        cells: arguments.cells,
        columns: arguments.columns as usize,
        steps: arguments.steps as usize,
    };
    let mut progress = Bars::new();
    let parts = if arguments.only.is_empty() { Part::value_variants() } else { &arguments.only };
    let desk = Desk { output, browser: arguments.browser.as_deref(), effort };
    let chapters = chapters(&desk, parts, &mut progress)?;
    progress.finish();
    for file in chapters.iter().flat_map(|chapter| &chapter.data) {
        write_atomically(&output.join(&file.name), file.text.as_bytes())?;
    }
    let page = Page {
        title: "The paper's elastic cube, reproduced".into(),
        intro: intro(
            arguments.cells,
            &chapters.iter().flat_map(|chapter| chapter.findings.clone()).collect::<Vec<_>>(),
        ),
        sections: chapters.into_iter().map(|chapter| chapter.section).collect(),
    };
    let report = output.join("report.html");
    write_atomically(&report, page.html().as_bytes())?;
    print(&format!("{}\n", report.display()))
}

/// What the page is about, and the table of what was found.
fn intro(cells: u32, findings: &[Finding]) -> String {
    let text = paragraph(&format!(
        "What “A Study on Haptic Interaction and Simulation of Motion and DeformationSnapshot of Elastic Object” reports of its cube \
         (side 0.1 m, E = 2000 Pa, ν = 0.49, ρ = 110 kg/m³), measured with palpate {} by the command below. The paper states \
         no damping; here α = 2 1/s, β = 2·10⁻⁴ s where nothing else is said. The numbers behind the figures lie beside this page as CSV, the runs of figure 5 as \
         logs that palpate serve and palpate replay read.",
        env!("CARGO_PKG_VERSION")
    ));
    text + &code(&format!("palpate reproduce --cells {cells} -o DIR")) + &findings_table(findings)
}
