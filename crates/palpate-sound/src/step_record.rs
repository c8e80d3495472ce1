//! Record of a step for the sound: what a force process hands to another thread.

use alloc::vec::Vec;
use palpate::{OscillatorState, State};

/// Modal states at the end of a step and the modal forces that it held, of the audible modes of every body.
#[derive(Debug, Clone)]
pub struct StepRecord {
    /// Number of the step, from 1.
    pub(crate) step: u64,
    pub(crate) bodies: Vec<BodyRecord>,
}

/// Record of one body.
#[derive(Debug, Clone)]
pub(crate) struct BodyRecord {
    /// Index of the first audible mode in the recording.
    pub(crate) first: usize,
    pub(crate) states: Vec<OscillatorState>,
    /// Held forces p [N/√kg].
    pub(crate) forces: Vec<f64>,
    pub(crate) is_asleep: bool,
}

impl StepRecord {
    /// Copy the last step of a state of the synthesiser's scene.
    ///
    /// # Real time
    /// No allocation; costs the audible modes.
    pub fn capture(&mut self, state: &State) {
        self.step = state.step_count();
        let outputs = &state.output().objects;
        for ((object, body), output) in self.bodies.iter_mut().enumerate().zip(outputs) {
            body.is_asleep = output.is_asleep;
            let modes = body.first..body.first + body.states.len();
            let of_object = (state.modal_state(object), state.held_modal_forces(object));
            if let (Some(states), Some(forces)) = (of_object.0.get(modes.clone()), of_object.1.get(modes)) {
                body.states.copy_from_slice(states);
                body.forces.copy_from_slice(forces);
            }
        }
    }
}
