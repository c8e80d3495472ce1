//! Scalar arguments: whole numbers, texts and paths. What Python itself refuses by an OverflowError or a UnicodeEncodeError is an InputError.

use crate::errors::input_error;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use std::path::PathBuf;

/// Whole number of 64 bits.
#[derive(Clone, Copy)]
pub struct Whole(pub i64);

/// Text.
pub struct Text(pub String);

/// Path of a file.
#[derive(PartialEq, Eq, Hash)]
pub struct FilePath(pub PathBuf);

impl<'a, 'py> FromPyObject<'a, 'py> for Whole {
    type Error = PyErr;

    fn extract(given: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        let too_large = || format!("{} is too large for a whole number of 64 bits", shown(given));
        given.extract().map(Self).map_err(|error| refused(given.py(), error, too_large))
    }
}

impl<'a, 'py> FromPyObject<'a, 'py> for Text {
    type Error = PyErr;

    fn extract(given: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        let not_text =
            || format!("{} has characters that no text has (half of a surrogate pair)", shown(given));
        given.extract().map(Self).map_err(|error| refused(given.py(), error, not_text))
    }
}

impl<'a, 'py> FromPyObject<'a, 'py> for FilePath {
    type Error = PyErr;

    fn extract(given: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        let no_path = || format!("the path {} has characters that no file's name has", shown(given));
        given.extract().map(Self).map_err(|error| refused(given.py(), error, no_path))
    }
}

impl Whole {
    /// Number of an argument that has a default.
    pub fn number_of(given: &Bound<'_, PyAny>) -> PyResult<i64> {
        given.extract().map(|Self(number)| number)
    }
}

/// Exception of Python that tells a wrong type, which names the argument; for anything else an InputError.
fn refused(py: Python<'_>, error: PyErr, text: impl FnOnce() -> String) -> PyErr {
    if error.is_instance_of::<PyTypeError>(py) { error } else { input_error(py, text()) }
}

/// Value as Python shows it.
fn shown(given: Borrowed<'_, '_, PyAny>) -> String {
    // ASCII, so that it is text in any case.
    let ascii = given.py().import("builtins").and_then(|module| module.call_method1("ascii", (given,)));
    ascii.and_then(|text| text.extract()).unwrap_or_else(|_| "the argument".into())
}
