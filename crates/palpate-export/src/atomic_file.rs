//! Output files that are complete or not there: written under a temporary name beside the target, then renamed.

use crate::claim::{claim, sync_folder};
use crate::error::ExportError;
use crate::unfinished::{Removal, register, unregister};
use std::fs::File;
use std::io::{BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// Output file with a temporary name until [`finish`](Self::finish) renames it; dropped before that, it is removed. What a killed
/// process left is overwritten by the next that writes the same file.
pub struct AtomicFile {
    writer: Option<BufWriter<File>>,
    /// Temporary path; `None` once the file has its own.
    temporary: Option<PathBuf>,
    path: PathBuf,
    /// Path that was asked for: `path` itself, or a link to it.
    given: PathBuf,
}

impl AtomicFile {
    /// Creates the temporary file. A link is followed.
    ///
    /// # Errors
    /// When the target is no regular file or one of `inputs`, when its folder is missing, when another process writes it, or when the
    /// system refuses.
    pub fn create(path: &Path, inputs: &[&Path]) -> Result<Self, ExportError> {
        Self::claim(path, inputs)?.map_err(|_| ExportError::target(path, "another process is writing it"))
    }

    /// Claims the temporary file, or gives the one that another writer has.
    fn claim(path: &Path, inputs: &[&Path]) -> Result<Result<Self, File>, ExportError> {
        let given = path.to_path_buf();
        let path = target(path, inputs)?;
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let temporary = path.with_file_name(format!(".{name}.tmp"));
        let file = register(
            Removal::File,
            || claim(&temporary)?.emptied(),
            |file| file.is_ok().then(|| temporary.clone()),
        );
        let file = file.map_err(|e| ExportError::io("write", &path, e))?;
        Ok(file.map(|file| Self {
            writer: Some(BufWriter::new(file)),
            temporary: Some(temporary),
            path,
            given,
        }))
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
        // Open until it is renamed: its claim lasts as long as its temporary name.
        let file = self.writer.take().map(BufWriter::into_inner).transpose();
        let file = file.map_err(|e| failed(e.into_error()))?;
        file.as_ref().map_or(Ok(()), File::sync_all).map_err(failed)?;
        if let Some(temporary) = self.temporary.take() {
            let renamed = std::fs::rename(&temporary, &self.path).map_err(failed);
            if renamed.is_err() {
                let _ = std::fs::remove_file(&temporary);
            }
            unregister(&temporary);
            renamed?;
            sync_folder(&self.path);
        }
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
        if let Some(temporary) = &self.temporary {
            let _ = std::fs::remove_file(temporary);
            unregister(temporary);
        }
    }
}

/// Path of an output with links followed.
pub(crate) fn target(path: &Path, inputs: &[&Path]) -> Result<PathBuf, ExportError> {
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

/// Writes a file atomically, after others that are doing so: the last one stands, whole.
///
/// # Errors
/// When the target is no regular file, when its folder is missing, or when the system refuses.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), ExportError> {
    loop {
        match AtomicFile::claim(path, &[])? {
            Ok(mut file) => {
                file.write(bytes)?;
                return file.finish().map(drop);
            }
            Err(of_another) => of_another.lock().map_err(|e| ExportError::io("write", path, e))?,
        }
    }
}
