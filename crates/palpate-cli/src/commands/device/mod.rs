//! `palpate device`: a local device for a scene in another process or on another machine.

mod real;

use crate::commands::guard::attach_guarded;
use crate::commands::run::{device_line, percentiles, read_secret, safety, timing};
use crate::failure::Failure;
use crate::interrupt::stop_on_interrupt;
use crate::terminal::{notify, print, print_json};
use clap::Args;
use palpate::DeviceMode;
use palpate_haptics::device::{DeviceSpec, Hand};
use palpate_haptics::link::{LinkClient, LinkState};
use palpate_haptics::{
    AttachedDevice, Clock, Columns, DeviceReport, MotionPath, SafetyLimits, Scheduling, run_haptic_update,
};
use palpate_scene::{attach_path, find_device_traits, find_grip, read_path};
use real::RealArguments;
use serde_json::json;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Connect a haptic device to a scene in another process or on another machine
///
/// The scene has a device of this name with `linked = true`, and runs with `palpate run SCENE --realtime`. This process reads the
/// device, sends its motion, and applies the force that comes back, within safety limits and passively. If the link breaks,
/// the force is removed at once; it returns with the link.
#[derive(Args, Debug, Clone)]
#[command(after_help = "On one machine:
  palpate run scene.toml --realtime --duration 60
  palpate device left --path left.csv --simulated touch
  palpate device left --driver haply --mount-position 0,-0.15,0.1 --mount-scale 2
Between machines, with a secret that both know:
  palpate run scene.toml --realtime --listen 0.0.0.0:7402 --secret secret.txt
  palpate device left --path left.csv --connect 192.168.1.20:7402 --secret secret.txt")]
pub struct Arguments {
    /// Name of the device in the scene
    pub name: String,
    /// Address of the scene
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:7402")]
    pub connect: SocketAddr,
    /// Motion path: t,x,y,z in s and m, world
    #[arg(long, value_name = "FILE.csv", required_unless_present = "driver")]
    pub path: Option<PathBuf>,
    /// Simulated device, in a simulated hand that tracks the path: touch, omega.3 or inverse3
    #[arg(long, value_name = "DEVICE")]
    pub simulated: Option<String>,
    /// Grip of the simulated hand: firm, light or fingertip
    #[arg(long, value_name = "GRIP", requires = "simulated")]
    pub grip: Option<String>,
    /// Real device
    #[command(flatten)]
    pub real: RealArguments,
    /// Safety limit: slew (N/s), step (N), speed (m/s), range (m), watchdog, motion_age, round_trip, ramp_up, ramp_down,
    /// recovery or hang (s), as in docs/realtime.md
    #[arg(long, value_name = "NAME=VALUE")]
    pub limit: Vec<String>,
    /// Updates per second [Hz]
    #[arg(long, value_name = "HZ", default_value_t = 1000.0, allow_negative_numbers = true)]
    pub rate: f64,
    /// Duration from the connection on [s]; by default to the end of the path, with a real device until Ctrl-C
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    pub duration: Option<f64>,
    /// Timeout of the connection [s]
    #[arg(long, value_name = "S", default_value_t = 30.0, allow_negative_numbers = true)]
    pub wait: f64,
    /// File with the shared secret of the link; needed between machines
    #[arg(long, value_name = "FILE")]
    pub secret: Option<PathBuf>,
    /// Without passivity controller
    #[arg(long)]
    pub not_passive: bool,
    /// One JSON object on standard output
    #[arg(long)]
    pub json: bool,
}

/// Real-time priority of the haptic update.
const PRIORITY: u8 = 70;

/// Interval of checks of the link.
const POLL_INTERVAL: Duration = Duration::from_millis(20);

/// Source of motion.
enum Source {
    Path(MotionPath, Option<(DeviceSpec, Hand)>),
    Real(Box<AttachedDevice>),
}

/// Runs the command.
pub fn device(arguments: &Arguments) -> Result<(), Failure> {
    if !(50.0..=5000.0).contains(&arguments.rate) {
        return Err(Failure(format!("--rate is {} Hz, expected 50 to 5000", arguments.rate)));
    }
    // The scene decides the mode.
    let (mode, rate, passivity) = (DeviceMode::Touch, arguments.rate, !arguments.not_passive);
    let limits = arguments.limits(SafetyLimits::default())?;
    let source = match (arguments.real.real(limits)?, &arguments.path) {
        (Some(real), _) => {
            let (attached, line) = attach_guarded(&real, mode, rate, passivity)?;
            notify(&line);
            Source::Real(Box::new(attached))
        }
        (None, Some(path)) => Source::Path(read_path(path, Columns::Position)?, simulated(arguments)?),
        (None, None) => {
            return Err(Failure("there is no --path and no --driver: one of them is needed".into()));
        }
    };
    let duration = duration(arguments, &source)?;
    let start = Instant::now();
    let secret = read_secret(arguments.secret.as_deref())?;
    let (port, client) = LinkClient::new(arguments.connect, &secret, &arguments.name, start)?;
    let stop = stop_on_interrupt();
    connect(&client, arguments, start, stop)?;
    // The path begins with the connection.
    let found = start.elapsed().as_secs_f64();
    let attached = match source {
        Source::Path(path, simulated) => {
            let attached = attach_path(path.delayed_by(found), simulated, mode, rate, passivity);
            AttachedDevice { limits: arguments.limits(attached.limits)?, ..attached }
        }
        Source::Real(attached) => *attached,
    };
    let update = attached.update(port);
    let (clock, ended) = (Clock::new(start, 1.0 / arguments.rate), AtomicBool::new(false));
    let scheduling = Scheduling { priority: Some(PRIORITY), core: None };
    let (report, linked) = std::thread::scope(|scope| {
        let updating = scope.spawn(|| run_haptic_update(update, &clock, scheduling, &ended));
        let linked = watch(&client, arguments, found + duration, start, stop);
        ended.store(true, Ordering::Relaxed);
        let report = updating.join().map_err(|_| Failure("the haptic update has ended by a bug".to_string()));
        (report, linked)
    });
    let (report, linked) = (report?, linked?);
    if arguments.json {
        print_json(&json(arguments, &report, linked))
    } else {
        print(&text_of(arguments, &report))
    }
}

