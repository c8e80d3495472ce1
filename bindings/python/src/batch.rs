//! `palpate.Batch`: many states of one scene, stepped on all cores.
//!
//! Rows share the model only, and are stepped one by one as a simulation is: the numbers do not depend on the number of threads.

use crate::arrays::array;
use crate::batch_motion::BatchMotion;
use crate::batch_outputs::{BatchOutputs, Part};
use crate::batch_rows::{
    Row, Rows, Workspaces, check_positions, chosen_rows, failure_of, fill_rows, make_rows,
};
use crate::batch_series::BatchSeries;
use crate::contacts::ContactLayout;
use crate::device_mode::ModeChange;
use crate::errors::{catch_panic, input_error, internal_error, lock_at_once};
use crate::motion::{Arguments, check_devices};
use crate::run_state::{RunState, held_points};
use crate::scalars::Whole;
use crate::scene::Scene;
use crate::simulation::Simulation;
use crate::snapshot::Snapshot;
use crate::starts::Starts;
use crate::warnings::Told;
use crate::workers::{Workers, no_threads};
use numpy::{PyArray1, PyArrayDyn, PyArrayMethods};
use pyo3::exceptions::PyMemoryError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;
use std::sync::{Arc, Mutex, MutexGuard};

/// Largest number of rows.
const MAX_ROWS: i64 = 1_000_000;

/// Largest number of threads.
const MAX_THREADS: i64 = 1024;

/// Many simulations of one scene, stepped together on all cores: a row for each.
///
/// Parameters
/// ----------
/// scene : Scene
/// n : int
///     Number of rows.
/// threads : int, optional
///     Number of threads; without it one for each core that the process may use. The numbers do not depend on it, to the bit.
///
/// Notes
/// -----
/// :meth:`step` releases the interpreter's lock. `time`, `forces`, `proxies`, `poses`, `velocities` and `clamp_loads` are always the same arrays,
/// which each step, reset and restore writes over: copy what you keep. A row whose step fails takes no part, and has NaN in these arrays but for its
/// time, until it is reset or restored.
#[pyclass(frozen, module = "palpate")]
pub struct Batch {
    scene: Py<Scene>,
    inner: Arc<palpate_scene::Scene>,
    layout: ContactLayout,
    outputs: BatchOutputs,
    len: usize,
    threads: usize,
    rows: Mutex<Rows>,
    told: Told,
}

