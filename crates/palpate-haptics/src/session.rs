//! A run in real time: the processes as threads.

use crate::clock::Clock;
use crate::device::{Device, Mount, Traits};
use crate::error::Error;
use crate::force_process::{ForceProcess, ObstacleTrajectory};
use crate::haptic_update::{HapticUpdate, UpdateCounts};
use crate::log::{LogSender, LogSummary, LogWriter};
use crate::motion_path::MotionPath;
use crate::passivity::PassivityController;
use crate::playback::Playback;
use crate::port::{DevicePort, ForcePort, port};
use crate::safety::{Safety, SafetyLimits};
use crate::scheduling::{GrantedScheduling, Scheduling, steal_time_s};
use crate::snapshot::{Snapshot, SnapshotWriter, snapshot_buffer};
use crate::timing::{Cycle, CycleSender, Spread, Timing};
use palpate::{DeviceMode, Model, State};
use std::io::{Seek, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::{Builder, Scope, ScopedJoinHandle};
use std::time::{Duration, Instant};

/// The devices begin this long before the force process.
const HEAD_START: Duration = Duration::from_millis(20);

/// A device with everything that its haptic update needs.
pub struct AttachedDevice {
    /// The driver.
    pub device: Box<dyn Device>,
    /// What it does in the scene.
    pub mode: DeviceMode,
    /// Where it is in the world.
    pub mount: Mount,
    /// How often it is updated [Hz].
    pub rate_hz: f64,
    /// What it may do to a hand.
    pub limits: SafetyLimits,
    /// Whether its port's energy is controlled.
    pub passive: bool,
    /// Whether it waits for a button before it gives force.
    pub by_button: bool,
}

/// A device of a session.
pub enum SessionDevice {
    /// On this machine, with a haptic update of its own.
    Here(AttachedDevice),
    /// Elsewhere, behind a link or under a pointer: this is its port.
    Linked(ForcePort, DeviceMode),
    /// Nobody's: it follows a path by simulated time, and feels nothing.
    Following(MotionPath, DeviceMode),
}

/// What to run.
pub struct Session {
    /// The scene.
    pub model: Arc<Model>,
    /// The state that it begins with; none is the scene at its start.
    pub state: Option<State>,
    /// From when all times count.
    pub start: Instant,
    /// A device for each of the model's.
    pub devices: Vec<SessionDevice>,
    /// A mover for each obstacle.
    pub movers: Vec<ObstacleTrajectory>,
    /// Steps after which it ends; none goes on until it is stopped.
    pub steps: Option<u64>,
    /// Pictures per second; 0 for none.
    pub pictures_hz: f64,
    /// What the force process asks of the system; haptic updates ask for a priority less.
    pub scheduling: Scheduling,
    /// A device that has told nothing for so long [s] is away.
    pub patience_s: f64,
    /// What those who watch ask for.
    pub playback: Arc<Playback>,
    /// Who listens to how the force process keeps its time.
    pub cycles: Option<CycleSender>,
}

/// How a run in real time went.
#[derive(Debug, Clone)]
pub struct Report {
    /// What the force process got from the system.
    pub granted: GrantedScheduling,
    /// How it kept its time.
    pub force: Timing,
    /// How long pictures took; lateness is not looked at.
    pub pictures: Timing,
    /// The devices, in the model's order; none for those behind links.
    pub devices: Vec<Option<DeviceReport>>,
    /// The scene at the end.
    pub state: State,
    /// Steps.
    pub steps: u64,
    /// Steps in which the contacts of some object could not be solved, or were left out.
    pub unsolved: u64,
    /// What was logged, if it could be.
    pub log: Option<LogSummary>,
    /// Wall-clock time [s] that the steps took.
    pub wall_s: f64,
    /// Of that what the machine below this one took from the force process's core, where the system tells, see
    /// [`crate::steal_time_s`].
    pub steal_time_s: Option<f64>,
}

/// How it went for a device.
#[derive(Debug, Clone)]
pub struct DeviceReport {
    /// What it is.
    pub traits: Traits,
    /// What its updates met.
    pub counts: UpdateCounts,
    /// What they got from the system.
    pub granted: GrantedScheduling,
    /// How they kept their time.
    pub timing: Timing,
    /// How long it took from a motion to an effort that answers it.
    pub answers: Spread,
    /// Why a reading or a push failed, the first time.
    pub failure: Option<Error>,
}

/// Sets flags when it goes.
struct SetWhenDropped<'a>(&'a [AtomicBool; 2]);

