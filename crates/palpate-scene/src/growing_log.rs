//! Log of a scene that runs: it grows as `NAME.part`, tells of a failure when it happens, and keeps what was written.

use crate::error::{SceneError, SceneErrorKind};
use palpate_export::{ExportError, PartFile};
use palpate_haptics::LogError;
use palpate_haptics::log::{LogReader, LogSummary};
use palpate_mesh::read_regular_file;
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Teller of a failure.
pub type Teller = Box<dyn Fn(&str) + Send>;

/// Log file. The part that was flushed stays, however the process ends.
pub struct GrowingLog {
    file: PartFile,
    path: PathBuf,
    tell: Teller,
    failures: Failures,
}

/// Whether failures are told: those before the log has begun are errors of whoever begins it.
#[derive(Clone, Default)]
pub struct Failures(Arc<AtomicBool>);

impl Failures {
    /// Tells of the next failure.
    pub fn tell(&self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

impl GrowingLog {
    /// Creates the file. `tell` gets the text of the first failure, when it happens.
    ///
    /// # Errors
    /// As [`PartFile::create`].
    pub fn create(path: &Path, inputs: &[&Path], tell: Teller) -> Result<Self, SceneError> {
        let file = create_part(path, inputs)?;
        Ok(Self { file, path: path.to_path_buf(), tell, failures: Failures::default() })
    }

    /// Switch that is on once the log has begun.
    pub fn failures(&self) -> Failures {
        self.failures.clone()
    }

    /// Path that was asked for.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Gives a whole log its name, and says what can be had of one that is cut. A log without steps is removed.
    ///
    /// # Errors
    /// When the log is cut, or cannot get its name.
    pub fn keep(self, LogSummary { steps, missed, is_cut }: LogSummary) -> Result<(), SceneError> {
        let Self { file, path, .. } = self;
        let cut = |text: String| Err(SceneError::of_file(SceneErrorKind::Log, &path, text));
        let (shown, part) = (path.display(), file.part().display().to_string());
        match (is_cut, steps) {
            (false, 0) => Ok(file.discard()?),
            (false, _) => Ok(file.finish().map(drop)?),
            (true, 0) => {
                cut(format!("the log {shown} could not be written: none of {missed} steps are kept"))
            }
            (true, _) => cut(format!(
                "the log {shown} is incomplete: at least the first {steps} of {} steps are kept in {part}; `palpate recover {part} -o \
                 WHOLE.mcap` makes a whole file of them",
                steps + missed
            )),
        }
    }

    /// Tells of the first failure at once: the scene goes on without a log.
    fn watch<T>(&self, done: std::io::Result<T>) -> std::io::Result<T> {
        if let Err(error) = &done
            && self.failures.0.swap(false, Ordering::Relaxed)
        {
            (self.tell)(&format!("cannot write the log {}: {error}", self.path.display()));
        }
        done
    }
}

/// Creates the file of a log that grows. One that was left without a whole step is replaced.
///
/// # Errors
/// As [`PartFile::create`].
pub fn create_part(path: &Path, inputs: &[&Path]) -> Result<PartFile, ExportError> {
    match PartFile::create(path, inputs) {
        Err(ExportError::Unfinished { part, .. }) if !has_steps(&part) => {
            std::fs::remove_file(&part).map_err(|source| ExportError::Io {
                action: "remove",
                path: part,
                source,
            })?;
            PartFile::create(path, inputs)
        }
        created => created,
    }
}

/// Whether something can be read of an unfinished log; what is no log counts, too.
fn has_steps(part: &Path) -> bool {
    let Ok(bytes) = read_regular_file(part) else { return true };
    match LogReader::new(bytes) {
        Ok(log) => log.step_count() > 0,
        Err(error) => !matches!(error, palpate_haptics::Error::Log(LogError::NoWholeStep)),
    }
}

impl Write for GrowingLog {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let done = self.file.write(bytes);
        self.watch(done)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        let done = self.file.flush();
        self.watch(done)
    }
}

impl Seek for GrowingLog {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        let done = self.file.seek(to);
        self.watch(done)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use palpate::{Input, ModelParameters};
    use palpate_haptics::SceneNames;
    use palpate_haptics::log::LogWriter;
    use palpate_testkit::{free_block, model_and_state, object_at};
    use std::collections::BTreeMap;
    use std::io::Cursor;

    #[test]
    fn a_whole_log_without_steps_that_was_left_is_replaced() {
        let objects = vec![object_at(&free_block(), DVec3::ZERO, DVec3::ZERO)];
        let (model, state) = model_and_state(ModelParameters::default(), objects);
        let names = SceneNames { objects: vec!["body".into()], ..SceneNames::default() };
        let start = (&model, &state, &Input::default());
        let (_, writer) = LogWriter::new(Cursor::new(Vec::new()), names, BTreeMap::new(), &[], start)
            .expect("a log in memory");
        let written = writer.run(&AtomicBool::new(true));
        assert_eq!(written.failure, None);
        let folder = tempfile::tempdir().expect("a folder");
        let part = folder.path().join("run.mcap.part");
        std::fs::write(&part, written.sink.into_inner()).expect("a writable folder");
        assert!(!has_steps(&part));
        let file = create_part(&folder.path().join("run.mcap"), &[]).expect("a new log");
        assert_eq!(file.part(), part);
    }
}
