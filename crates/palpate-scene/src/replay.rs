//! Replay of a log: its steps are computed again from the scene that it carries, and compared.
//!
//! A log of this version must repeat bit for bit. A log of another version is computed with the logged inputs, and the first
//! difference is reported: a change of the solver changes last digits.

use crate::error::SceneError;
use crate::file::{PartsInMemory, RunMode, named_files, read_scene_text, text_of};
#[cfg(feature = "native")]
use crate::file::{Relocated, read_relocated_scene};
use crate::recording_file::recording_of_bytes;
use crate::scene::{Scene, SceneDevice};
use palpate::{DeviceMode, Input, State, step};
#[cfg(feature = "native")]
use palpate_export::{TemporaryFolder, part_of};
use palpate_haptics::SceneNames;
use palpate_haptics::log::{LogReader, LoggedStep, StepCursor};
#[cfg(feature = "native")]
use palpate_mesh::read_regular_file;
use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Reason that a log cannot be replayed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReplayError {
    /// The operating system refused to read the log, or to unpack its files.
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        /// Action that failed.
        action: &'static str,
        /// File.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The log is not there, but an unfinished one.
    #[error(
        "cannot read the log {}: there is only {}, of a run that is going on, was killed or had no room; what is in it can be read by that \
         name",
        path.display(), part.display()
    )]
    OnlyPart {
        /// Log.
        path: PathBuf,
        /// Unfinished log.
        part: PathBuf,
    },
    /// The file is no log, or damaged.
    #[error("{}: {error}", path.display())]
    Log {
        /// Log.
        path: PathBuf,
        /// Error of the reader.
        error: palpate_haptics::Error,
    },
    /// There is no temporary folder for the log's files.
    #[error("cannot make a folder for the log's files: {0}")]
    TemporaryFolder(io::Error),
    /// The log does not name its scene.
    #[error("the log does not tell which scene it is of")]
    NoScene,
    /// The scene in the log is refused.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// Steps are missing.
    #[error("{}: step {step} comes after step {previous}: the log missed steps, and can't be replayed beyond", path.display())]
    MissedSteps {
        /// Log.
        path: PathBuf,
        /// Step after the gap.
        step: u64,
        /// Step before the gap.
        previous: u64,
    },
    /// A computed number differs from the logged one.
    #[error(
        "{}: step {} differs: {} was {:?}, now it is {:?}. The log is of palpate {}, and so is this; only the same build on the same \
         kind of machine gives the same bits",
        path.display(), difference.step, difference.quantity, difference.logged, difference.computed, env!("CARGO_PKG_VERSION")
    )]
    Differs {
        /// Log.
        path: PathBuf,
        /// The number.
        difference: Difference,
    },
    /// The log is empty.
    #[error("{}: the log holds no steps", .0.display())]
    NoSteps(PathBuf),
}

/// Number that differs from the logged one.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference {
    /// Step.
    pub step: u64,
    /// Name of the number.
    pub quantity: String,
    /// Value in the log.
    pub logged: f64,
    /// Value now.
    pub computed: f64,
}

/// Result of a replay.
#[derive(Debug, Clone, PartialEq)]
pub struct Replayed {
    /// Number of steps.
    pub steps: u64,
    /// First difference; none for a log of this version.
    pub first_difference: Option<Difference>,
}

/// Log with the scene that it carries.
pub struct LogReplay {
    path: PathBuf,
    reader: LogReader<'static>,
    facts: BTreeMap<String, String>,
    /// Scene; the log is one of its inputs.
    pub scene: Scene,
    /// Number of steps.
    pub steps: u64,
    names: SceneNames,
    modes: Vec<DeviceMode>,
    // The unpacked files must outlive the scene: tables are read on first use.
    #[cfg(feature = "native")]
    _folder: Option<TemporaryFolder>,
}

/// Place in the replay of a log, for a program that computes it step by step.
pub struct ReplayCursor {
    steps: StepCursor,
    done: u64,
    first_difference: Option<Difference>,
}

impl LogReplay {
    /// Reads a log.
    ///
    /// # Errors
    /// When it cannot be read, or its scene is refused.
    #[cfg(feature = "native")]
    pub fn read(path: &Path) -> Result<Self, ReplayError> {
        let bytes = read_regular_file(path).map_err(|source| {
            let part = part_of(path);
            match source.kind() {
                io::ErrorKind::NotFound if part.is_file() => {
                    ReplayError::OnlyPart { path: path.into(), part }
                }
                _ => ReplayError::Io { action: "read the log", path: path.into(), source },
            }
        })?;
        let content = LogContent::new(path, bytes)?;
        let (scene, folder) = unpack(content.files()?, content.scene())?;
        Ok(Self { _folder: Some(folder), ..content.with(scene)? })
    }

