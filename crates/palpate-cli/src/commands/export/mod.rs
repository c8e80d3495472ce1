//! `palpate export`: a log or a recording as files for other programs.

mod log;
mod recording;

use crate::failure::Failure;
use crate::log_kind::{has_ending, is_log};
use crate::standard_streams::{FOLDER, LOG_INPUT, SEEKS, refuse};
use crate::terminal::{print, print_json, size_text};
use clap::{ArgGroup, Args};
use palpate_export::WrittenFile;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Turn a log or a recording into files for ParaView, Blender, a browser or a notebook
///
/// A log (palpate run --realtime --log) is replayed step by step, as by palpate replay, so every frame is exact at its time; a
/// step that differs ends the export. Of a recording the mode shapes are exported, with the surface at rest.
///
/// --vtu: surfaces of objects, planes and obstacles, contacts and devices as points with their forces; open scene.pvd in
/// ParaView. --gltf: one animated file, y up, in metres; the objects' deformation as morph targets, one per frame.
#[derive(Args, Debug, Clone)]
#[command(group(ArgGroup::new("outputs").required(true).multiple(true).args(["csv", "contacts", "vtu", "gltf"])))]
#[command(after_help = "For example:
  palpate run scene.toml --realtime --duration 10 --log run.mcap
  palpate export run.mcap --gltf run.glb                       # for Blender, or a browser
  palpate export run.mcap --vtu frames --fps 100 --from 2 --to 4
  palpate export run.mcap --csv steps.csv --contacts contacts.csv
  palpate export cube.palp --gltf modes.glb --modes 6          # an animation per mode
  palpate export cube.palp --vtu modes --csv modes.csv
A scene that needs no clock: palpate run scene.toml --vtu frames. docs/export.md tells how to go on in each program.")]
pub struct Arguments {
    /// The log (.mcap) or the recording (.palp)
    source: PathBuf,
    /// Write every step as a row, as palpate run does; of a recording frequency and damping of every mode
    #[arg(long, value_name = "OUT.csv")]
    csv: Option<PathBuf>,
    /// Write every contact of every step as a row, as palpate run does
    #[arg(long, value_name = "OUT.csv")]
    contacts: Option<PathBuf>,
    /// Write frames for ParaView: VTU files and scene.pvd; of a recording modes.pvd, a time for each mode
    #[arg(long, value_name = "DIR")]
    vtu: Option<PathBuf>,
    /// Write an animation: glTF 2.0, binary
    #[arg(long, value_name = "OUT.glb")]
    gltf: Option<PathBuf>,
    /// Frames of --vtu and --gltf per second of simulated time [default: 30]
    #[arg(long, value_name = "FPS", allow_negative_numbers = true)]
    fps: Option<f64>,
    /// Leave out what is before this time [s]
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    from: Option<f64>,
    /// Leave out what is after this time [s]
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    to: Option<f64>,
    /// Number of modes of a recording, from the lowest [default: 10, and all for --csv]
    #[arg(long, value_name = "N")]
    modes: Option<usize>,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

/// Reason against rows on standard output.
const LISTED: &str = "the files are listed there; palpate replay writes rows to standard output";

/// Runs the command.
pub fn export(arguments: &Arguments) -> Result<(), Failure> {
    refuse(&[
        ("the log or recording", Some(&arguments.source), LOG_INPUT),
        ("--vtu", arguments.vtu.as_deref(), FOLDER),
        ("--gltf", arguments.gltf.as_deref(), SEEKS),
        ("--csv", arguments.csv.as_deref(), LISTED),
        ("--contacts", arguments.contacts.as_deref(), LISTED),
    ])?;
    if is_log(&arguments.source) {
        if arguments.modes.is_some() {
            return Err(misplaced("--modes", "a recording", &arguments.source));
        }
        return log::export(arguments);
    }
    let of_logs = [
        ("--contacts", arguments.contacts.is_some()),
        ("--fps", arguments.fps.is_some()),
        ("--from", arguments.from.is_some()),
        ("--to", arguments.to.is_some()),
    ];
    if let Some((option, _)) = of_logs.iter().find(|(_, given)| *given) {
        return Err(misplaced(option, "a log", &arguments.source));
    }
    if has_ending(&arguments.source, "toml") {
        return Err(Failure(format!(
            "{} is a scene: palpate run {0} takes --csv, --contacts and --vtu; for --gltf, run it with --realtime --log \
             run.mcap and export that",
            arguments.source.display()
        )));
    }
    recording::export(arguments)
}

fn misplaced(option: &str, of: &str, source: &Path) -> Failure {
    let is = if of == "a log" { "a recording" } else { "a log" };
    Failure(format!("{option} is of {of}, {} is {is}: leave it out", source.display()))
}

/// Prints the written files: as JSON with facts, or after a line of text.
fn print_written(
    arguments: &Arguments,
    written: &[WrittenFile],
    mut facts: Value,
    first_line: &str,
) -> Result<(), Failure> {
    let bytes = |file: &WrittenFile| std::fs::metadata(&file.path).map_or(0, |facts| facts.len());
    if arguments.json {
        let files = written.iter();
        let files = files.map(|file| json!({ "kind": file.kind, "path": file.path, "bytes": bytes(file) }));
        facts["files"] = files.collect();
        return print_json(&facts);
    }
    let mut text = format!("{first_line}\n");
    for file in written {
        let path = file.path.display();
        text += &match file.kind {
            "vtu" => format!("  surfaces     {path} (open it in ParaView)\n"),
            "gltf" => format!("  animation    {path}, {}\n", size_text(bytes(file) as usize)),
            "contacts" => format!("  contacts     {path}\n"),
            _ => format!("  rows         {path}\n"),
        };
    }
    print(&text)
}
