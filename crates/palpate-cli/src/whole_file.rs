//! Output files that are either whole or not there.

use crate::Failure;
use std::collections::BTreeSet;
use std::fs::File;
use std::io::{BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

/// Files that have not taken their names yet, and folders that were made for them.
static UNFINISHED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// Note a file or a folder and make it, as one: no interrupt comes between.
fn noted<T>(temporary: &Path, make: impl FnOnce(&Path) -> T) -> T {
    let unfinished = UNFINISHED.lock().map(|mut unfinished| {
        unfinished.insert(temporary.to_path_buf());
        unfinished
    });
    let made = make(temporary);
    drop(unfinished);
    made
}

fn forget(temporary: &Path) {
    if let Ok(mut unfinished) = UNFINISHED.lock() {
        unfinished.remove(temporary);
    }
}

/// What an interrupt sets where work can end in good order.
static STOP: AtomicBool = AtomicBool::new(false);
static STOPPABLE: AtomicBool = AtomicBool::new(false);

/// Let the first interrupt (Ctrl-C) set a flag from now on; a second one ends the process.
pub fn stop_on_interrupt() -> &'static AtomicBool {
    STOPPABLE.store(true, Ordering::Relaxed);
    &STOP
}

/// Let an interrupt (Ctrl-C) remove the files that are not finished, and end the process with status 130.
pub fn remove_unfinished_on_interrupt() {
    // Without a handler an interrupt leaves a hidden file behind, nothing worse.
    let _ = ctrlc::set_handler(|| {
        if STOPPABLE.load(Ordering::Relaxed) && !STOP.swap(true, Ordering::Relaxed) {
            return;
        }
        if let Ok(unfinished) = UNFINISHED.lock() {
            // What lies in a folder sorts after it; a folder with anything else in it stays.
            let gone = |path: &PathBuf| std::fs::remove_file(path).or_else(|_| std::fs::remove_dir(path));
            unfinished.iter().rev().for_each(|path| drop(gone(path)));
            // Still locked: nothing new is begun.
            std::process::exit(130);
        }
        std::process::exit(130);
    });
}

/// A file that takes its name when it is finished. Until then it stands beside it under another, and goes if it is not
/// finished.
pub struct WholeFile {
    writer: Option<BufWriter<File>>,
    temporary: PathBuf,
    path: PathBuf,
    /// As it was asked for: a link to the path, or another way there.
    given: PathBuf,
}

impl WholeFile {
    /// Begin a file. A link is followed; what stands there must be a file, or nothing, and none of `inputs`.
    pub fn create(path: &Path, inputs: &[&Path]) -> Result<Self, Failure> {
        let given = path.to_path_buf();
        let path = target(path, inputs)?;
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let temporary = path.with_file_name(format!(".{name}.{}.tmp", std::process::id()));
        let file = noted(&temporary, |place| File::create(place));
        let file = file.map_err(|e| {
            forget(&temporary);
            Failure::file("write", &path, &e)
        })?;
        Ok(Self { writer: Some(BufWriter::new(file)), temporary, path, given })
    }

    /// Write some bytes.
    pub fn write(&mut self, bytes: &[u8]) -> Result<(), Failure> {
        let Some(writer) = &mut self.writer else { return Ok(()) };
        writer.write_all(bytes).map_err(|e| Failure::file("write", &self.path, &e))
    }

    /// The file is written, and waits for others before it takes its name: one of a series that is whole or not there.
    pub fn close(&mut self) -> Result<(), Failure> {
        let Some(writer) = self.writer.take() else { return Ok(()) };
        writer.into_inner().map(drop).map_err(|e| Failure::file("write", &self.path, &e.into_error()))
    }

    /// Where it will be.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Let the file take its name; gives the one that was asked for.
    pub fn finish(mut self) -> Result<PathBuf, Failure> {
        let failed = |e: std::io::Error| Failure::file("write", &self.path, &e);
        if let Some(writer) = self.writer.take() {
            writer.into_inner().map_err(|e| failed(e.into_error()))?.sync_all().map_err(failed)?;
        }
        std::fs::rename(&self.temporary, &self.path).map_err(failed)?;
        Ok(std::mem::take(&mut self.given))
    }
}

impl Write for WholeFile {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.writer.as_mut().map_or(Ok(0), |writer| writer.write(bytes))
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.writer.as_mut().map_or(Ok(()), Write::flush)
    }
}

impl Seek for WholeFile {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        self.writer.as_mut().map_or(Ok(0), |writer| writer.seek(to))
    }
}

impl Drop for WholeFile {
    fn drop(&mut self) {
        // After `finish` there is nothing left to remove.
        let _ = std::fs::remove_file(&self.temporary);
        forget(&self.temporary);
    }
}

/// A folder for a series of files. If it was not there before, it goes when it is left empty.
pub struct MadeFolder {
    path: PathBuf,
    made: bool,
}

impl MadeFolder {
    /// Make it, and those around it, if they are not there.
    pub fn create(path: &Path) -> Result<Self, Failure> {
        if path.is_dir() {
            return Ok(Self { path: path.to_path_buf(), made: false });
        }
        let made = noted(path, |path| std::fs::create_dir_all(path));
        made.map_err(|e| {
            forget(path);
            Failure::file("make the folder", path, &e)
        })?;
        Ok(Self { path: path.to_path_buf(), made: true })
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for MadeFolder {
    fn drop(&mut self) {
        if self.made {
            let _ = std::fs::remove_dir(&self.path);
            forget(&self.path);
        }
    }
}

/// Where an output really goes.
fn target(path: &Path, inputs: &[&Path]) -> Result<PathBuf, Failure> {
    let refuse = |why: String| Err(Failure(format!("cannot write {}: {why}", path.display())));
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

/// Refuse options that name the same file as an output.
pub fn check_apart(outputs: &[(&str, Option<&Path>)]) -> Result<(), Failure> {
    let given = outputs.iter().filter_map(|(option, path)| Some((option, (*path)?)));
    let given: Vec<_> = given.collect();
    for (at, (second, b)) in given.iter().enumerate() {
        if let Some((first, _)) = given[..at].iter().find(|(_, a)| is_same_file(a, b)) {
            return Err(Failure(format!(
                "cannot write {}: {first} and {second} name the same file",
                b.display()
            )));
        }
    }
    Ok(())
}

/// Whether two outputs would be one file; what can't be written is told of elsewhere.
pub fn is_same_file(a: &Path, b: &Path) -> bool {
    let real = |path: &Path| {
        let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
        path.canonicalize().ok().or_else(|| Some(folder.canonicalize().ok()?.join(path.file_name()?)))
    };
    real(a).is_some_and(|a| real(b) == Some(a))
}

/// Check that an output may be written there, and touch nothing.
pub fn check_target(path: &Path, inputs: &[&Path]) -> Result<(), Failure> {
    target(path, inputs).map(drop)
}

/// Check before long work that an output can be written.
pub fn check_writable(path: &Path, inputs: &[&Path]) -> Result<(), Failure> {
    WholeFile::create(path, inputs).map(drop)
}

/// Write a whole file at once.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    let mut file = WholeFile::create(path, &[])?;
    file.write(bytes)?;
    file.finish().map(drop)
}
