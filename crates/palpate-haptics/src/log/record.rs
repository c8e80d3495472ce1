//! What goes from the force process to the log, in buffers that are made once and go round.

use palpate::{
    ContactOutput, DeviceOutput, EnergyLedger, Input, Model, ObjectOutput, Output, Pose, State, StepStatus,
};
use std::time::Duration;

/// One step.
#[derive(Debug)]
pub struct Record {
    /// Steps since the start, and the tick of the clock that it was made at.
    pub step: u64,
    /// See `step`.
    pub tick: u64,
    /// Simulated time at its end [s].
    pub time_s: f64,
    /// How late it began.
    pub late: Duration,
    /// How long it took.
    pub took: Duration,
    /// What it was given.
    pub input: Input,
    /// What came out.
    pub devices: Vec<DeviceOutput>,
    /// See `devices`.
    pub objects: Vec<ObjectOutput>,
    /// See `devices`.
    pub energy: EnergyLedger,
    /// See `devices`.
    pub status: StepStatus,
}

/// What a picture of a step takes.
#[derive(Debug)]
pub struct Picture {
    /// Steps since the start.
    pub step: u64,
    /// Simulated time at its end [s].
    pub time_s: f64,
    /// Where the objects and the obstacles are.
    pub objects: Vec<Pose>,
    /// See `objects`.
    pub obstacles: Vec<Pose>,
    /// Contacts that carry force.
    pub contacts: Vec<ContactOutput>,
    /// Modal coordinates q [m·√kg] of every object.
    pub modes: Vec<Vec<f64>>,
}

impl Record {
    /// Room for the steps of a scene.
    pub fn new(state: &State, input: &Input) -> Self {
        let output = state.output();
        Self {
            step: 0,
            tick: 0,
            time_s: 0.0,
            late: Duration::ZERO,
            took: Duration::ZERO,
            input: input.clone(),
            devices: output.devices.clone(),
            objects: output.objects.clone(),
            energy: output.energy,
            status: output.status,
        }
    }

    /// Take over a step.
    ///
    /// # Real time
    /// No allocation.
    pub fn take(&mut self, input: &Input, state: &State) {
        let Output { time_s, devices, objects, energy, status, .. } = state.output();
        (self.time_s, self.energy, self.status) = (*time_s, *energy, *status);
        self.input.devices.copy_from_slice(&input.devices);
        self.input.obstacles.copy_from_slice(&input.obstacles);
        self.devices.copy_from_slice(devices);
        self.objects.copy_from_slice(objects);
    }
}

impl Picture {
    /// Room for the pictures of a scene.
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

    /// Take over a step.
    ///
    /// # Real time
    /// No allocation.
    pub fn take(&mut self, input: &Input, state: &State) {
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
