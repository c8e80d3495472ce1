//! Temporary folders that go with their process, however that ends.

use crate::unfinished::{Removal, register, unregister};
use std::fs::{File, TryLockError};
use std::io;
use std::path::Path;
use tempfile::TempDir;

/// Beginning of the names, below the system's folder for temporary files.
const PREFIX: &str = "palpate-";

/// File in a folder whose lock says that its process lives.
const LOCK: &str = ".lock";

/// Temporary folder, removed on drop and by [`remove_unfinished`](crate::remove_unfinished); one that a killed process left, by the
/// next that makes one.
pub struct TemporaryFolder {
    folder: TempDir,
    /// Locked while the process lives.
    _lock: File,
}

impl TemporaryFolder {
    /// Empty folder, but for a hidden file.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn new() -> io::Result<Self> {
        let parent = std::env::temp_dir();
        remove_left(&parent);
        Self::new_in(&parent)
    }

    fn new_in(parent: &Path) -> io::Result<Self> {
        let make = || tempfile::Builder::new().prefix(PREFIX).tempdir_in(parent);
        let folder = register(Removal::WholeFolder, make, |folder| Some(folder.path().to_path_buf()))?;
        // Locked before it has its name: a lock that can be had is of a process that has ended.
        let new = folder.path().join(".lock.new");
        let lock = File::create(&new)?;
        lock.lock()?;
        std::fs::rename(&new, folder.path().join(LOCK))?;
        Ok(Self { folder, _lock: lock })
    }

    /// Path.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }
}

impl Drop for TemporaryFolder {
    fn drop(&mut self) {
        // The folder removes itself after this.
        unregister(self.folder.path());
    }
}

/// Removes the folders of processes that have ended.
fn remove_left(parent: &Path) {
    for entry in std::fs::read_dir(parent).into_iter().flatten().flatten() {
        let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
        if !is_folder || !entry.file_name().to_string_lossy().starts_with(PREFIX) {
            continue;
        }
        let lock = entry.path().join(LOCK);
        // Whatever else others put there is not opened.
        if !std::fs::symlink_metadata(&lock).is_ok_and(|lock| lock.is_file()) {
            continue;
        }
        let Ok(lock) = File::open(lock) else { continue };
        match lock.try_lock() {
            Ok(()) => drop(std::fs::remove_dir_all(entry.path())),
            Err(TryLockError::WouldBlock | TryLockError::Error(_)) => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_of_a_process_that_has_ended_is_removed_and_one_in_use_is_not() {
        let parent = tempfile::tempdir().expect("a folder");
        let used = TemporaryFolder::new_in(parent.path()).expect("a folder");
        // A killed process leaves its folder, and no lock.
        let left = parent.path().join("palpate-left");
        std::fs::create_dir(&left).expect("a folder");
        std::fs::write(left.join(LOCK), "").expect("a file");
        std::fs::write(left.join("cube.palp"), "of a log").expect("a file");
        let of_others = parent.path().join("palpate-notes");
        std::fs::create_dir(&of_others).expect("a folder");
        remove_left(parent.path());
        assert!(used.path().exists() && !left.exists() && of_others.exists());
        let path = used.path().to_path_buf();
        drop(used);
        assert!(!path.exists());
    }
}
