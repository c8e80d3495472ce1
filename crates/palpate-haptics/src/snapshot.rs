//! What goes from the force process to whoever draws: the newest state, which is enough for a whole picture.

use palpate::{
    ContactOutput, DeformationSnapshot, DeviceOutput, EnergyLedger, Input, Model, Output, State, StepStatus,
};
use triple_buffer::triple_buffer;

/// A scene at the end of a step, as far as pictures take it.
#[derive(Debug)]
pub struct Snapshot {
    /// Steps since the start.
    pub step: u64,
    /// Simulated time [s].
    pub time_s: f64,
    /// What deforms the objects, and where they are.
    pub objects: Vec<DeformationSnapshot>,
    /// What the step was given: devices and obstacles.
    pub input: Input,
    /// What came out.
    pub devices: Vec<DeviceOutput>,
    /// Contacts that carry force.
    pub contacts: Vec<ContactOutput>,
    /// Of the whole scene.
    pub energy: EnergyLedger,
    /// How the step went.
    pub status: StepStatus,
}

/// The force process's end: it leaves the newest state there.
pub struct SnapshotWriter(triple_buffer::Input<Snapshot>);

/// The other end.
pub struct SnapshotReader(triple_buffer::Output<Snapshot>);

impl Clone for Snapshot {
    /// With as much room: moments are filled without allocation.
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
    /// A state, with room for what later ones hold.
    pub fn new(model: &Model, state: &State, input: &Input) -> Self {
        let Output { time_s, devices, contacts, energy, status, .. } = state.output();
        let room = contacts.capacity();
        let mut moment = Self {
            step: 0,
            time_s: *time_s,
            objects: (0..model.recordings().count()).map(|object| state.deformation(object)).collect(),
            input: input.clone(),
            devices: devices.clone(),
            contacts: Vec::with_capacity(room),
            energy: *energy,
            status: *status,
        };
        moment.contacts.extend_from_slice(contacts);
        moment
    }

    /// Take over the state after so many steps.
    ///
    /// # Real time
    /// No allocation. Costs modes and contacts.
    pub fn take(&mut self, step: u64, input: &Input, state: &State) {
        let Output { time_s, devices, contacts, energy, status, .. } = state.output();
        (self.step, self.time_s, self.energy, self.status) = (step, *time_s, *energy, *status);
        self.objects.iter_mut().for_each(|object| object.copy_from(state));
        self.input.devices.copy_from_slice(&input.devices);
        self.input.obstacles.copy_from_slice(&input.obstacles);
        self.devices.copy_from_slice(devices);
        self.contacts.clear();
        self.contacts.extend_from_slice(contacts);
    }
}

/// Two ends between which the newest moment goes: nobody waits for anybody.
pub fn snapshot_buffer(first: &Snapshot) -> (SnapshotWriter, SnapshotReader) {
    let (input, output) = triple_buffer(first);
    (SnapshotWriter(input), SnapshotReader(output))
}

impl SnapshotWriter {
    /// Leave the state for whoever draws.
    ///
    /// # Real time
    /// No allocation. Costs modes and contacts.
    pub fn show(&mut self, step: u64, input: &Input, state: &State) {
        self.0.input_buffer_mut().take(step, input, state);
        self.0.publish();
    }
}

impl SnapshotReader {
    /// The newest moment; none when there is none newer than the last.
    pub fn newest(&mut self) -> Option<&Snapshot> {
        self.0.update().then(|| &*self.0.output_buffer_mut())
    }
}
