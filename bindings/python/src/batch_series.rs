//! Series of a run of a batch. Each row makes some steps while its state is in the cache.

use crate::batch_motion::BatchMotion;
use crate::batch_rows::{Row, Workspaces};
use palpate_fem::check_memory;
use palpate_scene::Scene;
use rayon::prelude::*;

/// Number of steps that a row makes at once: a thousand rows take some hundredths of a second for them, after which Python is asked for signals.
const STEPS_AT_ONCE: usize = 16;

/// Numbers of the steps of all rows.
pub struct BatchSeries {
    /// Numbers of a row, step by step; row by row.
    pub numbers: Vec<f64>,
    steps: usize,
    /// Numbers of a row in a step.
    length: usize,
    done: usize,
}

impl BatchSeries {
    /// Series with room for a number of steps of a number of rows.
    ///
    /// # Errors
    /// Text, if there is no memory for it.
    pub fn new(rows: usize, steps: usize, length: usize) -> Result<Self, String> {
        let count = rows.saturating_mul(steps).saturating_mul(length);
        check_memory(size_of::<f64>() as f64 * count as f64).map_err(|error| error.to_string())?;
        let mut numbers = Vec::new();
        numbers.try_reserve_exact(count).map_err(|error| error.to_string())?;
        numbers.resize(count, 0.0);
        Ok(Self { numbers, steps, length, done: 0 })
    }

    /// Number of steps that all rows have made.
    pub fn done(&self) -> usize {
        self.done
    }

    /// Let all rows make the next steps, on the threads that it is called on; gives the rows that failed, in their order.
    pub fn run_part(
        &mut self,
        scene: &Scene,
        workspaces: &Workspaces,
        motion: &BatchMotion,
        rows: &mut [Row],
    ) -> Vec<usize> {
        let (length, from) = (self.length, self.done);
        let to = self.steps.min(from + STEPS_AT_ONCE);
        self.done = to;
        let run_row = |at: usize, row: &mut Row, numbers: &mut [f64]| {
            let (mut has_failed, mut workspace) = (false, workspaces.own());
            for step in from..to {
                has_failed |= row.step(scene, &mut workspace, motion, (step, at));
                row.fill(&mut numbers[step * length..][..length]);
            }
            has_failed.then_some(at)
        };
        let each = rows.par_iter_mut().zip(self.numbers.par_chunks_mut(self.steps * length)).enumerate();
        each.filter_map(|(at, (row, numbers))| run_row(at, row, numbers)).collect()
    }
}
