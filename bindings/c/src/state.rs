//! States: steps, surfaces, and points on them.

use crate::buffers::Buffers;
use crate::error::{Error, Failure, Status, checked, put};
use crate::scene::{Loaded, Scene, no_part, texts};
use crate::types::{SurfacePoint, Vector};
use glam::DVec3;
use palpate::{DeviceInput, Grasp, Input, ModelError, ResidualFieldCache, step};
use palpate_scene::RunCheck;
use std::ffi::{CString, c_char};
use std::ptr;
use std::sync::Arc;

/// State of a scene: placement, motion and deformation of its objects, and the input of its next step.
pub struct State {
    pub(crate) scene: Arc<Loaded>,
    pub(crate) state: palpate::State,
    /// Input of the next step.
    pub(crate) input: Input,
    /// Input in the scene's mode, for devices that take no part before their first position.
    waiting: Vec<Option<DeviceInput>>,
    pub(crate) buffers: Buffers,
    /// Whether a step has failed, by a bug: what is left of the state is of no use.
    has_failed: bool,
    /// Check of the steps so far, and the texts of its warnings when these were asked for last.
    check: RunCheck,
    warnings: Vec<CString>,
    /// Displacements of an object's nodes, and what they share from one surface to the next.
    displacements: Vec<DVec3>,
    residual_fields: Vec<ResidualFieldCache>,
}

impl State {
    fn new(scene: Arc<Loaded>) -> Self {
        let state = palpate::State::new(scene.model());
        let mut input = scene.scene.input_at(0.0);
        let mut waiting = vec![None; input.devices.len()];
        for ((waiting, input), device) in waiting.iter_mut().zip(&mut input.devices).zip(&scene.scene.devices)
        {
            if device.path.is_none() {
                *waiting = Some(std::mem::replace(input, DeviceInput::inactive()));
            }
        }
        let buffers = Buffers::of(state.output());
        let residual_fields =
            scene.scene.object_names.iter().map(|_| ResidualFieldCache::default()).collect();
        Self {
            check: RunCheck::new(&scene.scene),
            warnings: Vec::new(),
            scene,
            state,
            input,
            waiting,
            buffers,
            displacements: Vec::new(),
            residual_fields,
            has_failed: false,
        }
    }

    fn copy(&self) -> Self {
        let mut buffers = Buffers::of(self.state.output());
        if self.has_failed {
            buffers.release();
        }
        Self {
            scene: self.scene.clone(),
            state: self.state.clone(),
            input: self.input.clone(),
            waiting: self.waiting.clone(),
            buffers,
            has_failed: self.has_failed,
            check: self.check.clone(),
            warnings: Vec::new(),
            displacements: Vec::new(),
            residual_fields: self.residual_fields.clone(),
        }
    }

    /// Input of a device in the next step; of one that waits for its first, that in which it begins.
    pub(crate) fn device_input(&self, device: usize) -> Result<DeviceInput, Failure> {
        let own = self.input.devices.get(device).ok_or_else(|| no_part("device", device))?;
        Ok(self.waiting[device].unwrap_or(*own))
    }

    /// Sets the input of a device, which takes part from now on.
    pub(crate) fn set_device_input(&mut self, device: usize, input: DeviceInput) -> Result<(), Failure> {
        *self.input.devices.get_mut(device).ok_or_else(|| no_part("device", device))? = input;
        self.waiting[device] = None;
        Ok(())
    }

    /// Computes the displacements of an object's nodes [m, body].
    fn displace(&mut self, object: usize) -> Result<(), Failure> {
        let nodes = self.scene.surface(object)?.positions.len();
        self.displacements.resize(nodes, DVec3::ZERO);
        let deformation = self.state.deformation(object);
        let fields = &mut self.residual_fields[object];
        deformation.surface_displacement_cached(self.scene.model(), fields, &mut self.displacements);
        Ok(())
    }

    /// A point in the present placement and deformation of its object [m, world].
    fn position(&self, grasp: &Grasp) -> Result<DVec3, Failure> {
        let surface = self.scene.surface(grasp.object)?;
        if !surface.contains(&grasp.point) {
            let (object, triangle) = (grasp.object, grasp.point.triangle);
            let error = Box::new(ModelError::NoSuchPoint { triangle });
            return Err(palpate::Error::from(ModelError::Object { object, error }).into());
        }
        let pose = self.state.output().objects[grasp.object].pose;
        let displacement = self.state.point_displacement(self.scene.model(), grasp.object, &grasp.point);
        Ok(pose.world_from_body(surface.rest_position(&grasp.point) + displacement))
    }
}

/// Make a state at the start of its scene. `*state` is null unless it succeeds; free it with [`palpate_state_free`].
///
/// # Safety
/// `scene` is a scene or null; `state` can be written; `error` can be, or is null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_state_new(
    scene: *const Scene,
    state: *mut *mut State,
    error: *mut Error,
) -> Status {
    let new = || {
        // SAFETY: as promised by the caller.
        unsafe { put(state, ptr::null_mut()) }?;
        // SAFETY: as promised by the caller.
        let scene = unsafe { scene.as_ref() }.ok_or_else(|| Failure::argument("scene is null"))?;
        // SAFETY: as promised by the caller.
        unsafe { put(state, Box::into_raw(Box::new(State::new(scene.0.clone())))) }
    };
    // SAFETY: as promised by the caller.
    unsafe { checked(error, new) }
}

