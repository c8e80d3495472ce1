//! Report of a session, by name: the names of `palpate run --realtime --json`, in SI units.

use crate::warnings::warnings_by_name;
use palpate_haptics::{Percentiles, Report, Timing};
use palpate_scene::{Scene, Warning};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Timing of the force process.
pub fn timing_by_name<'py>(py: Python<'py>, timing: &Timing) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("cycles", timing.cycles())?;
    dict.set_item("compute_time", percentiles_by_name(py, timing.compute_us())?)?;
    dict.set_item("lateness", percentiles_by_name(py, timing.lateness_us())?)?;
    dict.set_item("overruns", timing.overruns)?;
    dict.set_item("own_overruns", timing.own_overruns)?;
    dict.set_item("skipped", timing.skipped)?;
    Ok(dict)
}

/// Percentiles [s].
fn percentiles_by_name(py: Python<'_>, of: Percentiles) -> PyResult<Bound<'_, PyDict>> {
    let dict = PyDict::new(py);
    for (name, micros) in [("p50", of.p50), ("p99", of.p99), ("p999", of.p999), ("max", of.max)] {
        dict.set_item(name, 1e-6 * micros)?;
    }
    Ok(dict)
}

/// Report of a session that has ended.
pub fn report_by_name<'py>(
    py: Python<'py>,
    scene: &Scene,
    report: &Report,
    warnings: &[Warning],
) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("steps", report.steps)?;
    dict.set_item("wall_time", report.wall_s)?;
    dict.set_item("steal_time", report.steal_time_s)?;
    dict.set_item("granted", report.granted.to_string())?;
    dict.set_item("force_process", timing_by_name(py, &report.force)?)?;
    dict.set_item("unsolved_steps", report.unsolved_steps)?;
    dict.set_item("steps_out_of_budget", report.steps_out_of_budget)?;
    let names = scene.names();
    let by_object = PyDict::new(py);
    for (name, penetration_m) in names.objects.iter().zip(&report.largest_penetration_m) {
        by_object.set_item(name, penetration_m)?;
    }
    dict.set_item("largest_penetration", by_object)?;
    let by_device = PyDict::new(py);
    for (name, steps) in names.devices.iter().zip(&report.touching_steps) {
        by_device.set_item(name, steps)?;
    }
    dict.set_item("touching_steps", by_device)?;
    let log = report.log.map(|log| {
        let dict = PyDict::new(py);
        dict.set_item("steps", log.steps)?;
        dict.set_item("missed", log.missed)?;
        dict.set_item("whole", !log.is_cut)?;
        PyResult::Ok(dict)
    });
    dict.set_item("warnings", warnings_by_name(py, warnings)?)?;
    dict.set_item("log", log.transpose()?)?;
    Ok(dict)
}
