//! Logs that are written: what one carries along of its scene, and one after the other of scenes that are served.

use crate::Failure;
use crate::scene_file::Scene;
use crate::whole_file::{WholeFile, check_target, check_writable};
use palpate::{Input, Model, State};
use palpate_haptics::log::{LogSender, LogSummary, LogWriter, Names};
use palpate_viewer::{LogFile, LogOpener, PageNotifier};
use std::collections::BTreeMap;
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// What logs of a scene tell of it.
pub struct LoggedScene {
    model: Arc<Model>,
    names: Names,
    input: Input,
    /// The files that it was read from, itself first.
    inputs: Vec<PathBuf>,
    /// Its text, where that is not its file's.
    text: Option<String>,
}

impl LoggedScene {
    /// A scene of a file, or of a text that stands for it.
    pub fn new(scene: &Scene, text: Option<String>) -> Self {
        Self {
            model: scene.model.clone(),
            names: scene.names(),
            input: scene.input_at(0.0),
            inputs: scene.inputs.clone(),
            text,
        }
    }

    fn inputs(&self) -> Vec<&Path> {
        self.inputs.iter().map(PathBuf::as_path).collect()
    }

    /// Begin a log in a file that takes its name when it is finished.
    pub fn begin(&self, path: &Path, state: &State) -> Result<(LogSender, LogWriter<WholeFile>), Failure> {
        self.begin_in(WholeFile::create(path, &self.inputs())?, state)
    }

    fn begin_in<W: Write + Seek>(
        &self,
        file: W,
        state: &State,
    ) -> Result<(LogSender, LogWriter<W>), Failure> {
        let facts = BTreeMap::from([
            (
                "scene".to_string(),
                self.inputs.first().map(|path| path.display().to_string()).unwrap_or_default(),
            ),
            ("step_s".to_string(), format!("{:?}", self.model.parameters().step_s)),
            ("version".to_string(), env!("CARGO_PKG_VERSION").to_string()),
        ]);
        let start = (&*self.model, state, &self.input);
        Ok(LogWriter::new(file, self.names.clone(), facts, &self.files()?, start)?)
    }

    /// The files that it carries, by their names.
    fn files(&self) -> Result<Vec<(String, Vec<u8>)>, Failure> {
        let mut files: Vec<(String, Vec<u8>)> = Vec::new();
        for (at, input) in self.inputs.iter().enumerate() {
            let name = input.display().to_string();
            if input.is_dir() {
                crate::tell(&format!(
                    "warning: {name} is not taken into the log: a replay needs it where it is"
                ));
            } else if !files.iter().any(|(known, _)| *known == name) {
                let bytes = match &self.text {
                    Some(text) if at == 0 => text.clone().into_bytes(),
                    _ => std::fs::read(input).map_err(|e| Failure::file("read", input, &e))?,
                };
                files.push((name, bytes));
            }
        }
        Ok(files)
    }
}

/// Logs of scenes that are served: one for each time that a scene begins anew, `OUT.mcap`, `OUT-2.mcap`, ….
pub struct LogSeries {
    path: PathBuf,
    so_far: Mutex<SoFar>,
}

#[derive(Default)]
struct SoFar {
    written: usize,
    /// Why one could not be written.
    failure: Option<String>,
}

impl LogSeries {
    /// With the first log there.
    pub fn new(path: &Path) -> Result<Arc<Self>, Failure> {
        check_writable(path, &[])?;
        Ok(Arc::new(Self { path: path.to_path_buf(), so_far: Mutex::default() }))
    }

    fn lock(&self) -> MutexGuard<'_, SoFar> {
        self.so_far.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Where the next log goes. Only the first one may replace a file: nobody has named the others.
    fn next(&self) -> PathBuf {
        let written = self.lock().written;
        if written == 0 {
            return self.path.clone();
        }
        let mut names = (written + 1..).map(|number| numbered(&self.path, number));
        names.find(|path| !path.exists()).unwrap_or_else(|| self.path.clone())
    }

    /// What begins logs of a scene.
    pub fn opener(self: &Arc<Self>, scene: LoggedScene) -> Result<LogOpener, Failure> {
        check_target(&self.path, &scene.inputs())?;
        let series = self.clone();
        Ok(Arc::new(move |state, pages| {
            let path = series.next();
            let begun = Arc::new(AtomicBool::new(false));
            let file = WholeFile::create(&path, &scene.inputs()).map(|file| SeriesFile {
                file,
                path: path.clone(),
                step_s: scene.model.parameters().step_s,
                series: series.clone(),
                pages,
                begun: begun.clone(),
                failed: false,
            });
            let log = file.and_then(|file| {
                let log = scene.begin_in(Box::new(file) as Box<dyn LogFile>, state);
                log.map_err(|failure| Failure(format!("{}: {failure}", path.display())))
            });
            begun.store(true, Ordering::Relaxed);
            log.map_err(|failure| {
                series.note_failure(&failure.0);
                failure.0
            })
        }))
    }

    fn note_failure(&self, text: &str) {
        crate::tell(&format!("warning: {text}"));
        self.lock().failure.get_or_insert_with(|| text.to_string());
    }

    /// Whether all were written.
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

/// A log of a series.
struct SeriesFile {
    file: WholeFile,
    path: PathBuf,
    step_s: f64,
    series: Arc<LogSeries>,
    pages: PageNotifier,
    /// Until then whoever begins it tells what fails.
    begun: Arc<AtomicBool>,
    failed: bool,
}

impl SeriesFile {
    /// Tell of the first failure at once: the scene goes on, and nobody would know.
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
            crate::tell(&format!("log {path}: no step was made, so it is not kept"));
            return;
        }
        if let Err(failure) = file.finish() {
            series.note_failure(&failure.0);
            return;
        }
        series.lock().written += 1;
        let late = if missed == 0 {
            String::new()
        } else {
            format!("; the disk was too slow for {missed} more, and a replay ends where the first is missing")
        };
        crate::tell(&format!("log {path}: {steps} steps, {:.3} s{late}", steps as f64 * step_s));
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
