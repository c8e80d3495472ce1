//! A scene in real time: the processes of `palpate-haptics`, with devices that follow the scene's paths or are held by
//! simulated hands.

use super::{Arguments, count_steps};
use crate::Failure;
use crate::scene_file::{Scene, SceneDevice};
use crate::verbs::{print, print_json};
use crate::whole_file::{WholeFile, stop_on_interrupt};
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use palpate::{Pose, State};
use palpate_haptics::device::{Device, Mount, Scripted, Simulated};
use palpate_haptics::link::{LinkCounts, LinkServer, Secret};
use palpate_haptics::log::{LogHand, LogWriter, Names};
use palpate_haptics::{
    Attached, DevicePort, DeviceReport, MotionPath, Mover, Percentiles, Report, SafetyLimits, Scheduling,
    Session, SessionDevice, Timing, port,
};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::io::IsTerminal;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// How a run in real time goes.
#[derive(Args, Debug, Clone, Default)]
pub struct RealtimeArguments {
    /// Run by the clock, with a force process, a deformation process and a haptic update for each device
    #[arg(long)]
    pub realtime: bool,
    /// Write a log (MCAP) that `palpate replay` repeats bit for bit, and that Foxglove opens
    #[arg(long, value_name = "OUT.mcap")]
    pub log: Option<PathBuf>,
    /// Updates of each device per second [Hz]
    #[arg(long, value_name = "HZ", default_value_t = 1000.0, allow_negative_numbers = true)]
    pub device_rate: f64,
    /// Pictures per second that the deformation process makes; 0 for none
    #[arg(long, value_name = "HZ", default_value_t = 60.0, allow_negative_numbers = true)]
    pub pictures: f64,
    /// The core that the force process stays on, counted from 0; by default the last one
    #[arg(long, value_name = "CORE")]
    pub core: Option<usize>,
    /// Where devices with `linked = true` are waited for, which `palpate device` brings
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:7402")]
    pub listen: Option<SocketAddr>,
    /// A file with the secret that both ends of a link know; needed between machines
    #[arg(long, value_name = "FILE")]
    pub secret: Option<PathBuf>,
    /// Leave the passivity controllers out
    #[arg(long)]
    pub not_passive: bool,
}

/// Real-time priority of the force process; the haptic updates have 10 less.
const PRIORITY: u8 = 80;

/// A device that has told nothing for so long [s] is away.
const PATIENCE_S: f64 = 0.1;

/// Between two looks at how far a run is.
const LOOK: Duration = Duration::from_millis(200);

