//! Functions that JavaScript calls, and those of JavaScript that are called.
//!
//! Texts and bytes are pairs of address and length in linear memory, which the caller allocates and frees. Results are sent by
//! [`send`] before a function returns: an error as a text of kind [`ERROR`]. Handles are addresses; 0 is none.

#![allow(missing_docs)]

use crate::simulation::{Array, Simulation, energy_names};
use crate::{describe_recording, describe_scene};
use glam::DVec3;
use palpate::Recording;
use palpate_scene::{PartsInMemory, RunMode, Scene, named_files, read_scene_text};
use serde_json::{Value, json};
use std::alloc::Layout;
use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Kinds of what is sent.
const ERROR: u32 = 0;
const JSON: u32 = 1;
pub(crate) const TEXT: u32 = 2;
pub(crate) const DATA: u32 = 4;

#[link(wasm_import_module = "palpate")]
unsafe extern "C" {
    /// Takes bytes of a kind, before it returns.
    #[link_name = "send"]
    fn host_send(kind: u32, address: *const u8, length: usize);
}

pub(crate) fn send(kind: u32, bytes: &[u8]) {
    // SAFETY: JavaScript reads so many bytes there.
    unsafe { host_send(kind, bytes.as_ptr(), bytes.len()) }
}

pub(crate) fn send_json(value: &Value) {
    send(JSON, value.to_string().as_bytes());
}

/// Result, or the default of its type after an error was sent.
pub(crate) fn or_error<T: Default>(result: Result<T, String>) -> T {
    result.unwrap_or_else(|text| {
        send(ERROR, text.as_bytes());
        T::default()
    })
}

/// Bytes that JavaScript has written.
pub(crate) unsafe fn bytes<'a>(address: *const u8, length: usize) -> &'a [u8] {
    if length == 0 {
        return &[];
    }
    // SAFETY: as promised by the caller of the export.
    unsafe { std::slice::from_raw_parts(address, length) }
}

/// Text that JavaScript has written.
pub(crate) unsafe fn text(address: *const u8, length: usize) -> String {
    // SAFETY: as promised by the caller of the export.
    String::from_utf8_lossy(unsafe { bytes(address, length) }).into_owned()
}

pub(crate) fn handle<T>(value: T) -> *mut T {
    Box::into_raw(Box::new(value))
}

/// Handle of a value, or none after an error was sent.
pub(crate) fn handle_or_error<T>(value: Result<T, impl Display>) -> *mut T {
    or_error(value.map(Some).map_err(|error| error.to_string())).map_or(std::ptr::null_mut(), handle)
}

/// Layout of an allocation that JavaScript asks for.
fn layout(length: usize) -> Layout {
    Layout::from_size_align(length.max(1), 8).unwrap_or(Layout::new::<u64>())
}

#[unsafe(no_mangle)]
pub extern "C" fn allocate(length: usize) -> *mut u8 {
    // SAFETY: the layout is not empty.
    unsafe { std::alloc::alloc(layout(length)) }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn deallocate(address: *mut u8, length: usize) {
    // SAFETY: it was allocated with this length.
    unsafe { std::alloc::dealloc(address, layout(length)) }
}

#[unsafe(no_mangle)]
pub extern "C" fn describe_library() {
    send_json(&json!({ "version": env!("CARGO_PKG_VERSION"), "energies": energy_names() }));
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn recording_read(address: *const u8, length: usize) -> *mut Arc<Recording> {
    // SAFETY: as promised by the caller.
    let read = Recording::from_bytes(unsafe { bytes(address, length) });
    handle_or_error(read.map(Arc::new))
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn recording_free(recording: *mut Arc<Recording>) {
    // SAFETY: a handle that is not used any more.
    drop(unsafe { Box::from_raw(recording) });
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn recording_describe(recording: &Arc<Recording>) {
    send_json(&describe_recording(recording));
}

/// Positions of the surface's nodes at rest, rows of 3 [m, body].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn recording_positions(recording: &Arc<Recording>) -> *const DVec3 {
    recording.surface.positions.as_ptr()
}

/// Nodes of the surface's triangles.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn recording_triangles(recording: &Arc<Recording>) -> *const [u32; 3] {
    recording.surface.triangles.as_ptr()
}

/// Recording of a body of the same shape and Poisson's ratio in another material [Pa, kg/m³].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn recording_rescaled(
    recording: &Arc<Recording>,
    young: f64,
    density: f64,
) -> *mut Arc<Recording> {
    handle_or_error(recording.rescaled(young, density).map(Arc::new))
}

/// Sends the files that a scene names.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn scene_files(address: *const u8, length: usize) {
    // SAFETY: as promised by the caller.
    let files = named_files(&unsafe { text(address, length) });
    let files = or_error(files.map_err(|error| error.to_string()));
    send_json(&files.iter().map(|file| file.display().to_string()).collect());
}

