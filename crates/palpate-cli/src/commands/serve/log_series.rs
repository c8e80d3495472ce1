//! Logs of served scenes: one for each time that a scene begins anew.

use crate::failure::Failure;
use crate::terminal::{notify, warn_of_stores};
use palpate_export::{AtomicFile, check_target, check_writable};
use palpate_haptics::log::LogSummary;
use palpate_scene::SceneLog;
use palpate_viewer::{LogFile, LogOpener, PageNotifier};
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Series of logs `OUT.mcap`, `OUT-2.mcap`, ….
pub struct LogSeries {
    path: PathBuf,
    so_far: Mutex<SoFar>,
}

#[derive(Default)]
struct SoFar {
    written: usize,
    /// First failure.
    failure: Option<String>,
}

impl LogSeries {
    /// Series whose first log has the given path.
    pub fn new(path: &Path) -> Result<Arc<Self>, Failure> {
        check_writable(path, &[])?;
        Ok(Arc::new(Self { path: path.to_path_buf(), so_far: Mutex::default() }))
    }

    fn lock(&self) -> MutexGuard<'_, SoFar> {
        self.so_far.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Path of the next log. Only the first may replace a file: nobody has named the others.
    fn next(&self) -> PathBuf {
        let written = self.lock().written;
        if written == 0 {
            return self.path.clone();
        }
        let mut names = (written + 1..).map(|number| numbered(&self.path, number));
        names.find(|path| !path.exists()).unwrap_or_else(|| self.path.clone())
    }

    /// Function that begins logs of a scene.
    pub fn opener(self: &Arc<Self>, scene: SceneLog) -> Result<LogOpener, Failure> {
        check_target(&self.path, &scene.inputs())?;
        let series = self.clone();
        Ok(Arc::new(move |state, pages| {
            let path = series.next();
            let begun = Arc::new(AtomicBool::new(false));
            let created = AtomicFile::create(&path, &scene.inputs()).map_err(Failure::from);
            let file = created.map(|file| SeriesFile {
                file,
                path: path.clone(),
                step_s: scene.step_s(),
                series: series.clone(),
                pages,
                begun: begun.clone(),
                failed: false,
            });
            let log = file.and_then(|file| {
                warn_of_stores(&scene);
                let log = scene.begin(Box::new(file) as Box<dyn LogFile>, state);
                log.map_err(|error| Failure(format!("{}: {error}", path.display())))
            });
            begun.store(true, Ordering::Relaxed);
            log.map_err(|failure| {
                series.note_failure(&failure.0);
                failure.0.into()
            })
        }))
    }

    fn note_failure(&self, text: &str) {
        notify(&format!("warning: {text}"));
        self.lock().failure.get_or_insert_with(|| text.to_string());
    }

    /// First failure of the series, if there was one.
    pub fn end(&self) -> Result<(), Failure> {
        self.lock().failure.take().map_or(Ok(()), |text| Err(Failure(text)))
    }
}

/// `OUT-2.mcap` of `OUT.mcap`.
fn numbered(path: &Path, number: usize) -> PathBuf {
    let mut name = path.file_stem().unwrap_or_default().to_os_string();
    name.push(format!("-{number}"));
    if let Some(ending) = path.extension() {
        name.push(".");
        name.push(ending);
    }
    path.with_file_name(name)
}

/// Log of a series.
struct SeriesFile {
    file: AtomicFile,
    path: PathBuf,
    step_s: f64,
    series: Arc<LogSeries>,
    pages: PageNotifier,
    /// Whether the log has begun; before that the opener reports failures.
    begun: Arc<AtomicBool>,
    failed: bool,
}

impl SeriesFile {
    /// Reports the first failure at once: the scene goes on without a log.
    fn watch<T>(&mut self, done: std::io::Result<T>) -> std::io::Result<T> {
        let silent = self.failed || !self.begun.load(Ordering::Relaxed);
        if let (Err(error), false) = (&done, silent) {
            self.failed = true;
            let text = format!("cannot write the log {}: {error}", self.path.display());
            self.series.note_failure(&text);
            (self.pages)(&format!("{text}. The scene goes on without it."));
        }
        done
    }
}

impl Write for SeriesFile {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let done = Write::write(&mut self.file, bytes);
        self.watch(done)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        let done = self.file.flush();
        self.watch(done)
    }
}

impl Seek for SeriesFile {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        let done = self.file.seek(to);
        self.watch(done)
    }
}

impl LogFile for SeriesFile {
    fn finish(self: Box<Self>, LogSummary { steps, missed }: LogSummary) {
        let Self { file, path, step_s, series, .. } = *self;
        let path = path.display();
        if steps == 0 {
            notify(&format!("log {path}: no step was made, so it is not kept"));
            return;
        }
        if let Err(error) = file.finish() {
            series.note_failure(&error.to_string());
            return;
        }
        series.lock().written += 1;
        let late = if missed == 0 {
            String::new()
        } else {
            format!("; the disk was too slow for {missed} more, and a replay ends where the first is missing")
        };
        notify(&format!("log {path}: {steps} steps, {:.3} s{late}", steps as f64 * step_s));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn further_logs_are_numbered_before_their_ending() {
        for (path, second) in
            [("run.mcap", "run-2.mcap"), ("a/b.c.mcap", "a/b.c-2.mcap"), ("/x/run", "/x/run-2")]
        {
            assert_eq!(numbered(Path::new(path), 2), Path::new(second));
        }
    }
}
