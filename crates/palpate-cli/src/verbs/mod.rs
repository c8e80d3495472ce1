//! One verb, one file.

mod animation;
pub mod bench;
pub mod demo;
pub mod device;
pub mod devices;
pub mod export;
pub mod inspect;
pub mod record;
pub mod render;
pub mod replay;
pub mod reproduce;
pub mod run;
pub mod serve;
pub mod verify;

use crate::Failure;
pub use crate::whole_file::write_whole;
use palpate::Recording;
use std::io::Write;
use std::path::Path;

/// Read a recording file.
pub fn read_recording(path: &Path) -> Result<Recording, Failure> {
    let failed = |e: std::io::Error| Failure::file("read the recording", path, &e);
    if !std::fs::metadata(path).map_err(failed)?.is_file() {
        return Err(Failure(format!("cannot read the recording {}: it is not a file", path.display())));
    }
    let bytes = std::fs::read(path).map_err(failed)?;
    if bytes.is_empty() {
        return Err(Failure(format!("{}: the file is empty", path.display())));
    }
    Recording::from_bytes(&bytes).map_err(|e| Failure(format!("{}: {e}", path.display())))
}

/// Print a value as one JSON object.
pub fn print_json(value: &serde_json::Value) -> Result<(), Failure> {
    print(&format!("{value:#}\n"))
}

/// Print to standard output; a reader that has gone away is no failure.
pub fn print(text: &str) -> Result<(), Failure> {
    match std::io::stdout().write_all(text.as_bytes()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Failure(format!("cannot write to standard output: {error}")))
        }
        _ => Ok(()),
    }
}