impl Batch {
    fn lock(&self, py: Python<'_>) -> PyResult<MutexGuard<'_, Rows>> {
        let in_use =
            "the batch is in use by another thread: wait for its step to end, or give each thread a batch";
        lock_at_once(py, &self.rows, in_use)
    }

    /// Change the chosen rows on all threads, by their place among the chosen ones, and write their numbers into the arrays. A row whose change fails
    /// stays as it was; the first of them is the exception.
    fn change(
        &self,
        py: Python<'_>,
        chosen: &[usize],
        change: impl Fn(usize, &mut Row) -> Result<(), String> + Sync,
    ) -> PyResult<()> {
        let mut place = vec![None; self.len];
        chosen.iter().enumerate().for_each(|(at, row)| place[*row] = Some(at));
        let mut guard = self.lock(py)?;
        let Rows { rows, outputs, workers, .. } = &mut *guard;
        let length = self.outputs.row_length();
        let change_row = |row: usize, at: Option<usize>, own: &mut Row, outputs: &mut [f64]| {
            let changed = catch_panic(|| change(at?, own).err());
            own.fill(outputs);
            match changed {
                Ok(failure) => failure.map(|text| (row, Err(text))),
                Err(panic) => Some((row, Ok(panic))),
            }
        };
        let changed = py.detach(|| {
            workers.run(|| {
                let each = rows.par_iter_mut().zip(outputs.par_chunks_mut(length)).zip(&place).enumerate();
                each.filter_map(|(row, ((own, outputs), at))| change_row(row, *at, own, outputs))
                    .min_by_key(|(row, _)| *row)
            })
        });
        let changed = changed.map_err(|error| no_threads(py, &error))?;
        self.outputs.write(py, outputs)?;
        match changed {
            None => Ok(()),
            Some((row, Err(text))) => Err(input_error(py, format!("row {row}: {text}"))),
            Some((row, Ok(panic))) => Err(internal_error(py, &format!("row {row}: {panic}"))),
        }
    }
}

#[pymethods]
impl Batch {
    #[new]
    #[pyo3(signature = (scene, n, threads=None))]
    fn new(py: Python<'_>, scene: Py<Scene>, n: Whole, threads: Option<Whole>) -> PyResult<Self> {
        let inner = Arc::clone(&scene.get().inner);
        check_devices(py, &inner)?;
        let Whole(n) = n;
        if !(1..=MAX_ROWS).contains(&n) {
            return Err(input_error(py, format!("n is {n}, expected 1 to {MAX_ROWS}")));
        }
        let cores = || std::thread::available_parallelism().map_or(1, usize::from) as i64;
        let threads = threads.map_or_else(cores, |Whole(threads)| threads);
        if !(1..=MAX_THREADS).contains(&threads) {
            return Err(input_error(py, format!("threads is {threads}, expected 1 to {MAX_THREADS}")));
        }
        let (len, threads) = (n as usize, threads as usize);
        let mut workers = Workers::new(threads).map_err(|error| no_threads(py, &error))?;
        let made = py.detach(|| catch_panic(|| make_rows(&inner, len, &mut workers)));
        let rows = made.map_err(|text| internal_error(py, &text))?.map_err(|text| input_error(py, text))?;
        let outputs = BatchOutputs::new(py, &inner, len);
        let mut numbers = vec![0.0; len * outputs.row_length()];
        fill_rows(&rows, &mut numbers, outputs.row_length());
        outputs.write(py, &numbers)?;
        let motion = BatchMotion::new(&inner, len);
        let workspaces = Workspaces::new(&inner, threads);
        let rows = Rows { rows, outputs: numbers, motion, workers, workspaces, is_backward: false };
        let layout = ContactLayout::new(&inner);
        Ok(Self {
            scene,
            inner,
            layout,
            outputs,
            len,
            threads,
            rows: Mutex::new(rows),
            told: Told::default(),
        })
    }

    /// Scene.
    #[getter]
    fn scene(&self, py: Python<'_>) -> Py<Scene> {
        self.scene.clone_ref(py)
    }

    /// Number of threads.
    #[getter]
    fn threads(&self) -> usize {
        self.threads
    }

