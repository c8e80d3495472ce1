//! Output of the last step.

use crate::state::State;
use crate::types::{ClampOutput, ContactOutput, DeviceOutput, Energy, ObjectOutput, StepStatus};
use palpate::Output;
use std::ptr;

/// Output in the interface's types; buffers are made once.
pub(crate) struct Outputs {
    devices: Vec<DeviceOutput>,
    objects: Vec<ObjectOutput>,
    clamps: Vec<ClampOutput>,
    contacts: Vec<ContactOutput>,
    energy: Energy,
    status: StepStatus,
}

impl Outputs {
    /// Output of a state, with room for all contacts that it can have.
    pub fn of(output: &Output) -> Self {
        let mut contacts = Vec::with_capacity(output.contacts.capacity());
        contacts.extend(output.contacts.iter().map(ContactOutput::from));
        Self {
            devices: output.devices.iter().map(DeviceOutput::from).collect(),
            objects: output.objects.iter().map(ObjectOutput::from).collect(),
            clamps: output.clamps.iter().map(ClampOutput::from).collect(),
            contacts,
            energy: (&output.energy).into(),
            status: (&output.status).into(),
        }
    }

    /// Takes the output of a step. No allocation.
    pub fn update(&mut self, output: &Output) {
        refill(&mut self.devices, &output.devices);
        refill(&mut self.objects, &output.objects);
        refill(&mut self.clamps, &output.clamps);
        refill(&mut self.contacts, &output.contacts);
        self.energy = (&output.energy).into();
        self.status = (&output.status).into();
    }
}

fn refill<'a, T: From<&'a S>, S>(own: &mut Vec<T>, from: &'a [S]) {
    own.clear();
    own.extend(from.iter().map(T::from));
}

/// Array of a state, and its length.
///
/// # Safety
/// `state` is a state or null; `count` can be written, or is null.
unsafe fn array<T>(state: *const State, count: *mut usize, of: impl FnOnce(&Outputs) -> &[T]) -> *const T {
    // SAFETY: as promised by the caller.
    let (state, count) = unsafe { (state.as_ref(), count.as_mut()) };
    let array = state.map(|state| of(&state.outputs));
    if let Some(count) = count {
        *count = array.map_or(0, <[T]>::len);
    }
    array.map_or(ptr::null(), <[T]>::as_ptr)
}

/// Time at the end of the last step [s].
///
/// # Safety
/// `state` is a state or null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_state_time_s(state: *const State) -> f64 {
    // SAFETY: as promised by the caller.
    unsafe { state.as_ref() }.map_or(0.0, |state| state.state.output().time_s)
}

/// Devices after the last step; `*count` is their number.
///
/// # Safety
/// `state` is a state or null; `count` can be written, or is null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_state_devices(
    state: *const State,
    count: *mut usize,
) -> *const DeviceOutput {
    // SAFETY: as promised by the caller.
    unsafe { array(state, count, |outputs| &outputs.devices) }
}

/// Objects after the last step; `*count` is their number.
///
/// # Safety
/// `state` is a state or null; `count` can be written, or is null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_state_objects(
    state: *const State,
    count: *mut usize,
) -> *const ObjectOutput {
    // SAFETY: as promised by the caller.
    unsafe { array(state, count, |outputs| &outputs.objects) }
}

/// Clamps after the last step; `*count` is their number.
///
/// # Safety
/// `state` is a state or null; `count` can be written, or is null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_state_clamps(state: *const State, count: *mut usize) -> *const ClampOutput {
    // SAFETY: as promised by the caller.
    unsafe { array(state, count, |outputs| &outputs.clamps) }
}

/// Contacts that carry force after the last step, without held points; `*count` is their number.
///
/// # Safety
/// `state` is a state or null; `count` can be written, or is null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_state_contacts(
    state: *const State,
    count: *mut usize,
) -> *const ContactOutput {
    // SAFETY: as promised by the caller.
    unsafe { array(state, count, |outputs| &outputs.contacts) }
}

/// Energy ledger of the scene after the last step; null for null.
///
/// # Safety
/// `state` is a state or null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_state_energy(state: *const State) -> *const Energy {
    // SAFETY: as promised by the caller.
    unsafe { state.as_ref() }.map_or(ptr::null(), |state| &state.outputs.energy)
}

/// What the last step could not do; null for null.
///
/// # Safety
/// `state` is a state or null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_state_status(state: *const State) -> *const StepStatus {
    // SAFETY: as promised by the caller.
    unsafe { state.as_ref() }.map_or(ptr::null(), |state| &state.outputs.status)
}
