//! `palpate.Simulation`: the state of a scene, stepped from Python.
//!
//! A call that finds the simulation in use by another thread is an exception: `run` steps without the interpreter's lock.

use crate::arrays::{array, flat};
use crate::contacts::ContactLayout;
use crate::device_mode::{ModeChange, mode_name};
use crate::errors::{catch_panic, input_error, internal_error, lock_at_once};
use crate::motion::{Arguments, SeriesMotion, check_devices, write_step};
use crate::position_check::{Given, PositionCheck};
use crate::readings::{self, array_of, energy_by_name, status_by_name, write_forces};
use crate::run_length::count_steps;
use crate::run_state::{RunState, StepFailure, held_points, run_part};
use crate::scalars::Whole;
use crate::scene::Scene;
use crate::series::Series;
use crate::snapshot::Snapshot;
use crate::starts::Starts;
use crate::warnings::{Told, warnings_by_name};
use numpy::PyArray2;
use palpate::Output;
use palpate_fem::check_memory;
use pyo3::exceptions::PyMemoryError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::TryReserveError;
use std::sync::{Arc, Mutex, MutexGuard};

/// Number of samples of all surfaces in a run, as `palpate run` takes them.
const SAMPLES: usize = 100;

/// Least number of steps between two samples: a sample costs as much as some steps of one body.
const MIN_SAMPLE_INTERVAL: usize = 200;

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
    told: Told,
}

impl Simulation {
    /// Simulation that goes on from a state.
    pub fn with(py: Python<'_>, scene: Py<Scene>, run: RunState) -> PyResult<Self> {
        let inner = Arc::clone(&scene.get().inner);
        let forces = PyArray2::zeros(py, [inner.devices.len(), 3], false).unbind();
        let layout = ContactLayout::new(&inner);
        let made = Self { scene, inner, layout, forces, run: Mutex::new(run), told: Told::default() };
        made.write_forces(py, made.lock(py)?.state.output())?;
        Ok(made)
    }

