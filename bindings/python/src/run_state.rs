//! State of a simulation, its snapshots, and the loop of a run.

use crate::arrays::pose_of;
use crate::errors::{Class, catch_panic, exception, internal_error};
use crate::motion::SeriesMotion;
use crate::progress::SIGNAL_INTERVAL;
use glam::DVec3;
use palpate::{DeviceMode, Grasp, Input, ObjectSnapshot, State, Support, Twist, Workspace, step, step_in};
use palpate_scene::RunCheck;
use pyo3::exceptions::PyMemoryError;
use pyo3::prelude::*;
use std::collections::TryReserveError;
use std::time::Instant;

/// Number of steps between looks at the clock.
const STEPS_PER_LOOK: usize = 16;

/// State of a simulation, or of one row of a batch.
#[derive(Clone)]
pub struct RunState {
    pub state: State,
    pub input: Input,
    /// Modes of the devices: those of the scene, until one grasps, lets go or leaves.
    pub modes: Vec<DeviceMode>,
    /// Check of the steps since the start.
    pub check: RunCheck,
    /// Text of a panic in a step: what is left of the state is of no use.
    panic: Option<String>,
}

/// Reason that a step failed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum StepFailure {
    /// Motion that cannot be written or followed.
    Motion(String),
    /// Panic, in this step or in an earlier one.
    Panic(String),
    /// No memory for what is kept of a step.
    Memory(TryReserveError),
}

impl StepFailure {
    /// Exception with a text before the reason.
    pub fn exception(&self, py: Python<'_>, before: &str) -> PyErr {
        match self {
            Self::Motion(text) => exception(py, Class::Step, format!("{before}{text}")),
            Self::Panic(text) => internal_error(py, &format!("{before}{text}")),
            Self::Memory(error) => PyMemoryError::new_err(format!("{before}{error}")),
        }
    }
}

/// Placement and motion of the objects at the start: rows of poses and velocities, one for each object.
#[derive(Clone, Copy, Default)]
pub struct Start<'a> {
    /// x, y, z [m], qw, qx, qy, qz.
    pub poses: Option<&'a [f64]>,
    /// Velocity [m/s] and angular velocity [rad/s, world].
    pub velocities: Option<&'a [f64]>,
}

impl RunState {
    /// State at the start of the scene.
    pub fn new(scene: &palpate_scene::Scene) -> Self {
        Self::with(scene, State::new(&scene.model))
    }

    fn with(scene: &palpate_scene::Scene, state: State) -> Self {
        let modes = scene.devices.iter().map(|device| device.mode).collect();
        Self { state, input: scene.input_at(0.0), modes, check: RunCheck::new(scene), panic: None }
    }

    /// State that resumes from the objects of another one, at time 0.
    pub fn resume(scene: &palpate_scene::Scene, objects: &[ObjectSnapshot]) -> Self {
        Self::with(scene, State::resume(&scene.model, objects))
    }

    /// State at the start of the scene, its objects placed and moving as given; those with fixed nodes or on a table as the scene says.
    ///
    /// # Errors
    /// Text, for quaternions that are none.
    pub fn at(scene: &palpate_scene::Scene, start: Start) -> Result<Self, String> {
        if start.poses.is_none() && start.velocities.is_none() {
            return Ok(Self::new(scene));
        }
        let mut objects = State::new(&scene.model).snapshots();
        for (at, (own, recording)) in objects.iter_mut().zip(scene.model.recordings()).enumerate() {
            if recording.metadata.support == Support::Fixed || own.modes.is_empty() {
                continue;
            }
            if let Some(poses) = start.poses {
                own.pose = pose_of(&poses[7 * at..][..7])?;
            }
            if let Some(velocities) = start.velocities {
                let row = &velocities[6 * at..][..6];
                own.twist = Twist { linear: DVec3::from_slice(row), angular: DVec3::from_slice(&row[3..]) };
            }
            let (turn, inertia) = (own.pose.orientation, recording.inertia());
            own.angular_momentum = turn * (inertia * (turn.inverse() * own.twist.angular));
        }
        Ok(Self::resume(scene, &objects))
    }

    /// Whether a step has panicked: only a reset or a snapshot helps.
    pub fn has_panicked(&self) -> Option<StepFailure> {
        self.panic.clone().map(StepFailure::Panic)
    }

    /// Move what has a path in the scene to its place at the end of the next step.
    pub fn follow_paths(&mut self, scene: &palpate_scene::Scene) {
        scene.follow_next_step(&self.state, &mut self.input);
        for (own, mode) in self.input.devices.iter_mut().zip(&self.modes) {
            // A force of the scene's course, or of the last step.
            if !matches!((own.mode, mode), (DeviceMode::Force(_), DeviceMode::Force(_))) {
                own.mode = *mode;
            }
        }
    }

    /// Step with the input.
    ///
    /// # Errors
    /// When the motion cannot be followed; when a step panics, and from then on.
    pub fn step(&mut self, scene: &palpate_scene::Scene) -> Result<(), StepFailure> {
        self.step_by(scene, |state, input| _ = step(&scene.model, state, input))
    }

    /// Step with the input in the buffers of a thread; after a panic they are made again.
    ///
    /// # Errors
    /// As [`Self::step`].
    pub fn step_in(
        &mut self,
        scene: &palpate_scene::Scene,
        workspace: &mut Workspace,
    ) -> Result<(), StepFailure> {
        let stepped = self.step_by(scene, |state, input| _ = step_in(&scene.model, state, workspace, input));
        if let Err(StepFailure::Panic(_)) = stepped {
            *workspace = Workspace::new(&scene.model);
        }
        stepped
    }

    /// Step with the input by a function, unless an earlier step has panicked; see [`Self::step`].
    fn step_by(
        &mut self,
        scene: &palpate_scene::Scene,
        step: impl FnOnce(&mut State, &Input),
    ) -> Result<(), StepFailure> {
        if let Some(failure) = self.has_panicked() {
            return Err(failure);
        }
        let stepped = catch_panic(|| {
            step(&mut self.state, &self.input);
            self.check.add(&self.input, &self.state);
            scene.check_step(&self.input, &self.state)
        });
        match stepped {
            Ok(checked) => checked.map_err(StepFailure::Motion),
            Err(text) => {
                self.panic = Some(text.clone());
                Err(StepFailure::Panic(text))
            }
        }
    }
}

/// Points that devices hold or exert forces on [m, world]; NaN for tips.
pub fn held_points(scene: &palpate_scene::Scene, run: &RunState) -> impl Iterator<Item = DVec3> {
    let (model, state) = (&scene.model, &run.state);
    run.modes.iter().map(|mode| {
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
    })
}

/// Run steps until they are done, or it is time to ask for signals; gives the number of the next.
pub fn run_part(
    scene: &palpate_scene::Scene,
    run: &mut RunState,
    motion: &SeriesMotion,
    steps: std::ops::Range<usize>,
    mut append: impl FnMut(usize, &mut RunState) -> Result<(), StepFailure>,
) -> Result<usize, StepFailure> {
    let started = Instant::now();
    for number in steps.clone() {
        if (number - steps.start).is_multiple_of(STEPS_PER_LOOK) && started.elapsed() > SIGNAL_INTERVAL {
            return Ok(number);
        }
        run.follow_paths(scene);
        motion.write(number, &mut run.input).map_err(StepFailure::Motion)?;
        run.step(scene)?;
        append(number, run)?;
    }
    Ok(steps.end)
}
