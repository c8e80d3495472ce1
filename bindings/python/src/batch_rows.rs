//! States of the rows of a batch, and which rows a caller chooses.

use crate::arrays::shown;
use crate::batch_motion::BatchMotion;
use crate::batch_outputs::fill_row;
use crate::errors::{catch_panic, input_error};
use crate::position_check::{Given, PositionCheck};
use crate::run_state::{RunState, StepFailure};
use crate::warnings::Told;
use crate::workers::Workers;
use palpate::Workspace;
use palpate_fem::check_memory;
use palpate_scene::Scene;
use pyo3::prelude::*;
use rayon::ThreadPoolBuildError;
use rayon::prelude::*;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Number of rows by whose memory that of all is estimated.
const FIRST_ROWS: usize = 64;

/// States of a batch, and the buffers of its steps.
pub struct Rows {
    pub rows: Vec<Row>,
    /// Numbers of the arrays, row by row.
    pub outputs: Vec<f64>,
    pub motion: BatchMotion,
    pub workers: Workers,
    pub workspaces: Workspaces,
    /// Whether the next step goes from the last row to the first.
    pub is_backward: bool,
}

impl Rows {
    /// Step all rows with their motions, and write their numbers, of a length; gives the rows that failed, in their order. Steps go to and fro:
    /// the states of the rows that were stepped last are still in the cache.
    ///
    /// # Errors
    /// If the system gives no threads.
    pub fn step(&mut self, scene: &Scene, length: usize) -> Result<Vec<usize>, ThreadPoolBuildError> {
        let Self { rows, outputs, motion, workers, workspaces, is_backward } = self;
        let (motion, workspaces) = (&*motion, &*workspaces);
        let backward = std::mem::replace(is_backward, !*is_backward);
        let step_row = |(at, (row, outputs)): (usize, (&mut Row, &mut [f64]))| {
            let has_failed = row.step(scene, &mut workspaces.own(), motion, (0, at));
            row.fill(outputs);
            has_failed.then_some(at)
        };
        let mut failed: Vec<usize> = workers.run(|| {
            let each = rows.par_iter_mut().zip(outputs.par_chunks_mut(length)).enumerate();
            if backward {
                each.rev().filter_map(step_row).collect()
            } else {
                each.filter_map(step_row).collect()
            }
        })?;
        failed.sort_unstable();
        Ok(failed)
    }

    /// State of a row that has not failed.
    pub fn whole(&self, py: Python<'_>, at: usize) -> PyResult<&RunState> {
        match &self.rows[at].failure {
            None => Ok(&self.rows[at].run),
            Some(failure) => {
                Err(failure.exception(py, &format!("row {at} has failed, reset or restore it: ")))
            }
        }
    }
}

/// Buffers of steps, for each thread: those of a thousand rows would not stay in a core's cache.
pub struct Workspaces(Vec<Mutex<Workspace>>);

impl Workspaces {
    /// Buffers for a number of threads.
    pub fn new(scene: &Scene, threads: usize) -> Self {
        Self((0..threads).map(|_| Mutex::new(Workspace::new(&scene.model))).collect())
    }

    /// Buffers of the thread that asks, which no other one uses.
    pub fn own(&self) -> MutexGuard<'_, Workspace> {
        let thread = rayon::current_thread_index().unwrap_or(0);
        self.0[thread].lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// State of a row.
pub struct Row {
    pub run: RunState,
    /// Why it takes no part.
    pub failure: Option<StepFailure>,
}

impl Row {
    pub fn new(mut run: RunState) -> Self {
        run.state.release_workspace();
        Self { run, failure: None }
    }

    /// Step with the motion of the row `at` in a step of the series; gives whether it failed now. A row that has failed before stays.
    pub fn step(
        &mut self,
        scene: &Scene,
        workspace: &mut Workspace,
        motion: &BatchMotion,
        (step, at): (usize, usize),
    ) -> bool {
        if self.failure.is_some() {
            return false;
        }
        let stepped = catch_panic(|| {
            self.run.follow_paths(scene);
            motion.write(step, at, &mut self.run.input).map_err(StepFailure::Motion)?;
            self.run.step_in(scene, workspace)
        });
        self.failure = stepped.unwrap_or_else(|text| Err(StepFailure::Panic(text))).err();
        self.failure.is_some()
    }

