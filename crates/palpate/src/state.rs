//! What changes while a scene runs, what a step takes and what it gives.

use crate::contact::{Grasp, HeldPoints, HeldSystem};
use crate::energy::EnergyLedger;
use crate::motion::RigidState;
use crate::response::{ModalPoints, Oscillation, ResponseState};
use crate::scene::{Model, SceneObject};
use crate::spatial::{Pose, Twist};
use alloc::vec;
use alloc::vec::Vec;
use glam::DVec3;

/// One device's part of a step's input.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeviceInput {
    /// Interface point at the end of the step [m, world].
    pub position: DVec3,
    /// The point it holds; none lets go.
    pub grasp: Option<Grasp>,
}

/// Input of a step: one entry per device of the model.
#[derive(Debug, Clone, PartialEq)]
pub struct Input {
    /// In the order of the model's devices. Missing entries hold nothing.
    pub devices: Vec<DeviceInput>,
}

/// One device's part of a step's output.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DeviceOutput {
    /// Force on the hand [N, world]: the reaction, held over the step.
    pub force_on_hand: DVec3,
    /// Where the held point is at the end of the step [m, world]; the device's position if it
    /// holds nothing.
    pub point: DVec3,
}

/// One object's part of a step's output.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObjectOutput {
    /// Placement at the end of the step.
    pub pose: Pose,
    /// Velocity at the end of the step.
    pub twist: Twist,
    /// Its energies.
    pub energy: EnergyLedger,
}

/// How a step went. A step can't fail; this says what it met.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct StepStatus {
    /// Largest miss of a held point [m].
    pub solver_residual_m: f64,
    /// Most repetitions that an object needed.
    pub iterations: u32,
    /// Devices whose position was not finite or whose grasp does not exist; they hold nothing.
    pub rejected_devices: u32,
    /// Held directions that repeat others and got no force.
    pub dependent_rows: u32,
    /// Objects whose held points could not be met, or whose turn could not be found, because a hand or the body moves
    /// too far in a step; they moved freely in this step.
    pub unsolved_objects: u32,
}

/// Output of a step.
#[derive(Debug, Clone, PartialEq)]
pub struct Output {
    /// Time at the end of the step [s].
    pub time_s: f64,
    /// Per device.
    pub devices: Vec<DeviceOutput>,
    /// Per object.
    pub objects: Vec<ObjectOutput>,
    /// Sum over objects.
    pub energy: EnergyLedger,
    /// How it went.
    pub status: StepStatus,
}

/// One object in motion.
#[derive(Debug, Clone)]
pub(crate) struct ObjectState {
    pub(crate) rigid: RigidState,
    pub(crate) response: ResponseState,
    pub(crate) ledger: EnergyLedger,
    pub(crate) stored_at_start: f64,
}

/// Buffers of a step, made once.
#[derive(Debug, Clone)]
pub(crate) struct Workspace {
    pub(crate) system: HeldSystem,
    pub(crate) active: Vec<ActivePoint>,
}

/// A held point while its object's step is solved.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct ActivePoint {
    pub(crate) device: usize,
    /// Where the hand is at the end of the step [m, world].
    pub(crate) target: DVec3,
    /// Arm from the centre of mass at the start of the step [m, world].
    pub(crate) start_arm: DVec3,
    /// Displacement at the end of the step without new force [m, body].
    pub(crate) free: DVec3,
    /// Force on the object [N, world].
    pub(crate) force: DVec3,
    /// The same in body axes.
    pub(crate) force_in_body: DVec3,
    /// Displacement at the end of the step [m, body].
    pub(crate) displacement: DVec3,
    /// Arm at the end of the step [m, world].
    pub(crate) end_arm: DVec3,
    /// How far the point is from the hand [m, world].
    pub(crate) miss: DVec3,
}

/// The state of a scene.
#[derive(Debug, Clone)]
pub struct State {
    pub(crate) steps: u64,
    pub(crate) objects: Vec<ObjectState>,
    pub(crate) held: HeldPoints,
    pub(crate) modal_points: ModalPoints,
    pub(crate) workspace: Workspace,
    pub(crate) output: Output,
}

