//! `palpate.Snapshot`: the state of a simulation, or of a row of a batch.

use crate::errors::input_error;
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

impl Snapshot {
    /// One snapshot, or a list of them, of a scene.
    pub fn list(given: &Bound<'_, PyAny>, scene: &Arc<palpate_scene::Scene>) -> PyResult<Vec<Py<Self>>> {
        let py = given.py();
        let snapshots: Vec<Py<Self>> = match given.extract::<Py<Self>>() {
            Ok(one) => vec![one],
            Err(_) => given
                .extract()
                .map_err(|_| input_error(py, "snapshots is no Snapshot, and no list of them"))?,
        };
        if snapshots.iter().any(|own| !Arc::ptr_eq(&own.get().scene, scene)) {
            let message = "the snapshot is of another scene: restore it in a batch of the same Scene object";
            return Err(input_error(py, message));
        }
        Ok(snapshots)
    }
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
