//! Readings of a state: what a simulation returns of it.

use crate::arrays::{array, flat};
use crate::errors::{Class, catch_panic, exception, internal_error};
use glam::DVec3;
use numpy::{PyArray2, PyArrayMethods};
use palpate::{EnergyLedger, Output, State, StepStatus};
use palpate_scene::Scene;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Energy ledger [J], by name.
pub fn energy_by_name<'py>(py: Python<'py>, ledger: &EnergyLedger) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    for (name, value) in ledger.named() {
        dict.set_item(name, value)?;
    }
    Ok(dict)
}

/// Status of a step, by name.
pub fn status_by_name<'py>(py: Python<'py>, status: &StepStatus) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("solver_residual", status.solver_residual_m)?;
    dict.set_item("iterations", status.iterations)?;
    dict.set_item("dependent_rows", status.dependent_rows)?;
    dict.set_item("unsolved_islands", status.unsolved_islands)?;
    dict.set_item("islands_out_of_budget", status.islands_out_of_budget)?;
    dict.set_item("dropped_contacts", status.dropped_contacts)?;
    Ok(dict)
}

/// Row of a force [N] and a torque [N·m].
pub fn load_row(force: DVec3, torque: DVec3) -> [f64; 6] {
    [force.x, force.y, force.z, torque.x, torque.y, torque.z]
}

/// Write the forces on the hands into a simulation's array.
pub fn write_forces(array: &Bound<'_, PyArray2<f64>>, output: &Output) -> PyResult<()> {
    let refused = |error: String| {
        let message = format!(
            "the array of forces cannot be written to ({error}): it is the simulation's own; use a copy"
        );
        exception(array.py(), Class::Palpate, message)
    };
    let mut forces = array.try_readwrite().map_err(|error| refused(error.to_string()))?;
    let forces = forces.as_slice_mut().map_err(|error| refused(error.to_string()))?;
    for (row, device) in forces.chunks_exact_mut(3).zip(&output.devices) {
        row.copy_from_slice(&device.force_on_hand.to_array());
    }
    Ok(())
}

/// Positions of an object's surface nodes [m, world].
pub fn surface<'py>(
    py: Python<'py>,
    scene: &Scene,
    state: &State,
    object: usize,
) -> PyResult<Bound<'py, PyAny>> {
    let model = &scene.model;
    let rest = model.recordings().nth(object).map_or(&[][..], |own| &own.surface.positions);
    let pose = state.output().objects[object].pose;
    let mut displacement = vec![DVec3::ZERO; rest.len()];
    catch_panic(|| state.surface_displacement(model, object, &mut displacement))
        .map_err(|text| internal_error(py, &text))?;
    let positions = rest.iter().zip(&displacement).map(|(rest, moved)| pose.world_from_body(*rest + *moved));
    array(py, flat(positions), &[rest.len(), 3])
}
