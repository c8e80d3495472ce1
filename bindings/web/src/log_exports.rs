//! Functions for logs that JavaScript calls: conventions as in [`exports`](crate::exports).

#![allow(missing_docs)]

use crate::exports::{DATA, bytes, handle, handle_or_error, or_error, send, send_json, text};
use crate::live_exports::{now, send_message};
use palpate_scene::{LogMaker, PartsInMemory};
use palpate_viewer::LocalLogs;
use serde_json::json;

#[unsafe(no_mangle)]
pub extern "C" fn logs_new() -> *mut LocalLogs {
    handle(LocalLogs::default())
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn logs_free(logs: *mut LocalLogs) {
    // SAFETY: a handle that is not used any more.
    drop(unsafe { Box::from_raw(logs) });
}

/// Adds the log of a file; its warning, or null, is sent as JSON. False after an error was sent.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn logs_add(
    logs: &mut LocalLogs,
    name: *const u8,
    name_length: usize,
    address: *const u8,
    length: usize,
) -> bool {
    // SAFETY: as promised by the caller.
    let (name, content) = unsafe { (text(name, name_length), bytes(address, length)) };
    let added = logs.add(&name, content.to_vec()).map_err(|error| error.to_string());
    or_error(added.map(|warning| {
        send_json(&json!(warning));
        true
    }))
}

/// Sends the first messages to the page.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn logs_greet(logs: &LocalLogs) {
    logs.greet(&mut send_message);
}

/// Computes steps for some milliseconds; returns whether there are more.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn logs_advance(logs: &mut LocalLogs) -> bool {
    logs.advance(&now, &mut send_message)
}

/// Sends the data of a path; false if there is none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn logs_data(logs: &LocalLogs, address: *const u8, length: usize) -> bool {
    // SAFETY: as promised by the caller.
    let data = logs.data(&unsafe { text(address, length) });
    data.inspect(|data| send(DATA, data)).is_some()
}

/// Steps that are made between two looks at the page's messages.
const STEPS_AT_ONCE: usize = 500;

/// Begins the log of a recorded run: the text of its scene, its parts, the numbers of its inputs, and the time of its start [s since 1970].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn log_maker_new(
    address: *const u8,
    length: usize,
    parts: &PartsInMemory,
    inputs: *const u8,
    inputs_length: usize,
    start_s: f64,
) -> *mut LogMaker {
    // SAFETY: as promised by the caller.
    let (scene, inputs) = unsafe { (text(address, length), bytes(inputs, inputs_length)) };
    let numbers = inputs.as_chunks::<8>().0.iter().map(|number| f64::from_le_bytes(*number)).collect();
    handle_or_error(LogMaker::new(scene, parts, numbers, (start_s * 1e9) as u64))
}

/// Makes some steps; returns whether there are more. False after an error was sent, too.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn log_maker_advance(maker: &mut LogMaker) -> bool {
    for _ in 0..STEPS_AT_ONCE {
        if !or_error(maker.advance().map_err(|error| error.to_string())) {
            return false;
        }
    }
    true
}

/// Number of steps that are written.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn log_maker_steps(maker: &LogMaker) -> f64 {
    maker.steps() as f64
}

/// Ends the log, whose bytes are sent; false after an error was sent.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn log_maker_finish(maker: *mut LogMaker) -> bool {
    // SAFETY: a handle that is not used any more.
    let maker = unsafe { Box::from_raw(maker) };
    or_error(maker.finish().map(|log| send(DATA, &log)).map(|()| true).map_err(|error| error.to_string()))
}