    /// Log of the bytes of a file, whose scene stays in memory: its recordings and paths, but no table and no mesh. Errors name `path`.
    ///
    /// # Errors
    /// When it is no log, or its scene is refused.
    pub fn from_bytes(path: &Path, bytes: Vec<u8>) -> Result<Self, ReplayError> {
        let content = LogContent::new(path, bytes)?;
        let scene = scene_in_memory(content.files()?, content.scene())?;
        content.with(scene)
    }

    /// State before the first step: that of the scene, or the one that the log resumes from.
    ///
    /// # Errors
    /// [`ReplayError::Log`].
    pub fn initial_state(&self) -> Result<State, ReplayError> {
        let model = &self.scene.model;
        let motions = self.reader.start(&self.names).map_err(|error| self.named(error))?;
        Ok(motions.map_or_else(|| State::new(model), |motions| State::resume(model, &motions)))
    }

    /// Input before the first step; for devices without a path that of the first step.
    ///
    /// # Errors
    /// [`ReplayError::Log`].
    pub fn initial_input(&self) -> Result<Input, ReplayError> {
        let mut input = self.scene.input_at(0.0);
        if let Some(logged) = self.reader.logged_steps().next() {
            let first = logged.and_then(|logged| logged.input(&self.names, &self.modes));
            let first = first.map_err(|error| self.named(error))?;
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

    /// Whether the log was cut: its last steps and its summary are missing.
    pub fn is_cut(&self) -> bool {
        self.reader.is_cut()
    }

    /// Warning about a log that was cut, with what was read of it.
    pub fn warning(&self) -> Option<String> {
        let (path, steps) = (self.path.display(), self.steps);
        let seconds = steps as f64 * self.scene.model.parameters().step_s;
        self.is_cut().then(|| {
            format!(
                "{path}: the log ends without its summary after {steps} steps ({seconds:.3} s): was the run killed? `palpate recover \
                 {path} -o WHOLE.mcap` makes a whole file"
            )
        })
    }

    /// Version of palpate that wrote the log.
    pub fn version(&self) -> &str {
        self.facts.get("version").map_or("?", String::as_str)
    }

    /// Computes up to `max_steps` steps, compares each with the log, and calls `visit` with its input, state and compute time.
    ///
    /// # Errors
    /// When steps are missing, a number differs in a log of this version, or `visit` fails.
    pub fn replay<E: From<ReplayError>>(
        &self,
        state: &mut State,
        max_steps: u64,
        mut visit: impl FnMut(&Input, &State, Duration) -> Result<(), E>,
    ) -> Result<Replayed, E> {
        let mut cursor = self.cursor();
        for _ in 0..max_steps {
            let Some(next) = cursor.next(self) else { break };
            let (logged, input) = next?;
            let before = Instant::now();
            step(&self.scene.model, state, &input);
            let took = before.elapsed();
            cursor.compare(self, &logged, state)?;
            visit(&input, state, took)?;
        }
        Ok(cursor.finish(self)?)
    }

    /// Place before the first step.
    pub fn cursor(&self) -> ReplayCursor {
        ReplayCursor { steps: self.reader.step_cursor(), done: 0, first_difference: None }
    }

    fn named(&self, error: palpate_haptics::Error) -> ReplayError {
        ReplayError::Log { path: self.path.clone(), error }
    }
}

impl ReplayCursor {
    /// Next logged step with its input; `None` at the end.
    ///
    /// # Errors
    /// When it cannot be read, or steps before it are missing.
    pub fn next(&mut self, log: &LogReplay) -> Option<Result<(LoggedStep, Input), ReplayError>> {
        let logged = match self.steps.next(&log.reader)? {
            Ok(logged) => logged,
            Err(error) => return Some(Err(log.named(error))),
        };
        if logged.step != self.done + 1 {
            let (path, step, previous) = (log.path.clone(), logged.step, self.done);
            return Some(Err(ReplayError::MissedSteps { path, step, previous }));
        }
        let input = logged.input(&log.names, &log.modes).map_err(|error| log.named(error));
        Some(input.map(|input| (logged, input)))
    }

    /// Compares a step with its state after it.
    ///
    /// # Errors
    /// When a number differs in a log of this version.
    pub fn compare(
        &mut self,
        log: &LogReplay,
        logged: &LoggedStep,
        state: &State,
    ) -> Result<(), ReplayError> {
        if self.first_difference.is_none() {
            let found = logged.first_difference(&log.names, state.output());
            self.first_difference = found.map(|(quantity, then, now)| Difference {
                step: logged.step,
                quantity,
                logged: then,
                computed: now,
            });
        }
        let is_current = log.version() == env!("CARGO_PKG_VERSION");
        if let Some(difference) = self.first_difference.take_if(|_| is_current) {
            return Err(ReplayError::Differs { path: log.path.clone(), difference });
        }
        self.done = logged.step;
        Ok(())
    }

    /// Result of the steps so far.
    ///
    /// # Errors
    /// When there were none.
    pub fn finish(self, log: &LogReplay) -> Result<Replayed, ReplayError> {
        match self.done {
            0 => Err(ReplayError::NoSteps(log.path.clone())),
            steps => Ok(Replayed { steps, first_difference: self.first_difference }),
        }
    }
}

/// Log whose scene has not been read.
struct LogContent {
    path: PathBuf,
    reader: LogReader<'static>,
    facts: BTreeMap<String, String>,
}

impl LogContent {
    fn new(path: &Path, bytes: Vec<u8>) -> Result<Self, ReplayError> {
        let named = |error| ReplayError::Log { path: path.to_path_buf(), error };
        let reader = LogReader::new(bytes).map_err(named)?;
        let facts = reader.metadata().map_err(named)?;
        Ok(Self { path: path.to_path_buf(), reader, facts })
    }

    fn files(&self) -> Result<Vec<(String, Vec<u8>)>, ReplayError> {
        self.reader.files().map_err(|error| ReplayError::Log { path: self.path.clone(), error })
    }

    fn scene(&self) -> Option<&Path> {
        self.facts.get("scene").map(Path::new)
    }

    fn with(self, mut scene: Scene) -> Result<LogReplay, ReplayError> {
        let Self { path, reader, facts } = self;
        let steps = reader.step_count();
        scene.inputs.push(path.clone());
        let names = scene.names();
        let start = reader.start(&names).map_err(|error| ReplayError::Log { path: path.clone(), error })?;
        // Since logs hold initial states, they tell of every held point: a device that has none has let go of the scene's.
        let mode = |device: &SceneDevice| match device.mode {
            DeviceMode::Held(_) if start.is_some() => DeviceMode::Touch,
            mode => mode,
        };
        let modes = scene.devices.iter().map(mode).collect();
        Ok(LogReplay {
            path,
            reader,
            facts,
            scene,
            steps,
            names,
            modes,
            #[cfg(feature = "native")]
            _folder: None,
        })
    }
}

/// Scene of a log from its files: the recordings and motion paths among them, by the names that the scene gives them.
fn scene_in_memory(files: Vec<(String, Vec<u8>)>, scene: Option<&Path>) -> Result<Scene, ReplayError> {
    let scene = scene.ok_or(ReplayError::NoScene)?;
    let mut files: BTreeMap<PathBuf, Vec<u8>> =
        files.into_iter().map(|(name, content)| (PathBuf::from(name), content)).collect();
    let text = text_of(scene, files.remove(scene).unwrap_or_default())?;
    let mut parts = PartsInMemory::default();
    let folder = scene.parent().unwrap_or(Path::new(""));
    // A scene that cannot be read is refused below, with the line.
    for name in named_files(&text).unwrap_or_default() {
        let path = folder.join(&name);
        let Some(content) = files.get(&path) else { continue };
        match path.extension().and_then(|ending| ending.to_str()) {
            Some("csv") => drop(parts.paths.insert(name, String::from_utf8_lossy(content).into_owned())),
            Some("palp") => {
                drop(parts.recordings.insert(name, Arc::new(recording_of_bytes(&path, content)?)));
            }
            // A mesh, or a recording of another name.
            _ => drop(recording_of_bytes(&path, content).map(|recording| {
                parts.recordings.insert(name, Arc::new(recording));
            })),
        }
    }
    Ok(read_scene_text(scene, &text, &parts, RunMode::RealTime)?)
}

/// Scene of a log, and the temporary folder with its files.
#[cfg(feature = "native")]
fn unpack(
    files: Vec<(String, Vec<u8>)>,
    scene: Option<&Path>,
) -> Result<(Scene, TemporaryFolder), ReplayError> {
    let scene = scene.ok_or(ReplayError::NoScene)?;
    let folder = TemporaryFolder::new().map_err(ReplayError::TemporaryFolder)?;
    let mut relocated = Relocated::new();
    for (at, (name, data)) in files.into_iter().enumerate() {
        let name = PathBuf::from(name);
        // Only the file name is used: nothing is written outside of the folder.
        let file = name.file_name().map_or_else(|| "file".into(), |name| name.to_os_string());
        let own = folder.path().join(at.to_string());
        let stored = own.join(file);
        let written = std::fs::create_dir(&own).and_then(|()| std::fs::write(&stored, data));
        written.map_err(|source| ReplayError::Io { action: "unpack", path: stored.clone(), source })?;
        relocated.insert(name, stored);
    }
    Ok((read_relocated_scene(scene, &relocated, RunMode::RealTime)?, folder))
}
