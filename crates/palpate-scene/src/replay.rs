//! Replay of a log: its steps are computed again from the scene that it carries, and compared.
//!
//! A log of this version must repeat bit for bit. A log of another version is computed with the logged inputs, and the first
//! difference is reported: a change of the solver changes last digits.

use crate::error::SceneError;
use crate::file::{Relocated, RunMode, read_relocated_scene};
use crate::scene::{Scene, SceneDevice};
use palpate::{DeviceMode, Input, State, step};
use palpate_export::{TemporaryFolder, part_of};
use palpate_haptics::SceneNames;
use palpate_haptics::log::LogReader;
use palpate_mesh::read_regular_file;
use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
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
    _folder: TemporaryFolder,
}

impl LogReplay {
    /// Reads a log.
    ///
    /// # Errors
    /// When it cannot be read, or its scene is refused.
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
        let named = |error| ReplayError::Log { path: path.to_path_buf(), error };
        let reader = LogReader::new(bytes).map_err(named)?;
        let facts = reader.metadata().map_err(named)?;
        let files = reader.files().map_err(named)?;
        let steps = reader.step_count();
        let (mut scene, folder) = unpack(files, facts.get("scene").map(Path::new))?;
        scene.inputs.push(path.to_path_buf());
        let names = scene.names();
        // Since logs hold initial states, they tell of every held point: a device that has none has let go of the scene's.
        let tells_held_points = reader.start(&names).map_err(named)?.is_some();
        let mode = |device: &SceneDevice| match device.mode {
            DeviceMode::Held(_) if tells_held_points => DeviceMode::Touch,
            mode => mode,
        };
        let modes = scene.devices.iter().map(mode).collect();
        Ok(Self { path: path.to_path_buf(), reader, facts, scene, steps, names, modes, _folder: folder })
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
        let path = || self.path.clone();
        let is_current = self.version() == env!("CARGO_PKG_VERSION");
        let (mut done, mut first_difference) = (0, None);
        for logged in self.reader.logged_steps().take(max_steps.try_into().unwrap_or(usize::MAX)) {
            let logged = logged.map_err(|error| self.named(error))?;
            if logged.step != done + 1 {
                let gap = ReplayError::MissedSteps { path: path(), step: logged.step, previous: done };
                return Err(gap.into());
            }
            let input = logged.input(&self.names, &self.modes).map_err(|error| self.named(error))?;
            let before = Instant::now();
            step(&self.scene.model, state, &input);
            let took = before.elapsed();
            if first_difference.is_none() {
                let found = logged.first_difference(&self.names, state.output());
                first_difference = found.map(|(quantity, then, now)| Difference {
                    step: logged.step,
                    quantity,
                    logged: then,
                    computed: now,
                });
            }
            if let Some(difference) = first_difference.take_if(|_| is_current) {
                return Err(ReplayError::Differs { path: path(), difference }.into());
            }
            done = logged.step;
            visit(&input, state, took)?;
        }
        if done == 0 {
            return Err(ReplayError::NoSteps(path()).into());
        }
        Ok(Replayed { steps: done, first_difference })
    }

    fn named(&self, error: palpate_haptics::Error) -> ReplayError {
        ReplayError::Log { path: self.path.clone(), error }
    }
}

/// Scene of a log, and the temporary folder with its files.
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