impl State {
    /// The scene at its start: undeformed, with all buffers that steps will need.
    pub fn new(model: &Model) -> Self {
        let devices = model.parameters.devices;
        let most_modes = model.objects.iter().map(|o| o.response.modes()).max().unwrap_or(0);
        let objects: Vec<_> =
            model.objects.iter().map(|o| ObjectState::new(o, devices, model.parameters.gravity)).collect();
        let object_outputs = model.objects.iter().zip(&objects).map(|(object, state)| ObjectOutput {
            pose: state.rigid.pose,
            twist: object.start.twist,
            energy: state.ledger,
        });
        let output = Output {
            time_s: 0.0,
            devices: vec![DeviceOutput::default(); devices],
            objects: object_outputs.collect(),
            energy: objects.iter().fold(EnergyLedger::default(), |sum, o| sum.plus(&o.ledger)),
            status: StepStatus::default(),
        };
        Self {
            steps: 0,
            objects,
            held: HeldPoints::new(devices),
            modal_points: ModalPoints::new(devices, most_modes),
            workspace: Workspace { system: HeldSystem::new(devices), active: Vec::with_capacity(devices) },
            output,
        }
    }

    /// The output of the last step; before the first, the scene at its start.
    pub fn output(&self) -> &Output {
        &self.output
    }

    /// Modal coordinates q [m·√kg] of an object and their rates; none for one that uses a table.
    pub fn modal_state(&self, object: usize) -> &[Oscillation] {
        self.objects[object].response.modes()
    }

    /// Elastic displacement [m, body] of every surface node of an object at the end of the last step. Costs nodes ×
    /// modes, with a table nodes × forces of the last T steps: for pictures, beside the force.
    ///
    /// # Panics
    /// When `out` does not have one entry per surface node.
    pub fn surface_displacement(&self, model: &Model, object: usize, out: &mut [DVec3]) {
        let SceneObject { recording, response, .. } = &model.objects[object];
        assert_eq!(out.len(), recording.surface.positions.len(), "one entry per surface node");
        let state = &self.objects[object];
        let gravity = model.objects[object].gravity_in_body(model.parameters.gravity, &state.rigid.pose);
        state.response.surface_displacement(response, recording, gravity, out);
    }
}

impl ObjectState {
    fn new(object: &SceneObject, devices: usize, gravity: DVec3) -> Self {
        let twist = object.start.twist;
        let pose = object.start.pose;
        let angular_momentum = object
            .inertia
            .map_or(DVec3::ZERO, |inertia| inertia.angular_momentum(pose.orientation, twist.angular));
        let mut state = Self {
            rigid: RigidState { pose, velocity: twist.linear, angular_momentum },
            response: object.response.at_rest(devices),
            ledger: EnergyLedger::default(),
            stored_at_start: 0.0,
        };
        state.weigh(object, gravity);
        state.stored_at_start = state.ledger.stored();
        state
    }

    /// Write kinetic, elastic and potential energy of the state into its ledger.
    ///
    /// # Real time
    pub(crate) fn weigh(&mut self, object: &SceneObject, gravity: DVec3) {
        let elastic = self.response.energy(&object.response);
        let rigid = object.inertia.map_or(0.0, |inertia| inertia.kinetic_energy(&self.rigid));
        let mut potential = -object.recording.mass() * gravity.dot(self.rigid.pose.position);
        if let Some(response) = &object.recording.gravity {
            let acceleration = object.gravity_in_body(gravity, &self.rigid.pose);
            let modes = self.response.modes();
            for (axis, a) in acceleration.to_array().into_iter().enumerate() {
                let loads = &response.modal_forces[axis * modes.len()..][..modes.len()];
                let work: f64 = loads.iter().zip(modes).map(|(p, mode)| p * mode.q).sum();
                potential -= a * work;
            }
        }
        self.ledger.kinetic = elastic.kinetic + rigid;
        self.ledger.elastic = elastic.elastic;
        self.ledger.residual = elastic.residual;
        self.ledger.potential = potential;
    }
}
