//! `palpate.Snapshot`: the state of a simulation, or of a row of a batch.

use crate::run_state::RunState;
use pyo3::prelude::*;
use std::sync::Arc;

/// State of a simulation, or of a row of a batch, at a time, for :meth:`Simulation.restore` and :meth:`Batch.restore`.
#[pyclass(frozen, module = "palpate")]
pub struct Snapshot {
    /// Scene, which a restored simulation shares.
    pub scene: Arc<palpate_scene::Scene>,
    pub run: RunState,
}

#[pymethods]
impl Snapshot {
    /// Time [s].
    #[getter]
    fn time(&self) -> f64 {
        self.run.state.output().time_s
    }

    fn __repr__(&self) -> String {
        format!("<palpate.Snapshot at {:.6} s>", self.time())
    }
}
