//! Output files that are worth something before they are finished, such as logs: written as `NAME.part`, then renamed.
//!
//! The name is a visible one, so that it is found after a kill or a power cut, and not the final one, so that an older file of that
//! name stays until the new one is whole, and nobody takes a half for a whole.

use crate::atomic_file::target;
use crate::claim::{Claim, claim, sync_folder};
use crate::error::ExportError;
use crate::unfinished::{Removal, register, unregister};
use std::ffi::OsString;
use std::fs::File;
use std::io::{BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// Ending of the name of an unfinished file.
pub const PART: &str = "part";

/// Output file that grows under its name with `.part`. What was flushed is on the disk and stays, however the process ends; dropped
/// before the first flush, the file is removed.
pub struct PartFile {
    writer: BufWriter<File>,
    part: PathBuf,
    path: PathBuf,
    /// Path that was asked for: `path` itself, or a link to it.
    given: PathBuf,
    is_flushed: bool,
}

/// Name of the unfinished file of a path: `NAME.part`.
pub fn part_of(path: &Path) -> PathBuf {
    let mut name = path.file_name().map_or_else(OsString::new, OsString::from);
    name.push(".");
    name.push(PART);
    path.with_file_name(name)
}

impl PartFile {
    /// Creates the file. A link is followed.
    ///
    /// # Errors
    /// When the target is no regular file or one of `inputs`, when its folder is missing, when another process writes it or an
    /// unfinished one is there, or when the system refuses.
    pub fn create(path: &Path, inputs: &[&Path]) -> Result<Self, ExportError> {
        let given = path.to_path_buf();
        let path = target(path, inputs)?;
        let part = part_of(&path);
        let failed = |e| ExportError::io("write", &path, e);
        let is_own = |claim: &Claim| matches!(claim, Claim::New(_)).then(|| part.clone());
        let file = match register(Removal::File, || claim(&part), is_own).map_err(failed)? {
            Claim::New(file) => file,
            Claim::Held(_) => return Err(ExportError::target(&given, "another process is writing it")),
            Claim::Left(file) if file.metadata().map_err(failed)?.len() == 0 => file,
            Claim::Left(_) => return Err(ExportError::Unfinished { path: given, part }),
        };
        Ok(Self { writer: BufWriter::new(file), part, path, given, is_flushed: false })
    }

    /// Path of the unfinished file.
    pub fn part(&self) -> &Path {
        &self.part
    }

    /// Removes the file: nothing in it is worth keeping.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn discard(self) -> Result<(), ExportError> {
        if !self.is_flushed {
            // Removed on drop.
            return Ok(());
        }
        std::fs::remove_file(&self.part).map_err(|e| ExportError::io("remove", &self.part, e))
    }

    /// Renames the file to its final path; returns the path that was asked for.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn finish(mut self) -> Result<PathBuf, ExportError> {
        self.flush().map_err(|e| ExportError::io("write", &self.path, e))?;
        std::fs::rename(&self.part, &self.path).map_err(|e| ExportError::io("write", &self.path, e))?;
        sync_folder(&self.path);
        Ok(std::mem::take(&mut self.given))
    }
}

impl Write for PartFile {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.writer.write(bytes)
    }

    /// Hands the bytes to the disk, so that they survive a power cut.
    fn flush(&mut self) -> std::io::Result<()> {
        self.writer.flush()?;
        self.writer.get_ref().sync_data()?;
        if !self.is_flushed {
            self.is_flushed = true;
            sync_folder(&self.part);
            unregister(&self.part);
        }
        Ok(())
    }
}

impl Seek for PartFile {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        self.writer.seek(to)
    }
}

impl Drop for PartFile {
    fn drop(&mut self) {
        if !self.is_flushed {
            let _ = std::fs::remove_file(&self.part);
            unregister(&self.part);
        }
    }
}