    /// Advance all rows by one step.
    ///
    /// Parameters
    /// ----------
    /// positions : array_like, optional
    ///     Positions of the hands at the end of the step [m, world], shape (n, devices, 3); else as for :meth:`Simulation.step`.
    /// obstacles, clamps : array_like, optional
    ///     Poses of planes and obstacles, and frames of the clamps, at the end of the step, shape (n, obstacles, 7) and (n, clamps, 7).
    ///
    /// Returns
    /// -------
    /// numpy.ndarray
    ///     Forces on the hands [N, world], shape (n, devices, 3): the array `forces`, which the next step writes over. Copy what you keep.
    ///
    /// Raises
    /// ------
    /// InputError
    ///     If an array has another shape, or numbers that are not finite. Nothing has moved then.
    /// StepError
    ///     If hands moved too far in one step. Its attribute `rows` has these rows, which take no part until reset; all others have made the step.
    #[pyo3(signature = (positions=None, *, obstacles=None, clamps=None))]
    fn step(
        &self,
        py: Python<'_>,
        positions: Option<&Bound<'_, PyAny>>,
        obstacles: Option<&Bound<'_, PyAny>>,
        clamps: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Py<PyArrayDyn<f64>>> {
        let mut guard = self.lock(py)?;
        let all = &mut *guard;
        all.motion.read(py, &self.inner, false, &Arguments { positions, obstacles, clamps })?;
        check_positions(py, &self.inner, &all.motion, &mut all.rows, &self.told)?;
        let failed = py.detach(|| all.step(&self.inner, self.outputs.row_length()));
        let failed = failed.map_err(|error| no_threads(py, &error))?;
        let Rows { rows, outputs, .. } = all;
        self.outputs.write(py, outputs)?;
        match failure_of(py, rows, failed)? {
            None => Ok(self.outputs.array(py, Part::Forces)),
            Some(error) => Err(error),
        }
    }

    /// Run many steps of all rows in one call. Each row makes several steps while its state is in the cache, so that this is faster than :meth:`step`.
    ///
    /// Parameters
    /// ----------
    /// positions : array_like, optional
    ///     Positions of the hands at the end of each step [m, world], shape (steps, n, devices, 3); else as for :meth:`Simulation.step`.
    /// steps : int, optional
    ///     Number of steps, if no motions are given.
    /// obstacles, clamps : array_like, optional
    ///     Poses, shape (steps, n, obstacles, 7) and (steps, n, clamps, 7).
    ///
    /// Returns
    /// -------
    /// dict of numpy.ndarray
    ///     By step: `time` (steps, n) [s]; `forces`, `proxies` (steps, n, devices, 3) [N, m]; `poses` (steps, n, objects, 7); `velocities` (steps, n,
    ///     objects, 6); `clamp_loads` (steps, n, clamps, 6). The arrays of the batch have the last step.
    ///
    /// Raises
    /// ------
    /// InputError
    ///     If an array has another shape, or numbers that are not finite. Nothing has moved then.
    /// StepError
    ///     If hands moved too far in one step to be followed: as for :meth:`step`. All other rows have made all steps; `series` has them.
    /// KeyboardInterrupt
    ///     If Ctrl-C is pressed meanwhile; all rows stay after the same step, and the attribute `series` of the exception has those before.
    /// MemoryError
    ///     If there is no room for the series.
    #[pyo3(signature = (positions=None, *, steps=None, obstacles=None, clamps=None))]
    fn run<'py>(
        &self,
        py: Python<'py>,
        positions: Option<&Bound<'py, PyAny>>,
        steps: Option<Whole>,
        obstacles: Option<&Bound<'py, PyAny>>,
        clamps: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let mut motion = BatchMotion::new(&self.inner, self.len);
        motion.read(py, &self.inner, true, &Arguments { positions, obstacles, clamps })?;
        let count =
            motion.count_steps(steps.map(|Whole(steps)| steps)).map_err(|text| input_error(py, text))?;
        let mut guard = self.lock(py)?;
        let Rows { rows, outputs, workers, workspaces, .. } = &mut *guard;
        check_positions(py, &self.inner, &motion, rows, &self.told)?;
        let mut series = BatchSeries::new(self.len, count, self.outputs.row_length())
            .map_err(|error| PyMemoryError::new_err(format!("the series of {count} steps: {error}")))?;
        let mut failed = Vec::new();
        let mut interrupt = None;
        while series.done() < count && interrupt.is_none() {
            let part = py.detach(|| workers.run(|| series.run_part(&self.inner, workspaces, &motion, rows)));
            failed.append(&mut part.map_err(|error| no_threads(py, &error))?);
            interrupt = py.check_signals().err();
        }
        let done = series.done();
        fill_rows(rows, outputs, self.outputs.row_length());
        self.outputs.write(py, outputs)?;
        let series = self.outputs.series(py, series.numbers, (self.len, [count, done]))?;
        failed.sort_unstable();
        match interrupt.map_or_else(|| failure_of(py, rows, failed), |error| Ok(Some(error)))? {
            None => Ok(series),
            Some(error) => {
                error.value(py).setattr("series", series)?;
                Err(error)
            }
        }
    }

    /// Times at the end of the last step [s]: float64 of shape (n,).
    #[getter]
    fn time(&self, py: Python<'_>) -> Py<PyArrayDyn<f64>> {
        self.outputs.array(py, Part::Time)
    }

    /// Forces on the hands in the last step [N, world]: float64 of shape (n, devices, 3), the array that :meth:`step` returns.
    #[getter]
    fn forces(&self, py: Python<'_>) -> Py<PyArrayDyn<f64>> {
        self.outputs.array(py, Part::Forces)
    }

    /// Held points, and centres of the tips that stay outside [m, world]: float64 of shape (n, devices, 3).
    #[getter]
    fn proxies(&self, py: Python<'_>) -> Py<PyArrayDyn<f64>> {
        self.outputs.array(py, Part::Proxies)
    }

    /// Centres of mass [m] and orientations of the objects, x, y, z, qw, qx, qy, qz: float64 of shape (n, objects, 7).
    #[getter]
    fn poses(&self, py: Python<'_>) -> Py<PyArrayDyn<f64>> {
        self.outputs.array(py, Part::Poses)
    }