impl Drop for SetWhenDropped<'_> {
    fn drop(&mut self) {
        self.0.iter().for_each(|flag| flag.store(true, Ordering::Release));
    }
}

/// What the force process's thread gives back.
struct Forces {
    process: ForceProcess,
    granted: GrantedScheduling,
    timing: Timing,
    unsolved: u64,
    wall_s: f64,
    steal_time_s: Option<f64>,
    missed: u64,
}

impl Session {
    /// Run until the steps are done or `stop` is set. `show` gets what every picture takes, on the deformation process's
    /// thread; `steps` counts along. Gives back what the log was written to, or why it can't be: the scene goes on without it.
    ///
    /// # Errors
    /// When the setting is not one, or a thread can't be started.
    pub fn run<W: Write + Seek + Send>(
        self,
        log: Option<(LogSender, LogWriter<W>)>,
        stop: &AtomicBool,
        steps: &AtomicU64,
        mut show: impl FnMut(&Snapshot) + Send,
    ) -> Result<(Report, Option<Result<W, Error>>), Error> {
        self.check()?;
        let Self { model, start, devices, movers, steps: most, pictures_hz, scheduling, patience_s, .. } =
            self;
        let (playback, cycles) = (self.playback, self.cycles);
        let step_s = model.parameters().step_s;
        let follows: Vec<Option<MotionPath>> = devices.iter().map(SessionDevice::path).collect();
        let (updates, seats) = connect(devices);
        let state = self.state.unwrap_or_else(|| State::new(&model));
        let mut process = ForceProcess::from_state(state, model.clone(), seats, movers, patience_s);
        for (device, path) in follows.into_iter().enumerate() {
            path.into_iter().for_each(|path| process.follow(device, path));
        }
        let (snapshot_buffer, mut moments) =
            snapshot_buffer(&Snapshot::new(&model, process.state(), process.input()));
        let (hand, writer) = log.unzip();
        let flags = [AtomicBool::new(false), AtomicBool::new(false)];
        let [ended, logged] = &flags;
        std::thread::scope(|scope| {
            // However it ends, no thread goes on alone.
            let over = SetWhenDropped(&flags);
            let picture_every =
                if pictures_hz > 0.0 { (1.0 / (pictures_hz * step_s)).round().max(1.0) as u64 } else { 0 };
            let writing = writer.map(|writer| spawn(scope, "log", move || writer.run(logged))).transpose()?;
            let here: Vec<bool> = updates.iter().map(Option::is_some).collect();
            let mut updating = Vec::new();
            for (update, rate_hz) in updates.into_iter().flatten() {
                let asked = Scheduling {
                    priority: scheduling.priority.map(|p| p.saturating_sub(10).max(1)),
                    core: None,
                };
                // Between two steps: what is told then is half a step old when it is used, and the answer half a step later.
                let clock = Clock::new(start, 1.0 / rate_hz).later(0.5 * step_s);
                updating
                    .push(spawn(scope, "haptic update", move || run_update(update, &clock, asked, ended))?);
            }
            let clock = Clock::new(start, step_s);
            let parts = Running {
                process,
                clock,
                hand,
                snapshot_buffer,
                picture_every,
                most,
                stop,
                steps,
                playback,
                cycles,
            };
            let forcing = spawn(scope, "force", move || parts.run(scheduling))?;
            let seeing = spawn(scope, "deformation", move || {
                let mut timing = Timing::default();
                while pictures_hz > 0.0 && !ended.load(Ordering::Relaxed) {
                    let begun = Instant::now();
                    if let Some(moment) = moments.newest() {
                        show(moment);
                        timing.record(Cycle { late: Duration::ZERO, took: begun.elapsed(), overrun: None });
                    }
                    std::thread::sleep(
                        Duration::from_secs_f64(0.5 / pictures_hz).saturating_sub(begun.elapsed()),
                    );
                }
                timing
            })?;
            let forces = join(forcing, "force process");
            drop(over);
            let forces = forces?;
            let mut updated = updating.into_iter().map(|thread| join(thread, "haptic update"));
            let devices: Result<Vec<_>, _> = here
                .into_iter()
                .map(|here| if here { updated.next().transpose() } else { Ok(None) })
                .collect();
            let pictures = join(seeing, "deformation process")?;
            let written = writing.map(|thread| join(thread, "log").and_then(|written| written));
            let (steps, out) = match written {
                Some(Ok((steps, out))) => (Some(steps), Some(Ok(out))),
                Some(Err(error)) => (None, Some(Err(error))),
                None => (None, None),
            };
            let report = Report {
                granted: forces.granted,
                force: forces.timing,
                pictures,
                devices: devices?,
                steps: forces.process.steps(),
                state: forces.process.into_state(),
                unsolved: forces.unsolved,
                log: steps.map(|steps| LogSummary { steps, missed: forces.missed }),
                wall_s: forces.wall_s,
                steal_time_s: forces.steal_time_s,
            };
            Ok((report, out))
        })
    }

