//! Functions for logs that JavaScript calls: conventions as in [`exports`](crate::exports).

#![allow(missing_docs)]

use crate::exports::{DATA, bytes, handle, now, or_error, send, send_json, send_message, text};
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