#[unsafe(no_mangle)]
pub extern "C" fn parts_new() -> *mut PartsInMemory {
    handle(PartsInMemory::default())
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn parts_free(parts: *mut PartsInMemory) {
    // SAFETY: a handle that is not used any more.
    drop(unsafe { Box::from_raw(parts) });
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn parts_add_recording(
    parts: &mut PartsInMemory,
    name: *const u8,
    name_length: usize,
    recording: &Arc<Recording>,
) {
    // SAFETY: as promised by the caller.
    let name = PathBuf::from(unsafe { text(name, name_length) });
    parts.recordings.insert(name, Arc::clone(recording));
}

/// Adds a motion path as CSV text.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn parts_add_path(
    parts: &mut PartsInMemory,
    name: *const u8,
    name_length: usize,
    path: *const u8,
    path_length: usize,
) {
    // SAFETY: as promised by the caller.
    let (name, path) = unsafe { (text(name, name_length), text(path, path_length)) };
    parts.paths.insert(PathBuf::from(name), path);
}

/// Reads a scene, whose description is sent.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn scene_read(
    address: *const u8,
    length: usize,
    parts: &PartsInMemory,
) -> *mut Arc<Scene> {
    // SAFETY: as promised by the caller.
    let scene_text = unsafe { text(address, length) };
    let scene = read_scene_text(Path::new("scene"), &scene_text, parts, RunMode::Offline);
    handle_or_error(scene.map(Arc::new).inspect(|scene| send_json(&describe_scene(scene))))
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn scene_free(scene: *mut Arc<Scene>) {
    // SAFETY: a handle that is not used any more.
    drop(unsafe { Box::from_raw(scene) });
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn simulation_new(scene: &Arc<Scene>) -> *mut Simulation {
    handle(Simulation::new(Arc::clone(scene)))
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn simulation_free(simulation: *mut Simulation) {
    // SAFETY: a handle that is not used any more.
    drop(unsafe { Box::from_raw(simulation) });
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn simulation_reset(simulation: &mut Simulation) {
    simulation.reset();
}

/// Steps; false after an error was sent.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn simulation_step(simulation: &mut Simulation) -> bool {
    or_error(simulation.step().map(|()| true))
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn simulation_time(simulation: &Simulation) -> f64 {
    simulation.time_s()
}

/// Sends the warnings about the steps since the start.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn simulation_warnings(simulation: &Simulation) {
    send_json(&json!(simulation.warnings()));
}

/// Address of an array, by its place in [`Array::ALL`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn simulation_array(simulation: &Simulation, array: usize) -> *const f64 {
    Array::ALL.get(array).map_or(std::ptr::null(), |array| simulation.array(*array).as_ptr())
}

/// Length of an array.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn simulation_array_length(simulation: &Simulation, array: usize) -> usize {
    Array::ALL.get(array).map_or(0, |array| simulation.array(*array).len())
}

/// Address of the positions of an object's nodes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn simulation_surface(simulation: &mut Simulation, object: usize) -> *const f32 {
    simulation.surface(object).as_ptr()
}

/// Numbers of the positions that [`simulation_surface`] has written last.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn simulation_surface_length(simulation: &Simulation) -> usize {
    simulation.surface_length()
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn simulation_grasp(
    simulation: &mut Simulation,
    device: usize,
    object: usize,
    x: f64,
    y: f64,
    z: f64,
) -> bool {
    or_error(simulation.grasp(device, object, DVec3::new(x, y, z)).map(|()| true))
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn simulation_release(simulation: &mut Simulation, device: usize) -> bool {
    or_error(simulation.release(device).map(|()| true))
}
