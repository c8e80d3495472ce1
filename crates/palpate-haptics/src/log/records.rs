//! Records of steps and frames, in buffers that the force process fills and the log writer empties.

use palpate::{
    ClampOutput, ContactOutput, DeviceOutput, EnergyLedger, Input, Model, ObjectOutput, Output, Pose, State,
    StepStatus,
};
use std::time::Duration;

/// Record of one step: input, output and timing.
#[derive(Debug)]
pub struct StepRecord {
    /// Number of the step, from 1.
    pub step: u64,
    /// Tick of the force process's clock.
    pub tick: u64,
    /// Simulated time at the end of the step [s].
    pub time_s: f64,
    /// Delay of the cycle after its deadline.
    pub lateness: Duration,
    /// Compute time of the cycle.
    pub compute: Duration,
    /// Input.
    pub input: Input,
    /// Output of every device.
    pub devices: Vec<DeviceOutput>,
    /// Output of every object.
    pub objects: Vec<ObjectOutput>,
    /// Output of every clamp.
    pub clamps: Vec<ClampOutput>,
    /// Energy ledger of the scene.
    pub energy: EnergyLedger,
    /// Status of the step.
    pub status: StepStatus,
}

/// Record of one frame: what a display needs beyond the steps.
#[derive(Debug)]
pub struct FrameRecord {
    /// Number of the step, from 1.
    pub step: u64,
    /// Simulated time at the end of the step [s].
    pub time_s: f64,
    /// Poses of the objects.
    pub objects: Vec<Pose>,
    /// Poses of the obstacles.
    pub obstacles: Vec<Pose>,
    /// Contacts that carry force.
    pub contacts: Vec<ContactOutput>,
    /// Modal coordinates q of every object [m·√kg].
    pub modes: Vec<Vec<f64>>,
}

impl StepRecord {
    /// Record with the capacity of any step of a scene.
    pub fn new(state: &State, input: &Input) -> Self {
        let output = state.output();
        let mut input = input.clone();
        input.clamps.resize(output.clamps.len(), Pose::IDENTITY);
        input.bases.resize(output.objects.len(), None);
        Self {
            step: 0,
            tick: 0,
            time_s: 0.0,
            lateness: Duration::ZERO,
            compute: Duration::ZERO,
            input,
            devices: output.devices.clone(),
            objects: output.objects.clone(),
            clamps: output.clamps.clone(),
            energy: output.energy,
            status: output.status,
        }
    }

    /// Overwrites the record with a step, except for its number and timing.
    ///
    /// # Real time
    /// No allocation.
    pub fn capture(&mut self, input: &Input, state: &State) {
        let Output { time_s, devices, objects, clamps, energy, status, .. } = state.output();
        (self.time_s, self.energy, self.status) = (*time_s, *energy, *status);
        self.input.copy_from(input);
        self.devices.copy_from_slice(devices);
        self.objects.copy_from_slice(objects);
        self.clamps.copy_from_slice(clamps);
    }
}

impl FrameRecord {
    /// Record with the capacity of any frame of a scene.
    pub fn new(model: &Model, state: &State, input: &Input) -> Self {
        let output = state.output();
        let modes = (0..model.recordings().count()).map(|object| vec![0.0; state.modal_state(object).len()]);
        Self {
            step: 0,
            time_s: 0.0,
            objects: output.objects.iter().map(|object| object.pose).collect(),
            obstacles: input.obstacles.clone(),
            contacts: Vec::with_capacity(output.contacts.capacity()),
            modes: modes.collect(),
        }
    }

    /// Overwrites the record with a step, except for its number.
    ///
    /// # Real time
    /// No allocation.
    pub fn capture(&mut self, input: &Input, state: &State) {
        let output = state.output();
        self.time_s = output.time_s;
        self.objects.iter_mut().zip(&output.objects).for_each(|(pose, object)| *pose = object.pose);
        self.obstacles.copy_from_slice(&input.obstacles);
        self.contacts.clear();
        self.contacts.extend_from_slice(&output.contacts);
        for (object, modes) in self.modes.iter_mut().enumerate() {
            modes.iter_mut().zip(state.modal_state(object)).for_each(|(q, mode)| *q = mode.q);
        }
    }
}
