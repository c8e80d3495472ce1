//! Starts that the caller gives: placements and velocities of the objects of one simulation, or of each row of a batch.

use crate::arrays::{Numbers, check_finite, pose_of};
use crate::errors::{catch_panic, input_error, internal_error};
use crate::run_state::Start;
use palpate::{State, Support};
use palpate_scene::{Scene, pose_row, twist_row};
use pyo3::prelude::*;

/// Largest difference from the start of the scene that is round-off [m, m/s, 1].
const ROUND_OFF: f64 = 1e-9;

/// Starts of one or several states of a scene, checked.
pub struct Starts {
    poses: Option<Vec<f64>>,
    velocities: Option<Vec<f64>>,
    objects: usize,
}

impl Starts {
    /// Starts of the arguments `poses` and `velocities`, of shape (objects, …), or (rows, objects, …) for a number of rows.
    pub fn read(
        py: Python<'_>,
        scene: &Scene,
        rows: Option<usize>,
        (poses, velocities): (Option<&Bound<'_, PyAny>>, Option<&Bound<'_, PyAny>>),
    ) -> PyResult<Self> {
        let objects = scene.object_names.len();
        let read = |given: Option<&Bound<'_, PyAny>>, name: &str, width: usize| {
            let Some(given) = given else { return Ok(None) };
            let shape = [Some(objects), Some(width)];
            let shape: Vec<_> = rows.map(Some).into_iter().chain(shape).collect();
            let numbers = Numbers::read(given, name, &shape)?;
            check_finite(py, name, numbers.as_slice()?, width)?;
            PyResult::Ok(Some(numbers.as_slice()?.to_vec()))
        };
        let starts =
            Self { poses: read(poses, "poses", 7)?, velocities: read(velocities, "velocities", 6)?, objects };
        for (row, pose) in starts.poses.iter().flat_map(|numbers| numbers.chunks_exact(7)).enumerate() {
            pose_of(pose).map_err(|error| input_error(py, format!("row {row} of poses: {error}")))?;
        }
        let state = py.detach(|| catch_panic(|| starts.is_given().then(|| State::new(&scene.model))));
        if let Some(state) = state.map_err(|text| internal_error(py, &text))? {
            starts.check_immovable(scene, &state).map_err(|text| input_error(py, text))?;
        }
        Ok(starts)
    }

    fn is_given(&self) -> bool {
        self.poses.is_some() || self.velocities.is_some()
    }

    /// Start of a row, from 0.
    pub fn of(&self, row: usize) -> Start<'_> {
        let part = |width: usize| row * width * self.objects..(row + 1) * width * self.objects;
        Start {
            poses: self.poses.as_ref().map(|own| &own[part(7)]),
            velocities: self.velocities.as_ref().map(|own| &own[part(6)]),
        }
    }

    /// Check that what cannot be placed is where the scene says.
    fn check_immovable(&self, scene: &Scene, start: &State) -> Result<(), String> {
        for (object, recording) in scene.model.recordings().enumerate() {
            let is_fixed = recording.metadata.support == Support::Fixed;
            if !is_fixed && !start.modal_state(object).is_empty() {
                continue;
            }
            let why = if is_fixed { "has fixed nodes" } else { "uses a table" };
            let own = &start.output().objects[object];
            let differs = |numbers: &Option<Vec<f64>>, expected: &[f64]| {
                let mut rows = numbers.iter().flat_map(|numbers| numbers.chunks_exact(expected.len()));
                // Rows of all objects follow one another.
                rows.by_ref()
                    .skip(object)
                    .step_by(self.objects)
                    .any(|row| row.iter().zip(expected).any(|(a, b)| (a - b).abs() > ROUND_OFF))
            };
            if differs(&self.poses, &pose_row(&own.pose)) || differs(&self.velocities, &twist_row(&own.twist))
            {
                return Err(format!(
                    "object {:?} {why}: it starts where the scene says; give its rows as the scene has them",
                    scene.object_names[object]
                ));
            }
        }
        Ok(())
    }
}
