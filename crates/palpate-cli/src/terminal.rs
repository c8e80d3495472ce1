//! Output on the terminal: results on standard output, messages on standard error.

use crate::failure::Failure;
use palpate_export::has_reader;
use palpate_scene::{LogReplay, SceneLog};
use std::io::Write;

/// Prints a message on standard error; a reader that has gone away is no failure.
pub fn notify(text: &str) {
    let _ = writeln!(std::io::stderr(), "{text}");
}

/// Prints to standard output; a reader that has gone away is no failure.
pub fn print(text: &str) -> Result<(), Failure> {
    print_bytes(text.as_bytes())
}

/// Writes data to standard output; a reader that has gone away is no failure.
pub fn print_bytes(bytes: &[u8]) -> Result<(), Failure> {
    let mut out = std::io::stdout().lock();
    has_reader(out.write_all(bytes).and_then(|()| out.flush()))?;
    Ok(())
}

/// Prints a value as one JSON object.
pub fn print_json(value: &serde_json::Value) -> Result<(), Failure> {
    print(&format!("{value:#}\n"))
}

/// Number of bytes for people.
pub fn size_text(bytes: usize) -> String {
    match bytes as f64 {
        bytes if bytes < 1e5 => format!("{:.1} kB", bytes / 1e3),
        bytes if bytes >= 1e10 => format!("{:.1} GB", bytes / 1e9),
        bytes => format!("{:.1} MB", bytes / 1e6),
    }
}

/// Warns of stores of impulse responses, which logs do not carry.
pub fn warn_of_stores(scene: &SceneLog) {
    for store in scene.stores_left_out() {
        notify(&format!(
            "warning: {} is not taken into the log: a replay needs it where it is",
            store.display()
        ));
    }
}

/// Warns of a log that was cut.
pub fn warn_of_cut(log: &LogReplay) {
    if let Some(warning) = log.warning() {
        notify(&format!("warning: {warning}"));
    }
}
