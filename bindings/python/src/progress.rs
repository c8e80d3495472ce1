//! Progress of a recording: calls of a Python function, warnings, and KeyboardInterrupt.

use crate::keywords::keywords_in;
use palpate_fem::Progress;
use pyo3::prelude::*;
use std::cell::{Cell, RefCell};
use std::time::{Duration, Instant};

/// Interval at which Python is asked for signals: not felt by whoever presses Ctrl-C, and no cost.
pub const SIGNAL_INTERVAL: Duration = Duration::from_millis(50);

/// Listener that calls `progress(stage, share)`, at most a hundred times a stage. The first exception interrupts the work.
pub struct PythonProgress {
    callback: Option<Py<PyAny>>,
    stage: String,
    total: u64,
    done: u64,
    /// Hundredths that were reported.
    reported: u64,
    asked: Cell<Instant>,
    failure: RefCell<Option<PyErr>>,
}

impl PythonProgress {
    /// Listener for a callback, or for signals alone.
    pub fn new(callback: Option<Py<PyAny>>) -> Self {
        Self {
            callback,
            stage: String::new(),
            total: 0,
            done: 0,
            reported: 0,
            asked: Cell::new(Instant::now()),
            failure: RefCell::new(None),
        }
    }

    /// Exception that interrupted the work.
    pub fn failure(self) -> Option<PyErr> {
        self.failure.into_inner()
    }

    /// Keep the first exception.
    fn keep<T>(&self, result: PyResult<T>) {
        if let Err(error) = result {
            self.failure.borrow_mut().get_or_insert(error);
        }
    }

    fn report(&self, share: Option<f64>) {
        let Some(callback) = &self.callback else { return };
        if self.failure.borrow().is_none() {
            self.keep(Python::attach(|py| callback.call1(py, (self.stage.as_str(), share))));
        }
    }
}

impl Progress for PythonProgress {
    fn begin(&mut self, stage: &str, total: u64) {
        (self.stage, self.total, self.done, self.reported) = (stage.into(), total, 0, 0);
        self.report((total > 0).then_some(0.0));
    }

    fn advance(&mut self, units: u64) {
        self.done += units;
        let share = (self.done as f64 / self.total.max(1) as f64).min(1.0);
        let hundredths = (100.0 * share) as u64;
        if hundredths > self.reported {
            self.reported = hundredths;
            self.report(Some(share));
        }
    }

    fn warn(&mut self, text: &str) {
        self.keep(Python::attach(|py| warn(py, &keywords_in(text))));
    }

    fn is_interrupted(&self) -> bool {
        if self.failure.borrow().is_none() && self.asked.get().elapsed() > SIGNAL_INTERVAL {
            self.asked.set(Instant::now());
            self.keep(Python::attach(|py| py.check_signals()));
        }
        self.failure.borrow().is_some()
    }
}

/// Warn through Python's warnings, at the line that called the package.
pub fn warn(py: Python<'_>, text: &str) -> PyResult<()> {
    py.import("palpate._errors")?.call_method1("warn", (text,))?;
    Ok(())
}
