//! Functions for a live scene that the page's worker calls: conventions as in [`exports`](crate::exports).

#![allow(missing_docs)]

use crate::exports::{DATA, TEXT, handle_or_error, or_error, send, send_json, text};
use crate::live_scene::{LiveScene, RecordedRun, Rescaled, Titles};
use glam::{DQuat, DVec3};
use palpate::Recording;
use palpate_haptics::device::Reading;
use palpate_scene::{PartsInMemory, falling_scene};
use palpate_viewer::{DevicePlace, PageMessage, SceneSummary};
use serde_json::{Value, json};
use std::sync::Arc;

/// Kinds of what is sent, beside those of [`exports`](crate::exports).
const FRAME: u32 = 3;
const SOUND: u32 = 5;

#[link(wasm_import_module = "palpate")]
unsafe extern "C" {
    /// Reads a clock that never goes back [s].
    #[link_name = "now"]
    fn host_now() -> f64;
}

pub(crate) fn send_message(message: PageMessage) {
    match message {
        PageMessage::Text(text) => send(TEXT, text.as_bytes()),
        PageMessage::Frame(frame) => send(FRAME, &frame),
        PageMessage::Sound(block) => send(SOUND, &block),
    }
}

pub(crate) fn now() -> f64 {
    // SAFETY: a function of JavaScript without effects.
    unsafe { host_now() }
}

/// Sends the text of a scene in which the recorded object falls on a floor; the name is that of its file.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn recording_falling_scene(
    recording: &Arc<Recording>,
    name: *const u8,
    name_length: usize,
) {
    // SAFETY: as promised by the caller.
    send_json(&json!(falling_scene(recording, &unsafe { text(name, name_length) })));
}

/// Titles of a scene on the page: `{ "id": …, "title": …, "about": … }`.
fn titles(given: &Value) -> Titles {
    let field = |key: &str| given.get(key).and_then(Value::as_str).unwrap_or_default().to_string();
    Titles { id: Some(field("id")).filter(|id| !id.is_empty()), title: field("title"), about: field("about") }
}

/// Starts a live scene of a text and its parts; `about` is JSON with id, title and about.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn live_open(
    address: *const u8,
    length: usize,
    parts: &PartsInMemory,
    about: *const u8,
    about_length: usize,
) -> *mut LiveScene {
    // SAFETY: as promised by the caller.
    let (scene, about) = unsafe { (text(address, length), text(about, about_length)) };
    let about = serde_json::from_str(&about).unwrap_or_default();
    handle_or_error(LiveScene::open(titles(&about), scene, parts.clone()))
}

/// Starts another scene in place of the one that runs; false after an error was sent.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn live_replace(
    live: &mut LiveScene,
    address: *const u8,
    length: usize,
    parts: &PartsInMemory,
    about: *const u8,
    about_length: usize,
) -> bool {
    // SAFETY: as promised by the caller.
    let (scene, about) = unsafe { (text(address, length), text(about, about_length)) };
    let about = serde_json::from_str(&about).unwrap_or_default();
    or_error(live.replace(titles(&about), scene, parts.clone(), &mut send_message).map(|()| true))
}

/// Greets the page; `scenes` is a JSON list of objects with id, title and about.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn live_greet(live: &mut LiveScene, address: *const u8, length: usize) {
    // SAFETY: as promised by the caller.
    let scenes: Value = serde_json::from_str(&unsafe { text(address, length) }).unwrap_or_default();
    let scenes = scenes.as_array().into_iter().flatten().map(titles);
    let summary =
        |of: Titles| SceneSummary { id: of.id.unwrap_or_default(), title: of.title, about: of.about };
    live.greet(scenes.map(summary).collect(), &mut send_message);
}

/// Receives a message of the page. A scene to open is sent as JSON, its id.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn live_receive(live: &mut LiveScene, address: *const u8, length: usize) {
    // SAFETY: as promised by the caller.
    let message = unsafe { text(address, length) };
    if let Some(id) = or_error(live.receive(&message, &mut send_message)) {
        send_json(&Value::String(id));
    }
}

/// Begins a record for a log; false after an error was sent.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn live_begin_record(live: &mut LiveScene) -> bool {
    or_error(live.begin_record(&mut send_message).map(|()| true))
}

/// Ends a record, which is sent: JSON with the text of the scene, the number of steps and the changes of materials, and as data the numbers of the
/// inputs. False if none was begun.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn live_end_record(live: &mut LiveScene) -> bool {
    let Some(RecordedRun { text, rescaled, inputs }) = live.end_record() else { return false };
    let change = |Rescaled { name, of, young, density }: &Rescaled| json!({ "name": name, "of": of, "young": young, "density": density });
    let rescaled: Value = rescaled.iter().map(change).collect();
    send_json(&json!({ "text": text, "steps": inputs.steps(), "rescaled": rescaled }));
    let numbers: Vec<u8> = inputs.numbers().iter().flat_map(|number| number.to_le_bytes()).collect();
    send(DATA, &numbers);
    true
}

/// Makes the steps that are due, and returns the time of the next deadline [s].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn live_advance(live: &mut LiveScene) -> f64 {
    live.advance(&now, &mut send_message);
    live.deadline_s()
}

/// Sends the data of a path; false if there is none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn live_data(live: &LiveScene, address: *const u8, length: usize) -> bool {
    // SAFETY: as promised by the caller.
    let data = live.static_data(&unsafe { text(address, length) });
    data.inspect(|data| send(DATA, data)).is_some()
}

/// Attaches a haptic device: place of its first reading [m, world], orientation of its frame (w, x, y, z), and scale; false where the scene
/// has no free pointer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn live_attach_device(live: &mut LiveScene, place: &[f64; 8]) -> bool {
    let &[px, py, pz, w, x, y, z, scale] = place;
    let (start, orientation) = (DVec3::new(px, py, pz), DQuat::from_xyzw(x, y, z, w));
    live.attach_device(DevicePlace { start, orientation, scale }).is_some()
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn live_detach_device(live: &mut LiveScene) {
    live.detach_device();
}

/// Update of the haptic device with a position [m, device frame] and pressed buttons, one bit each, if it gave them: returns three numbers, the
/// force to command [N, device frame].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn live_exchange(
    live: &mut LiveScene,
    is_read: bool,
    x: f64,
    y: f64,
    z: f64,
    buttons: u32,
) -> *const f64 {
    let reading = Reading { position: DVec3::new(x, y, z), orientation: None, buttons };
    live.exchange(is_read.then_some(reading), now()).as_ptr()
}
