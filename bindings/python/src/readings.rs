//! Readings of a state: what a simulation returns of it.

use crate::arrays::{array, flat};
use crate::contacts::ContactLayout;
use crate::errors::{Class, catch_panic, exception, internal_error};
use glam::DVec3;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use palpate::{DeformationSnapshot, EnergyLedger, Model, Output, StepStatus};
use palpate_scene::{pose_row, twist_row};
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

/// Forces on the hands [N].
pub fn forces(output: &Output) -> Vec<[f64; 3]> {
    output.devices.iter().map(|device| device.force_on_hand.to_array()).collect()
}

/// Held points, and centres of the tips [m].
pub fn proxies(output: &Output) -> Vec<[f64; 3]> {
    output.devices.iter().map(|device| device.proxy.to_array()).collect()
}

/// Poses of the objects.
pub fn poses(output: &Output) -> Vec<[f64; 7]> {
    output.objects.iter().map(|object| pose_row(&object.pose)).collect()
}

/// Velocities of the objects.
pub fn velocities(output: &Output) -> Vec<[f64; 6]> {
    output.objects.iter().map(|object| twist_row(&object.twist)).collect()
}

/// Forces [N] and torques [N·m] on the clamps.
pub fn clamp_loads(output: &Output) -> Vec<[f64; 6]> {
    let row = |[f, t]: [DVec3; 2]| [f.x, f.y, f.z, t.x, t.y, t.z];
    output.clamps.iter().map(|clamp| row([clamp.force, clamp.torque])).collect()
}

/// Net forces on planes and obstacles [N].
pub fn obstacle_forces(output: &Output) -> Vec<[f64; 3]> {
    output.obstacles.iter().map(|own| own.force.to_array()).collect()
}

/// Net torques on planes and obstacles [N·m].
pub fn obstacle_torques(output: &Output) -> Vec<[f64; 3]> {
    output.obstacles.iter().map(|own| own.torque.to_array()).collect()
}

/// Net forces on objects [N].
pub fn object_forces(output: &Output) -> Vec<[f64; 3]> {
    output.objects.iter().map(|own| own.force.to_array()).collect()
}

/// Net torques on objects [N·m].
pub fn object_torques(output: &Output) -> Vec<[f64; 3]> {
    output.objects.iter().map(|own| own.torque.to_array()).collect()
}

/// Array of rows, one for each item of an output.
pub fn array_of<const N: usize>(py: Python<'_>, rows: Vec<[f64; N]>) -> PyResult<Bound<'_, PyAny>> {
    array(py, rows.as_flattened().to_vec(), &[rows.len(), N])
}

/// Whether each object is asleep.
pub fn asleep<'py>(py: Python<'py>, output: &Output) -> Bound<'py, PyAny> {
    let asleep = output.objects.iter().map(|object| object.is_asleep).collect();
    PyArray1::<bool>::from_vec(py, asleep).into_any()
}

/// Contacts, a structured array.
pub fn contacts<'py>(
    py: Python<'py>,
    layout: &ContactLayout,
    output: &Output,
) -> PyResult<Bound<'py, PyAny>> {
    let mut rows = Vec::new();
    output.contacts.iter().for_each(|contact| layout.append(output.time_s, contact, &mut rows));
    layout.array(py, rows, false)
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
    model: &Model,
    deformation: &DeformationSnapshot,
) -> PyResult<Bound<'py, PyAny>> {
    let rest = model.recordings().nth(deformation.object()).map_or(&[][..], |own| &own.surface.positions);
    let pose = deformation.pose();
    let mut displacement = vec![DVec3::ZERO; rest.len()];
    catch_panic(|| deformation.surface_displacement(model, &mut displacement))
        .map_err(|text| internal_error(py, &text))?;
    let positions = rest.iter().zip(&displacement).map(|(rest, moved)| pose.world_from_body(*rest + *moved));
    array(py, flat(positions), &[rest.len(), 3])
}
