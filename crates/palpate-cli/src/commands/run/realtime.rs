//! A scene in real time: the processes of `palpate-haptics`, with devices that follow paths or are held by simulated or real
//! hands.

use super::realtime_report::{json, text};
use super::warnings::refuse;
use super::{Arguments, count_steps};
use crate::commands::guard::attach_guarded;
use crate::failure::Failure;
use crate::interrupt::stop_on_interrupt;
use crate::secret_file::read_secret_file;
use crate::terminal::{notify, print, print_json, warn_of_stores};
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use palpate::{DeviceMode, State};
use palpate_haptics::link::{LinkServer, Secret};
use palpate_haptics::log::{LogSender, LogWriter, WrittenLog};
use palpate_haptics::{DeformationProcess, DevicePort, Report, Scheduling, Session, SessionDevice, port};
use palpate_scene::{GrowingLog, Scene, SceneDevice, SceneLog, attach_path};
use std::io::IsTerminal;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Options of a run in real time.
#[derive(Args, Debug, Clone, Default)]
pub struct RealtimeArguments {
    /// Run in real time, with a force process, a deformation process and a haptic update per device
    #[arg(long)]
    pub realtime: bool,
    /// Write a log (MCAP) that `palpate replay` repeats bit for bit, and that Foxglove opens
    #[arg(long, value_name = "OUT.mcap")]
    pub log: Option<PathBuf>,
    /// Updates of each device per second [Hz]
    #[arg(long, value_name = "HZ", default_value_t = 1000.0, allow_negative_numbers = true)]
    pub device_rate: f64,
    /// Rate of the deformation process [Hz]; 0 for none
    #[arg(long, value_name = "HZ", default_value_t = 60.0, allow_negative_numbers = true)]
    pub pictures: f64,
    /// Core of the force process, from 0; by default the last one
    #[arg(long, value_name = "CORE")]
    pub core: Option<usize>,
    /// Address for devices with `linked = true`, which `palpate device` connects
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:7402")]
    pub listen: Option<SocketAddr>,
    /// File with the shared secret of the links; needed between machines
    #[arg(long, value_name = "FILE")]
    pub secret: Option<PathBuf>,
    /// Without passivity controllers
    #[arg(long)]
    pub not_passive: bool,
}

/// Real-time priority of the force process; the haptic updates have 10 less.
const PRIORITY: u8 = 80;

/// Interval of updates of the progress bar.
const UPDATE_INTERVAL: Duration = Duration::from_millis(200);

impl RealtimeArguments {
    /// Refuses options that need `--realtime`.
    pub(super) fn refuse(&self) -> Result<(), Failure> {
        let option = if self.log.is_some() {
            "--log"
        } else if self.core.is_some() {
            "--core"
        } else if self.secret.is_some() {
            "--secret"
        } else if self.not_passive {
            "--not-passive"
        } else {
            return Ok(());
        };
        Err(Failure(format!("{option} is of a run in real time: add --realtime")))
    }
}

/// Runs a scene in real time.
pub(super) fn run(scene: &Scene, arguments: &Arguments) -> Result<(), Failure> {
    let options = &arguments.realtime;
    if arguments.outputs.writes_files() {
        return Err(Failure(
            "--csv, --contacts, --vtu and --sound take time that a run in real time does not have: write a log with --log, and \
             get them from that with palpate replay"
                .to_string(),
        ));
    }
    if !(options.pictures >= 0.0 && options.pictures <= 1000.0) {
        return Err(Failure(format!("--pictures is {}, expected 0 to 1000", options.pictures)));
    }
    if let Some(device) = scene.devices.iter().find(|device| device.pointer) {
        return Err(super::pointer_without_page(&device.name));
    }
    // Devices without a path end with Ctrl-C only.
    let endless = arguments.duration.is_none() && scene.devices.iter().any(|device| device.path.is_none());
    let steps = if endless { None } else { Some(count_steps(scene, arguments)? as u64) };
    let log = options.log.as_deref().map(|path| begin_log(scene, path)).transpose()?;
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let start = Instant::now();
    let mut linked = Vec::new();
    let (rate, passivity) = (options.device_rate, !options.not_passive);
    let attach = |device: &SceneDevice| match (&device.real, &device.path) {
        (Some(real), _) => {
            let (attached, line) = attach_guarded(real, device.mode, rate, passivity)?;
            notify(&line);
            Ok(SessionDevice::Local(attached))
        }
        (None, Some(path)) if matches!(device.mode, DeviceMode::Force(_)) => {
            Ok(SessionDevice::Path(path.clone(), device.mode))
        }
        (None, Some(path)) => {
            let attached = attach_path(path.clone(), device.simulated, device.mode, rate, passivity);
            Ok(SessionDevice::Local(attached))
        }
        (None, None) => {
            let (device_port, force_port) = port();
            linked.push((device.name.clone(), device_port));
            Ok(SessionDevice::Remote(force_port.with_limits(device.motion_limits), device.mode))
        }
    };
    let devices: Result<Vec<_>, Failure> = scene.devices.iter().map(attach).collect();
    let devices = devices?;
    let server = listen(options, linked, (start, scene.model.parameters().step_s))?;
    let scheduling = Scheduling { priority: Some(PRIORITY), core: options.core.or(cores.checked_sub(1)) };
    let frame_rate_hz = options.pictures;
    let session = Session { steps, frame_rate_hz, ..scene.session(devices, start, scheduling) };
    let (report, written) = watch(session, log, steps)?;
    let links = server.map(|server| server.counts());
    // The report is printed whatever became of the log.
    let kept = match written.zip(report.log) {
        Some((written, summary)) => written.sink.keep(summary),
        None => Ok(()),
    };
    if arguments.outputs.json {
        print_json(&json(scene, &report, links))?;
    } else {
        print(&text(scene, &report, links, options.log.as_deref()))?;
    }
    kept?;
    refuse(arguments.strict, &scene.session_warnings(&report))
}

