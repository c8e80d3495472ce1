//! One verb, one file.

pub mod bench;
pub mod demo;
pub mod inspect;
pub mod record;
pub mod run;
pub mod verify;

use crate::Failure;
use palpate::Recording;
use std::io::Write;
use std::path::Path;

/// Read a recording file.
pub fn read_recording(path: &Path) -> Result<Recording, Failure> {
    let bytes = std::fs::read(path).map_err(|e| Failure::file("read the recording", path, &e))?;
    if bytes.is_empty() {
        return Err(Failure(format!("{}: the file is empty", path.display())));
    }
    Recording::from_bytes(&bytes).map_err(|e| Failure(format!("{}: {e}", path.display())))
}

/// Write a file so that it is either whole or not there.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let failed = |e: std::io::Error| Failure::file("write", path, &e);
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let mut file = tempfile::Builder::new().prefix(".palpate-").tempfile_in(folder).map_err(failed)?;
    file.write_all(bytes).map_err(failed)?;
    file.as_file().sync_all().map_err(failed)?;
    // Temporary files are private; the result gets the permissions of a new file.
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let permissions = std::fs::Permissions::from_mode(0o644);
        file.as_file().set_permissions(permissions).map_err(failed)?;
    }
    file.persist(path).map_err(|e| failed(e.error))?;
    Ok(())
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
