//! State of a simulation, its snapshots, and the loop of a run.

use crate::motion::SeriesMotion;
use crate::progress::SIGNAL_INTERVAL;
use palpate::{Input, State, step};
use pyo3::prelude::*;
use std::sync::Arc;
use std::time::Instant;

/// Number of steps between looks at the clock.
const STEPS_PER_LOOK: usize = 16;

/// State of a simulation.
#[derive(Clone)]
pub struct RunState {
    pub state: State,
    pub input: Input,
    pub steps: u64,
}

/// State of a simulation at a time, for :meth:`Simulation.restore`.
#[pyclass(frozen, module = "palpate")]
pub struct Snapshot {
    /// Scene, which a restored simulation shares.
    pub scene: Arc<palpate_scene::Scene>,
    pub run: RunState,
}

#[pymethods]
impl Snapshot {
    /// Time [s].
    #[getter]
    fn time(&self) -> f64 {
        self.run.state.output().time_s
    }

    fn __repr__(&self) -> String {
        format!("<palpate.Snapshot at {:.6} s>", self.time())
    }
}

impl RunState {
    /// State at the start.
    pub fn new(scene: &palpate_scene::Scene) -> Self {
        Self { state: State::new(&scene.model), input: scene.input_at(0.0), steps: 0 }
    }

    /// Move what has a path in the scene to its place at the end of the next step.
    pub fn follow_paths(&mut self, scene: &palpate_scene::Scene) {
        let end_s = (self.steps + 1) as f64 * scene.model.parameters().step_s;
        scene.follow_paths(end_s, &mut self.input);
    }

    /// Step with the input.
    ///
    /// # Errors
    /// Text, when the motion cannot be followed.
    pub fn step(&mut self, scene: &palpate_scene::Scene) -> Result<(), String> {
        step(&scene.model, &mut self.state, &self.input);
        self.steps += 1;
        scene.check_step(&self.input, &self.state)
    }
}

/// Run steps until they are done, or it is time to ask for signals; gives the number of the next.
pub fn run_part(
    scene: &palpate_scene::Scene,
    run: &mut RunState,
    motion: &SeriesMotion,
    steps: std::ops::Range<usize>,
    mut append: impl FnMut(&Input, &State),
) -> Result<usize, String> {
    let started = Instant::now();
    for number in steps.clone() {
        if (number - steps.start).is_multiple_of(STEPS_PER_LOOK) && started.elapsed() > SIGNAL_INTERVAL {
            return Ok(number);
        }
        run.follow_paths(scene);
        motion.write(number, &mut run.input)?;
        run.step(scene)?;
        append(&run.input, &run.state);
    }
    Ok(steps.end)
}
