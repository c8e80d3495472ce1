//! C interface of palpate: scenes, states, steps, forces, contacts and surfaces.
//!
//! ```text
//! palpate_scene_load → PalpateScene ─ palpate_state_new → PalpateState ─ palpate_state_step → forces, contacts, surfaces
//! ```
//!
//! The header `include/palpate.h` is made of this crate by cbindgen. Recording is not in it: `palpate record` makes recordings.
//!
//! # Rules of the interface
//! - Functions that can fail return a [`Status`] and fill a [`Error`], where one is given. A panic is a bug, and becomes
//!   [`Status::Panic`]; a null handle is [`Status::InvalidArgument`], or gives 0 or null.
//! - A scene does not change, and may be used by many threads. A state belongs to one thread at a time.
//! - A state keeps its scene alive: either may be freed first.
//! - Arrays that a state returns are its own, and valid until its next step, or until it is freed.

mod buffers;
mod error;
mod input;
mod output;
mod scene;
mod state;
mod types;

pub use error::{Error, Status};
pub use input::{
    palpate_state_device_input, palpate_state_follow_paths, palpate_state_set_clamp,
    palpate_state_set_device, palpate_state_set_force, palpate_state_set_gravity, palpate_state_set_obstacle,
    palpate_state_set_position,
};
pub use output::{
    palpate_state_clamps, palpate_state_contacts, palpate_state_devices, palpate_state_energy,
    palpate_state_objects, palpate_state_obstacles, palpate_state_status, palpate_state_time_s,
};
pub use scene::{
    Scene, palpate_scene_count, palpate_scene_find, palpate_scene_free, palpate_scene_load,
    palpate_scene_name, palpate_scene_node_count, palpate_scene_step_s, palpate_scene_triangles,
    palpate_scene_warning,
};
pub use state::{
    State, palpate_state_copy, palpate_state_free, palpate_state_nearest_point, palpate_state_new,
    palpate_state_point_position, palpate_state_step, palpate_state_surface, palpate_state_warning,
};
pub use types::{
    ClampOutput, Collider, ContactOutput, DeviceInput, DeviceMode, DeviceOutput, Energy, ObjectOutput,
    ObstacleOutput, Part, Pose, Purpose, Quaternion, StepStatus, SurfacePoint, Vector,
};

use std::ffi::{CStr, c_char};

/// Version of the interface: it grows with every change that programs compiled with an older header can't bear.
pub const ABI_VERSION: u32 = 1;

/// [`ABI_VERSION`] of the library, to compare with `PALPATE_ABI_VERSION` of the header.
#[unsafe(no_mangle)]
pub extern "C" fn palpate_abi_version() -> u32 {
    ABI_VERSION
}

/// Version of palpate, as "0.4.0".
#[unsafe(no_mangle)]
pub extern "C" fn palpate_version() -> *const c_char {
    const VERSION: &CStr =
        match CStr::from_bytes_with_nul(concat!(env!("CARGO_PKG_VERSION"), "\0").as_bytes()) {
            Ok(version) => version,
            Err(_) => c"",
        };
    VERSION.as_ptr()
}
