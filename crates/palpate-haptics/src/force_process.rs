//! Force process (paper, section 3.2): newest positions in, one step, forces out.

use crate::motion_check::Ball;
use crate::motion_path::{MotionPath, PoseTrajectory};
use crate::port::{Effort, ForcePort, Motion};
use crate::ramp::Ramp;
use crate::safety_limits::RefusedMotions;
use glam::DVec3;
use palpate::{AppliedForce, DeviceInput, DeviceMode, Input, Model, Output, Pose, State, step};
use std::sync::Arc;

/// Motion of a scene's parts, in the model's order.
#[derive(Default)]
pub struct SceneMotion {
    /// Trajectories, one for each obstacle.
    pub obstacles: Vec<PoseTrajectory>,
    /// Trajectories of the clamps' frames; `None` stays. None at all is the same.
    pub clamps: Vec<Option<PoseTrajectory>>,
    /// Paths of the bases of the objects with fixed nodes over simulated time, one for each object; `None` stays. None at all is the same.
    pub bases: Vec<Option<MotionPath>>,
    /// Gravity over simulated time, rows of t [s] and x, y, z [m/s²]; `None` is the model's.
    pub gravity: Option<MotionPath>,
}

/// Listener to the input of every step and the state after it. It must not allocate, lock or call the system.
pub type StepListener = Box<dyn FnMut(&Input, &State) + Send>;

/// Steps of the warm-up.
const WARM_UP_STEPS: usize = 50;

/// Device slot: a device as the force process sees it.
struct DeviceSlot {
    port: ForcePort,
    /// Mode while the device is active and its motion names no other.
    mode: DeviceMode,
    /// Path in simulated time that the device follows in place of its port's motions.
    path: Option<MotionPath>,
    /// Motion that was used last.
    motion: Motion,
    /// Hand on its way to the position of the motion [m, world].
    position: DVec3,
    ramp: Ramp,
    /// Work that the proxy has done on the scene since the start [J], see [`Effort::absorbed_j`].
    proxy_work_j: f64,
    /// Proxy at the end of the last step [m, world].
    proxy: DVec3,
    /// Stiffness of the virtual coupling [N/m].
    stiffness: f64,
    sequence: u64,
}

/// Force process without its thread: a function of time.
pub struct ForceProcess {
    model: Arc<Model>,
    state: State,
    input: Input,
    slots: Vec<DeviceSlot>,
    motion: SceneMotion,
    steps: u64,
    listener: Option<StepListener>,
    /// Silence of a device [s] after which it is inactive.
    device_timeout_s: f64,
    /// Ball around the objects at the start.
    objects_at_start: Ball,
}

impl ForceProcess {
    /// Force process at the model's initial state, with a port and a mode for each device of the model and a trajectory for each
    /// obstacle. A device that is silent for longer than `device_timeout_s` [s] is suspended until it sends again.
    pub fn new(
        model: Arc<Model>,
        devices: Vec<(ForcePort, DeviceMode)>,
        obstacle_trajectories: Vec<PoseTrajectory>,
        device_timeout_s: f64,
    ) -> Self {
        let state = State::new(&model);
        let motion = SceneMotion { obstacles: obstacle_trajectories, ..SceneMotion::default() };
        Self::from_state(state, model, devices, motion, device_timeout_s)
    }

    /// Force process at a state of the model, with the motion of all parts, otherwise as [`Self::new`].
    ///
    /// # Panics
    /// If the parts are not as many as the model's.
    pub fn from_state(
        state: State,
        model: Arc<Model>,
        devices: Vec<(ForcePort, DeviceMode)>,
        mut motion: SceneMotion,
        device_timeout_s: f64,
    ) -> Self {
        let coupling = |at: usize| model.parameters().devices.get(at).and_then(|device| device.coupling);
        let slots = devices.into_iter().enumerate().map(|(at, (port, mode))| DeviceSlot {
            port,
            mode,
            path: None,
            motion: Motion::default(),
            position: DVec3::ZERO,
            ramp: Ramp::default(),
            proxy_work_j: 0.0,
            proxy: DVec3::ZERO,
            stiffness: coupling(at).map_or(0.0, |coupling| coupling.stiffness),
            sequence: 0,
        });
        let slots: Vec<DeviceSlot> = slots.collect();
        let obstacles = motion.obstacles.iter_mut().map(|trajectory| trajectory(0.0)).collect();
        let clamps: Vec<Pose> = model.parameters().clamps.iter().map(|clamp| clamp.frame).collect();
        let objects = model.recordings().count();
        let fits = |given: usize, parts: usize| given == 0 || given == parts;
        assert!(fits(motion.clamps.len(), clamps.len()), "one trajectory for each clamp");
        assert!(fits(motion.bases.len(), objects), "one path for each object");
        let input = Input {
            devices: vec![DeviceInput::inactive(); slots.len()],
            obstacles,
            clamps,
            bases: vec![None; objects],
            ..Input::default()
        };
        let objects_at_start = objects_at_start(&model, &state);
        Self {
            objects_at_start,
            model,
            state,
            input,
            slots,
            motion,
            steps: 0,
            listener: None,
            device_timeout_s,
        }
    }

    /// Lets a device follow a path in simulated time, also where that runs slower than the clock; where a force is prescribed, it is the
    /// course of the force.
    ///
    /// # Panics
    /// If the model has no such device.
    pub fn follow(&mut self, device: usize, path: MotionPath) {
        self.slots[device].path = Some(path);
    }