    /// Velocities [m/s] and angular velocities [rad/s, world] of the objects: float64 of shape (n, objects, 6).
    #[getter]
    fn velocities(&self, py: Python<'_>) -> Py<PyArrayDyn<f64>> {
        self.outputs.array(py, Part::Velocities)
    }

    /// Forces [N] and torques [N·m, world] on the clamps: float64 of shape (n, clamps, 6).
    #[getter]
    fn clamp_loads(&self, py: Python<'_>) -> Py<PyArrayDyn<f64>> {
        self.outputs.array(py, Part::ClampLoads)
    }

    /// Rows whose step failed, and which take no part until they are reset or restored: bool of shape (n,).
    #[getter]
    fn has_failed<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let failed = self.lock(py)?.rows.iter().map(|row| row.failure.is_some()).collect();
        Ok(PyArray1::<bool>::from_vec(py, failed).into_any())
    }

    /// Whether each object is asleep: bool of shape (n, objects).
    #[getter]
    fn is_asleep<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let rows = self.lock(py)?;
        let objects = rows.rows.iter().flat_map(|row| &row.run.state.output().objects);
        let asleep = PyArray1::<bool>::from_vec(py, objects.map(|object| object.is_asleep).collect());
        Ok(asleep.reshape([self.len, self.inner.object_names.len()])?.into_any())
    }

    /// Contacts of all rows in the last step that carry force, a structured array: the fields of :attr:`Simulation.contacts`, and `row` before them.
    #[getter]
    fn contacts<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let mut bytes = Vec::new();
        let rows = self.lock(py)?;
        for (at, row) in rows.rows.iter().enumerate().filter(|(_, row)| row.failure.is_none()) {
            let output = row.run.state.output();
            for contact in &output.contacts {
                bytes.extend((at as i64).to_ne_bytes());
                self.layout.append(output.time_s, contact, &mut bytes);
            }
        }
        self.layout.array(py, bytes, true)
    }

    /// Points that devices hold or exert forces on [m, world]: float64 of shape (n, devices, 3), NaN for tips. Start hands there.
    fn held_points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        let rows = self.lock(py)?;
        let points = rows.rows.iter().flat_map(|row| held_points(&self.inner, &row.run));
        array(py, crate::arrays::flat(points), &[self.len, self.inner.devices.len(), 3])
    }

    /// Simulation that goes on from the state of a row by itself.
    ///
    /// Parameters
    /// ----------
    /// row : int
    fn simulation(&self, py: Python<'_>, row: Whole) -> PyResult<Simulation> {
        let Whole(row) = row;
        let at = usize::try_from(row).ok().filter(|at| *at < self.len);
        let at =
            at.ok_or_else(|| input_error(py, format!("row is {row}, expected 0 to {}", self.len - 1)))?;
        let run = self.lock(py)?.whole(py, at)?.clone();
        Simulation::with(py, self.scene.clone_ref(py), run)
    }

    /// Let rows go back to the start of the scene.
    ///
    /// Parameters
    /// ----------
    /// rows : array_like, optional
    ///     Mask of shape (n,), or numbers of rows; all without it.
    /// poses : array_like, optional
    ///     Centres of mass [m, world] and orientations of the objects at the start, shape (k, objects, 7) for k chosen rows: x, y, z, qw, qx, qy, qz.
    ///     Without it those of the scene. Objects with fixed nodes, or on a table, start where the scene says.
    /// velocities : array_like, optional
    ///     Velocities [m/s] and angular velocities [rad/s, world] at the start, shape (k, objects, 6), likewise.
    #[pyo3(signature = (rows=None, *, poses=None, velocities=None))]
    fn reset(
        &self,
        py: Python<'_>,
        rows: Option<&Bound<'_, PyAny>>,
        poses: Option<&Bound<'_, PyAny>>,
        velocities: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let chosen = chosen_rows(self.len, rows)?;
        let starts = Starts::read(py, &self.inner, Some(chosen.len()), (poses, velocities))?;
        self.change(py, &chosen, |at, row| {
            *row = Row::new(RunState::at(&self.inner, starts.of(at))?);
            Ok(())
        })
    }

    /// Copies of the states of rows, in their order, for :meth:`restore` and :meth:`Simulation.restore`.
    ///
    /// Parameters
    /// ----------
    /// rows : array_like, optional
    ///     Mask of shape (n,), or numbers of rows; all without it.
    ///
    /// Returns
    /// -------
    /// list of Snapshot
    #[pyo3(signature = (rows=None))]
    fn snapshot(&self, py: Python<'_>, rows: Option<&Bound<'_, PyAny>>) -> PyResult<Vec<Snapshot>> {
        let chosen = chosen_rows(self.len, rows)?;
        let guard = self.lock(py)?;
        let snapshot = |at: &usize| {
            let run = guard.whole(py, *at)?.clone();
            Ok(Snapshot { scene: Arc::clone(&self.inner), run })
        };
        chosen.iter().map(snapshot).collect()
    }

    /// Let rows go back to snapshots of this batch, of another one or of a simulation of the same Scene object.
    ///
    /// Parameters
    /// ----------
    /// snapshots : Snapshot or sequence of Snapshot
    ///     One for all rows, or one for each chosen row.
    /// rows : array_like, optional
    ///     Mask of shape (n,), or numbers of rows; all without it.
    #[pyo3(signature = (snapshots, rows=None))]
    fn restore(
        &self,
        py: Python<'_>,
        snapshots: &Bound<'_, PyAny>,
        rows: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let chosen = chosen_rows(self.len, rows)?;
        let snapshots = Snapshot::list(snapshots, &self.inner)?;
        let is_one = snapshots.len() == 1;
        if !is_one && snapshots.len() != chosen.len() {
            let message = format!("there are {} snapshots for {} rows", snapshots.len(), chosen.len());
            return Err(input_error(py, message));
        }
        let snapshots: Vec<&Snapshot> = snapshots.iter().map(Py::get).collect();
        self.change(py, &chosen, |at, row| {
            *row = Row::new(snapshots[if is_one { 0 } else { at }].run.clone());
            Ok(())
        })
    }

    /// Let a device of rows take hold of a point, as :meth:`Simulation.grasp`.
    ///
    /// Parameters
    /// ----------
    /// device, object : str or int
    ///     Names or numbers.
    /// point : (3,) array_like
    ///     Point near the surface [m, body frame].
    /// rows : array_like, optional
    ///     Mask of shape (n,), or numbers of rows; all without it.
    #[pyo3(signature = (device, object, point, rows=None))]
    fn grasp(
        &self,
        py: Python<'_>,
        device: &Bound<'_, PyAny>,
        object: &Bound<'_, PyAny>,
        point: &Bound<'_, PyAny>,
        rows: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let change = ModeChange::grasp(&self.inner, device, object, point)?;
        self.change(py, &chosen_rows(self.len, rows)?, |_, row| change.apply(&self.inner, &mut row.run.modes))
    }

    /// Let a device of rows let go, as :meth:`Simulation.release`.
    ///
    /// Parameters
    /// ----------
    /// device : str or int
    ///     Name or number.
    /// rows : array_like, optional
    ///     Mask of shape (n,), or numbers of rows; all without it.
    #[pyo3(signature = (device, rows=None))]
    fn release(
        &self,
        py: Python<'_>,
        device: &Bound<'_, PyAny>,
        rows: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let change = ModeChange::release(&self.inner, device)?;
        self.change(py, &chosen_rows(self.len, rows)?, |_, row| change.apply(&self.inner, &mut row.run.modes))
    }

    /// Take a device out of rows, as :meth:`Simulation.deactivate`.
    ///
    /// Parameters
    /// ----------
    /// device : str or int
    ///     Name or number.
    /// rows : array_like, optional
    ///     Mask of shape (n,), or numbers of rows; all without it.
    #[pyo3(signature = (device, rows=None))]
    fn deactivate(
        &self,
        py: Python<'_>,
        device: &Bound<'_, PyAny>,
        rows: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        let change = ModeChange::deactivate(&self.inner, device)?;
        self.change(py, &chosen_rows(self.len, rows)?, |_, row| change.apply(&self.inner, &mut row.run.modes))
    }

    fn __len__(&self) -> usize {
        self.len
    }

    fn __repr__(&self) -> String {
        let names = self.inner.object_names.join(", ");
        format!("<palpate.Batch of {} rows of {names} on {} threads>", self.len, self.threads)
    }
}
