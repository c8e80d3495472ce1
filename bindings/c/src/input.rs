//! Input of the next step.

use crate::error::{Error, Failure, Status, checked, put};
use crate::scene::no_part;
use crate::state::{State, no_state};
use crate::types::{DeviceInput, Pose, Vector};
use palpate::{AppliedForce, DeviceMode};
use std::ptr;

/// Runs a change of a state's input.
///
/// # Safety
/// `state` is a state or null; `error` can be written, or is null.
unsafe fn change(
    state: *mut State,
    error: *mut Error,
    body: impl FnOnce(&mut State) -> Result<(), Failure>,
) -> Status {
    let run = || {
        // SAFETY: as promised by the caller.
        body(unsafe { state.as_mut() }.ok_or_else(no_state)?)
    };
    // SAFETY: as promised by the caller.
    unsafe { checked(error, run) }
}

/// Set the position of a device at the end of the next step [m]; its mode stays. A device without a path in the scene takes part from its
/// first position on, in the mode of the scene.
///
/// # Safety
/// `state` is a state or null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_state_set_position(
    state: *mut State,
    device: usize,
    position: Vector,
) -> Status {
    // SAFETY: as promised by the caller.
    unsafe {
        change(state, ptr::null_mut(), |state| {
            let mut input = state.device_input(device)?;
            if matches!(input.mode, DeviceMode::Force(_)) {
                return Err(Failure::argument(
                    "the device has a force, not a position: palpate_state_set_force",
                ));
            }
            input.position = position.into();
            state.set_device_input(device, input)
        })
    }
}

/// Set the force of a device of mode `force` on its object in the next step and after [N].
///
/// # Safety
/// `state` is a state or null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_state_set_force(state: *mut State, device: usize, force: Vector) -> Status {
    // SAFETY: as promised by the caller.
    unsafe {
        change(state, ptr::null_mut(), |state| {
            let input = state.device_input(device)?;
            let DeviceMode::Force(applied) = input.mode else {
                return Err(Failure::argument(
                    "the device has a position, not a force: palpate_state_set_position",
                ));
            };
            let mode = DeviceMode::Force(AppliedForce { force: force.into(), ..applied });
            state.set_device_input(device, palpate::DeviceInput { mode, ..input })
        })
    }
}

/// Whether a mode needs more of the model than another one: another point, or a tip that another mode is not.
fn acts_elsewhere(before: &DeviceMode, mode: &DeviceMode) -> bool {
    match (before, mode) {
        (DeviceMode::Force(before), DeviceMode::Force(now)) => before.grasp != now.grasp,
        _ => before != mode,
    }
}

/// Set mode, position, point and force of a device. Of an object on a recorded table it loads what another mode or point needs: it may read a
/// file then, so call it between runs or in another thread than that of a device; with mode and point as before it costs as much as
/// [`palpate_state_set_position`].
///
/// # Safety
/// `state` is a state or null; `input` can be read; `error` can be written, or is null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_state_set_device(
    state: *mut State,
    device: usize,
    input: *const DeviceInput,
    error: *mut Error,
) -> Status {
    // SAFETY: as promised by the caller.
    unsafe {
        let input = input.as_ref();
        change(state, error, |state| {
            let input = input.ok_or_else(|| Failure::argument("input is null"))?;
            let input = input.checked()?;
            if acts_elsewhere(&state.device_input(device)?.mode, &input.mode) {
                state.scene.scene.prepare_device(device, &input.mode)?;
            }
            state.set_device_input(device, input)
        })
    }
}

/// Input of a device in the next step; of one that has not begun yet, that in which it will, so that the point that it holds or pushes is known:
/// a held device begins without a blow at [`palpate_state_point_position`](crate::palpate_state_point_position) of its point.
///
/// # Safety
/// `state` is a state or null; `input` can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_state_device_input(
    state: *const State,
    device: usize,
    input: *mut DeviceInput,
) -> Status {
    let read = || {
        // SAFETY: as promised by the caller.
        let state = unsafe { state.as_ref() }.ok_or_else(no_state)?;
        // SAFETY: as promised by the caller.
        unsafe { put(input, state.device_input(device)?.into()) }
    };
    // SAFETY: no error is written.
    unsafe { checked(ptr::null_mut(), read) }
}

/// Set the pose of a plane or obstacle at the end of the next step.
///
/// # Safety
/// `state` is a state or null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_state_set_obstacle(
    state: *mut State,
    obstacle: usize,
    pose: Pose,
) -> Status {
    // SAFETY: as promised by the caller.
    unsafe {
        change(state, ptr::null_mut(), |state| {
            let own = state.input.obstacles.get_mut(obstacle).ok_or_else(|| no_part("obstacle", obstacle))?;
            *own = pose.into();
            Ok(())
        })
    }
}

/// Set the frame of a clamp at the end of the next step.
///
/// # Safety
/// `state` is a state or null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_state_set_clamp(state: *mut State, clamp: usize, frame: Pose) -> Status {
    // SAFETY: as promised by the caller.
    unsafe {
        change(state, ptr::null_mut(), |state| {
            *state.input.clamps.get_mut(clamp).ok_or_else(|| no_part("clamp", clamp))? = frame.into();
            Ok(())
        })
    }
}

/// Set gravity from the next step on [m/s²].
///
/// # Safety
/// `state` is a state or null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_state_set_gravity(state: *mut State, gravity: Vector) -> Status {
    // SAFETY: as promised by the caller.
    unsafe {
        change(state, ptr::null_mut(), |state| {
            state.input.gravity = Some(gravity.into());
            Ok(())
        })
    }
}

/// Set the input of the next step from the scene's paths, of devices, obstacles, clamps, bases and gravity. What has no path stays as it
/// was set.
///
/// # Safety
/// `state` is a state or null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_state_follow_paths(state: *mut State) -> Status {
    // SAFETY: as promised by the caller.
    unsafe {
        change(state, ptr::null_mut(), |state| {
            state.scene.scene.follow_next_step(&state.state, &mut state.input);
            Ok(())
        })
    }
}
