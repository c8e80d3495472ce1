//! Warnings of scenes and runs: as Python's warnings, each kind of a part once, and as dicts.

use crate::errors::kind_name;
use crate::progress::warn;
use palpate_scene::{Warning, WarningKind};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::{Mutex, PoisonError};

/// Kinds and parts that a caller has been warned of.
#[derive(Default)]
pub struct Told(Mutex<Vec<(WarningKind, String)>>);

impl Told {
    /// Warn of what has not been told.
    pub fn tell<'w>(&self, py: Python<'_>, warnings: impl IntoIterator<Item = &'w Warning>) -> PyResult<()> {
        for Warning { kind, part, message } in warnings {
            // Python's filters run code of the caller: not while it is locked.
            let is_new = {
                let mut told = self.0.lock().unwrap_or_else(PoisonError::into_inner);
                let is_new = !told.iter().any(|(own, of)| own == kind && of == part);
                if is_new {
                    told.push((*kind, part.clone()));
                }
                is_new
            };
            if is_new {
                warn(py, message)?;
            }
        }
        Ok(())
    }
}

impl Clone for Told {
    fn clone(&self) -> Self {
        Self(Mutex::new(self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()))
    }
}

/// Warnings as dicts with `kind`, `part` and `message`.
pub fn warnings_by_name<'py>(py: Python<'py>, warnings: &[Warning]) -> PyResult<Vec<Bound<'py, PyDict>>> {
    let entry = |Warning { kind, part, message }: &Warning| {
        let entry = PyDict::new(py);
        entry.set_item("kind", kind_name(kind))?;
        entry.set_item("part", part)?;
        entry.set_item("message", message)?;
        Ok(entry)
    };
    warnings.iter().map(entry).collect()
}