impl RealtimeArguments {
    /// Options that mean nothing without `--realtime`.
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

/// Run a scene by the clock.
pub(super) fn run(scene: &Scene, arguments: &Arguments) -> Result<(), Failure> {
    let options = &arguments.realtime;
    if arguments.outputs.writes_files() {
        return Err(Failure(
            "--csv, --contacts and --vtu take time that a run in real time does not have: write a log with --log, and \
             get them from that with palpate replay"
                .to_string(),
        ));
    }
    if !(options.pictures >= 0.0 && options.pictures <= 1000.0) {
        return Err(Failure(format!("--pictures is {}, expected 0 to 1000", options.pictures)));
    }
    let steps = count_steps(scene, arguments)?;
    let names = Names {
        objects: scene.object_names.clone(),
        devices: scene.devices.iter().map(|device| device.name.clone()).collect(),
        obstacles: scene.obstacles.iter().map(|obstacle| obstacle.name.clone()).collect(),
    };
    let log = options.log.as_deref().map(|path| begin_log(scene, arguments, path, names)).transpose()?;
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let start = Instant::now();
    let mut linked = Vec::new();
    let mut seat = |device: &SceneDevice| match &device.path {
        Some(path) => SessionDevice::Here(attach(device, path, options)),
        None => {
            let (device_port, force_port) = port();
            linked.push((device.name.clone(), device_port));
            SessionDevice::Linked(force_port, device.mode)
        }
    };
    let devices = scene.devices.iter().map(&mut seat).collect();
    let server = listen(options, linked, start)?;
    let session = Session {
        model: scene.model.clone(),
        start,
        devices,
        movers: movers(scene),
        steps: Some(steps as u64),
        pictures_hz: options.pictures,
        scheduling: Scheduling { priority: Some(PRIORITY), core: options.core.or(cores.checked_sub(1)) },
        patience_s: PATIENCE_S,
    };
    let (report, file) = watch(session, log, steps)?;
    let links = server.map(|server| server.counts());
    if let Some(file) = file {
        file.finish()?;
    }
    if arguments.outputs.json {
        print_json(&json(scene, &report, links))
    } else {
        print(&text(scene, &report, links, options.log.as_deref()))
    }
}

/// Run with a bar on a terminal, until it is done or interrupted.
fn watch(
    session: Session,
    log: Option<(LogHand, LogWriter<WholeFile>)>,
    steps: usize,
) -> Result<(Report, Option<WholeFile>), Failure> {
    let (stop, done) = (stop_on_interrupt(), AtomicU64::new(0));
    let over = AtomicBool::new(false);
    std::thread::scope(|scope| {
        if std::io::stderr().is_terminal() {
            scope.spawn(|| {
                let style =
                    ProgressStyle::with_template("{wide_bar} {pos}/{len} steps, {eta} left (Ctrl-C ends it)");
                let bar = ProgressBar::new(steps as u64);
                bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
                while !over.load(Ordering::Relaxed) {
                    bar.set_position(done.load(Ordering::Relaxed));
                    std::thread::sleep(LOOK);
                }
                bar.finish_and_clear();
            });
        }
        let ran = session.run(log, stop, &done, |_| ());
        over.store(true, Ordering::Relaxed);
        ran.map_err(Failure::from)
    })
}

/// Listen for the devices that come over links, if there are any.
fn listen(
    options: &RealtimeArguments,
    ports: Vec<(String, DevicePort)>,
    start: Instant,
) -> Result<Option<LinkServer>, Failure> {
    let Some(address) = options.listen.filter(|_| !ports.is_empty()) else { return Ok(None) };
    let names: Vec<&str> = ports.iter().map(|(name, _)| name.as_str()).collect();
    let text = format!(
        "waiting at {address} for {}: palpate device {} --connect {address} …",
        names.join(", "),
        names[0]
    );
    let server = LinkServer::new(address, &read_secret(options.secret.as_deref())?, ports, start)?;
    crate::tell(&text);
    Ok(Some(server))
}

/// The secret in a file; none without one.
pub fn read_secret(file: Option<&Path>) -> Result<Secret, Failure> {
    let Some(file) = file else { return Ok(Secret::none()) };
    let text = std::fs::read_to_string(file).map_err(|e| Failure::file("read the secret", file, &e))?;
    Secret::new(&text).map_err(|error| Failure(format!("{}: {error}", file.display())))
}

fn attach(device: &SceneDevice, path: &MotionPath, options: &RealtimeArguments) -> Attached {
    let driver: Box<dyn Device> = match device.simulated {
        Some((traits, hand)) => Box::new(Simulated::new(traits, hand, path.clone())),
        None => Box::new(Scripted::new(path.clone())),
    };
    let simulated = device.simulated.is_some();
    // A path feels nothing: whatever its force is, nobody has to be kept from it.
    let limits = if simulated {
        SafetyLimits { force_n: driver.traits().force_n, ..SafetyLimits::default() }
    } else {
        SafetyLimits { force_n: f64::MAX, slew_n_s: f64::MAX, speed_m_s: f64::MAX, ..SafetyLimits::default() }
    };
    Attached {
        device: driver,
        mode: device.mode,
        mount: Mount::default(),
        rate_hz: options.device_rate,
        limits,
        passive: simulated && !options.not_passive,
        by_button: false,
    }
}

fn movers(scene: &Scene) -> Vec<Mover> {
    let one = |obstacle: &crate::scene_file::SceneObstacle| -> Mover {
        let obstacle = obstacle.clone();
        Box::new(move |t: f64| -> Pose { obstacle.at(t) })
    };
    scene.obstacles.iter().map(one).collect()
}

fn begin_log(
    scene: &Scene,
    arguments: &Arguments,
    path: &Path,
    names: Names,
) -> Result<(LogHand, LogWriter<WholeFile>), Failure> {
    let inputs: Vec<&Path> = scene.inputs.iter().map(PathBuf::as_path).collect();
    let file = WholeFile::create(path, &inputs)?;
    let mut files = Vec::new();
    for input in &scene.inputs {
        let name = input.display().to_string();
        if input.is_dir() {
            crate::tell(&format!("warning: {name} is not taken into the log: a replay needs it where it is"));
        } else if !files.iter().any(|(known, _)| *known == name) {
            files.push((name, std::fs::read(input).map_err(|e| Failure::file("read", input, &e))?));
        }
    }
    let facts = BTreeMap::from([
        ("scene".to_string(), arguments.scene.display().to_string()),
        ("step_s".to_string(), format!("{:?}", scene.model.parameters().step_s)),
        ("version".to_string(), env!("CARGO_PKG_VERSION").to_string()),
    ]);
    let state = State::new(&scene.model);
    let input = super::input_at(scene, 0.0);
    Ok(LogWriter::new(file, names, facts, &files, (&scene.model, &state, &input))?)
}

/// Percentiles [µs] for a program.
pub fn percentiles(of: Percentiles) -> Value {
    json!({ "p50": of.p50, "p99": of.p99, "p999": of.p999, "max": of.max })
}

/// How a process kept its time, for a program.
pub fn timing(of: &Timing) -> Value {
    json!({
        "cycles": of.cycles(),
        "compute_us": percentiles(of.compute_us()),
        "lateness_us": percentiles(of.lateness_us()),
        "overruns": of.overruns,
        "own_overruns": of.own_overruns,
        "skipped": of.skipped,
    })
}

/// For a program.
fn json(scene: &Scene, report: &Report, links: Option<LinkCounts>) -> Value {
    let devices = scene.devices.iter().zip(&report.devices).map(|(device, own)| {
        let Some(own) = own else { return json!({ "name": device.name, "kind": "link" }) };
        let (counts, safety) = (own.counts, own.counts.safety);
        json!({
            "name": device.name,
            "kind": own.traits.kind,
            "force_max_n": counts.force_max_n,
            "given_j": counts.given_j,
            "updates": counts.updates,
            "failed": counts.failed,
            "timing": timing(&own.timing),
            "answer_us": percentiles(own.answers.percentiles_us()),
            "passivity": { "acted": counts.passivity_acted, "missing_max_j": counts.passivity_worst_j },
            "safety": {
                "clamped": safety.clamped,
                "slewed": safety.slewed,
                "stale": safety.stale,
                "too_fast": safety.too_fast,
                "not_finite": safety.not_finite,
                "trips": safety.trips,
            },
        })
    });
    let objects = scene.object_names.iter().zip(&report.output.objects);
    let objects =
        objects.map(|(name, object)| json!({ "name": name, "position_m": object.pose.position.to_array() }));
    json!({
        "steps": report.steps,
        "step_s": scene.model.parameters().step_s,
        "wall_s": report.wall_s,
        "granted": report.granted.to_string(),
        "force_process": timing(&report.force),
        "deformation_process": timing(&report.pictures),
        "unsolved_steps": report.unsolved,
        "devices": devices.collect::<Vec<_>>(),
        "objects": objects.collect::<Vec<_>>(),
        "links": links.map(|links| json!({
            "connected": links.connected,
            "refused": links.refused,
            "motions": links.motions,
            "old": links.old,
            "garbage": links.garbage,
        })),
        "log": report.log.map(|log| json!({ "steps": log.steps, "missed": log.missed })),
    })
}

/// The same for a person.
fn text(scene: &Scene, report: &Report, links: Option<LinkCounts>, log: Option<&Path>) -> String {
    let step_s = scene.model.parameters().step_s;
    let line = |name: &str, of: Percentiles| {
        format!("  {name:<22} {:>9.1} {:>9.1} {:>9.1} {:>9.1}\n", of.p50, of.p99, of.p999, of.max)
    };
    let mut out = format!(
        "{} steps at {:.0} Hz in {:.3} s; force process: {}\n\n  {:<22} {:>9} {:>9} {:>9} {:>9}\n",
        report.steps,
        1.0 / step_s,
        report.wall_s,
        report.granted,
        "µs",
        "median",
        "99 %",
        "99.9 %",
        "most"
    );
    out += &line("force: compute", report.force.compute_us());
    out += &line("force: lateness", report.force.lateness_us());
    if report.pictures.cycles() > 0 {
        out += &line("deformation: compute", report.pictures.compute_us());
    }
    let here = || {
        scene.devices.iter().zip(&report.devices).filter_map(|(device, own)| Some((device, own.as_ref()?)))
    };
    for (device, own) in here() {
        out += &line(&format!("{}: motion to force", device.name), own.answers.percentiles_us());
    }
    out += "\n";
    out += &overruns(report, step_s);
    for (device, own) in here() {
        out += &format!("  {:<12} {}\n", device.name, device_line(own));
    }
    if let Some(LinkCounts { connected, refused, motions, old, garbage }) = links {
        out += &format!(
            "  links        {connected} devices came, {refused} were refused; {motions} motions, {old} late or doubled, \
             {garbage} no motions\n"
        );
    }
    if report.unsolved > 0 {
        out += &format!(
            "  warning      in {} steps contacts could not be solved, or were left out\n",
            report.unsolved
        );
    }
    if let (Some(summary), Some(path)) = (report.log, log) {
        out += &format!("  log          {} steps in {}", summary.steps, path.display());
        if summary.missed > 0 {
            out += &format!(
                ", {} MISSED: the disk was too slow, a replay ends where they begin",
                summary.missed
            );
        }
        out += "\n";
    }
    out
}

/// What a device gave and met, in a line.
pub fn device_line(own: &DeviceReport) -> String {
    let (counts, safety) = (own.counts, own.counts.safety);
    let mut out = format!("{}, {:.4} N at most", own.traits.kind, counts.force_max_n);
    if own.traits.force_n.is_infinite() {
        return out;
    }
    out += &format!(
        "; gave the hand {:+.3e} J; passivity acted in {} of {} updates",
        counts.given_j, counts.passivity_acted, counts.updates
    );
    let faults = [
        (safety.clamped, "clamped"),
        (safety.slewed, "slewed"),
        (safety.stale, "stale"),
        (safety.too_fast, "too fast"),
        (safety.not_finite, "no number"),
        (safety.trips, "trips"),
        (counts.failed, "failed"),
    ];
    let met = faults.iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!("{count} {what}"));
    let met: Vec<String> = met.collect();
    out + &if met.is_empty() {
        "; safety met nothing".to_string()
    } else {
        format!("; safety: {}", met.join(", "))
    }
}

/// What became of cycles that were not done when the next was due.
fn overruns(report: &Report, step_s: f64) -> String {
    let Timing { overruns, own_overruns, skipped, .. } = report.force;
    if overruns == 0 {
        return "  overruns     none: every cycle was done before the next was due\n".to_string();
    }
    format!(
        "  overruns     {overruns} of {} cycles: {own_overruns} took longer than {:.3} ms by themselves, {} woke up late; \
         {skipped} ticks were passed over to be on the grid again\n",
        report.force.cycles(),
        1e3 * step_s,
        overruns - own_overruns
    )
}
