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
                Removal::WholeFolder => remove_folder(path),
            };
        }
    }
    let done = then();
    drop(unfinished);
    done
}

/// Attempts to remove a folder that another thread fills meanwhile.
const ATTEMPTS: u32 = 100;

/// Removes a folder with all that is in it. A file that another thread puts there between the removal of the others and that of the folder
/// is removed in the next attempt.
fn remove_folder(path: &Path) -> io::Result<()> {
    let mut removed = std::fs::remove_dir_all(path);
    for _ in 1..ATTEMPTS {
        match &removed {
            Err(error) if error.kind() == io::ErrorKind::DirectoryNotEmpty => {}
            _ => break,
        }
        removed = std::fs::remove_dir_all(path);
    }
    removed
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicBool, Ordering};

    #[test]
    fn a_folder_that_is_being_filled_is_removed() {
        for _ in 0..40 {
            let parent = tempfile::tempdir().expect("a folder");
            let folder = parent.path().join("filled");
            std::fs::create_dir(&folder).expect("a folder");
            let [has_begun, has_ended] = [const { AtomicBool::new(false) }; 2];
            let removed = std::thread::scope(|scope| {
                scope.spawn(|| {
                    // A writer without an end could be faster than the removal for as long as the disk has space.
                    for number in 0..2000 {
                        if has_ended.load(Ordering::Relaxed) {
                            break;
                        }
                        // It fails when the folder is gone.
                        let _ = std::fs::write(folder.join(number.to_string()), "of a log");
                        has_begun.store(true, Ordering::Relaxed);
                    }
                });
                while !has_begun.load(Ordering::Relaxed) {
                    std::hint::spin_loop();
                }
                let removed = remove_folder(&folder);
                has_ended.store(true, Ordering::Relaxed);
                removed
            });
            removed.expect("it is removed");
            assert!(!folder.exists());
        }
    }
}
