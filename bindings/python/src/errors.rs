//! Exceptions: the classes of `palpate._errors`, by the kinds of palpate's errors.

use palpate_scene::{SceneError, SceneErrorKind};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::any::Any;
use std::fmt::{Debug, Display};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::{Mutex, MutexGuard, TryLockError};

/// Class of an exception, by its name in `palpate._errors`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Class {
    Palpate,
    File,
    Input,
    Log,
    Mesh,
    Recording,
    Scene,
    Step,
}

impl Class {
    fn name(self) -> &'static str {
        match self {
            Self::Palpate => "PalpateError",
            Self::File => "FileError",
            Self::Input => "InputError",
            Self::Log => "LogError",
            Self::Mesh => "MeshError",
            Self::Recording => "RecordingError",
            Self::Scene => "SceneError",
            Self::Step => "StepError",
        }
    }
}

/// Exception of a class with a message.
pub fn exception(py: Python<'_>, class: Class, message: impl Display) -> PyErr {
    raise(py, class, &message.to_string(), &PyDict::new(py))
}

/// Exception for an argument that cannot be used.
pub fn input_error(py: Python<'_>, message: impl Display) -> PyErr {
    exception(py, Class::Input, message)
}

fn raise(py: Python<'_>, class: Class, message: &str, attributes: &Bound<'_, PyDict>) -> PyErr {
    let made = py
        .import("palpate._errors")
        .and_then(|module| module.getattr(class.name()))
        .and_then(|class| class.call((message,), Some(attributes)));
    made.map_or_else(|error| error, PyErr::from_value)
}

/// Exception for an error of a scene, a mesh or a recording, with its kind, file, line and key.
pub fn scene_error(py: Python<'_>, error: &SceneError) -> PyErr {
    let class = match error.kind {
        _ if error.line.is_some() => Class::Scene,
        SceneErrorKind::Io => Class::File,
        SceneErrorKind::Mesh => Class::Mesh,
        SceneErrorKind::Recording | SceneErrorKind::Record => Class::Recording,
        SceneErrorKind::Log => Class::Log,
        _ => Class::Scene,
    };
    let attributes = PyDict::new(py);
    let filled = attributes
        .set_item("kind", kind_name(error.kind))
        .and_then(|()| attributes.set_item("file", error.file.as_deref()))
        .and_then(|()| attributes.set_item("line", error.line))
        .and_then(|()| attributes.set_item("key", error.key.as_deref()));
    let filled = filled.and_then(|()| match class {
        Class::File => attributes.set_item("errno", error.os_error),
        _ => Ok(()),
    });
    filled.err().unwrap_or_else(|| raise(py, class, &error.to_string(), &attributes))
}

/// Exception for a file that the operating system refuses to read.
pub fn file_error(py: Python<'_>, file: &Path, os_error: Option<i32>, message: &str) -> PyErr {
    let attributes = PyDict::new(py);
    let filled = attributes.set_item("file", file).and_then(|()| attributes.set_item("errno", os_error));
    filled.err().unwrap_or_else(|| raise(py, Class::File, message, &attributes))
}

/// Kind in words with underscores, as `out_of_range`.
pub fn kind_name(kind: impl Debug) -> String {
    let mut name = String::new();
    for letter in format!("{kind:?}").chars() {
        if letter.is_uppercase() && !name.is_empty() {
            name.push('_');
        }
        name.extend(letter.to_lowercase());
    }
    name
}

/// Result of some work, in which a panic is an error with its text.
pub fn catch_panic<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(work)).map_err(|payload| panic_text(&*payload))
}

/// Exception for a panic.
pub fn internal_error(py: Python<'_>, text: &str) -> PyErr {
    let message = format!(
        "palpate failed inside: {text}. This is a mistake of palpate: please report it with your program"
    );
    exception(py, Class::Palpate, message)
}

fn panic_text(payload: &(dyn Any + Send)) -> String {
    let text = payload.downcast_ref::<String>().map(String::as_str);
    text.or_else(|| payload.downcast_ref::<&str>().copied()).unwrap_or("a panic without text").to_string()
}

/// Guard of a mutex that no other thread may have meanwhile; else an exception with this text.
pub fn lock_at_once<'m, T>(
    py: Python<'_>,
    mutex: &'m Mutex<T>,
    in_use: &'static str,
) -> PyResult<MutexGuard<'m, T>> {
    match mutex.try_lock() {
        Ok(guard) => Ok(guard),
        // A panic is caught before it passes the guard.
        Err(TryLockError::Poisoned(poisoned)) => Ok(poisoned.into_inner()),
        Err(TryLockError::WouldBlock) => Err(exception(py, Class::Palpate, in_use)),
    }
}
