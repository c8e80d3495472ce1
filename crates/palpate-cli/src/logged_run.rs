//! A run in real time as its log has it, computed again step by step.

use crate::Failure;
use crate::scene_file::{self, Carried, Pace, Scene};
use indicatif::{ProgressBar, ProgressStyle};
use palpate::{DeviceMode, Input, State, step};
use palpate_haptics::log::{Names, Reader};
use std::collections::BTreeMap;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// A log, and the scene that it carries.
pub struct LoggedRun {
    path: PathBuf,
    bytes: Vec<u8>,
    facts: BTreeMap<String, String>,
    /// The scene; the log is one of its inputs.
    pub scene: Scene,
    /// How many steps there are.
    pub steps: u64,
    names: Names,
    modes: Vec<DeviceMode>,
    // Where the scene's files lie while it is used: a table is mapped into memory.
    _folder: TempDir,
}

impl LoggedRun {
    /// Read a log.
    pub fn read(path: &Path) -> Result<Self, Failure> {
        let bytes = std::fs::read(path).map_err(|e| Failure::file("read the log", path, &e))?;
        let named = |error: palpate_haptics::Error| named(path, &error);
        let reader = Reader::new(&bytes).map_err(named)?;
        let facts = reader.facts().map_err(named)?;
        let files = reader.files().map_err(named)?;
        let steps = reader.steps();
        let (mut scene, folder) = unpack(files, facts.get("scene").map(Path::new))?;
        scene.inputs.push(path.to_path_buf());
        let names = scene.names();
        let modes = scene.devices.iter().map(|device| device.mode).collect();
        Ok(Self { path: path.to_path_buf(), bytes, facts, scene, steps, names, modes, _folder: folder })
    }

    /// The scene before the first step: as its file says, or where the one before it went on.
    pub fn state_at_start(&self) -> Result<State, Failure> {
        let model = &self.scene.model;
        let motions = self.reader()?.start(&self.names).map_err(|error| named(&self.path, &error))?;
        Ok(motions.map_or_else(|| State::new(model), |motions| State::resume(model, &motions)))
    }

    /// Where devices and obstacles are at the start; of a device without a path that is known from the first step on.
    pub fn input_at_start(&self) -> Result<Input, Failure> {
        let mut input = self.scene.input_at(0.0);
        if let Some(logged) = self.reader()?.each_step().next() {
            let first = logged.and_then(|logged| logged.input(&self.names, &self.modes));
            let first = first.map_err(|error| named(&self.path, &error))?;
            for ((device, at_start), first) in
                self.scene.devices.iter().zip(&mut input.devices).zip(first.devices)
            {
                if device.path.is_none() {
                    *at_start = first;
                }
            }
        }
        Ok(input)
    }

    /// Compute the first steps again, compare each with what was logged, and hand it on with the time that it took; gives
    /// how many there were.
    pub fn repeat(
        &self,
        state: &mut State,
        most: u64,
        mut take: impl FnMut(&Input, &State, Duration) -> Result<(), Failure>,
    ) -> Result<u64, Failure> {
        let path = self.path.display();
        let bar = progress_bar(most.min(self.steps));
        let mut done = 0;
        for logged in self.reader()?.each_step().take(most.try_into().unwrap_or(usize::MAX)) {
            let logged = logged.map_err(|error| named(&self.path, &error))?;
            if logged.step != done + 1 {
                return Err(Failure(format!(
                    "{path}: step {} comes after step {done}: the log missed steps, and can't be replayed beyond",
                    logged.step
                )));
            }
            let input = logged.input(&self.names, &self.modes).map_err(|error| named(&self.path, &error))?;
            let before = Instant::now();
            step(&self.scene.model, state, &input);
            let took = before.elapsed();
            if let Some((what, then, now)) = logged.difference(&self.names, state.output()) {
                return Err(Failure(format!(
                    "{path}: step {} differs: {what} was {then:?}, now it is {now:?}. The log is of palpate {}, this is {}; \
                     only the same build on the same kind of machine gives the same bits",
                    logged.step,
                    self.facts.get("version").map_or("?", String::as_str),
                    env!("CARGO_PKG_VERSION"),
                )));
            }
            done = logged.step;
            if done.is_multiple_of(256) {
                bar.set_position(done);
            }
            take(&input, state, took)?;
        }
        bar.finish_and_clear();
        if done == 0 {
            return Err(Failure(format!("{path}: the log holds no steps")));
        }
        Ok(done)
    }

    fn reader(&self) -> Result<Reader<'_>, Failure> {
        Reader::new(&self.bytes).map_err(|error| named(&self.path, &error))
    }
}

fn named(path: &Path, error: &palpate_haptics::Error) -> Failure {
    Failure(format!("{}: {error}", path.display()))
}

fn progress_bar(steps: u64) -> ProgressBar {
    if !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(steps);
    match ProgressStyle::with_template("{wide_bar} {pos}/{len} steps, {eta} left") {
        Ok(style) => bar.with_style(style),
        Err(_) => bar,
    }
}

/// The scene that a log carries, and the folder that its files lie in while it is read.
fn unpack(files: Vec<(String, Vec<u8>)>, scene: Option<&Path>) -> Result<(Scene, TempDir), Failure> {
    let scene = scene.ok_or_else(|| Failure("the log does not tell which scene it is of".to_string()))?;
    let folder =
        TempDir::new().map_err(|e| Failure(format!("cannot make a folder for the log's files: {e}")))?;
    let mut carried = Carried::new();
    for (at, (name, data)) in files.into_iter().enumerate() {
        let name = PathBuf::from(name);
        // Only the last part of a name becomes a file's: nothing is written outside of the folder.
        let file = name.file_name().map_or_else(|| "file".into(), |name| name.to_os_string());
        let own = folder.path().join(at.to_string());
        let place = own.join(file);
        let written = std::fs::create_dir(&own).and_then(|()| std::fs::write(&place, data));
        written.map_err(|e| Failure::file("unpack", &place, &e))?;
        carried.insert(name, place);
    }
    Ok((scene_file::read_carried(scene, &carried, Pace::RealTime)?, folder))
}