    fn check(&self) -> Result<(), Error> {
        let fail = |what: String| Err(Error::Setup(what));
        let step_s = self.model.parameters().step_s;
        if !(200e-6..=10e-3).contains(&step_s) {
            return fail(format!(
                "the step is {step_s} s: in real time it is 0.0002 s to 0.01 s (5 kHz to 100 Hz; hands want 1 kHz)"
            ));
        }
        for device in &self.devices {
            let SessionDevice::Here(AttachedDevice { rate_hz: rate, .. }) = device else { continue };
            if !(50.0..=5000.0).contains(rate) {
                return fail(format!("a device is to be updated at {rate} Hz, expected 50 to 5000"));
            }
        }
        if self.devices.len() != self.model.parameters().devices.len() {
            return fail(format!(
                "{} devices for a scene of {}",
                self.devices.len(),
                self.model.parameters().devices.len()
            ));
        }
        Ok(())
    }
}

/// The force process with everything around its cycle.
struct Running<'a> {
    process: ForceProcess,
    clock: Clock,
    hand: Option<LogSender>,
    snapshot_buffer: SnapshotWriter,
    /// Ticks.
    picture_every: u64,
    most: Option<u64>,
    stop: &'a AtomicBool,
    steps: &'a AtomicU64,
    playback: Arc<Playback>,
    cycles: Option<CycleSender>,
}

impl Running<'_> {
    fn run(self, scheduling: Scheduling) -> Forces {
        let Self {
            mut process, clock, mut hand, mut snapshot_buffer, picture_every, most, stop, steps, ..
        } = self;
        let (playback, mut cycles) = (self.playback, self.cycles);
        let granted = scheduling.claim();
        if let Some(cycles) = &mut cycles {
            cycles.begin(granted.clone());
        }
        process.warm_up();
        let stolen = || steal_time_s(granted.core.clone().ok().flatten());
        let stolen_before = stolen();
        std::thread::sleep(HEAD_START);
        let mut timing = Timing::default();
        let mut unsolved = 0;
        let period = clock.deadline(1) - clock.deadline(0);
        let mut tick = clock.next_after(0);
        let (mut picture_at, mut pictured_step) = (tick, 0);
        let begun_all = clock.deadline(tick);
        while most.is_none_or(|most| process.steps() < most) && !stop.load(Ordering::Relaxed) {
            let late = clock.wait(tick);
            if !playback.goes(tick) {
                // A run that pauses shows where.
                if playback.is_paused() && picture_every > 0 && pictured_step < process.steps() {
                    pictured_step = process.steps();
                    snapshot_buffer.show(process.steps(), process.input(), process.state());
                }
                tick = clock.next_after(tick);
                continue;
            }
            let begun = Instant::now();
            let output = process.cycle(clock.now_s());
            unsolved += u64::from(output.status.unsolved_islands > 0 || output.status.dropped_contacts > 0);
            let pictured = picture_every > 0 && (tick >= picture_at || playback.is_paused());
            if pictured {
                (picture_at, pictured_step) = (tick + picture_every, process.steps());
                snapshot_buffer.show(process.steps(), process.input(), process.state());
            }
            let took = begun.elapsed();
            if let Some(hand) = &mut hand {
                hand.take(|record| {
                    (record.step, record.tick, record.late, record.took) =
                        (process.steps(), tick, late, took);
                    record.take(process.input(), process.state());
                });
                if pictured {
                    hand.take_picture(|picture| {
                        picture.step = process.steps();
                        picture.take(process.input(), process.state());
                    });
                }
            }
            steps.store(process.steps(), Ordering::Relaxed);
            // On the grid again, whatever was missed.
            let over = Instant::now() > clock.deadline(tick + 1);
            let next = if over { clock.next_after(tick) } else { tick + 1 };
            let cycle = Cycle { late, took, overrun: over.then_some((took > period, next - tick - 1)) };
            timing.record(cycle);
            if let Some(cycles) = &mut cycles {
                cycles.tell(cycle);
            }
            tick = next;
        }
        let wall_s = Instant::now().saturating_duration_since(begun_all).as_secs_f64();
        let steal_time_s = stolen().zip(stolen_before).map(|(after, before)| after - before);
        let missed = hand.map_or(0, |hand| hand.missed());
        Forces { process, granted, timing, unsolved, wall_s, steal_time_s, missed }
    }
}