/// Begins a log that tells of its first failure at once.
fn begin_log(scene: &Scene, path: &Path) -> Result<(LogSender, LogWriter<GrowingLog>), Failure> {
    let content = SceneLog::new(scene, None);
    let tell = |text: &str| notify(&format!("warning: {text}. The run goes on without it."));
    let file = GrowingLog::create(path, &content.inputs(), Box::new(tell))?;
    let failures = file.failures();
    warn_of_stores(&content);
    let log = content.begin(file, &State::new(&scene.model))?;
    failures.tell();
    Ok(log)
}

/// Runs a session with a bar on a terminal, until it is done or interrupted.
fn watch(
    session: Session,
    log: Option<(LogSender, LogWriter<GrowingLog>)>,
    steps: Option<u64>,
) -> Result<(Report, Option<WrittenLog<GrowingLog>>), Failure> {
    let (stop, done) = (stop_on_interrupt(), AtomicU64::new(0));
    let over = AtomicBool::new(false);
    std::thread::scope(|scope| {
        if std::io::stderr().is_terminal() {
            scope.spawn(|| {
                let (bar, style) = match steps {
                    Some(steps) => {
                        (ProgressBar::new(steps), "{wide_bar} {pos}/{len} steps, {eta} left (Ctrl-C ends it)")
                    }
                    None => (ProgressBar::new_spinner(), "{spinner} {pos} steps (Ctrl-C ends it)"),
                };
                bar.set_style(
                    ProgressStyle::with_template(style).unwrap_or_else(|_| ProgressStyle::default_bar()),
                );
                while !over.load(Ordering::Relaxed) {
                    bar.set_position(done.load(Ordering::Relaxed));
                    std::thread::sleep(UPDATE_INTERVAL);
                }
                bar.finish_and_clear();
            });
        }
        let mut deformation = DeformationProcess::new(session.model.clone());
        let ran = session.run(log, stop, &done, |snapshot| {
            deformation.cycle(snapshot);
        });
        over.store(true, Ordering::Relaxed);
        Ok(ran?)
    })
}

/// Listens for linked devices, if there are any.
fn listen(
    options: &RealtimeArguments,
    ports: Vec<(String, DevicePort)>,
    clock: (Instant, f64),
) -> Result<Option<LinkServer>, Failure> {
    let Some(address) = options.listen.filter(|_| !ports.is_empty()) else { return Ok(None) };
    let names: Vec<&str> = ports.iter().map(|(name, _)| name.as_str()).collect();
    let text = format!(
        "waiting at {address} for {}: palpate device {} --connect {address} …",
        names.join(", "),
        names[0]
    );
    let server = LinkServer::new(address, &read_secret(options.secret.as_deref())?, ports, clock)?;
    notify(&text);
    Ok(Some(server))
}

/// Secret of a file; none without one.
pub fn read_secret(file: Option<&Path>) -> Result<Secret, Failure> {
    let Some(file) = file else { return Ok(Secret::none()) };
    let text = read_secret_file("the secret", file)?;
    Secret::new(&text).map_err(|error| Failure(format!("{}: {error}", file.display())))
}
