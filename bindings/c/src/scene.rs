//! Scenes: loading, names, and surfaces at rest.

use crate::error::{Error, Failure, Status, checked, put};
use crate::types::{Part, Purpose};
use palpate::Model;
use palpate_scene::{SceneError, read_driven_scene};
use std::ffi::{CStr, CString, c_char};
use std::path::Path;
use std::ptr;
use std::sync::Arc;

/// Scene that is ready to run: objects, devices, obstacles and their parameters, with names.
pub struct Scene(pub(crate) Arc<Loaded>);

/// Scene as read, shared by handle and states.
pub(crate) struct Loaded {
    pub scene: palpate_scene::Scene,
    names: [Vec<CString>; 4],
    warnings: Vec<CString>,
}

impl Loaded {
    pub fn model(&self) -> &Model {
        &self.scene.model
    }

    /// Surface of an object.
    pub fn surface(&self, object: usize) -> Result<&palpate::Surface, Failure> {
        let recording = self.model().recordings().nth(object);
        recording.map(|recording| &recording.surface).ok_or_else(|| no_part("object", object))
    }

    fn names(&self, part: u32) -> Result<&[CString], Failure> {
        let part = Part::of(part)?;
        Ok(&self.names[part as usize])
    }
}

/// Failure of a number that counts beyond the parts.
pub(crate) fn no_part(what: &str, number: usize) -> Failure {
    Failure::argument(format!("there is no {what} of number {number}"))
}

/// Texts for C; one with a zero byte, which no scene file can hold, is cut there.
pub(crate) fn texts(texts: impl IntoIterator<Item = String>) -> Vec<CString> {
    let text = |text: String| CString::new(text.split('\0').next().unwrap_or_default()).unwrap_or_default();
    texts.into_iter().map(text).collect()
}

fn load(path: &Path, purpose: u32) -> Result<Scene, Failure> {
    let mode = Purpose::of(purpose)?;
    let scene = read_driven_scene(path, mode).map_err(|error: SceneError| Failure::from(error))?;
    let names = scene.names();
    let names = [names.objects, names.devices, names.obstacles, names.clamps].map(texts);
    let warnings = texts(scene.warnings.iter().map(ToString::to_string));
    Ok(Scene(Arc::new(Loaded { scene, names, warnings })))
}

/// Read a scene file with its recordings, meshes and paths (docs/scene.md). `purpose` is a `PalpatePurpose`. A device without a
/// path is moved by the program. `*scene` is null unless it succeeds; free it with [`palpate_scene_free`].
///
/// # Safety
/// `path` is a string in UTF-8 that ends with 0; `scene` can be written; `error` can be, or is null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_scene_load(
    path: *const c_char,
    purpose: u32,
    scene: *mut *mut Scene,
    error: *mut Error,
) -> Status {
    let load = || {
        // SAFETY: as promised by the caller.
        unsafe { put(scene, ptr::null_mut()) }?;
        if path.is_null() {
            return Err(Failure::argument("path is null"));
        }
        // SAFETY: not null, and a string, as promised by the caller.
        let path = unsafe { CStr::from_ptr(path) };
        let path = path.to_str().map_err(|_| Failure::argument("path is not UTF-8"))?;
        let loaded = load(Path::new(path), purpose)?;
        // SAFETY: as promised by the caller.
        unsafe { put(scene, Box::into_raw(Box::new(loaded))) }
    };
    // SAFETY: as promised by the caller.
    unsafe { checked(error, load) }
}

/// Free a scene; its states stay as they are. Null is left alone.
///
/// # Safety
/// `scene` is from [`palpate_scene_load`], and not used any more.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_scene_free(scene: *mut Scene) {
    if !scene.is_null() {
        // SAFETY: from `Box::into_raw`, as promised by the caller.
        drop(unsafe { Box::from_raw(scene) });
    }
}

/// Duration of a step [s]; 0 for null.
///
/// # Safety
/// `scene` is a scene or null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_scene_step_s(scene: *const Scene) -> f64 {
    // SAFETY: as promised by the caller.
    unsafe { scene.as_ref() }.map_or(0.0, |scene| scene.0.model().parameters().step_s)
}

/// Number of a scene's parts of a kind, a `PalpatePart`.
///
/// # Safety
/// `scene` is a scene or null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_scene_count(scene: *const Scene, part: u32) -> usize {
    // SAFETY: as promised by the caller.
    let names = unsafe { scene.as_ref() }.and_then(|scene| scene.0.names(part).ok());
    names.map_or(0, <[CString]>::len)
}

/// Name of a part, which lives as long as the scene; null where there is none of that number.
///
/// # Safety
/// `scene` is a scene or null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_scene_name(scene: *const Scene, part: u32, number: usize) -> *const c_char {
    // SAFETY: as promised by the caller.
    let names = unsafe { scene.as_ref() }.and_then(|scene| scene.0.names(part).ok());
    names.and_then(|names| names.get(number)).map_or(ptr::null(), |name| name.as_ptr())
}

/// Number of the part of a name; -1 where there is none.
///
/// # Safety
/// `scene` is a scene or null, `name` a string that ends with 0 or null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_scene_find(scene: *const Scene, part: u32, name: *const c_char) -> isize {
    // SAFETY: as promised by the caller.
    let names = unsafe { scene.as_ref() }.and_then(|scene| scene.0.names(part).ok());
    let (Some(names), false) = (names, name.is_null()) else { return -1 };
    // SAFETY: not null, and a string, as promised by the caller.
    let name = unsafe { CStr::from_ptr(name) };
    names.iter().position(|own| own.as_c_str() == name).and_then(|at| isize::try_from(at).ok()).unwrap_or(-1)
}

/// Warning for the author of the scene, which lives as long as the scene; null after the last.
///
/// # Safety
/// `scene` is a scene or null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_scene_warning(scene: *const Scene, number: usize) -> *const c_char {
    // SAFETY: as promised by the caller.
    let scene = unsafe { scene.as_ref() };
    scene.and_then(|scene| scene.0.warnings.get(number)).map_or(ptr::null(), |text| text.as_ptr())
}

/// Number of surface nodes of an object; 0 where there is none of that number.
///
/// # Safety
/// `scene` is a scene or null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_scene_node_count(scene: *const Scene, object: usize) -> usize {
    // SAFETY: as promised by the caller.
    let surface = unsafe { scene.as_ref() }.and_then(|scene| scene.0.surface(object).ok());
    surface.map_or(0, |surface| surface.positions.len())
}

/// Triangles of an object's surface, three node numbers each, outward by the right-hand rule; `*count` is the number of triangles. Lives as
/// long as the scene; null where there is no such object.
///
/// # Safety
/// `scene` is a scene or null; `count` can be written, or is null.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn palpate_scene_triangles(
    scene: *const Scene,
    object: usize,
    count: *mut usize,
) -> *const u32 {
    // SAFETY: as promised by the caller.
    let scene = unsafe { scene.as_ref() };
    let triangles = scene.and_then(|scene| scene.0.surface(object).ok()).map(|surface| &surface.triangles);
    // SAFETY: as promised by the caller; it may do without.
    let _ = unsafe { put(count, triangles.map_or(0, Vec::len)) };
    triangles.map_or(ptr::null(), |triangles| triangles.as_ptr().cast())
}
