//! `palpate serve`: a scene, live, in the browser; or logs.

mod log_series;
mod scene_provider;

use crate::failure::Failure;
use crate::interrupt::stop_on_interrupt;
use crate::log_kind::is_log;
use crate::progress::CountBar;
use crate::terminal::{notify, warn_of_cut};
use clap::Args;
use indicatif::ProgressBar;
use log_series::LogSeries;
use palpate_haptics::Scheduling;
use palpate_render::LogFramePlayer;
use palpate_scene::BUILT_IN_SCENES;
use palpate_viewer::{Live, SceneProvider, ServedContent, Server, Settings, ViewerScene};
use scene_provider::LibraryProvider;
use std::io::IsTerminal;
use std::net::{Ipv4Addr, SocketAddr};
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::sync::Arc;

/// Show a scene in the browser and touch it with mouse, pen or fingers
///
/// The scene runs in real time, as `palpate run --realtime` does; the page shows it at display rate and its pointers are
/// devices. Scenes without `pointer = true` get four pointers of a size that suits their objects. Without a scene file
/// there are built-in scenes. Logs of `palpate run --realtime --log`, and of `--log` here, are shown with a time line; two of them
/// side by side.
#[derive(Args, Debug, Clone)]
#[command(after_help = "For example:
  palpate serve                        # the built-in scenes
  palpate serve scene.toml
  palpate serve scene.toml --log run.mcap   # with a log of what you do
  palpate serve run.mcap               # a log; two logs: side by side
  palpate serve --listen 0.0.0.0:7400 --token 4f0c9d2e71   # for other machines, tablets and phones too")]
pub struct Arguments {
    /// A scene file, or one or two logs (.mcap); without one, the built-in scenes
    #[arg(value_name = "FILE", num_args = 0..=2)]
    files: Vec<PathBuf>,
    /// The built-in scene to begin with: bounce, shake, pinch, stack, ball, slab
    #[arg(long, value_name = "ID", conflicts_with = "files")]
    scene: Option<String>,
    /// Server options
    #[command(flatten)]
    serving: Serving,
}

/// Options of the viewer's server.
#[derive(Args, Debug, Clone, Default)]
pub struct Serving {
    /// Address and port of the page [default: 127.0.0.1:7400, or a free port if that is taken]
    #[arg(long, value_name = "ADDRESS:PORT")]
    listen: Option<SocketAddr>,
    /// Secret for access from other machines; part of the printed address
    #[arg(long, value_name = "TEXT")]
    token: Option<String>,
    /// Do not open a browser
    #[arg(long)]
    no_browser: bool,
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

/// Default port.
const PORT: u16 = 7400;

/// Frame rate of logs [Hz].
const LOG_FRAMES_HZ: f64 = 60.0;

/// Real-time priority of the force process.
const PRIORITY: u8 = 80;

/// Runs the command.
pub fn serve(arguments: &Arguments) -> Result<(), Failure> {
    let Arguments { files, scene, serving } = arguments;
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
    let server = serving.bind()?;
    let read = |(number, path): (usize, &PathBuf)| LogFramePlayer::read(path, number, LOG_FRAMES_HZ);
    let logs: Result<Vec<LogFramePlayer>, _> = paths.iter().enumerate().map(read).collect();
    let logs = logs?;
    logs.iter().for_each(|log| warn_of_cut(log.log()));
    let frames = logs.iter().map(|log| log.frames.clone()).collect();
    let stop = stop_on_interrupt();
    std::thread::scope(|scope| {
        // The page reports a log that cannot be replayed, and shows the frames before.
        scope.spawn(|| logs.into_iter().for_each(|log| drop(log.compute(stop, &mut CountBar::steps()))));
        serving.serve(server, ServedContent::Logs(frames))
    })
}

/// Serves the built-in scenes, beginning with one of them.
pub fn serve_built_in(serving: &Serving, id: &str) -> Result<(), Failure> {
    serve_live(serving, |provider| {
        let bar =
            if std::io::stderr().is_terminal() { ProgressBar::new_spinner() } else { ProgressBar::hidden() };
        let mut shown = String::new();
        let opened = provider.open(id, &mut |what, _| {
            if shown != what {
                shown = what.into();
                bar.set_message(format!("recording (once): {what}"));
                bar.tick();
            }
        });
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
    let server = serving.bind()?;
    let first = first(&provider)?;
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let core = serving.core.or(cores.checked_sub(1));
    let scheduling = Scheduling { priority: Some(PRIORITY), core };
    let live = Live { provider: Arc::new(provider), first, scheduling };
    serving.serve(server, ServedContent::Live(Box::new(live)))?;
    logs.map_or(Ok(()), |logs| logs.end())
}

impl Serving {
    fn settings(&self, listen: SocketAddr) -> Settings {
        Settings { listen, token: self.token.clone() }
    }

    /// Binds the given address, or the default port, or a free one.
    pub fn bind(&self) -> Result<Server, Failure> {
        if let Some(listen) = self.listen {
            return Server::bind(&self.settings(listen)).map_err(|e| Failure(e.to_string()));
        }
        let here = |port| self.settings((Ipv4Addr::LOCALHOST, port).into());
        Server::bind(&here(PORT)).or_else(|_| Server::bind(&here(0))).map_err(|e| Failure(e.to_string()))
    }

    /// Prints the address, opens a browser, and serves until Ctrl-C.
    pub fn serve(&self, server: Server, content: ServedContent) -> Result<(), Failure> {
        let mut address = format!("http://{}/", server.address().map_err(|e| Failure(e.to_string()))?);
        if let Some(token) = &self.token {
            address += &format!("?token={token}");
        }
        // Before the address is printed: its reader may interrupt at once.
        let stop = stop_on_interrupt();
        notify(&format!("open {address} in a browser (Ctrl-C ends it)"));
        if !self.no_browser {
            open_browser(&address);
        }
        server.run(content, stop).map_err(|e| Failure(e.to_string()))
    }
}

/// Opens a browser where there is a screen.
fn open_browser(address: &str) {
    let screen = ["DISPLAY", "WAYLAND_DISPLAY"].iter().any(|name| std::env::var_os(name).is_some());
    let program = if cfg!(target_os = "macos") { "open" } else { "xdg-open" };
    if screen || cfg!(target_os = "macos") {
        let quiet = Command::new(program).arg(address).stdout(Stdio::null()).stderr(Stdio::null()).spawn();
        // The address is printed: a browser can be opened by hand.
        drop(quiet);
    }
}
