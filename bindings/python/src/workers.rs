//! Threads of its own for a batch, or for a recording in a forked process.

use crate::errors::{Class, exception};
use pyo3::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

/// Threads that work together.
pub struct Workers {
    pool: ThreadPool,
    /// Process that they live in.
    process: u32,
}

impl Workers {
    /// A number of threads.
    pub fn new(threads: usize) -> Result<Self, ThreadPoolBuildError> {
        let name = |at| format!("palpate-{at}");
        let pool = ThreadPoolBuilder::new().num_threads(threads).thread_name(name).build()?;
        Ok(Self { pool, process: std::process::id() })
    }

    /// Number of threads.
    pub fn count(&self) -> usize {
        self.pool.current_num_threads()
    }

    /// Result of some work that may use parallel iterators.
    pub fn run<T: Send>(&mut self, work: impl FnOnce() -> T + Send) -> Result<T, ThreadPoolBuildError> {
        if self.process != std::process::id() {
            // A fork has none of its parent's threads: multiprocessing. Nobody answers those of the old pool.
            let new = Self::new(self.count())?;
            std::mem::forget(std::mem::replace(self, new));
        }
        Ok(self.pool.install(work))
    }
}

/// Exception when the system gives no threads.
pub fn no_threads(py: Python<'_>, error: &ThreadPoolBuildError) -> PyErr {
    exception(py, Class::Palpate, format!("threads cannot be started: {error}"))
}
