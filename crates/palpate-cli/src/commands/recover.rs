//! `palpate recover`: a whole log of one that was cut.

use crate::failure::Failure;
use crate::standard_streams::{LOG_INPUT, LOG_OUTPUT, refuse};
use crate::terminal::{print, print_json, size_text};
use clap::Args;
use palpate_export::AtomicFile;
use palpate_haptics::log::Recovered;
use palpate_mesh::read_regular_file;
use serde_json::json;
use std::path::PathBuf;

/// Make a whole log of one that was cut by a kill, a power cut or a full disk
///
/// A log grows as OUT.mcap.part and gets its name when it is whole. What was written of one that was cut can be replayed, rendered,
/// exported and served as it is; the recovered file has the summary, too, which Foxglove and other readers of MCAP want. Every
/// record up to the first that is cut or damaged is kept, with all its bits.
#[derive(Args, Debug, Clone)]
#[command(after_help = "For example:
  palpate recover run.mcap.part -o run.mcap")]
pub struct Arguments {
    /// The log that was cut
    log: PathBuf,
    /// Whole log
    #[arg(short, long, value_name = "WHOLE.mcap")]
    output: PathBuf,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn recover(arguments: &Arguments) -> Result<(), Failure> {
    let Arguments { log, output, json } = arguments;
    refuse(&[("the log", Some(log), LOG_INPUT), ("-o", Some(output), LOG_OUTPUT)])?;
    let file = AtomicFile::create(output, &[log])?;
    let bytes = read_regular_file(log).map_err(|error| Failure::file("read the log", log, &error))?;
    let recovered = palpate_haptics::log::recover(&bytes, file);
    let named = |error: palpate_haptics::Error| Failure(format!("{}: {error}", log.display()));
    let (Recovered { steps, lost_bytes }, file) = recovered.map_err(named)?;
    let path = file.finish()?;
    if *json {
        return print_json(&json!({ "steps": steps, "lost_bytes": lost_bytes, "log": path }));
    }
    let lost = size_text(lost_bytes);
    print(&format!("{steps} steps in {}; {lost} at the end could not be read\n", path.display()))
}
