//! `palpate reproduce`: the paper's table and figures, made again, and its statements answered.

use crate::failure::Failure;
use crate::progress::Bars;
use crate::terminal::print;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args, value_parser};
use palpate_reproduce::{Effort, Options, Part};
use std::path::PathBuf;

/// Make the paper's table and figures again, and answer each of its statements
///
/// Records the paper's cube, and writes a page (report.html, which needs nothing else) that begins with a row for each statement and figure of
/// the paper: what it says, what came out, the command. Its sections: figure 1 and Table 1; figures 2 and 3 with the arrival of the wave;
/// the passivity of the samples; the agreement of both forms of the response; motion; cost, with finite elements beside it; figure 5(a),
/// a fall in real time; figures 4 and 5(b), two devices in processes of their own that shake the cube over links, on R[s] and in modal form; the images of figure 5
/// are drawn from their logs by a browser. Beside the page lie the numbers as CSV, the logs, the images and the scenes. Takes a few minutes.
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
    #[arg(long, default_value_t = Effort::default().cells, value_parser = value_parser!(u32).range(2..=40))]
    cells: u32,
    /// Columns of the table that are timed for Table 1
    #[arg(long, default_value_t = Effort::default().columns as u32, value_parser = value_parser!(u32).range(1..=10_000))]
    columns: u32,
    /// Steps that are timed per point of a curve
    #[arg(long, default_value_t = Effort::default().steps as u32, value_parser = value_parser!(u32).range(10..=10_000_000))]
    steps: u32,
    /// These parts only, with commas between them
    #[arg(long, value_parser = part_parser(), value_delimiter = ',', value_name = "PARTS")]
    only: Vec<Part>,
    /// The browser that draws pictures; by default the first of chromium, chromium-browser, google-chrome, chrome that is found
    #[arg(long, value_name = "PROGRAM")]
    browser: Option<PathBuf>,
}

/// Runs the command.
pub fn reproduce(arguments: &Arguments) -> Result<(), Failure> {
    let program = std::env::current_exe()
        .map_err(|e| Failure(format!("palpate can't be run in a process of its own: {e}")))?;
    let parts = if arguments.only.is_empty() { &Part::ALL[..] } else { &arguments.only };
    let options = Options {
        commit: option_env!("PALPATE_COMMIT"),
        output: arguments.output.clone(),
        program,
        browser: arguments.browser.clone(),
        effort: Effort {
            cells: arguments.cells,
            columns: arguments.columns as usize,
            steps: arguments.steps as usize,
        },
        parts: parts.to_vec(),
    };
    let report = palpate_reproduce::reproduce(&options, &mut Bars::new())?;
    print(&format!("{}\n", report.display()))
}

/// Parser of a part by its name.
fn part_parser() -> impl TypedValueParser<Value = Part> {
    let names = Part::ALL.map(|part| PossibleValue::new(part.name()).help(part.content()));
    let part = |name: String| Part::ALL.into_iter().find(|part| part.name() == name).ok_or("no such part");
    PossibleValuesParser::new(names).try_map(part)
}
