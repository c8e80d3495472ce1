//! `palpate.Session`: a scene in real time, driven and watched from Python.
//!
//! The threads are those of `palpate run --realtime`. They never take the interpreter's lock: positions go to them, and outputs come back, through
//! triple buffers.

use crate::contacts::ContactLayout;
use crate::device_mode::{ModeChange, mode_name};
use crate::errors::{Class, catch_panic, exception, input_error, internal_error, scene_error};
use crate::motion::{Arguments, check_devices};
use crate::output::Output;
use crate::progress::{SIGNAL_INTERVAL, warn};
use crate::run_length::count_steps;
use crate::run_state::RunState;
use crate::scalars::{FilePath, Whole};
use crate::scene::Scene;
use crate::session_hands::{Hands, Move};
use crate::session_report::{report_by_name, timing_by_name};
use crate::session_start::{LogFailure, begin_log, check_start, scheduling};
use crate::session_thread::{End, Running, lock};
use crate::snapshot::Snapshot;
use crate::warnings::Told;
use palpate::State;
use palpate_haptics::{Playback, Snapshot as Newest};
use palpate_scene::Warning;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// Session of a scene: it runs by the clock from now on, one step of the scene per period, in threads of its own.
///
/// Parameters
/// ----------
/// scene : Scene
///     Its step is the period: 0.0002 to 0.01 s. Where it states no `max_contact_samples` and no `solver_budget`, it has those of a run in real
///     time (docs/realtime.md).
/// positions : array_like, optional
///     Positions of the hands from the first step on, as for :meth:`move`. A device takes no part before the first position that it is given.
/// steps : int, optional
///     Number of steps; without `steps` and `duration` it runs until :meth:`stop`.
/// duration : float, optional
///     Simulated time [s] instead of the number of steps.
/// log : path, optional
///     File for a log (MCAP), for :class:`Log` and `palpate replay`, which repeats it bit for bit.
/// start : Snapshot, optional
///     State of the objects at the start, also from another scene with the same recordings: with other gravity, friction or couplings. Contacts and
///     times begin anew.
/// timeout : float, optional
///     Time [s] without a :meth:`move` after which a device exerts no force until the next one. Without it a hand stays where it was put.
/// priority : int, optional
///     Real-time priority, 1 to 99, with the memory of the process locked, as far as the system grants it: :attr:`granted` says. `palpate run` asks
///     for 80.
/// core : int, optional
///     Core that the force process is kept on, from 0.
///
/// Raises
/// ------
/// SceneError
///     If the step is not one of real time.
/// FileError
///     If the log cannot be written.
///
/// Notes
/// -----
/// A `with` block stops it at its end; so does the end of the interpreter, and when nothing refers to the session any more. A forked process has
/// none of the threads, and cannot use the session.
#[pyclass(frozen, module = "palpate")]
pub struct Session {
    scene: Py<Scene>,
    /// Scene with the limits of real time.
    inner: Arc<palpate_scene::Scene>,
    layout: Arc<ContactLayout>,
    hands: Mutex<Hands>,
    running: Arc<Running>,
    log_failure: LogFailure,
    told: Told,
}

impl Drop for Session {
    fn drop(&mut self) {
        if self.running.is_here() {
            self.running.ask_to_stop();
        }
    }
}

impl Session {
    /// Threads, which this process must have; warns of a log that has failed, once.
    fn here(&self, py: Python<'_>) -> PyResult<&Running> {
        if !self.running.is_here() {
            let message = "the session runs in the process that started it, not in one that was forked from it: start another here";
            return Err(exception(py, Class::Palpate, message));
        }
        if let Some(text) = lock(&self.log_failure).take() {
            warn(py, &format!("{text}. The session goes on without it"))?;
        }
        Ok(&self.running)
    }

    /// Threads that run; those that have failed or ended are an exception.
    fn live(&self, py: Python<'_>) -> PyResult<&Running> {
        let running = self.here(py)?;
        match running.end() {
            None => Ok(running),
            Some(end) => {
                self.check_end(py, &end)?;
                Err(exception(py, Class::Palpate, "the session has ended: start another"))
            }
        }
    }

