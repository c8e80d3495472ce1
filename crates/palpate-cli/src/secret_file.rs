//! Files with secrets: the token of the viewer's server, the secret of links.

use crate::failure::Failure;
use crate::terminal::notify;
use std::path::Path;

/// Text of a file with a secret; warns if others can read it.
pub fn read_secret_file(what: &str, path: &Path) -> Result<String, Failure> {
    if others_read(path) {
        notify(&format!("warning: others can read {0}, and {what} in it: chmod 600 {0}", path.display()));
    }
    palpate_mesh::read_regular_text(path)
        .map_err(|error| Failure::file(&format!("read {what}"), path, &error))
}

/// Whether the permissions of a file let its group or everybody read it.
#[cfg(unix)]
fn others_read(path: &Path) -> bool {
    use std::os::unix::fs::PermissionsExt;
    std::fs::metadata(path)
        .is_ok_and(|metadata| metadata.is_file() && metadata.permissions().mode() & 0o044 != 0)
}

/// Whether others can read a file: elsewhere than on Unix, permissions are inherited from the folder.
#[cfg(not(unix))]
fn others_read(_: &Path) -> bool {
    false
}
