//! Snapshots: the newest state of a scene, handed from the force process to displays through a triple buffer.

use palpate::{
    ContactOutput, DeformationSnapshot, DeviceOutput, EnergyLedger, Input, Model, Output, State, StepStatus,
};
use triple_buffer::triple_buffer;

/// State of a scene at the end of a step, as far as a display needs it.
#[derive(Debug)]
pub struct Snapshot {
    /// Number of the step, from 1; 0 is the initial state.
    pub step: u64,
    /// Simulated time [s].
    pub time_s: f64,
    /// Deformation and pose of every object, in the model's order.
    pub objects: Vec<DeformationSnapshot>,
    /// Input of the step: devices and obstacles.
    pub input: Input,
    /// Output of every device.
    pub devices: Vec<DeviceOutput>,
    /// Contacts that carry force.
    pub contacts: Vec<ContactOutput>,
    /// Energy ledger of the scene.
    pub energy: EnergyLedger,
    /// Status of the step.
    pub status: StepStatus,
}

/// Writing end of a snapshot buffer, held by the force process.
pub struct SnapshotWriter(triple_buffer::Input<Snapshot>);

/// Reading end of a snapshot buffer, held by a display.
pub struct SnapshotReader(triple_buffer::Output<Snapshot>);

impl Clone for Snapshot {
    /// Copy with the same capacity, so that it can be filled without allocation.
    fn clone(&self) -> Self {
        let mut contacts = Vec::with_capacity(self.contacts.capacity());
        contacts.extend_from_slice(&self.contacts);
        Self {
            objects: self.objects.clone(),
            input: self.input.clone(),
            devices: self.devices.clone(),
            contacts,
            ..*self
        }
    }
}

impl Snapshot {
    /// Snapshot of an initial state, with the capacity of any later one.
    pub fn new(model: &Model, state: &State, input: &Input) -> Self {
        let Output { time_s, devices, contacts, energy, status, .. } = state.output();
        let capacity = contacts.capacity();
        let mut snapshot = Self {
            step: 0,
            time_s: *time_s,
            objects: (0..model.recordings().count()).map(|object| state.deformation(object)).collect(),
            input: input.clone(),
            devices: devices.clone(),
            contacts: Vec::with_capacity(capacity),
            energy: *energy,
            status: *status,
        };
        snapshot.contacts.extend_from_slice(contacts);
        snapshot
    }

    /// Overwrites this snapshot with the state after `step` steps.
    ///
    /// # Real time
    /// No allocation. Cost: modes and contacts.
    pub fn capture(&mut self, step: u64, input: &Input, state: &State) {
        let Output { time_s, devices, contacts, energy, status, .. } = state.output();
        (self.step, self.time_s, self.energy, self.status) = (step, *time_s, *energy, *status);
        self.objects.iter_mut().for_each(|object| object.copy_from(state));
        self.input.copy_from(input);
        self.devices.copy_from_slice(devices);
        self.contacts.clear();
        self.contacts.extend_from_slice(contacts);
    }
}

/// Triple buffer of snapshots: neither end waits for the other.
pub fn snapshot_buffer(first: &Snapshot) -> (SnapshotWriter, SnapshotReader) {
    let (input, output) = triple_buffer(first);
    (SnapshotWriter(input), SnapshotReader(output))
}

impl SnapshotWriter {
    /// Publishes a snapshot of the state after `step` steps.
    ///
    /// # Real time
    /// No allocation. Cost: modes and contacts.
    pub fn publish(&mut self, step: u64, input: &Input, state: &State) {
        self.0.input_buffer_mut().capture(step, input, state);
        self.0.publish();
    }
}

impl SnapshotReader {
    /// Newest snapshot; `None` if there is none newer than the last one read.
    pub fn newest(&mut self) -> Option<&Snapshot> {
        self.0.update().then(|| &*self.0.output_buffer_mut())
    }
}