    /// Exception of a session that failed, or whose log is not whole.
    fn check_end(&self, py: Python<'_>, end: &End) -> PyResult<()> {
        end.report.as_ref().map_err(|failure| failure.exception(py))?;
        end.log.as_ref().map_err(|error| scene_error(py, error))?;
        Ok(())
    }

    /// Warnings about positions of a move that look like millimetres.
    fn far_positions(&self, given: &Move, hands: &Hands) -> Vec<Warning> {
        let poses = || {
            let objects = &self.running.newest().output.objects;
            objects.iter().map(|object| object.pose).collect::<Vec<_>>().into_iter()
        };
        let positions = given.positions(&self.inner, &hands.modes);
        let far = |(name, x)| self.inner.far_positions(name, std::iter::once(x), poses);
        positions.filter_map(far).collect()
    }

    fn change(&self, py: Python<'_>, change: ModeChange) -> PyResult<()> {
        self.live(py)?;
        lock(&self.hands).change(&self.inner, change).map_err(|text| input_error(py, text))
    }

    /// Exception of a step that could not be followed, once for all steps until then.
    fn check_steps(&self, py: Python<'_>) -> PyResult<()> {
        match self.running.lost_step.take() {
            Some(text) => Err(exception(py, Class::Step, text)),
            None => Ok(()),
        }
    }
}

#[pymethods]
impl Session {
    #[new]
    #[pyo3(signature = (scene, *, positions=None, steps=None, duration=None, log=None, start=None, timeout=None, priority=None, core=None))]
    #[expect(clippy::too_many_arguments, reason = "keywords of Python")]
    fn new(
        py: Python<'_>,
        scene: Py<Scene>,
        positions: Option<&Bound<'_, PyAny>>,
        steps: Option<Whole>,
        duration: Option<f64>,
        log: Option<FilePath>,
        start: Option<Py<Snapshot>>,
        timeout: Option<f64>,
        priority: Option<Whole>,
        core: Option<Whole>,
    ) -> PyResult<Self> {
        let refused = |text: String| input_error(py, text);
        check_devices(py, &scene.get().inner)?;
        let steps = match (steps, duration) {
            (None, None) => None,
            (steps, duration) => {
                let given = (steps.map(|Whole(steps)| steps), duration);
                Some(count_steps(&scene.get().inner, 0, None, given).map_err(refused)? as u64)
            }
        };
        let scheduling = scheduling(priority, core).map_err(refused)?;
        if let Some(timeout) = timeout.filter(|timeout| timeout.is_nan() || *timeout <= 0.0) {
            return Err(input_error(py, format!("timeout is {timeout} s, expected a positive time")));
        }
        let inner = Arc::new(scene.get().for_real_time(py)?);
        let objects = start.as_ref().map(|start| start.get().run.state.snapshots());
        if let Some(objects) = &objects {
            check_start(&inner, objects).map_err(refused)?;
        }
        let begun = Instant::now();
        let playback = Arc::new(Playback::default());
        let (mut hands, devices) = Hands::open(&inner, begun, Arc::clone(&playback));
        let arguments = Arguments { positions, obstacles: None, clamps: None };
        let begin = positions.map(|_| hands.read(py, &inner, &arguments, None, None)).transpose()?;
        begin.iter().for_each(|begin| hands.make(begin));
        let state = py.detach(|| {
            catch_panic(|| match &objects {
                Some(objects) => State::resume(&inner.model, objects),
                None => State::new(&inner.model),
            })
        });
        let state = state.map_err(|text| internal_error(py, &text))?;
        let mut session = palpate_haptics::Session {
            steps,
            device_timeout_s: timeout.unwrap_or(f64::INFINITY),
            playback,
            ..inner.session(devices, begun, scheduling)
        };
        hands.take_over(&inner, &mut session.motion);
        let log_failure = LogFailure::default();
        let log = log
            .map(|FilePath(path)| begin_log(py, &scene, &inner, &path, (&state, &log_failure)))
            .transpose()?;
        let first = Newest::new(&inner.model, &state, &inner.input_at(0.0));
        let running =
            Running::start(session, &inner, state, &first, log).map_err(|failure| failure.exception(py))?;
        let layout = Arc::new(ContactLayout::new(&inner));
        let hands = Mutex::new(hands);
        let made = Self { scene, inner, layout, hands, running, log_failure, told: Told::default() };
        if let Some(begin) = begin {
            let far = made.far_positions(&begin, &lock(&made.hands));
            made.told.tell(py, &far)?;
        }
        Ok(made)
    }

