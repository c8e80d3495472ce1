//! Folders for series of files, written by one process at a time.

use crate::claim::claim;
use crate::error::ExportError;
use crate::unfinished::{Removal, register, unregister};
use std::fs::File;
use std::path::{Path, PathBuf};

/// Name of the file in a folder whose lock says that the folder is being written.
const LOCK: &str = ".palpate.lock";

/// Folder for a series of files. One that was made here and is still empty is removed on drop.
pub struct OutputFolder {
    path: PathBuf,
    made: bool,
    /// Claim on the folder; `None` while there is no lock file.
    lock: Option<File>,
}

impl OutputFolder {
    /// Creates the folder and its parents where they are missing, and claims it.
    ///
    /// # Errors
    /// When another process writes into it, or the system refuses.
    pub fn create(path: &Path) -> Result<Self, ExportError> {
        let made = !path.is_dir();
        if made {
            let make = || std::fs::create_dir_all(path);
            register(Removal::EmptyFolder, make, |()| Some(path.to_path_buf()))
                .map_err(|e| ExportError::io("make the folder", path, e))?;
        }
        let mut folder = Self { path: path.to_path_buf(), made, lock: None };
        let lock = path.join(LOCK);
        let claimed =
            register(Removal::File, || claim(&lock)?.emptied(), |file| file.is_ok().then(|| lock.clone()));
        match claimed.map_err(|e| ExportError::io("write into", path, e))? {
            Ok(file) => folder.lock = Some(file),
            Err(_) => return Err(ExportError::target(path, "another process is writing into it")),
        }
        Ok(folder)
    }

    /// Path.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for OutputFolder {
    fn drop(&mut self) {
        if self.lock.is_some() {
            let lock = self.path.join(LOCK);
            let _ = std::fs::remove_file(&lock);
            unregister(&lock);
        }
        if self.made {
            let _ = std::fs::remove_dir(&self.path);
            unregister(&self.path);
        }
    }
}
