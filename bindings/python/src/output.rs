//! `palpate.Output`: the output of one step of a session.

use crate::arrays::{array, flat};
use crate::contacts::ContactLayout;
use crate::readings::{self, array_of, energy_by_name, status_by_name};
use crate::scene::Scene;
use palpate_haptics::Snapshot;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::Arc;

/// Output of one step of a session, from :meth:`Session.newest`. It stays as it is while the session goes on.
#[pyclass(frozen, module = "palpate")]
pub struct Output {
    pub scene: Arc<palpate_scene::Scene>,
    pub layout: Arc<ContactLayout>,
    pub snapshot: Snapshot,
}

#[pymethods]
impl Output {
    /// Number of the step, from 1; 0 is the start.
    #[getter]
    fn step(&self) -> u64 {
        self.snapshot.step
    }

    /// Time at the end of the step [s]: simulated, which is behind the clock by the steps that were skipped, in slow motion and after a pause.
    #[getter]
    fn time(&self) -> f64 {
        self.snapshot.output.time_s
    }

    /// Positions of the hands [m, world], and points that prescribed forces act on: float64 of shape (devices, 3).
    #[getter]
    fn positions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let Snapshot { input, output, .. } = &self.snapshot;
        let hands = input.devices.iter().zip(&output.devices).map(|(device, out)| device.hand(out));
        array(py, flat(hands), &[input.devices.len(), 3])
    }

    /// Forces on the hands [N, world]: float64 of shape (devices, 3).
    #[getter]
    fn forces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        array_of(py, readings::forces(&self.snapshot.output))
    }

    /// Held points, and centres of the tips that stay outside [m, world]: float64 of shape (devices, 3).
    #[getter]
    fn proxies<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        array_of(py, readings::proxies(&self.snapshot.output))
    }

    /// Centres of mass [m] and orientations of the objects, x, y, z, qw, qx, qy, qz: float64 of shape (objects, 7).
    #[getter]
    fn poses<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        array_of(py, readings::poses(&self.snapshot.output))
    }

    /// Velocities [m/s] and angular velocities [rad/s, world] of the objects: float64 of shape (objects, 6).
    #[getter]
    fn velocities<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        array_of(py, readings::velocities(&self.snapshot.output))
    }

    /// Forces [N] and torques [N·m, world] on the clamps: float64 of shape (clamps, 6).
    #[getter]
    fn clamp_loads<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        array_of(py, readings::clamp_loads(&self.snapshot.output))
    }

    /// Net forces of the objects on the planes and obstacles [N, world]: float64 of shape (obstacles, 3).
    #[getter]
    fn obstacle_forces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        array_of(py, readings::obstacle_forces(&self.snapshot.output))
    }

    /// Torques of these forces about the positions of the planes' and obstacles' poses [N·m, world]: float64 of shape (obstacles, 3).
    #[getter]
    fn obstacle_torques<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        array_of(py, readings::obstacle_torques(&self.snapshot.output))
    }

    /// Net forces on the objects [N, world], as :attr:`Simulation.object_forces`: float64 of shape (objects, 3).
    #[getter]
    fn object_forces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        array_of(py, readings::object_forces(&self.snapshot.output))
    }

    /// Torques of these forces about the objects' centres of mass [N·m, world]: float64 of shape (objects, 3).
    #[getter]
    fn object_torques<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        array_of(py, readings::object_torques(&self.snapshot.output))
    }

    /// Whether each object is asleep: bool of shape (objects,).
    #[getter]
    fn is_asleep<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        readings::asleep(py, &self.snapshot.output)
    }

    /// Contacts that carry force, a structured array with the fields of :attr:`Simulation.contacts`.
    #[getter]
    fn contacts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        readings::contacts(py, &self.layout, &self.snapshot.output)
    }

    /// Energy ledger of the scene [J], by name (docs/scene.md).
    #[getter]
    fn energy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        energy_by_name(py, &self.snapshot.output.energy)
    }

    /// Status of the step: residual of the solver [m], iterations, unsolved islands, dropped contacts.
    #[getter]
    fn status<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        status_by_name(py, &self.snapshot.output.status)
    }

    /// Deformed surface of an object.
    ///
    /// Parameters
    /// ----------
    /// object : str or int
    ///     Name or number.
    ///
    /// Returns
    /// -------
    /// numpy.ndarray
    ///     Positions of its surface nodes [m, world], float64 of shape (nodes, 3), for the triangles `scene.triangles(object)`.
    fn surface<'py>(&self, py: Python<'py>, object: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let at = Scene::object(&self.scene, object)?;
        readings::surface(py, &self.scene.model, &self.snapshot.objects[at])
    }

    fn __repr__(&self) -> String {
        format!("<palpate.Output of step {} at {:.6} s>", self.step(), self.time())
    }
}