    /// Scene.
    #[getter]
    fn scene(&self, py: Python<'_>) -> Py<Scene> {
        self.scene.clone_ref(py)
    }

    /// Move hands, planes, obstacles and clamps: from where they are in a straight line to what is given, from the next step on.
    ///
    /// Parameters
    /// ----------
    /// positions : array_like, optional
    ///     Positions of all hands [m, world], shape (devices, 3); a row of a device with `mode = "force"` is its force on the object [N], which holds
    ///     from the next step on. Rows of devices that follow a path of the scene are not used, here and below.
    /// device : str or int, optional
    ///     Name or number of one device: `positions` is its own, shape (3,).
    /// obstacles : array_like, optional
    ///     Poses of planes and obstacles, shape (obstacles, 7): x, y, z [m], qw, qx, qy, qz.
    /// clamps : array_like, optional
    ///     Frames of the clamps, likewise.
    /// over : float, optional
    ///     Time to get there [s, by the clock]; 0: within one step. Without it that since the last move, at most 0.1 s, so that moves at 10 Hz
    ///     and more make an even motion. The first position of a hand is where it begins.
    ///
    /// Raises
    /// ------
    /// InputError
    ///     If an array has another shape, or numbers that are not finite. Nothing has moved then.
    /// StepError
    ///     If a step could not be followed, as in :meth:`Simulation.step`; it is told once, and the session goes on. Nothing has moved then.
    /// PalpateError
    ///     If the session has ended.
    #[pyo3(signature = (positions=None, device=None, *, obstacles=None, clamps=None, over=None), name = "move")]
    fn move_hands(
        &self,
        py: Python<'_>,
        positions: Option<&Bound<'_, PyAny>>,
        device: Option<&Bound<'_, PyAny>>,
        obstacles: Option<&Bound<'_, PyAny>>,
        clamps: Option<&Bound<'_, PyAny>>,
        over: Option<f64>,
    ) -> PyResult<()> {
        self.live(py)?;
        self.check_steps(py)?;
        let mut hands = lock(&self.hands);
        let given = hands.read(py, &self.inner, &Arguments { positions, obstacles, clamps }, device, over)?;
        hands.make(&given);
        let far = self.far_positions(&given, &hands);
        // Python's filters run code of the caller.
        drop(hands);
        self.told.tell(py, &far)
    }

    /// Newest output: that of the last step, without waiting for the next.
    ///
    /// Returns
    /// -------
    /// Output
    ///     Forces, contacts, poses and time of one step; after the end those of the last one.
    ///
    /// Raises
    /// ------
    /// StepError
    ///     If a step could not be followed, as in :meth:`Simulation.step`; it is told once, and the session goes on.
    /// PalpateError
    ///     If the session failed.
    fn newest(&self, py: Python<'_>) -> PyResult<Output> {
        let running = self.here(py)?;
        if let Some(end) = running.end() {
            end.report.as_ref().map_err(|failure| failure.exception(py))?;
        }
        self.check_steps(py)?;
        let (scene, layout) = (Arc::clone(&self.inner), Arc::clone(&self.layout));
        Ok(Output { scene, layout, snapshot: running.newest() })
    }

