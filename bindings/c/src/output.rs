//! Output of the last step.

use crate::buffers::Buffers;
use crate::error::put;
use crate::state::State;
use crate::types::{
    ClampOutput, ContactOutput, DeviceOutput, Energy, ObjectOutput, ObstacleOutput, StepStatus,
};
use std::ptr;

/// Array of a state, and its length.
///
/// # Safety
/// `state` is a state or null; `count` can be written, or is null.
unsafe fn array<T>(state: *const State, count: *mut usize, of: impl FnOnce(&Buffers) -> &[T]) -> *const T {
    // SAFETY: as promised by the caller.
    let array = unsafe { state.as_ref() }.map(|state| of(&state.buffers));
    // SAFETY: as promised by the caller; it may do without.
    let _ = unsafe { put(count, array.map_or(0, <[T]>::len)) };
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
    unsafe { array(state, count, |buffers| &buffers.devices) }
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
    unsafe { array(state, count, |buffers| &buffers.objects) }
}

/// Planes and obstacles after the last step, with the net force on each; `*count` is their number.
///
/// # Safety
/// `state` is a state or null; `count` can be written, or is null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_state_obstacles(
    state: *const State,
    count: *mut usize,
) -> *const ObstacleOutput {
    // SAFETY: as promised by the caller.
    unsafe { array(state, count, |buffers| &buffers.obstacles) }
}

/// Clamps after the last step; `*count` is their number.
///
/// # Safety
/// `state` is a state or null; `count` can be written, or is null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_state_clamps(state: *const State, count: *mut usize) -> *const ClampOutput {
    // SAFETY: as promised by the caller.
    unsafe { array(state, count, |buffers| &buffers.clamps) }
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
    unsafe { array(state, count, |buffers| &buffers.contacts) }
}

/// Energy ledger of the scene after the last step; null for null.
///
/// # Safety
/// `state` is a state or null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_state_energy(state: *const State) -> *const Energy {
    // SAFETY: as promised by the caller.
    unsafe { state.as_ref() }.map_or(ptr::null(), |state| &state.buffers.energy)
}

/// Status of the last step, what it could not do; null for null.
///
/// # Safety
/// `state` is a state or null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_state_status(state: *const State) -> *const StepStatus {
    // SAFETY: as promised by the caller.
    unsafe { state.as_ref() }.map_or(ptr::null(), |state| &state.buffers.status)
}
