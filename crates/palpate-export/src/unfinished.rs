//! Register of files and folders that must not outlive their process.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// Extent of the removal of an unfinished path.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Removal {
    /// A file.
    File,
    /// A folder, if nothing else is in it.
    EmptyFolder,
    /// A folder with all that is in it.
    WholeFolder,
}

static UNFINISHED: Mutex<BTreeMap<PathBuf, Removal>> = Mutex::new(BTreeMap::new());

/// Makes a file or a folder and registers it under one lock: [`remove_unfinished`] sees both or none.
pub(crate) fn register<T>(
    removal: Removal,
    make: impl FnOnce() -> io::Result<T>,
    path: impl FnOnce(&T) -> Option<PathBuf>,
) -> io::Result<T> {
    let mut unfinished = UNFINISHED.lock();
    let made = make()?;
    if let (Ok(unfinished), Some(path)) = (&mut unfinished, path(&made)) {
        unfinished.insert(path, removal);
    }
    Ok(made)
}

/// Forgets a path that is finished, or gone.
pub(crate) fn unregister(path: &Path) {
    if let Ok(mut unfinished) = UNFINISHED.lock() {
        unfinished.remove(path);
    }
}

/// Removes all unfinished files and temporary folders, and holds off new ones until `then` has returned: for the handler of an
/// interrupt, which ends the process there.
pub fn remove_unfinished<T>(then: impl FnOnce() -> T) -> T {
    let unfinished = UNFINISHED.lock();
    if let Ok(unfinished) = &unfinished {
        // Contents of a folder sort after it; what can't be removed stays.
        for (path, removal) in unfinished.iter().rev() {
            let _ = match removal {
                Removal::File => std::fs::remove_file(path),
                Removal::EmptyFolder => std::fs::remove_dir(path),
                Removal::WholeFolder => std::fs::remove_dir_all(path),
            };
        }
    }
    let done = then();
    drop(unfinished);
    done
}