    /// Number of steps so far.
    #[getter]
    fn steps(&self, py: Python<'_>) -> PyResult<u64> {
        Ok(self.here(py)?.steps())
    }

    /// Whether the threads run.
    #[getter]
    fn is_running(&self) -> bool {
        self.running.is_here() && self.running.end().is_none()
    }

    /// Timing of the force process so far: `cycles`; percentiles `p50`, `p99`, `p999`, `max` [s] of `compute_time` and `lateness`; `overruns`,
    /// cycles that ended after the next deadline, `own_overruns` by their own compute time, and `skipped` periods (docs/realtime.md).
    #[getter]
    fn timing<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (timing, _) = self.here(py)?.timing();
        timing_by_name(py, &timing)
    }

    /// Scheduling that the system granted to the force process, in words; None before its first cycle.
    #[getter]
    fn granted(&self, py: Python<'_>) -> PyResult<Option<String>> {
        Ok(self.here(py)?.timing().1)
    }

    /// Whether it pauses; may be set. Simulated time stands still meanwhile.
    #[getter]
    fn is_paused(&self) -> bool {
        self.running.playback.is_paused()
    }

    #[setter]
    fn set_is_paused(&self, py: Python<'_>, is_paused: bool) -> PyResult<()> {
        self.live(py)?.playback.set_paused(is_paused);
        Ok(())
    }

    /// Wall-clock time per simulated time, a whole number from 1; may be set.
    #[getter]
    fn slowdown(&self) -> u32 {
        self.running.playback.slowdown()
    }

    #[setter]
    fn set_slowdown(&self, py: Python<'_>, slowdown: Whole) -> PyResult<()> {
        let Whole(given) = slowdown;
        let factor = u32::try_from(given).ok().filter(|factor| *factor > 0);
        let message = || input_error(py, format!("slowdown is {given}, expected a whole number from 1"));
        self.live(py)?.playback.set_slowdown(factor.ok_or_else(message)?);
        Ok(())
    }

    /// Make one step of a paused session, at its next period.
    fn request_step(&self, py: Python<'_>) -> PyResult<()> {
        self.live(py)?.playback.request_step();
        Ok(())
    }

    /// Let a device take hold of a point, as :meth:`Simulation.grasp`, from one of the next steps on.
    ///
    /// Parameters
    /// ----------
    /// device : str or int
    ///     Name or number.
    /// object : str or int
    ///     Name or number of the object.
    /// point : (3,) array_like
    ///     Point near the surface [m, body frame].
    fn grasp(
        &self,
        py: Python<'_>,
        device: &Bound<'_, PyAny>,
        object: &Bound<'_, PyAny>,
        point: &Bound<'_, PyAny>,
    ) -> PyResult<()> {
        self.change(py, ModeChange::grasp(&self.inner, device, object, point)?)
    }

    /// Let a device let go of its point, as :meth:`Simulation.release`: it touches with its tip.
    ///
    /// Parameters
    /// ----------
    /// device : str or int
    ///     Name or number.
    fn release(&self, py: Python<'_>, device: &Bound<'_, PyAny>) -> PyResult<()> {
        self.change(py, ModeChange::release(&self.inner, device)?)
    }

    /// Take a device out of the scene, as :meth:`Simulation.deactivate`, until it grasps or is released.
    ///
    /// Parameters
    /// ----------
    /// device : str or int
    ///     Name or number.
    fn deactivate(&self, py: Python<'_>, device: &Bound<'_, PyAny>) -> PyResult<()> {
        self.change(py, ModeChange::deactivate(&self.inner, device)?)
    }

    /// Modes of the devices: "touch", "held", "force" or "inactive".
    #[getter]
    fn modes(&self) -> Vec<&'static str> {
        lock(&self.hands).modes.iter().map(mode_name).collect()
    }

    /// Wait for the end of a session with `steps` or `duration`. Ctrl-C ends the wait with KeyboardInterrupt, and the session goes on.
    ///
    /// Parameters
    /// ----------
    /// timeout : float, optional
    ///     Longest time to wait [s].
    ///
    /// Returns
    /// -------
    /// bool
    ///     Whether it has ended.
    ///
    /// Raises
    /// ------
    /// StepError
    ///     As :meth:`newest`.
    /// PalpateError
    ///     If the session failed; LogError if its log is not whole.
    #[pyo3(signature = (timeout=None))]
    fn wait(&self, py: Python<'_>, timeout: Option<f64>) -> PyResult<bool> {
        if timeout.is_some_and(f64::is_nan) {
            return Err(input_error(py, "timeout is not a number, expected a time"));
        }
        let begun = Instant::now();
        loop {
            let running = self.here(py)?;
            let left = timeout.map_or(f64::INFINITY, |timeout| timeout - begun.elapsed().as_secs_f64());
            let patience = left.clamp(0.0, SIGNAL_INTERVAL.as_secs_f64());
            let ended = py.detach(|| running.wait(Duration::from_secs_f64(patience)));
            self.check_steps(py)?;
            match ended {
                Some(end) => return self.check_end(py, &end).map(|()| true),
                None if left <= 0.0 => return Ok(false),
                None => py.check_signals()?,
            }
        }
    }

    /// End the threads, and the log in good order. Stopping again gives the report again.
    ///
    /// Returns
    /// -------
    /// dict
    ///     Report: `steps`, `wall_time` [s], `steal_time` [s], `granted`, `force_process` (as :attr:`timing`), `unsolved_steps`, `steps_out_of_budget`,
    ///     `largest_penetration` [m] by object, `touching_steps` by device, and `log` (its `steps`, `missed` ones, whether it is `whole`; None
    ///     without one).
    ///
    /// Raises
    /// ------
    /// StepError
    ///     As :meth:`newest`; it has ended all the same.
    /// PalpateError
    ///     If the session failed; LogError if its log is not whole.
    fn stop<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let running = self.here(py)?;
        running.ask_to_stop();
        let end = py.detach(|| running.join());
        let report = end.report.as_ref().map_err(|failure| failure.exception(py))?;
        self.check_end(py, &end)?;
        self.check_steps(py)?;
        let warnings = self.inner.session_warnings(report);
        self.told.tell(py, &warnings)?;
        report_by_name(py, &self.inner, report, &warnings)
    }

    /// State at the end of a session, for the `start` of another one, and for :meth:`Simulation.restore`: objects are placed, moving and deformed
    /// as they are; contacts and time begin anew.
    fn snapshot(&self, py: Python<'_>) -> PyResult<Snapshot> {
        let Some(end) = self.here(py)?.end() else {
            return Err(exception(py, Class::Palpate, "the session runs: stop() it before its snapshot"));
        };
        let report = end.report.as_ref().map_err(|failure| failure.exception(py))?;
        let scene = Arc::clone(&self.scene.get().inner);
        let objects = report.state.snapshots();
        check_start(&scene, &objects).map_err(|text| input_error(py, text))?;
        let mut run = RunState::resume(&scene, &objects);
        run.modes.clone_from(&lock(&self.hands).modes);
        Ok(Snapshot { scene, run })
    }

    fn __enter__(this: Py<Self>) -> Py<Self> {
        this
    }

    #[pyo3(signature = (kind, _error, _trace))]
    fn __exit__(
        &self,
        py: Python<'_>,
        kind: Option<&Bound<'_, PyAny>>,
        _error: Option<&Bound<'_, PyAny>>,
        _trace: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<()> {
        match (self.stop(py), kind) {
            (Err(error), None) => Err(error),
            // The exception of the block counts.
            _ => Ok(()),
        }
    }

    fn __repr__(&self) -> String {
        let names = self.inner.object_names.join(", ");
        match self.is_running() {
            true => format!("<palpate.Session of {names}, {} steps>", self.running.steps()),
            false => format!("<palpate.Session of {names}, ended>"),
        }
    }
}
