//! `palpate.Simulation`: the state of a scene, stepped from Python.
//!
//! A call that finds the simulation in use by another thread is an exception: `run` steps without the interpreter's lock.

use crate::arrays::{array, flat, pose_row, twist_row};
use crate::contacts::ContactLayout;
use crate::errors::{Class, catch_panic, exception, input_error, internal_error};
use crate::motion::{Arguments, SeriesMotion, check_devices, write_step};

use crate::run_state::{RunState, Snapshot, run_part};
use crate::scene::Scene;
use crate::series::Series;
use glam::DVec3;
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use palpate::{DeviceMode, Grasp, Output};
use palpate_fem::check_memory;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::{Arc, Mutex, MutexGuard, TryLockError};

/// Largest number of steps of one `run`: a day at 1 kHz.
const MAX_STEPS: f64 = 1e8;

/// Simulation of a scene: its state, stepped from Python.
///
/// Parameters
/// ----------
/// scene : Scene
///
/// Notes
/// -----
/// :meth:`step` holds the interpreter's lock, :meth:`run` releases it. A call while another thread uses the simulation raises PalpateError; give
/// each thread a :meth:`copy`, which shares the scene.
#[pyclass(frozen, module = "palpate")]
pub struct Simulation {
    scene: Py<Scene>,
    inner: Arc<palpate_scene::Scene>,
    layout: ContactLayout,
    forces: Py<PyArray2<f64>>,
    run: Mutex<RunState>,
}

impl Simulation {
    fn with(py: Python<'_>, scene: Py<Scene>, run: RunState) -> PyResult<Self> {
        let inner = Arc::clone(&scene.get().inner);
        let forces = PyArray2::zeros(py, [inner.devices.len(), 3], false).unbind();
        let layout = ContactLayout::new(&inner);
        let made = Self { scene, inner, layout, forces, run: Mutex::new(run) };
        made.write_forces(py, made.lock(py)?.state.output())?;
        Ok(made)
    }

    fn lock(&self, py: Python<'_>) -> PyResult<MutexGuard<'_, RunState>> {
        match self.run.try_lock() {
            Ok(guard) => Ok(guard),
            // A panic is caught before it passes the guard.
            Err(TryLockError::Poisoned(poisoned)) => Ok(poisoned.into_inner()),
            Err(TryLockError::WouldBlock) => Err(exception(
                py,
                Class::Palpate,
                "the simulation is in use by another thread: wait for its run to end, or give each thread a copy()",
            )),
        }
    }

    /// Write the forces on the hands into the array that steps return.
    fn write_forces(&self, py: Python<'_>, output: &Output) -> PyResult<()> {
        let refused = |error: String| {
            exception(
                py,
                Class::Palpate,
                format!(
                    "the array of forces cannot be written to ({error}): it is the simulation's own; use a copy"
                ),
            )
        };
        let mut forces = self.forces.bind(py).try_readwrite().map_err(|error| refused(error.to_string()))?;
        let forces = forces.as_slice_mut().map_err(|error| refused(error.to_string()))?;
        for (row, device) in forces.chunks_exact_mut(3).zip(&output.devices) {
            row.copy_from_slice(&device.force_on_hand.to_array());
        }
        Ok(())
    }

    /// Number of steps of a run, by the motions or the arguments.
    fn count_steps(
        &self,
        py: Python<'_>,
        motion: &SeriesMotion,
        steps: Option<i64>,
        duration: Option<f64>,
    ) -> PyResult<usize> {
        let step_s = self.inner.model.parameters().step_s;
        let refused = |message: String| Err(input_error(py, message));
        let count = match (motion.steps, steps, duration) {
            (Some(given), None, None) => return Ok(given),
            (Some(_), ..) => {
                return refused("the motions have a row per step: leave steps and duration out".into());
            }
            (None, Some(_), Some(_)) => return refused("give steps or duration, not both".into()),
            (None, Some(steps), None) => steps as f64,
            (None, None, Some(duration)) => (duration / step_s).round(),
            (None, None, None) if self.inner.end_s() > 0.0 => {
                let done = self.steps_done(py)?;
                ((self.inner.end_s() / step_s).round() - done as f64).max(0.0)
            }
            (None, None, None) => {
                return refused("the scene has no path that ends: give positions, steps or duration".into());
            }
        };
        if (0.0..=MAX_STEPS).contains(&count) {
            Ok(count as usize)
        } else {
            refused(format!("the run has {count} steps of {step_s} s, expected 0 to {MAX_STEPS}"))
        }
    }

    fn steps_done(&self, py: Python<'_>) -> PyResult<u64> {
        Ok(self.lock(py)?.steps)
    }

    /// Array of rows, one for each item of the output.
    fn rows<'py, const N: usize>(
        &self,
        py: Python<'py>,
        rows: impl FnOnce(&Output) -> Vec<[f64; N]>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let rows = rows(self.lock(py)?.state.output());
        array(py, rows.as_flattened().to_vec(), &[rows.len(), N])
    }
}

