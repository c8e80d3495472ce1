//! Python package of palpate: recordings, scenes, simulations and logs with NumPy arrays.
//!
//! The classes here are thin: they convert arrays and errors, and call the same functions as the command line. Arguments are checked before
//! a step; a simulation that another thread uses is an exception; panics become exceptions.

mod arrays;
mod batch;
mod batch_motion;
mod batch_outputs;
mod batch_rows;
mod batch_series;
mod contacts;
mod device_mode;
mod errors;
mod keywords;
mod log;
mod motion;
mod output;
mod position_check;
mod progress;
mod readings;
mod record;
mod recording;
mod run_length;
mod run_state;
mod scalars;
mod scene;
mod series;
mod session;
mod session_hands;
mod session_report;
mod session_start;
mod session_thread;
mod simulation;
mod snapshot;
mod starts;
mod warnings;
mod workers;

use pyo3::prelude::*;

#[pymodule]
fn _palpate(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<recording::Recording>()?;
    module.add_class::<scene::Scene>()?;
    module.add_class::<simulation::Simulation>()?;
    module.add_class::<batch::Batch>()?;
    module.add_class::<snapshot::Snapshot>()?;
    module.add_class::<log::Log>()?;
    module.add_class::<session::Session>()?;
    module.add_class::<output::Output>()?;
    let stop_sessions = wrap_pyfunction!(session_thread::stop_sessions, module)?;
    module.py().import("atexit")?.call_method1("register", (stop_sessions,))?;
    module.add_function(wrap_pyfunction!(record::record, module)?)
}
