//! Snapshots: the newest state of a scene, handed from the force process to displays through a triple buffer.

use palpate::{DeformationSnapshot, Input, Model, Output, State};
use triple_buffer::triple_buffer;

/// State of a scene at the end of a step, as far as a display needs it.
#[derive(Debug)]
pub struct Snapshot {
    /// Number of the step, from 1; 0 is the initial state.
    pub step: u64,
    /// Deformation and pose of every object, in the model's order.
    pub objects: Vec<DeformationSnapshot>,
    /// Input of the step: devices and obstacles.
    pub input: Input,
    /// Output of the step.
    pub output: Output,
}

/// Number of steps from one frame to the next at a frame rate [Hz], for a step [s]: at least 1.
pub fn steps_per_frame(rate_hz: f64, step_s: f64) -> u64 {
    (1.0 / (rate_hz * step_s)).round().max(1.0) as u64
}

/// Writing end of a snapshot buffer, held by the force process.
pub struct SnapshotWriter(triple_buffer::Input<Snapshot>);

/// Reading end of a snapshot buffer, held by a display.
pub struct SnapshotReader(triple_buffer::Output<Snapshot>);

impl Clone for Snapshot {
    /// Copy with the same capacity, so that it can be filled without allocation.
    fn clone(&self) -> Self {
        let output = with_capacity(&self.output);
        Self { step: self.step, objects: self.objects.clone(), input: self.input.clone(), output }
    }
}

impl Snapshot {
    /// Snapshot of an initial state, with the capacity of any later one.
    pub fn new(model: &Model, state: &State, input: &Input) -> Self {
        Self {
            step: 0,
            objects: (0..model.recordings().count()).map(|object| state.deformation(object)).collect(),
            input: input.clone(),
            output: with_capacity(state.output()),
        }
    }

    /// Overwrites this snapshot with the state after `step` steps.
    ///
    /// # Real time
    /// No allocation. Cost: modes and contacts.
    pub fn capture(&mut self, step: u64, input: &Input, state: &State) {
        self.step = step;
        self.objects.iter_mut().for_each(|object| object.copy_from(state));
        self.input.copy_from(input);
        self.output.copy_from(state.output());
    }
}

/// Copy of an output with the same capacity of contacts.
fn with_capacity(output: &Output) -> Output {
    let mut copy = output.clone();
    copy.contacts.reserve_exact(output.contacts.capacity() - output.contacts.len());
    copy
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

    /// Newest snapshot, also one that was read before.
    pub fn latest(&mut self) -> &Snapshot {
        self.0.read()
    }
}