#[pymethods]
impl Simulation {
    #[new]
    fn new(py: Python<'_>, scene: Py<Scene>) -> PyResult<Self> {
        let inner = Arc::clone(&scene.get().inner);
        check_devices(py, &inner)?;
        let run = py.detach(|| catch_panic(|| RunState::new(&inner)));
        Self::with(py, scene, run.map_err(|text| internal_error(py, &text))?)
    }

    /// Scene.
    #[getter]
    fn scene(&self, py: Python<'_>) -> Py<Scene> {
        self.scene.clone_ref(py)
    }

    /// Advance by one step.
    ///
    /// Parameters
    /// ----------
    /// positions : array_like, optional
    ///     Positions of the hands at the end of the step [m, world], shape (devices, 3); a row of a device with `mode = "force"` is its force on the
    ///     object [N]. Without it devices follow the paths of the scene. A float64 array is read as it is, anything else is converted.
    /// obstacles : array_like, optional
    ///     Poses of planes and obstacles at the end of the step, shape (obstacles, 7): x, y, z [m], qw, qx, qy, qz. Without it they follow their paths,
    ///     and stay where they are where they have none.
    /// clamps : array_like, optional
    ///     Frames of the clamps, likewise.
    ///
    /// Returns
    /// -------
    /// numpy.ndarray
    ///     Forces on the hands [N, world], shape (devices, 3): always the same array, which the next step writes over. Copy what you keep.
    ///
    /// Raises
    /// ------
    /// InputError
    ///     If an array has another shape, or numbers that are not finite. Nothing has moved then.
    /// StepError
    ///     If the hands moved too far in one step to be followed.
    #[pyo3(signature = (positions=None, *, obstacles=None, clamps=None))]
    fn step(
        &self,
        py: Python<'_>,
        positions: Option<&Bound<'_, PyAny>>,
        obstacles: Option<&Bound<'_, PyAny>>,
        clamps: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Py<PyArray2<f64>>> {
        let mut run = self.lock(py)?;
        run.follow_paths(&self.inner);
        write_step(py, &self.inner, &Arguments { positions, obstacles, clamps }, &mut run.input)?;
        let stepped = catch_panic(|| run.step(&self.inner)).map_err(|text| internal_error(py, &text))?;
        self.write_forces(py, run.state.output())?;
        stepped.map_err(|text| exception(py, Class::Step, text))?;
        Ok(self.forces.clone_ref(py))
    }

    /// Run many steps in one call.
    ///
    /// Parameters
    /// ----------
    /// positions : array_like, optional
    ///     Positions of the hands at the end of each step [m, world], shape (steps, devices, 3); else as for :meth:`step`.
    /// steps : int, optional
    ///     Number of steps, if no motions are given. Without `steps` and `duration`: to the end of the scene's longest path.
    /// duration : float, optional
    ///     Duration [s] instead of the number of steps.
    /// obstacles, clamps : array_like, optional
    ///     Poses, shape (steps, obstacles, 7) and (steps, clamps, 7).
    /// contacts : bool
    ///     Whether to keep the contacts of all steps.
    ///
    /// Returns
    /// -------
    /// dict of numpy.ndarray
    ///     By step: `time` (steps,) [s]; `positions`, `forces`, `proxies` (steps, devices, 3) [m, N, m]; `poses` (steps, objects, 7);
    ///     `velocities` (steps, objects, 6) [m/s, rad/s]; `penetration` (steps, objects) [m]; `clamp_frames` (steps, clamps, 7), `clamp_forces`,
    ///     `clamp_torques` (steps, clamps, 3) [N, N·m]; `probe_positions`, `probe_displacements` (steps, probes, 3) [m]; `unsolved_islands` (steps,);
    ///     `energy`, a dict of (steps,) [J]; with `contacts=True` the structured array `contacts`, a row per contact and step.
    ///
    /// Raises
    /// ------
    /// KeyboardInterrupt
    ///     If Ctrl-C is pressed meanwhile; the simulation stays where it is. Other threads run meanwhile, too.
    #[pyo3(signature = (positions=None, *, steps=None, duration=None, obstacles=None, clamps=None, contacts=false))]
    #[expect(clippy::too_many_arguments, reason = "keywords of Python")]
    fn run<'py>(
        &self,
        py: Python<'py>,
        positions: Option<&Bound<'py, PyAny>>,
        steps: Option<i64>,
        duration: Option<f64>,
        obstacles: Option<&Bound<'py, PyAny>>,
        clamps: Option<&Bound<'py, PyAny>>,
        contacts: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        let motion = SeriesMotion::read(py, &self.inner, &Arguments { positions, obstacles, clamps })?;
        let count = self.count_steps(py, &motion, steps, duration)?;
        check_memory(count as f64 * Series::bytes_per_step(&self.inner)).map_err(|error| {
            input_error(py, format!("the series of {count} steps: {error}; run fewer at a time"))
        })?;
        let mut guard = self.lock(py)?;
        let (run, scene, layout) = (&mut *guard, &*self.inner, &self.layout);
        let mut series = Series::new(scene, count, contacts);
        let mut done = 0;
        while done < count {
            let part = py.detach(|| {
                catch_panic(|| {
                    run_part(scene, run, &motion, done..count, |input, state| {
                        series.append(scene, layout, input, state);
                    })
                })
            });
            // The forces are those of the last step, however the run ends.
            self.write_forces(py, run.state.output())?;
            let part = part.map_err(|text| internal_error(py, &text))?;
            done = part.map_err(|text| exception(py, Class::Step, text))?;
            py.check_signals()?;
        }
        series.into_dict(py, scene, layout)
    }

