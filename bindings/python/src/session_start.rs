//! Start of a session: its scheduling, its state and its log.

use crate::errors::{Class, exception, input_error, scene_error};
use crate::progress::warn;
use crate::scalars::Whole;
use crate::scene::Scene as PythonScene;
use crate::session_thread::{SessionLog, lock};
use palpate::{ObjectSnapshot, State};
use palpate_export::TemporaryFolder;
use palpate_haptics::Scheduling;
use palpate_scene::{GrowingLog, RunMode, Scene, SceneLog, read_driven_scene};
use pyo3::prelude::*;
use std::path::Path;
use std::sync::{Arc, Mutex};

/// Highest real-time priority.
const MAX_PRIORITY: i64 = 99;

/// Text of the first failure of a log, until it is told.
pub type LogFailure = Arc<Mutex<Option<String>>>;

/// Scheduling of the force process.
pub fn scheduling(priority: Option<Whole>, core: Option<Whole>) -> Result<Scheduling, String> {
    let priority = priority.map(|Whole(given)| match u8::try_from(given) {
        Ok(priority) if (1..=MAX_PRIORITY).contains(&given) => Ok(priority),
        _ => Err(format!("priority is {given}, expected 1 to {MAX_PRIORITY}")),
    });
    let core = core.map(|Whole(given)| {
        usize::try_from(given).map_err(|_| format!("core is {given}, expected a whole number from 0"))
    });
    Ok(Scheduling { priority: priority.transpose()?, core: core.transpose()? })
}

/// Check that a scene can begin with objects of another one.
pub fn check_start(scene: &Scene, objects: &[ObjectSnapshot]) -> Result<(), String> {
    if !scene.can_resume() {
        return Err("a scene with paths or clamps begins as it says: it has no start of another one".into());
    }
    let recordings = scene.model.recordings();
    let expected: Vec<usize> =
        recordings.map(|recording| recording.modes.angular_frequencies.len()).collect();
    let given: Vec<usize> = objects.iter().map(|object| object.modes.len()).collect();
    if given == expected {
        return Ok(());
    }
    Err(format!(
        "the start is of objects with {given:?} modes, the scene's have {expected:?}: take a scene of the same recordings"
    ))
}

/// Begin a log that tells of its first failure.
pub fn begin_log(
    py: Python<'_>,
    scene: &Py<PythonScene>,
    inner: &Scene,
    path: &Path,
    (state, failure): (&State, &LogFailure),
) -> PyResult<SessionLog> {
    if path.file_name().is_none() {
        return Err(input_error(
            py,
            format!("log is {:?}, expected the name of a file", path.display().to_string()),
        ));
    }
    let raise = |error| scene_error(py, &error);
    // Parts in memory are saved as files, which the log takes along.
    let mut folder = None;
    let content = if scene.get().has_parts_in_memory() {
        let made = TemporaryFolder::new().map_err(|error| {
            exception(py, Class::File, format!("cannot make a folder for the log's scene: {error}"))
        })?;
        let file = made.path().join("scene.toml");
        scene.bind(py).call_method1("save", (&file,))?;
        folder = Some(made);
        SceneLog::new(&read_driven_scene(&file, RunMode::RealTime).map_err(raise)?, None)
    } else {
        SceneLog::new(inner, Some(scene.get().toml().to_string()))
    };
    for store in content.stores_left_out() {
        warn(
            py,
            &format!("the log does not carry the table {}: a replay needs it where it is", store.display()),
        )?;
    }
    let failure = Arc::clone(failure);
    let tell = move |text: &str| *lock(&failure) = Some(text.to_string());
    let file = GrowingLog::create(path, &content.inputs(), Box::new(tell)).map_err(raise)?;
    let failures = file.failures();
    let log = content.begin(file, state).map_err(raise)?;
    failures.tell();
    drop(folder);
    Ok(log)
}
