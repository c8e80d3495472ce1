//! `palpate serve`: a scene, live, in the browser; or logs.

mod access;
mod log_series;
mod scene_provider;

use crate::failure::Failure;
use crate::interrupt::stop_on_interrupt;
use crate::log_kind::is_log;
use crate::progress::CountBar;
use crate::standard_streams::{LOG_OUTPUT, SERVED, refuse};
use crate::terminal::warn_of_cut;
use access::AccessOptions;
use clap::Args;
use indicatif::ProgressBar;
use log_series::LogSeries;
use palpate_haptics::Scheduling;
use palpate_render::LogFramePlayer;
use palpate_scene::BUILT_IN_SCENES;
use palpate_viewer::{JobControl, Live, SceneProvider, ServedContent, ViewerScene};
use scene_provider::LibraryProvider;
use std::io::IsTerminal;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Show a scene in the browser and touch it with mouse, pen or fingers
///
/// The scene runs in real time, as `palpate run --realtime` does; the page shows it at display rate and its pointers are
/// devices: tips that nothing else moves, or, in scenes without any, four of a size that suits their objects. Without a scene file
/// there are built-in scenes. Logs of `palpate run --realtime --log`, and of `--log` here, are shown with a time line; two of them
/// side by side.
#[derive(Args, Debug, Clone)]
#[command(after_help = "For example:
  palpate serve                        # the built-in scenes
  palpate serve scene.toml
  palpate serve scene.toml --log run.mcap   # with a log of what you do
  palpate serve run.mcap               # a log; two logs: side by side
  palpate serve --listen 0.0.0.0:7400 --tls-cert cert.pem --tls-key key.pem   # for other machines, tablets and phones too")]
pub struct Arguments {
    /// A scene file, or one or two logs (.mcap); without one, the built-in scenes
    #[arg(value_name = "FILE", num_args = 0..=2)]
    files: Vec<PathBuf>,
    /// The built-in scene to begin with: bounce, shake, pinch, stack, ball, slab, liver, jelly, gripper, duck, bar, fork, bell
    #[arg(long, value_name = "ID", conflicts_with = "files")]
    scene: Option<String>,
    /// Server options
    #[command(flatten)]
    serving: Serving,
}

/// Options of the viewer's server.
#[derive(Args, Debug, Clone, Default)]
pub struct Serving {
    /// Access to the server
    #[command(flatten)]
    access: AccessOptions,
    /// Core of the force process, from 0; by default the last one
    #[arg(long, value_name = "CORE")]
    core: Option<usize>,
    /// Log the scene (MCAP), for palpate replay, render, export and serve. Each time that the scene restarts a new log begins:
    /// OUT.mcap, OUT-2.mcap, …
    #[arg(long, value_name = "OUT.mcap")]
    pub log: Option<PathBuf>,
    /// Cache folder of recordings [default: $XDG_CACHE_HOME/palpate or ~/.cache/palpate]
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
}

/// Frame rate of logs [Hz].
const LOG_FRAMES_HZ: f64 = 60.0;

/// Real-time priority of the force process.
const PRIORITY: u8 = 80;

/// Runs the command.
pub fn serve(arguments: &Arguments) -> Result<(), Failure> {
    let Arguments { files, scene, serving } = arguments;
    let given = files.iter().map(|file| ("what is served", Some(file.as_path()), SERVED));
    refuse(&given.chain([("--log", serving.log.as_deref(), LOG_OUTPUT)]).collect::<Vec<_>>())?;
    match files.as_slice() {
        [] => serve_built_in(serving, scene.as_deref().unwrap_or(BUILT_IN_SCENES[0].id)),
        logs if logs.iter().all(|file| is_log(file)) => match &serving.log {
            None => serve_logs(serving, logs),
            Some(_) => Err(Failure(format!(
                "--log is of a scene that runs, and {} is a log already: leave it out",
                logs[0].display()
            ))),
        },
        [file] => serve_live(serving, |provider| provider.open_file(file)),
        _ => Err(Failure("one scene is served at a time; of logs (.mcap) two can stand side by side".into())),
    }
}

fn serve_logs(serving: &Serving, paths: &[PathBuf]) -> Result<(), Failure> {
    let server = serving.access.bind()?;
    let read = |(number, path): (usize, &PathBuf)| LogFramePlayer::read(path, number, LOG_FRAMES_HZ);
    let logs: Result<Vec<LogFramePlayer>, _> = paths.iter().enumerate().map(read).collect();
    let logs = logs?;
    logs.iter().for_each(|log| warn_of_cut(log.log()));
    let frames = logs.iter().map(|log| log.frames.clone()).collect();
    let stop = stop_on_interrupt();
    std::thread::scope(|scope| {
        // The page reports a log that cannot be replayed, and shows the frames before.
        scope.spawn(|| logs.into_iter().for_each(|log| drop(log.compute(stop, &mut CountBar::steps()))));
        server.serve(ServedContent::Logs(frames))
    })
}

/// Serves the built-in scenes, beginning with one of them.
pub fn serve_built_in(serving: &Serving, id: &str) -> Result<(), Failure> {
    serve_live(serving, |provider| {
        let bar =
            if std::io::stderr().is_terminal() { ProgressBar::new_spinner() } else { ProgressBar::hidden() };
        let mut shown = String::new();
        let mut report = |what: &str, _| {
            if shown != what {
                shown = what.into();
                bar.set_message(format!("recording (once): {what}"));
                bar.tick();
            }
        };
        let opened =
            provider.open(id, JobControl { report: &mut report, cancelled: &AtomicBool::new(false) });
        bar.finish_and_clear();
        opened.map_err(|e| Failure(e.to_string()))
    })
}

fn serve_live(
    serving: &Serving,
    first: impl FnOnce(&LibraryProvider) -> Result<ViewerScene, Failure>,
) -> Result<(), Failure> {
    // First what fails fast: a file that cannot be written, a port that is taken.
    let logs = serving.log.as_deref().map(LogSeries::new).transpose()?;
    let provider = LibraryProvider::new(serving.cache.as_deref(), logs.clone())?;
    let server = serving.access.bind()?;
    let first = first(&provider)?;
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let core = serving.core.or(cores.checked_sub(1));
    let scheduling = Scheduling { priority: Some(PRIORITY), core };
    let live = Live { provider: Arc::new(provider), first, scheduling };
    server.serve(ServedContent::Live(Box::new(live)))?;
    logs.map_or(Ok(()), |logs| logs.end())
}