    /// Write its numbers; NaN in place of all but the time, if it has failed.
    pub fn fill(&self, outputs: &mut [f64]) {
        fill_row(outputs, self.run.state.output());
        if self.failure.is_some() {
            outputs[1..].fill(f64::NAN);
        }
    }
}

/// Write the numbers of all rows, each of a length.
pub fn fill_rows(rows: &[Row], outputs: &mut [f64], length: usize) {
    rows.iter().zip(outputs.chunks_exact_mut(length)).for_each(|(row, own)| row.fill(own));
}

/// Check where the parts of all rows go, and warn of what looks like millimetres.
pub fn check_positions(
    py: Python<'_>,
    scene: &Scene,
    motion: &BatchMotion,
    rows: &mut [Row],
    told: &Told,
) -> PyResult<()> {
    let count = rows.len();
    for (kind, numbers, width) in motion.given() {
        for (at, row) in rows.iter_mut().enumerate() {
            let RunState { check, state, modes, .. } = &mut row.run;
            let given = Given { kind, numbers, first: at * width, stride: count * width };
            PositionCheck { scene, check, state, modes, told }.check(py, &given)?;
        }
    }
    Ok(())
}

/// Numbers of the chosen rows: all, by a mask or by numbers.
pub fn chosen_rows(len: usize, rows: Option<&Bound<'_, PyAny>>) -> PyResult<Vec<usize>> {
    let Some(rows) = rows else { return Ok((0..len).collect()) };
    let py = rows.py();
    let numpy = py.import("numpy")?;
    let given = numpy
        .call_method1("atleast_1d", (rows,))
        .map_err(|error| input_error(py, format!("rows is no array ({})", error.value(py))))?;
    let kind: String = given.getattr("dtype")?.getattr("kind")?.extract()?;
    let shape: Vec<usize> = given.getattr("shape")?.extract()?;
    let is_mask = kind == "b" && shape == [len];
    let is_empty = shape == [0];
    if !(is_mask || is_empty || (["i", "u"].contains(&kind.as_str()) && shape.len() == 1)) {
        let message = format!(
            "rows has {} of shape {}, expected a mask of shape ({},), or integers from 0 to {}",
            given.getattr("dtype")?.str()?,
            shown(&shape),
            len,
            len - 1
        );
        return Err(input_error(py, message));
    }
    let given = if is_mask { numpy.call_method1("flatnonzero", (given,))? } else { given };
    let numbers: Vec<i64> = given.call_method1("astype", ("int64",))?.call_method0("tolist")?.extract()?;
    let mut seen = vec![false; len];
    let number = |given: i64| {
        let at = usize::try_from(given).ok().filter(|at| *at < len);
        let at = at.ok_or_else(|| input_error(py, format!("rows has {given}, expected 0 to {}", len - 1)))?;
        if std::mem::replace(&mut seen[at], true) {
            return Err(input_error(py, format!("rows has {given} twice")));
        }
        Ok(at)
    };
    numbers.into_iter().map(number).collect()
}

/// Memory of this process [bytes], if the system states it.
fn resident_bytes() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find(|line| line.starts_with("VmRSS:"))?;
    line.split_whitespace().nth(1)?.parse().ok().map(|kilobytes: f64| 1024.0 * kilobytes)
}

/// Rows at the start of the scene; text, if there is no memory for so many.
pub fn make_rows(scene: &Scene, count: usize, workers: &mut Workers) -> Result<Vec<Row>, String> {
    let mut make = |count: usize| {
        let rows =
            workers.run(|| (0..count).into_par_iter().map(|_| Row::new(RunState::new(scene))).collect());
        rows.map_err(|error| error.to_string())
    };
    let before = resident_bytes();
    let mut rows: Vec<Row> = make(count.min(FIRST_ROWS))?;
    let rest = count - rows.len();
    if let (Some(before), Some(after)) = (before, resident_bytes()) {
        let each = (after - before).max(0.0) / rows.len() as f64;
        check_memory(each * rest as f64)
            .map_err(|error| format!("{count} rows of {:.1} MB: {error}", 1e-6 * each))?;
    }
    rows.append(&mut make(rest)?);
    Ok(rows)
}

/// Exception for the rows that failed, with their numbers; none if there are none.
pub fn failure_of(py: Python<'_>, rows: &[Row], failed: Vec<usize>) -> PyResult<Option<PyErr>> {
    let Some(&first) = failed.first() else { return Ok(None) };
    let before = match failed.len() {
        1 => format!("row {first}: "),
        count => format!("row {first}, and {} more: ", count - 1),
    };
    let Some(failure) = &rows[first].failure else { return Ok(None) };
    let error = failure.exception(py, &before);
    error.value(py).setattr("rows", failed)?;
    Ok(Some(error))
}
