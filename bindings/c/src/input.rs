//! Input of the next step.

use crate::error::{Error, Failure, Status, checked};
use crate::scene::no_part;
use crate::state::State;
use crate::types::{DeviceInput, Pose, Vector};
use palpate::DeviceMode;

/// Runs a change of a state's input.
///
/// # Safety
/// `state` is a state or null; `error` can be written, or is null.
unsafe fn change(
    state: *mut State,
    error: *mut Error,
    body: impl FnOnce(&mut State) -> Result<(), Failure>,
) -> Status {
    // SAFETY: as promised by the caller.
    let (state, error) = unsafe { (state.as_mut(), error.as_mut()) };
    checked(error, || body(state.ok_or_else(|| Failure::argument("state is null"))?))
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
        change(state, std::ptr::null_mut(), |state| {
            let input = state.input.devices.get_mut(device).ok_or_else(|| no_part("device", device))?;
            if let Some(first) = state.waiting[device].take() {
                *input = first;
            }
            input.position = position.into();
            Ok(())
        })
    }
}

/// Set mode, position, point and force of a device.
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
            let own = state.input.devices.get_mut(device).ok_or_else(|| no_part("device", device))?;
            match input.mode {
                DeviceMode::Held(grasp) => state.scene.model().check_grasp(&grasp)?,
                DeviceMode::Force(applied) => state.scene.model().check_grasp(&applied.grasp)?,
                DeviceMode::Inactive | DeviceMode::Touch | DeviceMode::Suspended => {}
            }
            *own = input;
            state.waiting[device] = None;
            Ok(())
        })
    }
}

/// Input of a device in the next step.
///
/// # Safety
/// `state` is a state or null; `input` can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_state_device_input(
    state: *const State,
    device: usize,
    input: *mut DeviceInput,
) -> Status {
    // SAFETY: as promised by the caller.
    let (state, input) = unsafe { (state.as_ref(), input.as_mut()) };
    checked(None, || {
        let state = state.ok_or_else(|| Failure::argument("state is null"))?;
        let own = state.input.devices.get(device).ok_or_else(|| no_part("device", device))?;
        *input.ok_or_else(|| Failure::argument("input is null"))? = (*own).into();
        Ok(())
    })
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
        change(state, std::ptr::null_mut(), |state| {
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
        change(state, std::ptr::null_mut(), |state| {
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
        change(state, std::ptr::null_mut(), |state| {
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
        change(state, std::ptr::null_mut(), |state| {
            let State { scene, state, input, next, .. } = state;
            let scene = &scene.scene;
            scene.write_input_at(state.output().time_s + scene.model.parameters().step_s, next);
            for ((own, next), device) in input.devices.iter_mut().zip(&next.devices).zip(&scene.devices) {
                *own = if device.path.is_some() { *next } else { *own };
            }
            for ((own, next), obstacle) in
                input.obstacles.iter_mut().zip(&next.obstacles).zip(&scene.obstacles)
            {
                *own = if obstacle.path.is_some() { *next } else { *own };
            }
            for ((own, next), clamp) in input.clamps.iter_mut().zip(&next.clamps).zip(&scene.clamps) {
                *own = if clamp.path.is_some() { *next } else { *own };
            }
            input.bases.clone_from(&next.bases);
            input.gravity = next.gravity.or(input.gravity);
            Ok(())
        })
    }
}
