//! `palpate replay`: a log of a run in real time, repeated and compared.

use crate::Failure;
use crate::scene_file::{self, Carried, Pace, Scene};
use crate::verbs::run::{OutputArguments, Outputs};
use crate::verbs::{print, print_json};
use clap::Args;
use indicatif::ProgressBar;
use palpate::{State, step};
use palpate_haptics::log::Reader;
use serde_json::json;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::time::Instant;
use tempfile::TempDir;

/// Repeat a log step by step, and check that every number comes out again, bit for bit
///
/// The log carries the scene and its recordings. Forces, proxies, poses, velocities and energies of every step are compared
/// with those that were logged; the first that differs ends the replay. The same build on the same kind of machine gives
/// the same bits. Steps can be written as in `palpate run`.
#[derive(Args, Debug, Clone)]
#[command(after_help = "For example:
  palpate run scene.toml --realtime --log run.mcap
  palpate replay run.mcap --csv steps.csv --contacts contacts.csv --vtu frames")]
pub struct Arguments {
    /// The log
    pub log: PathBuf,
    /// What it should leave
    #[command(flatten)]
    pub outputs: OutputArguments,
}

/// Run the verb.
pub fn replay(arguments: &Arguments) -> Result<(), Failure> {
    let path = &arguments.log;
    let bytes = std::fs::read(path).map_err(|e| Failure::file("read the log", path, &e))?;
    let named = |error: palpate_haptics::Error| Failure(format!("{}: {error}", path.display()));
    let reader = Reader::new(&bytes).map_err(named)?;
    let facts = reader.facts().map_err(named)?;
    let (scene, _folder) =
        unpack(&reader, facts.get("scene").map(Path::new)).map_err(|failure| match failure {
            Unpacked::Log(error) => named(error),
            Unpacked::Other(failure) => failure,
        })?;
    let steps = reader.steps();
    let names = scene.names();
    let modes: Vec<_> = scene.devices.iter().map(|device| device.mode).collect();
    let mut state = State::new(&scene.model);
    let mut outputs = Outputs::new(&arguments.outputs, &scene, &state, steps as usize)?;
    let bar = if std::io::stderr().is_terminal() { ProgressBar::new(steps) } else { ProgressBar::hidden() };
    let mut done = 0;
    for logged in reader.each_step() {
        let logged = logged.map_err(named)?;
        if logged.step != done + 1 {
            return Err(Failure(format!(
                "{}: step {} comes after step {done}: the log missed steps, and can't be replayed beyond",
                path.display(),
                logged.step
            )));
        }
        let input = logged.input(&names, &modes).map_err(named)?;
        let before = Instant::now();
        step(&scene.model, &mut state, &input);
        let took = before.elapsed();
        if let Some((what, then, now)) = logged.difference(&names, state.output()) {
            return Err(Failure(format!(
                "{}: step {} differs: {what} was {then:?}, now it is {now:?}. The log is of palpate {}, this is {}; only \
                 the same build on the same kind of machine gives the same bits",
                path.display(),
                logged.step,
                facts.get("version").map_or("?", String::as_str),
                env!("CARGO_PKG_VERSION"),
            )));
        }
        done = logged.step;
        if done.is_multiple_of(256) {
            bar.set_position(done);
        }
        outputs.take(&scene, &input, &state, took)?;
    }
    bar.finish_and_clear();
    if done == 0 {
        return Err(Failure(format!("{}: the log holds no steps", path.display())));
    }
    let summary = outputs.finish(&state)?;
    if arguments.outputs.json {
        let mut json = summary.json(&scene);
        json["replayed"] = json!({ "steps": done, "identical": true });
        return print_json(&json);
    }
    print(&format!(
        "{done} steps replayed: every number came out again, bit for bit\n\n{}",
        summary.text(&scene)
    ))
}

/// Why a scene can't be had from a log.
enum Unpacked {
    Log(palpate_haptics::Error),
    Other(Failure),
}

/// The scene that a log carries, and the folder that its files lie in while it is read.
fn unpack(reader: &Reader, scene: Option<&Path>) -> Result<(Scene, TempDir), Unpacked> {
    let scene = scene
        .ok_or_else(|| Unpacked::Other(Failure("the log does not tell which scene it is of".to_string())))?;
    let folder = TempDir::new()
        .map_err(|e| Unpacked::Other(Failure(format!("cannot make a folder for the log's files: {e}"))))?;
    let mut carried = Carried::new();
    for (at, (name, data)) in reader.files().map_err(Unpacked::Log)?.into_iter().enumerate() {
        let name = PathBuf::from(name);
        // Only the last part of a name becomes a file's: nothing is written outside of the folder.
        let file = name.file_name().map_or_else(|| "file".into(), |name| name.to_os_string());
        let own = folder.path().join(at.to_string());
        let place = own.join(file);
        let written = std::fs::create_dir(&own).and_then(|()| std::fs::write(&place, data));
        written.map_err(|e| Unpacked::Other(Failure::file("unpack", &place, &e)))?;
        carried.insert(name, place);
    }
    let scene = scene_file::read_carried(scene, &carried, Pace::RealTime).map_err(Unpacked::Other)?;
    Ok((scene, folder))
}