    /// State that is whole.
    fn lock(&self, py: Python<'_>) -> PyResult<MutexGuard<'_, RunState>> {
        let run = self.lock_any(py)?;
        match run.has_panicked() {
            None => Ok(run),
            Some(failure) => Err(failure
                .exception(py, "an earlier step ended in the middle: reset() or restore() a snapshot; ")),
        }
    }

    /// State, also one that a panic has left.
    fn lock_any(&self, py: Python<'_>) -> PyResult<MutexGuard<'_, RunState>> {
        let in_use = "the simulation is in use by another thread: wait for its run to end, or give each thread a copy()";
        lock_at_once(py, &self.run, in_use)
    }

    /// Write the forces on the hands into the array that steps return.
    fn write_forces(&self, py: Python<'_>, output: &Output) -> PyResult<()> {
        write_forces(self.forces.bind(py), output)
    }

    fn change(&self, py: Python<'_>, change: ModeChange) -> PyResult<()> {
        change.apply(&self.inner, &mut self.lock(py)?.modes).map_err(|text| input_error(py, text))
    }

    /// Array of rows, one for each item of the output.
    fn rows<'py, const N: usize>(
        &self,
        py: Python<'py>,
        rows: impl FnOnce(&Output) -> Vec<[f64; N]>,
    ) -> PyResult<Bound<'py, PyAny>> {
        array_of(py, rows(self.lock(py)?.state.output()))
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
        let RunState { check, state, modes, input, .. } = &mut *run;
        let mut check = PositionCheck { scene: &self.inner, check, state, modes, told: &self.told };
        write_step(py, &self.inner, &Arguments { positions, obstacles, clamps }, input, |kind, numbers| {
            check.check(py, &Given { kind, numbers, first: 0, stride: numbers.len() })
        })?;
        let stepped = run.step(&self.inner);
        self.write_forces(py, run.state.output())?;
        stepped.map_err(|failure| failure.exception(py, ""))?;
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
    ///     `velocities` (steps, objects, 6) [m/s, rad/s]; `penetration` (steps, objects) [m]; `object_forces`, `object_torques` (steps, objects, 3) and
    ///     `obstacle_forces`, `obstacle_torques` (steps, obstacles, 3) [N, N·m], as the attributes; `clamp_frames` (steps, clamps, 7), `clamp_forces`,
    ///     `clamp_torques` (steps, clamps, 3) [N, N·m]; `probe_positions`, `probe_displacements` (steps, probes, 3) [m]; `unsolved_islands` (steps,);
    ///     `energy`, a dict of (steps,) [J]; `warnings`, as the attribute; with `contacts=True` the structured array `contacts`, a row per contact and step.
    ///
    /// Raises
    /// ------
    /// KeyboardInterrupt
    ///     If Ctrl-C is pressed meanwhile; the simulation stays after the last step. Other threads run meanwhile, too.
    /// StepError
    ///     If the hands moved too far in one step to be followed.
    /// MemoryError
    ///     If there is no room for the series.
    ///
    /// Notes
    /// -----
    /// A run that an exception ends leaves the series of its steps in the attribute `series` of the exception.
    #[pyo3(signature = (positions=None, *, steps=None, duration=None, obstacles=None, clamps=None, contacts=false))]
    #[expect(clippy::too_many_arguments, reason = "keywords of Python")]
    fn run<'py>(
        &self,
        py: Python<'py>,
        positions: Option<&Bound<'py, PyAny>>,
        steps: Option<Whole>,
        duration: Option<f64>,
        obstacles: Option<&Bound<'py, PyAny>>,
        clamps: Option<&Bound<'py, PyAny>>,
        contacts: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        let motion = SeriesMotion::read(py, &self.inner, &Arguments { positions, obstacles, clamps })?;
        let count = count_steps(
            &self.inner,
            self.lock(py)?.state.step_count(),
            motion.steps,
            (steps.map(|Whole(steps)| steps), duration),
        )
        .map_err(|text| input_error(py, text))?;
        check_memory(count as f64 * Series::bytes_per_step(&self.inner)).map_err(|error| {
            input_error(py, format!("the series of {count} steps: {error}; run fewer at a time"))
        })?;
        let mut guard = self.lock(py)?;
        let (run, scene, layout) = (&mut *guard, &*self.inner, &self.layout);
        let no_memory =
            |error: TryReserveError| PyMemoryError::new_err(format!("the series of {count} steps: {error}"));
        let mut series = Series::new(scene, count, contacts).map_err(no_memory)?;
        let RunState { check, state, modes, .. } = &mut *run;
        let mut check = PositionCheck { scene, check, state, modes, told: &self.told };
        for (kind, numbers, stride) in motion.given() {
            check.check(py, &Given { kind, numbers, first: 0, stride })?;
        }
        let sample_every = (count / SAMPLES).max(MIN_SAMPLE_INTERVAL);
        let mut fields = Vec::new();
        let mut done = 0;
        let failure = loop {
            let part = py.detach(|| {
                catch_panic(|| {
                    run_part(scene, run, &motion, done..count, |number, run| {
                        let RunState { check, input, state, .. } = run;
                        if (number + 1).is_multiple_of(sample_every) {
                            check.sample_surfaces(scene, input, state, &mut fields);
                        }
                        series.append(scene, layout, input, state).map_err(StepFailure::Memory)
                    })
                })
            });
            // The forces are those of the last step, however the run ends.
            self.write_forces(py, run.state.output())?;
            match part.unwrap_or_else(|text| Err(StepFailure::Panic(text))) {
                Ok(next) if next == count => break None,
                Ok(next) => done = next,
                Err(failure) => break Some(failure.exception(py, "")),
            }
            if let Err(interrupt) = py.check_signals() {
                break Some(interrupt);
            }
        };
        let series = series.into_dict(py, scene, layout)?;
        let warnings = run.check.warnings(scene);
        series.set_item("warnings", warnings_by_name(py, &warnings)?)?;
        // Python's filters run code of the caller.
        drop(guard);
        match failure {
            None => {
                self.told.tell(py, &warnings)?;
                Ok(series)
            }
            Some(error) => {
                error.value(py).setattr("series", series)?;
                Err(error)
            }
        }
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
        self.rows(py, readings::proxies)
    }