impl Arguments {
    /// Limits, with those of the options in place of others.
    fn limits(&self, mut limits: SafetyLimits) -> Result<SafetyLimits, Failure> {
        for option in &self.limit {
            let named = option.split_once('=').and_then(|(name, value)| Some((name, value.parse().ok()?)));
            let (name, value) = named
                .ok_or_else(|| Failure(format!("--limit is {option:?}, expected NAME=VALUE, as speed=3")))?;
            limits.set(name, value).map_err(|what| Failure(format!("--limit: {what}")))?;
        }
        Ok(limits)
    }
}

/// Duration from the connection on [s].
fn duration(arguments: &Arguments, source: &Source) -> Result<f64, Failure> {
    let end = match source {
        Source::Path(path, _) => path.end(),
        Source::Real(_) if arguments.duration.is_none() => return Ok(f64::INFINITY),
        Source::Real(_) => f64::NAN,
    };
    let duration = arguments.duration.unwrap_or(end);
    if duration > 0.0 && duration < 1e8 {
        return Ok(duration);
    }
    Err(Failure(format!("the duration is {duration} s, expected above 0: --duration gives one")))
}

/// Simulated device and hand, if given.
fn simulated(arguments: &Arguments) -> Result<Option<(DeviceSpec, Hand)>, Failure> {
    let hand = arguments.grip.as_deref().map_or(Ok(Hand::FIRM), find_grip).map_err(Failure)?;
    let traits = arguments.simulated.as_deref().map(find_device_traits).transpose().map_err(Failure)?;
    Ok(traits.map(|traits| (traits, hand)))
}

/// Waits for the connection, also while the name is taken: whoever has it may leave.
fn connect(
    client: &LinkClient,
    arguments: &Arguments,
    start: Instant,
    stop: &AtomicBool,
) -> Result<(), Failure> {
    let Arguments { connect, name, wait, .. } = arguments;
    let mut was_taken = false;
    loop {
        let interrupted = stop.load(Ordering::Relaxed);
        let over = start.elapsed().as_secs_f64() >= *wait || wait.is_nan() || interrupted;
        let why = match client.state() {
            LinkState::Connected => {
                notify(&format!("linked to {connect} as {name}"));
                return Ok(());
            }
            LinkState::Taken(why) if interrupted => return Err(Failure(why)),
            LinkState::Taken(why) if over => {
                return Err(Failure(format!("{why}, also after {wait} s (--wait)")));
            }
            LinkState::Taken(why) => {
                if !std::mem::replace(&mut was_taken, true) {
                    notify(&format!("{why}: waiting for it"));
                }
                why
            }
            LinkState::Refused(why) => return Err(Failure(why)),
            LinkState::Connecting(why) => why,
        };
        if over {
            return Err(Failure(format!(
                "no scene was found at {connect} ({why}): start one with `palpate run SCENE.toml --realtime`, in which the \
                 device {name:?} has linked = true"
            )));
        }
        std::thread::sleep(POLL_INTERVAL);
    }
}

/// Reports changes of the link until the end; returns how long it was connected [s].
fn watch(
    client: &LinkClient,
    arguments: &Arguments,
    end_s: f64,
    start: Instant,
    stop: &AtomicBool,
) -> Result<f64, Failure> {
    let (mut last, mut linked) = (LinkState::Connected, 0.0);
    while start.elapsed().as_secs_f64() < end_s && !stop.load(Ordering::Relaxed) {
        let state = client.state();
        match &state {
            LinkState::Connected => linked += POLL_INTERVAL.as_secs_f64(),
            LinkState::Refused(why) => return Err(Failure(why.clone())),
            LinkState::Connecting(_) | LinkState::Taken(_) => {}
        }
        if last != state {
            notify(&match &state {
                LinkState::Connecting(why) | LinkState::Taken(why) => {
                    format!("looking for {}: {why}", arguments.connect)
                }
                _ => format!("linked to {} again", arguments.connect),
            });
        }
        last = state;
        std::thread::sleep(POLL_INTERVAL);
    }
    Ok(linked)
}

fn json(arguments: &Arguments, report: &DeviceReport, linked_s: f64) -> serde_json::Value {
    json!({
        "name": arguments.name,
        "kind": report.spec.kind,
        "linked_s": linked_s,
        "updates": report.counts.updates,
        "force_max_n": report.counts.force_max_n,
        "given_j": report.counts.work_on_hand_j,
        "failed": report.counts.failed,
        "safety": safety(&report.counts.safety),
        "failure": report.failure.as_ref().map(ToString::to_string),
        "granted": report.granted.to_string(),
        "timing": timing(&report.timing),
        "answer_us": percentiles(report.motion_to_force.percentiles_us()),
    })
}

fn text_of(arguments: &Arguments, report: &DeviceReport) -> String {
    let answers = report.motion_to_force.percentiles_us();
    format!(
        "{} updates at {:.0} Hz; {}\n  {:<12} {}\n  motion to force {:.0} µs median; 99 % below {:.0}, 99.9 % below {:.0}, all \
         below {:.0}\n",
        report.counts.updates,
        arguments.rate,
        report.granted,
        arguments.name,
        device_line(report),
        answers.p50,
        answers.p99,
        answers.p999,
        answers.max
    )
}
