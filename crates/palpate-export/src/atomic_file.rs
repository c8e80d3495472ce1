//! Output files that are complete or not there: written under a temporary name beside the target, then renamed.

use crate::error::ExportError;
use std::collections::BTreeSet;
use std::fs::File;
use std::io::{BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// Temporary files, and folders that were made for them.
static UNFINISHED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// Registers a file or a folder and makes it under one lock: [`remove_unfinished`] sees both or none.
fn register<T>(temporary: &Path, make: impl FnOnce(&Path) -> T) -> T {
    let unfinished = UNFINISHED.lock().map(|mut unfinished| {
        unfinished.insert(temporary.to_path_buf());
        unfinished
    });
    let made = make(temporary);
    drop(unfinished);
    made
}

fn unregister(temporary: &Path) {
    if let Ok(mut unfinished) = UNFINISHED.lock() {
        unfinished.remove(temporary);
    }
}

/// Removes all unfinished files, and holds off new ones until `then` has returned: for the handler of an interrupt, which ends
/// the process there.
pub fn remove_unfinished<T>(then: impl FnOnce() -> T) -> T {
    let unfinished = UNFINISHED.lock();
    if let Ok(unfinished) = &unfinished {
        // Contents of a folder sort after it; a folder with anything else in it stays.
        let remove = |path: &PathBuf| std::fs::remove_file(path).or_else(|_| std::fs::remove_dir(path));
        unfinished.iter().rev().for_each(|path| drop(remove(path)));
    }
    let done = then();
    drop(unfinished);
    done
}

/// Output file with a temporary name until [`finish`](Self::finish) renames it; dropped before that, it is removed.
pub struct AtomicFile {
    writer: Option<BufWriter<File>>,
    temporary: PathBuf,
    path: PathBuf,
    /// Path that was asked for: `path` itself, or a link to it.
    given: PathBuf,
}

impl AtomicFile {
    /// Creates the temporary file. A link is followed.
    ///
    /// # Errors
    /// When the target is no regular file or one of `inputs`, when its folder is missing, or when the system refuses.
    pub fn create(path: &Path, inputs: &[&Path]) -> Result<Self, ExportError> {
        let given = path.to_path_buf();
        let path = target(path, inputs)?;
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let temporary = path.with_file_name(format!(".{name}.{}.tmp", std::process::id()));
        let file = register(&temporary, |path| File::create(path));
        let file = file.map_err(|e| {
            unregister(&temporary);
            ExportError::io("write", &path, e)
        })?;
        Ok(Self { writer: Some(BufWriter::new(file)), temporary, path, given })
    }

    /// Writes bytes.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn write(&mut self, bytes: &[u8]) -> Result<(), ExportError> {
        let Some(writer) = &mut self.writer else { return Ok(()) };
        writer.write_all(bytes).map_err(|e| ExportError::io("write", &self.path, e))
    }

    /// Closes the temporary file without renaming it: for a series of files that is renamed as a whole.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn close(&mut self) -> Result<(), ExportError> {
        let Some(writer) = self.writer.take() else { return Ok(()) };
        writer.into_inner().map(drop).map_err(|e| ExportError::io("write", &self.path, e.into_error()))
    }

    /// Final path, with links followed.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Renames the file to its final path; returns the path that was asked for.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn finish(mut self) -> Result<PathBuf, ExportError> {
        let failed = |e: std::io::Error| ExportError::io("write", &self.path, e);
        if let Some(writer) = self.writer.take() {
            writer.into_inner().map_err(|e| failed(e.into_error()))?.sync_all().map_err(failed)?;
        }
        std::fs::rename(&self.temporary, &self.path).map_err(failed)?;
        Ok(std::mem::take(&mut self.given))
    }
}

impl Write for AtomicFile {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.writer.as_mut().map_or(Ok(0), |writer| writer.write(bytes))
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.writer.as_mut().map_or(Ok(()), Write::flush)
    }
}

impl Seek for AtomicFile {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        self.writer.as_mut().map_or(Ok(0), |writer| writer.seek(to))
    }
}

impl Drop for AtomicFile {
    fn drop(&mut self) {
        // After `finish` there is nothing left to remove.
        let _ = std::fs::remove_file(&self.temporary);
        unregister(&self.temporary);
    }
}

/// Folder for a series of files. One that was made here and is still empty is removed on drop.
pub struct OutputFolder {
    path: PathBuf,
    made: bool,
}

impl OutputFolder {
    /// Creates the folder and its parents where they are missing.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn create(path: &Path) -> Result<Self, ExportError> {
        if path.is_dir() {
            return Ok(Self { path: path.to_path_buf(), made: false });
        }
        let made = register(path, |path| std::fs::create_dir_all(path));
        made.map_err(|e| {
            unregister(path);
            ExportError::io("make the folder", path, e)
        })?;
        Ok(Self { path: path.to_path_buf(), made: true })
    }

    /// Path.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for OutputFolder {
    fn drop(&mut self) {
        if self.made {
            let _ = std::fs::remove_dir(&self.path);
            unregister(&self.path);
        }
    }
}

/// Path of an output with links followed.
fn target(path: &Path, inputs: &[&Path]) -> Result<PathBuf, ExportError> {
    let refuse = |reason: String| Err(ExportError::target(path, reason));
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if !folder.is_dir() {
        return refuse(format!("there is no folder {}", folder.display()));
    }
    let Ok(real) = path.canonicalize() else { return Ok(path.to_path_buf()) };
    if !real.is_file() {
        return refuse("it is not a file".into());
    }
    if inputs.iter().filter_map(|input| input.canonicalize().ok()).any(|input| input == real) {
        return refuse("it is one of the inputs".into());
    }
    Ok(real)
}

/// Checks that outputs, given by name and path, are different files.
///
/// # Errors
/// [`ExportError::SameFile`].
pub fn check_distinct(outputs: &[(&str, Option<&Path>)]) -> Result<(), ExportError> {
    let given = outputs.iter().filter_map(|(option, path)| Some((option, (*path)?)));
    let given: Vec<_> = given.collect();
    for (at, (second, b)) in given.iter().enumerate() {
        if let Some((first, _)) = given[..at].iter().find(|(_, a)| is_same_file(a, b)) {
            return Err(ExportError::SameFile {
                first: first.to_string(),
                second: second.to_string(),
                path: b.to_path_buf(),
            });
        }
    }
    Ok(())
}

/// Whether two outputs are one file; missing folders count as different.
fn is_same_file(a: &Path, b: &Path) -> bool {
    let real = |path: &Path| {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        path.canonicalize().ok().or_else(|| Some(folder.canonicalize().ok()?.join(path.file_name()?)))
    };
    real(a).is_some_and(|a| real(b) == Some(a))
}

/// Checks that an output may replace what is at the path, without touching it.
///
/// # Errors
/// [`ExportError::Target`].
pub fn check_target(path: &Path, inputs: &[&Path]) -> Result<(), ExportError> {
    target(path, inputs).map(drop)
}

/// Checks before long work that an output can be written.
///
/// # Errors
/// As [`AtomicFile::create`].
pub fn check_writable(path: &Path, inputs: &[&Path]) -> Result<(), ExportError> {
    AtomicFile::create(path, inputs).map(drop)
}

/// Writes a file atomically.
///
/// # Errors
/// As [`AtomicFile::create`] and [`AtomicFile::write`].
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), ExportError> {
    let mut file = AtomicFile::create(path, &[])?;
    file.write(bytes)?;
    file.finish().map(drop)
}
