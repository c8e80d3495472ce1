//! Motions of the rows of a batch, for one step or a series of steps.

use crate::arrays::{Numbers, pose_of};
use crate::errors::input_error;
use crate::motion::{Arguments, Kind, Part, check_paths, copy, parts, write};
use crate::run_length::MAX_STEPS;
use palpate::Input;
use palpate_scene::Scene;
use pyo3::prelude::*;

/// Motions of all rows, copied: the rows are stepped without the interpreter's lock. Buffers are made once.
pub struct BatchMotion {
    /// Number of rows.
    rows: usize,
    /// Number of steps, if a series of something is given.
    steps: Option<usize>,
    /// Kind, whether it is given, numbers and numbers per row.
    parts: Vec<(Kind, bool, Vec<f64>, usize)>,
}

impl BatchMotion {
    /// Buffers for a number of rows of a scene.
    pub fn new(scene: &Scene, rows: usize) -> Self {
        let nothing = Arguments { positions: None, obstacles: None, clamps: None };
        let part = |part: Part| (part.kind, false, Vec::new(), part.rows * part.kind.columns());
        Self { rows, steps: None, parts: parts(&nothing, scene).map(part).into() }
    }

    /// Read the arguments, of shape (rows, …), or (steps, rows, …) of a series.
    pub fn read(
        &mut self,
        py: Python<'_>,
        scene: &Scene,
        is_series: bool,
        arguments: &Arguments<'_, '_>,
    ) -> PyResult<()> {
        if arguments.positions.is_none() {
            check_paths(py, scene)?;
        }
        self.steps = None;
        for (Part { kind, given, rows }, (_, is_given, own, _)) in
            parts(arguments, scene).into_iter().zip(&mut self.parts)
        {
            *is_given = given.is_some();
            let Some(given) = given else { continue };
            let (name, columns) = (kind.name(), kind.columns());
            let shape = [self.steps, Some(self.rows), Some(rows), Some(columns)];
            let numbers = Numbers::read(given, name, if is_series { &shape } else { &shape[1..] })?;
            if is_series {
                self.steps = numbers.shape().first().copied();
            }
            let numbers = numbers.as_slice()?;
            let batch = self.rows;
            let place = |at: usize| {
                let (step, row, part) = (at / rows / batch, at / rows % batch, at % rows);
                if is_series {
                    format!("{name}[{step}, {row}, {part}]")
                } else {
                    format!("{name}[{row}, {part}]")
                }
            };
            for (at, row) in numbers.chunks_exact(columns).enumerate() {
                if row.iter().any(|number| !number.is_finite()) {
                    let message = format!("{} is {row:?}, expected finite numbers", place(at));
                    return Err(input_error(py, message));
                }
                if kind != Kind::Devices {
                    pose_of(row).map_err(|error| input_error(py, format!("{}: {error}", place(at))))?;
                }
            }
            copy(name, numbers, own)?;
        }
        Ok(())
    }

    /// Numbers, and numbers per row, of each kind that is given.
    pub fn given(&self) -> impl Iterator<Item = (Kind, &[f64], usize)> {
        let given = self.parts.iter().filter(|(_, is_given, ..)| *is_given);
        given.map(|(kind, _, numbers, width)| (*kind, &**numbers, *width))
    }

    /// Number of steps of the series, or as given.
    pub fn count_steps(&self, given: Option<i64>) -> Result<usize, String> {
        match (self.steps, given) {
            (Some(steps), None) => Ok(steps),
            (Some(_), Some(_)) => Err("the motions have a row per step: leave steps out".into()),
            (None, None) => Err("give positions, or steps".into()),
            (None, Some(steps)) if (0..=i64::from(MAX_STEPS)).contains(&steps) => Ok(steps as usize),
            (None, Some(steps)) => Err(format!("steps is {steps}, expected 0 to {MAX_STEPS}")),
        }
    }

    /// Write the motion of a row in a step, from 0, over the input of the scene's paths.
    ///
    /// # Errors
    /// As [`write`]; poses were checked.
    pub fn write(&self, step: usize, row: usize, input: &mut Input) -> Result<(), String> {
        for (kind, is_given, numbers, width) in &self.parts {
            if *is_given {
                write(*kind, &numbers[(step * self.rows + row) * width..][..*width], input)?;
            }
        }
        Ok(())
    }
}