    /// Time at the end of the last step [s].
    #[getter]
    fn time(&self, py: Python<'_>) -> PyResult<f64> {
        Ok(self.lock(py)?.state.output().time_s)
    }

    /// Forces on the hands in the last step [N, world], shape (devices, 3): the array that :meth:`step` returns.
    #[getter]
    fn forces(&self, py: Python<'_>) -> Py<PyArray2<f64>> {
        self.forces.clone_ref(py)
    }

    /// Held points, and centres of the tips that stay outside [m, world]: float64 of shape (devices, 3).
    #[getter]
    fn proxies<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.rows(py, |output| output.devices.iter().map(|device| device.proxy.to_array()).collect())
    }

    /// Centres of mass [m] and orientations of the objects, x, y, z, qw, qx, qy, qz: float64 of shape (objects, 7).
    #[getter]
    fn poses<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.rows(py, |output| output.objects.iter().map(|object| pose_row(&object.pose)).collect())
    }

    /// Velocities [m/s] and angular velocities [rad/s, world] of the objects: float64 of shape (objects, 6).
    #[getter]
    fn velocities<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.rows(py, |output| output.objects.iter().map(|object| twist_row(&object.twist)).collect())
    }

    /// Forces [N] and torques [N·m, world] on the clamps: float64 of shape (clamps, 6).
    #[getter]
    fn clamp_loads<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.rows(py, |output| {
            let row = |clamp: &palpate::ClampOutput| {
                let (f, t) = (clamp.force, clamp.torque);
                [f.x, f.y, f.z, t.x, t.y, t.z]
            };
            output.clamps.iter().map(row).collect()
        })
    }

    /// Whether each object is asleep: bool of shape (objects,).
    #[getter]
    fn is_asleep<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let asleep = self.lock(py)?.state.output().objects.iter().map(|object| object.is_asleep).collect();
        Ok(PyArray1::<bool>::from_vec(py, asleep).into_any())
    }

    /// Contacts of the last step that carry force, a structured array.
    ///
    /// Fields: `time` [s], `point` (3,) [m, world], `normal` (3,) out of the object, `force` (3,) on the object [N], `gap` [m] negative when
    /// penetrating, `slip_speed` [m/s], `object` and `against` (names), `device` (row of the device, or -1).
    #[getter]
    fn contacts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let mut rows = Vec::new();
        let run = self.lock(py)?;
        let output = run.state.output();
        output.contacts.iter().for_each(|contact| self.layout.append(output.time_s, contact, &mut rows));
        self.layout.array(py, rows)
    }

    /// Energy ledger of the scene [J], by name (docs/scene.md).
    #[getter]
    fn energy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let energy = PyDict::new(py);
        for (name, value) in self.lock(py)?.state.output().energy.named() {
            energy.set_item(name, value)?;
        }
        Ok(energy)
    }

    /// Status of the last step: residual of the solver [m], iterations, unsolved islands, dropped contacts.
    #[getter]
    fn status<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let status = self.lock(py)?.state.output().status;
        let dict = PyDict::new(py);
        dict.set_item("solver_residual", status.solver_residual_m)?;
        dict.set_item("iterations", status.iterations)?;
        dict.set_item("dependent_rows", status.dependent_rows)?;
        dict.set_item("unsolved_islands", status.unsolved_islands)?;
        dict.set_item("islands_out_of_budget", status.islands_out_of_budget)?;
        dict.set_item("dropped_contacts", status.dropped_contacts)?;
        Ok(dict)
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
        let at = Scene::object(&self.inner, object)?;
        let run = self.lock(py)?;
        let (model, state) = (&self.inner.model, &run.state);
        let rest = model.recordings().nth(at).map_or(&[][..], |own| &own.surface.positions);
        let pose = state.output().objects[at].pose;
        let mut displacement = vec![DVec3::ZERO; rest.len()];
        catch_panic(|| state.surface_displacement(model, at, &mut displacement))
            .map_err(|text| internal_error(py, &text))?;
        let positions =
            rest.iter().zip(&displacement).map(|(rest, moved)| pose.world_from_body(*rest + *moved));
        array(py, flat(positions), &[rest.len(), 3])
    }

    /// Points that devices hold or exert forces on [m, world]: float64 of shape (devices, 3), NaN for tips. Start a hand there.
    fn held_points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let run = self.lock(py)?;
        let (model, state) = (&self.inner.model, &run.state);
        let held = |mode: &DeviceMode| {
            let grasp = match mode {
                DeviceMode::Held(grasp) => *grasp,
                DeviceMode::Force(applied) => applied.grasp,
                _ => return DVec3::NAN,
            };
            let Grasp { object, point } = grasp;
            let Some(recording) = model.recordings().nth(object) else { return DVec3::NAN };
            let moved = state.point_displacement(model, object, &point);
            let pose = state.output().objects[object].pose;
            pose.world_from_body(recording.surface.rest_position(&point) + moved)
        };
        let points = self.inner.devices.iter().map(|device| held(&device.mode));
        array(py, flat(points), &[self.inner.devices.len(), 3])
    }

    /// Copy of the state, for :meth:`restore`.
    fn snapshot(&self, py: Python<'_>) -> PyResult<Snapshot> {
        Ok(Snapshot { scene: Arc::clone(&self.inner), run: self.lock(py)?.clone() })
    }

    /// Go back to a snapshot of a simulation of the same Scene object.
    ///
    /// Parameters
    /// ----------
    /// snapshot : Snapshot
    fn restore(&self, py: Python<'_>, snapshot: &Snapshot) -> PyResult<()> {
        if !Arc::ptr_eq(&self.inner, &snapshot.scene) {
            return Err(input_error(
                py,
                "the snapshot is of another scene: restore it in a simulation of the same Scene object",
            ));
        }
        let mut run = self.lock(py)?;
        run.clone_from(&snapshot.run);
        self.write_forces(py, run.state.output())
    }

    /// Go back to the start of the scene.
    fn reset(&self, py: Python<'_>) -> PyResult<()> {
        let fresh = py.detach(|| catch_panic(|| RunState::new(&self.inner)));
        let mut run = self.lock(py)?;
        *run = fresh.map_err(|text| internal_error(py, &text))?;
        self.write_forces(py, run.state.output())
    }

    /// Simulation that goes on from the same state by itself.
    fn copy(&self, py: Python<'_>) -> PyResult<Self> {
        let run = self.lock(py)?.clone();
        Self::with(py, self.scene.clone_ref(py), run)
    }

    fn __copy__(&self, py: Python<'_>) -> PyResult<Self> {
        self.copy(py)
    }

    fn __deepcopy__(&self, py: Python<'_>, _memo: &Bound<'_, PyAny>) -> PyResult<Self> {
        self.copy(py)
    }

    fn __repr__(&self) -> String {
        let names = self.inner.object_names.join(", ");
        match self.run.try_lock() {
            Ok(run) => {
                format!("<palpate.Simulation of {names} at {:.6} s>", run.state.output().time_s)
            }
            Err(_) => format!("<palpate.Simulation of {names}, in use by another thread>"),
        }
    }
}
