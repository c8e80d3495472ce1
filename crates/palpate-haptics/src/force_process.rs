//! The force process (paper, section 3.2): newest positions in, one step, forces out.

use crate::motion_path::MotionPath;
use crate::port::{Effort, ForcePort, Motion};
use glam::DVec3;
use palpate::{DeviceInput, DeviceMode, Input, Model, Output, Pose, State, step};
use std::sync::Arc;

/// Where an obstacle is at a time of the simulation [s]. It must not allocate.
pub type ObstacleTrajectory = Box<dyn Fn(f64) -> Pose + Send>;

/// A device as the force process sees it.
struct Seat {
    port: ForcePort,
    /// What it does while it is there and says nothing else.
    mode: DeviceMode,
    /// A path in simulated time that it follows, whatever its port tells.
    path: Option<MotionPath>,
    /// The motion that was used last.
    motion: Motion,
    /// See [`Effort::taken_j`]: what went into the proxy, and the proxy then.
    worked_j: f64,
    proxy: DVec3,
    stiffness: f64,
    sequence: u64,
}

/// The force process without its thread: what happens in a cycle.
pub struct ForceProcess {
    model: Arc<Model>,
    state: State,
    input: Input,
    seats: Vec<Seat>,
    movers: Vec<ObstacleTrajectory>,
    steps: u64,
    /// A device that has told nothing for so long [s] is away.
    patience_s: f64,
}

impl ForceProcess {
    /// Of a scene at its start. Devices that tell nothing for longer than `patience_s` [s] are away until they do again.
    ///
    /// There is a mover for each obstacle, and a port with a mode for each device of the model.
    pub fn new(
        model: Arc<Model>,
        devices: Vec<(ForcePort, DeviceMode)>,
        movers: Vec<ObstacleTrajectory>,
        patience_s: f64,
    ) -> Self {
        let state = State::new(&model);
        Self::from_state(state, model, devices, movers, patience_s)
    }

    /// The same from a state of the model's.
    pub fn from_state(
        state: State,
        model: Arc<Model>,
        devices: Vec<(ForcePort, DeviceMode)>,
        movers: Vec<ObstacleTrajectory>,
        patience_s: f64,
    ) -> Self {
        let coupling = |at: usize| model.parameters().devices.get(at).and_then(|device| device.coupling);
        let seats = devices.into_iter().enumerate().map(|(at, (port, mode))| Seat {
            port,
            mode,
            path: None,
            motion: Motion::default(),
            worked_j: 0.0,
            proxy: DVec3::ZERO,
            stiffness: coupling(at).map_or(0.0, |coupling| coupling.stiffness),
            sequence: 0,
        });
        let seats: Vec<Seat> = seats.collect();
        let obstacles = movers.iter().map(|mover| mover(0.0)).collect();
        let input = Input { devices: vec![DeviceInput::inactive(); seats.len()], obstacles };
        Self { model, state, input, seats, movers, steps: 0, patience_s }
    }

    /// Let a device follow a path exactly: by simulated time, also where that is slower than the clock.
    ///
    /// # Panics
    /// When there is no such device.
    pub fn follow(&mut self, device: usize, path: MotionPath) {
        self.seats[device].path = Some(path);
    }

    /// The scene as it is.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// The same, when there are no more cycles.
    pub fn into_state(self) -> State {
        self.state
    }

    /// What holds for the scene.
    pub fn model(&self) -> &Arc<Model> {
        &self.model
    }

    /// The input of the last step.
    pub fn input(&self) -> &Input {
        &self.input
    }

    /// Steps since the start.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Touch all memory that steps use, and bring the code in: a few steps on a copy.
    pub fn warm_up(&self) {
        let mut copy = self.state.clone();
        for _ in 0..50 {
            step(&self.model, &mut copy, &self.input);
        }
    }

    /// Take the newest motions, advance the scene by a step, answer with forces.
    ///
    /// # Real time
    /// No allocation, lock or system call; costs what [`palpate::step`] costs.
    pub fn cycle(&mut self, now_s: f64) -> &Output {
        self.steps += 1;
        let time_s = self.steps as f64 * self.model.parameters().step_s;
        for (seat, input) in self.seats.iter_mut().zip(&mut self.input.devices) {
            let mut motion = seat.port.newest();
            if let Some(path) = &seat.path {
                let position = path.at(time_s).position;
                motion = Motion { sequence: self.steps, time_s: now_s, position, ..Motion::default() };
            }
            let silent = motion.sequence == 0 || now_s - motion.time_s > self.patience_s;
            if motion.position.is_finite() {
                seat.motion = motion;
            }
            *input = if silent || !motion.position.is_finite() {
                DeviceInput::inactive()
            } else {
                DeviceInput { position: motion.position, mode: motion.mode.unwrap_or(seat.mode) }
            };
        }
        for (mover, pose) in self.movers.iter().zip(&mut self.input.obstacles) {
            *pose = mover(time_s);
        }
        let output = step(&self.model, &mut self.state, &self.input);
        for ((seat, input), device) in self.seats.iter_mut().zip(&self.input.devices).zip(&output.devices) {
            let force = device.force_on_hand;
            if input.mode == DeviceMode::Inactive {
                seat.proxy = seat.motion.position;
            } else {
                seat.worked_j -= force.dot(device.proxy - seat.proxy);
                seat.proxy = device.proxy;
            }
            let stretch = seat.motion.position - seat.proxy;
            let stored = 0.5 * seat.stiffness * stretch.length_squared();
            seat.sequence += 1;
            seat.port.answer(Effort {
                sequence: seat.sequence,
                answers: seat.motion.sequence,
                time_s: now_s,
                force,
                taken_j: seat.worked_j + stored,
            });
        }
        output
    }
}