    /// Hands the input of every step and the state after it to a listener.
    pub fn listen(&mut self, listener: StepListener) {
        self.listener = Some(listener);
    }

    /// State of the scene.
    pub fn state(&self) -> &State {
        &self.state
    }

    /// State of the scene, taken out of the process.
    pub fn into_state(self) -> State {
        self.state
    }

    /// Model of the scene.
    pub fn model(&self) -> &Arc<Model> {
        &self.model
    }

    /// Input of the last step.
    pub fn input(&self) -> &Input {
        &self.input
    }

    /// Refused motions of every device, in the model's order.
    pub fn refused_motions(&self) -> impl Iterator<Item = RefusedMotions> {
        self.slots.iter().map(|slot| slot.port.refused_motions())
    }

    /// Number of steps since the start.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Warms the caches with a few steps on a copy of the state: touches all memory and code that steps use.
    pub fn warm_up(&self) {
        let mut copy = self.state.clone();
        for _ in 0..WARM_UP_STEPS {
            step(&self.model, &mut copy, &self.input);
        }
    }

    /// Cycle at a time [s]: takes the newest motions, advances the scene by one step, sends efforts.
    ///
    /// # Real time
    /// No allocation, lock or system call. Cost: one [`palpate::step`].
    pub fn cycle(&mut self, now_s: f64) -> &Output {
        self.steps += 1;
        let step_s = self.model.parameters().step_s;
        let time_s = self.steps as f64 * step_s;

        // Motions become the input of the step. Devices are inactive until they begin, and suspended while they are silent, or
        // where their position is not finite or not plausible.
        for (slot, input) in self.slots.iter_mut().zip(&mut self.input.devices) {
            if let (Some(path), DeviceMode::Force(applied)) = (&slot.path, slot.mode) {
                let force = path.mid_step(time_s, step_s);
                *input = DeviceInput::exerting(AppliedForce { force, ..applied });
                continue;
            }
            let mut motion = slot.port.newest();
            if let Some(path) = &slot.path {
                let position = path.at(time_s).position;
                motion = Motion { sequence: self.steps, time_s: now_s, position, ..Motion::default() };
            }
            let usable = slot.port.accepts(&motion, self.objects_at_start);
            if usable {
                if motion.position != slot.motion.position {
                    slot.ramp = Ramp::over(motion.over_s, step_s);
                }
                slot.motion = motion;
            }
            // A hand that took no part begins where it is now.
            if !input.mode.is_active() {
                slot.ramp = Ramp::default();
            }
            slot.position = slot.ramp.advance(slot.position, slot.motion.position);
            // A motion of the future is as bad as an old one: a clock has jumped.
            let silent = !usable || (now_s - motion.time_s).abs() > self.device_timeout_s;
            let mode = match motion.mode.unwrap_or(slot.mode) {
                _ if slot.motion.sequence == 0 => DeviceMode::Inactive,
                DeviceMode::Inactive => DeviceMode::Inactive,
                _ if silent => DeviceMode::Suspended,
                mode => mode,
            };
            *input = DeviceInput { position: slot.position, mode };
        }
        let motion = &mut self.motion;
        for (trajectory, pose) in motion.obstacles.iter_mut().zip(&mut self.input.obstacles) {
            *pose = trajectory(time_s);
        }
        for (trajectory, frame) in motion.clamps.iter_mut().zip(&mut self.input.clamps) {
            trajectory.iter_mut().for_each(|trajectory| *frame = trajectory(time_s));
        }
        for (path, base) in motion.bases.iter().zip(&mut self.input.bases) {
            *base = path.as_ref().map(|path| path.of_base(time_s, step_s));
        }
        self.input.gravity = motion.gravity.as_ref().map(|gravity| gravity.mid_step(time_s, step_s));

        let output = step(&self.model, &mut self.state, &self.input);

        // Absorbed energy: work of the proxy, −Σ F·Δproxy, and the energy of the coupling's spring, ½·k·|stretch|².
        for ((slot, input), device) in self.slots.iter_mut().zip(&self.input.devices).zip(&output.devices) {
            let force = device.force_on_hand;
            if !input.mode.is_active() {
                slot.proxy = slot.position;
            } else {
                slot.proxy_work_j -= force.dot(device.proxy - slot.proxy);
                slot.proxy = device.proxy;
            }
            let stretch = slot.position - slot.proxy;
            let stored = 0.5 * slot.stiffness * stretch.length_squared();
            slot.sequence += 1;
            slot.port.send(Effort {
                sequence: slot.sequence,
                in_reply_to: slot.motion.sequence,
                time_s: now_s,
                force,
                absorbed_j: slot.proxy_work_j + stored,
            });
        }
        if let Some(listener) = &mut self.listener {
            listener(&self.input, &self.state);
        }
        self.state.output()
    }
}

/// Ball around all objects of a state.
fn objects_at_start(model: &Model, state: &State) -> Ball {
    let poses = state.output().objects.iter().map(|object| object.pose);
    let corners = model.recordings().zip(poses).flat_map(|(recording, pose)| {
        recording.surface.positions.iter().map(move |position| pose.world_from_body(*position))
    });
    let corners: Vec<DVec3> = corners.collect();
    let centre = corners.iter().sum::<DVec3>() / corners.len().max(1) as f64;
    let radius = corners.iter().map(|corner| (*corner - centre).length()).fold(0.0, f64::max);
    Ball { centre, radius }
}