    /// Centres of mass [m] and orientations of the objects, x, y, z, qw, qx, qy, qz: float64 of shape (objects, 7).
    #[getter]
    fn poses<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.rows(py, readings::poses)
    }

    /// Velocities [m/s] and angular velocities [rad/s, world] of the objects: float64 of shape (objects, 6).
    #[getter]
    fn velocities<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.rows(py, readings::velocities)
    }

    /// Forces [N] and torques [N·m, world] on the clamps: float64 of shape (clamps, 6).
    #[getter]
    fn clamp_loads<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.rows(py, readings::clamp_loads)
    }

    /// Net forces of the objects on the planes and obstacles in the last step, sums over their contacts [N, world]: float64 of shape (obstacles, 3).
    #[getter]
    fn obstacle_forces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.rows(py, readings::obstacle_forces)
    }

    /// Torques of these forces about the positions of the planes' and obstacles' poses at the end of the step [N·m, world]: float64 of shape
    /// (obstacles, 3).
    #[getter]
    fn obstacle_torques<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.rows(py, readings::obstacle_torques)
    }

    /// Net forces of contacts, hands, clamps and prescribed forces on the objects in the last step [N, world], without their weights and without
    /// what their supports carry: float64 of shape (objects, 3).
    #[getter]
    fn object_forces<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.rows(py, readings::object_forces)
    }

    /// Torques of these forces about the objects' centres of mass, the positions of `poses`, at the end of the step [N·m, world]: float64 of shape
    /// (objects, 3).
    #[getter]
    fn object_torques<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.rows(py, readings::object_torques)
    }

    /// Whether each object is asleep: bool of shape (objects,).
    #[getter]
    fn is_asleep<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(readings::asleep(py, self.lock(py)?.state.output()))
    }

    /// Contacts of the last step that carry force, a structured array.
    ///
    /// Fields: `time` [s], `point` (3,) [m, world], `normal` (3,) out of the object, `force` (3,) on the object [N], `gap` [m] negative when
    /// penetrating, `slip_speed` [m/s], `object` and `against` (names), `device` (row of the device, or -1).
    #[getter]
    fn contacts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        readings::contacts(py, &self.layout, self.lock(py)?.state.output())
    }

    /// Energy ledger of the scene [J], by name (docs/scene.md).
    #[getter]
    fn energy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        energy_by_name(py, &self.lock(py)?.state.output().energy)
    }

    /// Status of the last step: residual of the solver [m], iterations, unsolved islands, dropped contacts.
    #[getter]
    fn status<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        status_by_name(py, &self.lock(py)?.state.output().status)
    }

    /// Warnings of all steps since the start: dicts with `kind`, `part` and `message` (docs/scene.md). Surfaces are sampled now, and by :meth:`run`.
    #[getter]
    fn warnings<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let mut run = self.lock(py)?;
        let RunState { check, input, state, .. } = &mut *run;
        check.sample_surfaces(&self.inner, input, state, &mut Vec::new());
        warnings_by_name(py, &check.warnings(&self.inner))
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
        let deformation = self.lock(py)?.state.deformation(at);
        readings::surface(py, &self.inner.model, &deformation)
    }

    /// Points that devices hold or exert forces on [m, world]: float64 of shape (devices, 3), NaN for tips. Start a hand there.
    fn held_points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let run = self.lock(py)?;
        let points = held_points(&self.inner, &run);
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
        let mut run = self.lock_any(py)?;
        run.clone_from(&snapshot.run);
        self.write_forces(py, run.state.output())
    }

    /// Go back to the start of the scene.
    ///
    /// Parameters
    /// ----------
    /// poses : array_like, optional
    ///     Centres of mass [m, world] and orientations of the objects at the start, shape (objects, 7): x, y, z, qw, qx, qy, qz. Without it
    ///     those of the scene. Objects with fixed nodes, or on a table, start where the scene says.
    /// velocities : array_like, optional
    ///     Velocities [m/s] and angular velocities [rad/s, world] at the start, shape (objects, 6), likewise.
    #[pyo3(signature = (*, poses=None, velocities=None))]
    fn reset(
        &self,
        py: Python<'_>,
        poses: Option<&Bound<'_, PyAny>>,
        velocities: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let starts = Starts::read(py, &self.inner, None, (poses, velocities))?;
        let fresh = py.detach(|| catch_panic(|| RunState::at(&self.inner, starts.of(0))));
        let mut run = self.lock_any(py)?;
        let fresh = fresh.map_err(|text| internal_error(py, &text))?;
        *run = fresh.map_err(|text| input_error(py, text))?;
        self.write_forces(py, run.state.output())
    }

    /// Let a device take hold of a point, from the next step on.
    ///
    /// Parameters
    /// ----------
    /// device : str or int
    ///     Name or number.
    /// object : str or int
    ///     Name or number of the object.
    /// point : (3,) array_like
    ///     Point near the surface [m, body frame]: the nearest material point is held. Without a coupling it goes to the hand's position in the
    ///     first step: take a point where the hand is.
    ///
    /// Raises
    /// ------
    /// InputError
    ///     If there is no surface near the point, its nodes are fixed, or another device holds it.
    fn grasp(
        &self,
        py: Python<'_>,
        device: &Bound<'_, PyAny>,
        object: &Bound<'_, PyAny>,
        point: &Bound<'_, PyAny>,
    ) -> PyResult<()> {
        self.change(py, ModeChange::grasp(&self.inner, device, object, point)?)
    }

    /// Let a device let go of its point, from the next step on: it touches with its tip. That of a device which the scene has as `"held"` is a
    /// point without friction.
    ///
    /// Parameters
    /// ----------
    /// device : str or int
    ///     Name or number.
    fn release(&self, py: Python<'_>, device: &Bound<'_, PyAny>) -> PyResult<()> {
        self.change(py, ModeChange::release(&self.inner, device)?)
    }

    /// Take a device out of the scene, from the next step on, until it grasps or is released: it passes through everything.
    ///
    /// Parameters
    /// ----------
    /// device : str or int
    ///     Name or number.
    fn deactivate(&self, py: Python<'_>, device: &Bound<'_, PyAny>) -> PyResult<()> {
        self.change(py, ModeChange::deactivate(&self.inner, device)?)
    }

    /// Modes of the devices in the next step: "touch", "held", "force" or "inactive".
    #[getter]
    fn modes(&self, py: Python<'_>) -> PyResult<Vec<&'static str>> {
        Ok(self.lock(py)?.modes.iter().map(mode_name).collect())
    }

    /// Simulation that goes on from the same state by itself.
    fn copy(&self, py: Python<'_>) -> PyResult<Self> {
        let run = self.lock(py)?.clone();
        let copied = Self::with(py, self.scene.clone_ref(py), run)?;
        Ok(Self { told: self.told.clone(), ..copied })
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
