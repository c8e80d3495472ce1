//! Logs of served scenes: one for each time that a scene begins anew.

use crate::failure::Failure;
use crate::terminal::{notify, warn_of_stores};
use palpate_export::{check_target, part_of};
use palpate_haptics::log::LogSummary;
use palpate_scene::{GrowingLog, SceneLog, create_part};
use palpate_viewer::{LogFile, LogOpener};
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Series of logs `OUT.mcap`, `OUT-2.mcap`, ….
pub struct LogSeries {
    path: PathBuf,
    so_far: Mutex<SoFar>,
}

#[derive(Default)]
struct SoFar {
    /// Logs that are kept, whole or in part.
    kept: usize,
    /// First failure.
    failure: Option<String>,
}

impl LogSeries {
    /// Series whose first log has the given path.
    pub fn new(path: &Path) -> Result<Arc<Self>, Failure> {
        // An unfinished log of a run before is refused here, not when the scene runs.
        create_part(path, &[])?;
        Ok(Arc::new(Self { path: path.to_path_buf(), so_far: Mutex::default() }))
    }

    fn lock(&self) -> MutexGuard<'_, SoFar> {
        self.so_far.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Path of the next log. Only the first may replace a file: nobody has named the others.
    fn next(&self) -> PathBuf {
        let kept = self.lock().kept;
        if kept == 0 {
            return self.path.clone();
        }
        let mut names = (kept + 1..).map(|number| numbered(&self.path, number));
        names.find(|path| !path.exists() && !part_of(path).exists()).unwrap_or_else(|| self.path.clone())
    }

    /// Function that begins logs of a scene.
    pub fn opener(self: &Arc<Self>, scene: SceneLog) -> Result<LogOpener, Failure> {
        check_target(&self.path, &scene.inputs())?;
        let series = self.clone();
        Ok(Arc::new(move |state, pages| {
            let path = series.next();
            let teller = series.clone();
            let tell = move |text: &str| {
                teller.note_failure(text);
                pages(&format!("{text}. The scene goes on without it."));
            };
            let log = GrowingLog::create(&path, &scene.inputs(), Box::new(tell))
                .map_err(Failure::from)
                .and_then(|file| {
                    let failures = file.failures();
                    warn_of_stores(&scene);
                    let file = SeriesFile { file, step_s: scene.step_s(), series: series.clone() };
                    let log = scene.begin(Box::new(file) as Box<dyn LogFile>, state);
                    failures.tell();
                    log.map_err(|error| Failure(format!("{}: {error}", path.display())))
                });
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
    file: GrowingLog,
    step_s: f64,
    series: Arc<LogSeries>,
}

impl Write for SeriesFile {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.file.flush()
    }
}

impl Seek for SeriesFile {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        self.file.seek(to)
    }
}

impl LogFile for SeriesFile {
    fn finish(self: Box<Self>, summary: LogSummary) {
        let Self { file, step_s, series } = *self;
        let path = file.path().display().to_string();
        let LogSummary { steps, missed, is_cut } = summary;
        series.lock().kept += usize::from(steps > 0);
        if let Err(failure) = file.keep(summary) {
            series.note_failure(&failure.to_string());
        }
        if is_cut {
            return;
        }
        if steps == 0 {
            notify(&format!("log {path}: no step was made, so it is not kept"));
            return;
        }
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