/// Copy a state, which goes on as the original does. `*copy` is null unless it succeeds; free it with [`palpate_state_free`].
///
/// # Safety
/// `state` is a state or null; `copy` can be written; `error` can be, or is null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_state_copy(
    state: *const State,
    copy: *mut *mut State,
    error: *mut Error,
) -> Status {
    let make = || {
        // SAFETY: as promised by the caller.
        unsafe { put(copy, ptr::null_mut()) }?;
        // SAFETY: as promised by the caller.
        let state = unsafe { state.as_ref() }.ok_or_else(no_state)?;
        // SAFETY: as promised by the caller.
        unsafe { put(copy, Box::into_raw(Box::new(state.copy()))) }
    };
    // SAFETY: as promised by the caller.
    unsafe { checked(error, make) }
}

/// Free a state. Null is left alone.
///
/// # Safety
/// `state` is from [`palpate_state_new`] or [`palpate_state_copy`], and not used any more.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_state_free(state: *mut State) {
    if !state.is_null() {
        // SAFETY: from `Box::into_raw`, as promised by the caller.
        drop(unsafe { Box::from_raw(state) });
    }
}

/// Advance by one step with the input that was set. It allocates nothing, takes no lock and makes no system call;
/// [`palpate_state_status`](crate::palpate_state_status) tells what it could not do. After a bug (`PALPATE_STATUS_PANIC`) all forces are zero,
/// and the state takes no more steps.
///
/// # Safety
/// `state` is a state or null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_state_step(state: *mut State) -> Status {
    // SAFETY: as promised by the caller.
    let Some(state) = (unsafe { state.as_mut() }) else { return Status::InvalidArgument };
    let advance = || {
        if state.has_failed {
            return Err(Failure::panic("an earlier step has failed"));
        }
        state.check.add_input(&state.scene.scene, &state.input, &state.state);
        let output = step(state.scene.model(), &mut state.state, &state.input);
        state.buffers.update(output);
        state.check.add(&state.input, &state.state);
        Ok(())
    };
    // SAFETY: no error is written.
    let status = unsafe { checked(ptr::null_mut(), advance) };
    if status != Status::Ok {
        state.has_failed = true;
        state.buffers.release();
    }
    status
}

/// Warning about the steps so far, as those of `palpate run` but for large deformation: positions that look like millimetres, penetration,
/// contacts that were not solved or left out, a tip that begins inside an object, or that moved and touched nothing. Ask from 0 on; null after
/// the last. Texts live until 0 is asked for again.
///
/// # Safety
/// `state` is a state or null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_state_warning(state: *mut State, number: usize) -> *const c_char {
    // SAFETY: as promised by the caller.
    let Some(state) = (unsafe { state.as_mut() }) else { return ptr::null() };
    if number == 0 {
        state.warnings = texts(state.check.warnings(&state.scene.scene).iter().map(ToString::to_string));
    }
    state.warnings.get(number).map_or(ptr::null(), |text| text.as_ptr())
}

/// Positions of the nodes of an object's surface at the end of the last step [m]: `count` numbers, three for each of the
/// [`palpate_scene_node_count`](crate::palpate_scene_node_count) nodes. Costs nodes × modes: for drawing, not for each step.
///
/// # Safety
/// `state` is a state or null; `count` numbers can be written to `positions`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_state_surface(
    state: *mut State,
    object: usize,
    positions: *mut f64,
    count: usize,
) -> Status {
    let write = || {
        // SAFETY: as promised by the caller.
        let state = unsafe { state.as_mut() }.ok_or_else(no_state)?;
        state.displace(object)?;
        if positions.is_null() || count != 3 * state.displacements.len() {
            return Err(Failure::argument("three numbers per node are asked"));
        }
        let pose = state.state.output().objects[object].pose;
        let rest = &state.scene.surface(object)?.positions;
        for (node, (rest, displacement)) in rest.iter().zip(&state.displacements).enumerate() {
            let position = pose.world_from_body(*rest + *displacement);
            // SAFETY: three of so many numbers, as promised by the caller.
            unsafe { positions.add(3 * node).cast::<[f64; 3]>().write(position.to_array()) };
        }
        Ok(())
    };
    // SAFETY: no error is written.
    unsafe { checked(ptr::null_mut(), write) }
}

/// Point on an object's surface at rest that is nearest to a position [m], in the object's present placement: a point to hold.
///
/// # Safety
/// `state` is a state or null; `point` can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_state_nearest_point(
    state: *const State,
    object: usize,
    position: Vector,
    point: *mut SurfacePoint,
) -> Status {
    let find = || {
        // SAFETY: as promised by the caller.
        let state = unsafe { state.as_ref() }.ok_or_else(no_state)?;
        let surface = state.scene.surface(object)?;
        let position = DVec3::from(position);
        if !position.is_finite() {
            return Err(Failure::argument("the position is not finite"));
        }
        let pose = state.state.output().objects[object].pose;
        let nearest = surface.nearest(pose.body_from_world(position));
        let (nearest, _) = nearest.ok_or_else(|| no_part("surface of object", object))?;
        // SAFETY: as promised by the caller.
        unsafe { put(point, Grasp { object, point: nearest }.into()) }
    };
    // SAFETY: no error is written.
    unsafe { checked(ptr::null_mut(), find) }
}

/// Position of a point of a surface at the end of the last step [m].
///
/// # Safety
/// `state` is a state or null; `position` can be written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_state_point_position(
    state: *const State,
    point: SurfacePoint,
    position: *mut Vector,
) -> Status {
    let read = || {
        // SAFETY: as promised by the caller.
        let state = unsafe { state.as_ref() }.ok_or_else(no_state)?;
        // SAFETY: as promised by the caller.
        unsafe { put(position, state.position(&point.into())?.into()) }
    };
    // SAFETY: no error is written.
    unsafe { checked(ptr::null_mut(), read) }
}

/// Failure of a missing state.
pub(crate) fn no_state() -> Failure {
    Failure::argument("state is null")
}