/// Update a device by the clock, on the thread that calls, until it has ended.
pub fn run_update(
    mut update: HapticUpdate,
    clock: &Clock,
    scheduling: Scheduling,
    ended: &AtomicBool,
) -> DeviceReport {
    let granted = scheduling.claim();
    let mut timing = Timing::default();
    let mut tick = clock.next_after(0);
    while !ended.load(Ordering::Relaxed) {
        let late = clock.wait(tick);
        let begun = Instant::now();
        update.cycle(clock.now_s());
        timing.record(Cycle { late, took: begun.elapsed(), overrun: None });
        tick = clock.next_after(tick);
    }
    update.let_go(clock.now_s());
    let answers = update.answers().clone();
    let failure = update.failure().cloned();
    DeviceReport { traits: update.traits(), counts: update.counts(), granted, timing, answers, failure }
}

/// A haptic update and its rate for every device that is here, and the seats of all in the force process.
type Connected = (Vec<Option<(HapticUpdate, f64)>>, Vec<(ForcePort, DeviceMode)>);

fn connect(devices: Vec<SessionDevice>) -> Connected {
    let one = |device: SessionDevice| match device {
        SessionDevice::Here(attached) => {
            let (device_port, force_port) = port();
            let (mode, rate_hz) = (attached.mode, attached.rate_hz);
            (Some((attached.update(device_port), rate_hz)), (force_port, mode))
        }
        SessionDevice::Linked(force_port, mode) => (None, (force_port, mode)),
        SessionDevice::Following(_, mode) => (None, (port().1, mode)),
    };
    devices.into_iter().map(one).unzip()
}

impl SessionDevice {
    fn path(&self) -> Option<MotionPath> {
        match self {
            Self::Following(path, _) => Some(path.clone()),
            Self::Here(_) | Self::Linked(..) => None,
        }
    }
}

impl AttachedDevice {
    /// Its haptic update, on a port: with a passivity controller if it is to be passive, and safety limits that its device
    /// bears.
    pub fn update(self, port: DevicePort) -> HapticUpdate {
        let Self { device, mount, rate_hz, limits, passive, by_button, .. } = self;
        let traits = device.traits();
        let controller =
            PassivityController::new(traits.mass_kg, traits.resolution_m * mount.scale, 1.0 / rate_hz);
        let safety = Safety::new(SafetyLimits { force_n: limits.force_n.min(traits.force_n), ..limits });
        HapticUpdate::new(device, port, mount, safety, passive.then_some(controller), by_button)
    }
}

fn spawn<'scope, T: Send + 'scope>(
    scope: &'scope Scope<'scope, '_>,
    name: &str,
    body: impl FnOnce() -> T + Send + 'scope,
) -> Result<ScopedJoinHandle<'scope, T>, Error> {
    let thread = Builder::new().name(format!("palpate {name}"));
    thread
        .spawn_scoped(scope, body)
        .map_err(|e| Error::Thread(format!("cannot start a thread for the {name}: {e}")))
}

fn join<T>(thread: ScopedJoinHandle<'_, T>, name: &str) -> Result<T, Error> {
    thread.join().map_err(|_| Error::Thread(format!("the thread of the {name} has ended by a bug")))
}
