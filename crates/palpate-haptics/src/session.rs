//! Session: a run in real time, with the processes as threads.

use crate::attached_device::AttachedDevice;
use crate::clock::Clock;
use crate::cycle_channel::CycleSender;
use crate::device::DeviceSpec;
use crate::error::{Error, SessionError};
use crate::force_process::{ForceProcess, SceneMotion, StepListener};
use crate::haptic_update::{HapticUpdate, UpdateCounts};
use crate::log::{LogSender, LogSummary, LogWriter, WrittenLog};
use crate::motion_path::MotionPath;
use crate::playback::Playback;
use crate::port::{ForcePort, port};
use crate::safety_limits::RefusedMotions;
use crate::scheduling::{GrantedScheduling, Scheduling, steal_time_s};
use crate::snapshot::{Snapshot, SnapshotWriter, snapshot_buffer, steps_per_frame};
use crate::timing::{Cycle, DurationHistogram, Overrun, Timing};
use palpate::{Collider, ContactOutput, DeviceMode, Model, State};
use std::io::{Seek, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::{Builder, Scope, ScopedJoinHandle};
use std::time::{Duration, Instant};

/// Lead of the haptic updates over the force process.
const HEAD_START: Duration = Duration::from_millis(20);

/// Device of a session.
pub enum SessionDevice {
    /// Device of this process, with its own haptic update.
    Local(AttachedDevice),
    /// Device behind a link, or a pointer: its port.
    Remote(ForcePort, DeviceMode),
    /// No device: a path in simulated time, without force feedback; with a prescribed force its course.
    Path(MotionPath, DeviceMode),
}

/// Session: a scene with its devices and settings.
pub struct Session {
    /// Model of the scene.
    pub model: Arc<Model>,
    /// Initial state; `None` is the model's.
    pub state: Option<State>,
    /// Origin of all times.
    pub start: Instant,
    /// Devices, one for each of the model's.
    pub devices: Vec<SessionDevice>,
    /// Motion of the scene's parts.
    pub motion: SceneMotion,
    /// Number of steps; `None` runs until it is stopped.
    pub steps: Option<u64>,
    /// Rate of the deformation process [Hz]; 0 for none.
    pub frame_rate_hz: f64,
    /// Scheduling of the force process; haptic updates run at a priority lower by 10.
    pub scheduling: Scheduling,
    /// Silence of a device after which it is inactive [s].
    pub device_timeout_s: f64,
    /// Playback settings, shared with a viewer.
    pub playback: Arc<Playback>,
    /// Channel for the timing of the force process's cycles.
    pub cycles: Option<CycleSender>,
    /// Listener to every step.
    pub listener: Option<StepListener>,
}

/// Report of a session.
#[derive(Debug, Clone)]
pub struct Report {
    /// Granted scheduling of the force process.
    pub granted: GrantedScheduling,
    /// Timing of the force process.
    pub force: Timing,
    /// Compute time of the deformation process; its lateness is not measured.
    pub deformation: Timing,
    /// Reports of the devices, in the model's order; `None` for remote devices and paths.
    pub devices: Vec<Option<DeviceReport>>,
    /// Refused motions of the devices, in the model's order.
    pub refused_motions: Vec<RefusedMotions>,
    /// Final state.
    pub state: State,
    /// Number of steps.
    pub steps: u64,
    /// Steps with an unsolved island or dropped contacts.
    pub unsolved_steps: u64,
    /// Steps in which the budget of the contact solver was used up.
    pub steps_out_of_budget: u64,
    /// Largest penetration of each object's contacts over all steps [m].
    pub largest_penetration_m: Vec<f64>,
    /// Number of steps in which each device's tip touched something.
    pub touching_steps: Vec<u64>,
    /// Summary of the log; `None` if there is none.
    pub log: Option<LogSummary>,
    /// Wall-clock time of the steps [s].
    pub wall_s: f64,
    /// Steal time of the force process's core during the steps [s], see [`crate::steal_time_s`].
    pub steal_time_s: Option<f64>,
}

/// Report of a device.
#[derive(Debug, Clone)]
pub struct DeviceReport {
    /// Specification.
    pub spec: DeviceSpec,
    /// Counters of its haptic update.
    pub counts: UpdateCounts,
    /// Granted scheduling of its haptic update.
    pub granted: GrantedScheduling,
    /// Timing of its haptic update.
    pub timing: Timing,
    /// Latency from a motion to an effort that replies to it.
    pub motion_to_force: DurationHistogram,
    /// First failure of the device.
    pub failure: Option<Error>,
}

/// Guard that sets flags when it is dropped.
struct SetWhenDropped<'a>(&'a [AtomicBool; 2]);

impl Drop for SetWhenDropped<'_> {
    fn drop(&mut self) {
        self.0.iter().for_each(|flag| flag.store(true, Ordering::Release));
    }
}

/// Result of the force process's thread.
struct ForceResult {
    process: ForceProcess,
    granted: GrantedScheduling,
    timing: Timing,
    unsolved_steps: u64,
    steps_out_of_budget: u64,
    largest_penetration_m: Vec<f64>,
    touching_steps: Vec<u64>,
    wall_s: f64,
    steal_time_s: Option<f64>,
    missed_records: u64,
}

impl Session {
    /// Runs until the steps are done or `stop` is set. `steps` follows the number of steps. `show` is called with new snapshots at
    /// the frame rate, on the deformation process's thread. Returns the report, and the log as far as it was written: one that
    /// fails does not end the session.
    ///
    /// # Errors
    /// If a setting is invalid, or a thread can't be started.
    pub fn run<W: Write + Seek + Send>(
        self,
        log: Option<(LogSender, LogWriter<W>)>,
        stop: &AtomicBool,
        steps: &AtomicU64,
        mut show: impl FnMut(&Snapshot) + Send,
    ) -> Result<(Report, Option<WrittenLog<W>>), Error> {
        self.check()?;
        let Self { model, start, devices, motion, frame_rate_hz, scheduling, .. } = self;
        let (step_limit, device_timeout_s) = (self.steps, self.device_timeout_s);
        let (playback, cycles) = (self.playback, self.cycles);
        let step_s = model.parameters().step_s;
        let paths: Vec<Option<MotionPath>> = devices.iter().map(SessionDevice::path).collect();
        let (updates, slots) = connect(devices);
        let state = self.state.unwrap_or_else(|| State::new(&model));
        let mut process = ForceProcess::from_state(state, model.clone(), slots, motion, device_timeout_s);
        for (device, path) in paths.into_iter().enumerate() {
            path.into_iter().for_each(|path| process.follow(device, path));
        }
        self.listener.into_iter().for_each(|listener| process.listen(listener));
        let (snapshot_writer, mut snapshots) =
            snapshot_buffer(&Snapshot::new(&model, process.state(), process.input()));
        let (log_sender, writer) = log.unzip();
        let flags = [AtomicBool::new(false), AtomicBool::new(false)];
        let [ended, logged] = &flags;
        std::thread::scope(|scope| {
            // Whichever way the scope is left, all threads end.
            let end_threads = SetWhenDropped(&flags);
            let ticks_per_frame =
                if frame_rate_hz > 0.0 { steps_per_frame(frame_rate_hz, step_s) } else { 0 };
            let writing = writer.map(|writer| spawn(scope, "log", move || writer.run(logged))).transpose()?;
            let is_local: Vec<bool> = updates.iter().map(Option::is_some).collect();
            let mut update_threads = Vec::new();
            for (update, rate_hz) in updates.into_iter().flatten() {
                let scheduling = Scheduling {
                    priority: scheduling.priority.map(|p| p.saturating_sub(10).max(1)),
                    core: None,
                };
                // Half a step out of phase: a motion is half a step old when it is used, and so is its effort.
                let clock = Clock::new(start, 1.0 / rate_hz).with_phase(0.5 * step_s);
                let run = move || run_haptic_update(update, &clock, scheduling, ended);
                update_threads.push(spawn(scope, "haptic update", run)?);
            }
            let clock = Clock::new(start, step_s);
            let force_loop = ForceLoop {
                process,
                clock,
                log_sender,
                snapshot_writer,
                ticks_per_frame,
                step_limit,
                stop,
                steps,
                playback,
                cycles,
            };
            let force_thread = spawn(scope, "force", move || force_loop.run(scheduling))?;
            let deformation_thread = spawn(scope, "deformation", move || {
                let mut timing = Timing::default();
                while frame_rate_hz > 0.0 && !ended.load(Ordering::Relaxed) {
                    let begun = Instant::now();
                    if let Some(snapshot) = snapshots.newest() {
                        show(snapshot);
                        let lateness = Duration::ZERO;
                        timing.record(Cycle { lateness, compute: begun.elapsed(), overrun: None });
                    }
                    std::thread::sleep(
                        Duration::from_secs_f64(0.5 / frame_rate_hz).saturating_sub(begun.elapsed()),
                    );
                }
                timing
            })?;
            let forces = join(force_thread, "force process");
            drop(end_threads);
            let forces = forces?;
            let mut updated = update_threads.into_iter().map(|thread| join(thread, "haptic update"));
            let devices: Result<Vec<_>, _> = is_local
                .into_iter()
                .map(|local| if local { updated.next().transpose() } else { Ok(None) })
                .collect();
            let deformation = join(deformation_thread, "deformation process")?;
            let written = writing.map(|thread| join(thread, "log")).transpose()?;
            let steps = forces.process.steps();
            let log = written.as_ref().map(|log| LogSummary {
                steps: log.steps,
                missed: log.failure.as_ref().map_or(forces.missed_records, |_| steps - log.steps),
                is_cut: log.failure.is_some(),
            });
            let report = Report {
                granted: forces.granted,
                force: forces.timing,
                deformation,
                devices: devices?,
                refused_motions: forces.process.refused_motions().collect(),
                steps,
                state: forces.process.into_state(),
                unsolved_steps: forces.unsolved_steps,
                steps_out_of_budget: forces.steps_out_of_budget,
                largest_penetration_m: forces.largest_penetration_m,
                touching_steps: forces.touching_steps,
                log,
                wall_s: forces.wall_s,
                steal_time_s: forces.steal_time_s,
            };
            Ok((report, written))
        })
    }

    /// Checks the settings, as [`Self::run`] does at first.
    ///
    /// # Errors
    /// If one is invalid.
    pub fn check(&self) -> Result<(), Error> {
        let step_s = self.model.parameters().step_s;
        if !(200e-6..=10e-3).contains(&step_s) {
            return Err(SessionError::Step { step_s }.into());
        }
        for device in &self.devices {
            let SessionDevice::Local(AttachedDevice { rate_hz, .. }) = device else { continue };
            if !(50.0..=5000.0).contains(rate_hz) {
                return Err(SessionError::DeviceRate { rate_hz: *rate_hz }.into());
            }
        }
        let (given, expected) = (self.devices.len(), self.model.parameters().devices.len());
        if given != expected {
            return Err(SessionError::DeviceCount { given, expected }.into());
        }
        Ok(())
    }
}

/// Loop of the force process's thread.
struct ForceLoop<'a> {
    process: ForceProcess,
    clock: Clock,
    log_sender: Option<LogSender>,
    snapshot_writer: SnapshotWriter,
    /// Ticks from one snapshot to the next; 0 for none.
    ticks_per_frame: u64,
    step_limit: Option<u64>,
    stop: &'a AtomicBool,
    steps: &'a AtomicU64,
    playback: Arc<Playback>,
    cycles: Option<CycleSender>,
}

impl ForceLoop<'_> {
    fn run(self, scheduling: Scheduling) -> ForceResult {
        let Self { mut process, clock, mut log_sender, mut snapshot_writer, ticks_per_frame, .. } = self;
        let Self { step_limit, stop, steps, playback, mut cycles, .. } = self;
        let granted = scheduling.apply();
        if let Some(cycles) = &mut cycles {
            cycles.send_granted(granted.clone());
        }
        process.warm_up();
        let steal_time = || steal_time_s(granted.core.clone().ok().flatten());
        let steal_time_before = steal_time();
        std::thread::sleep(HEAD_START);
        let mut timing = Timing::default();
        let (mut unsolved_steps, mut steps_out_of_budget) = (0, 0);
        let output = process.state().output();
        let mut largest_penetration_m = vec![0.0_f64; output.objects.len()];
        let mut touching_steps = vec![0; output.devices.len()];
        let period = clock.deadline(1) - clock.deadline(0);
        let mut tick = clock.next_after(0);
        let (mut frame_at, mut frame_step) = (tick, 0);
        let first_deadline = clock.deadline(tick);
        while step_limit.is_none_or(|limit| process.steps() < limit) && !stop.load(Ordering::Relaxed) {
            let lateness = clock.wait(tick);
            if !playback.is_due(tick) {
                // A run that pauses shows its last step.
                if playback.is_paused() && ticks_per_frame > 0 && frame_step < process.steps() {
                    frame_step = process.steps();
                    snapshot_writer.publish(process.steps(), process.input(), process.state());
                }
                tick = clock.next_after(tick);
                continue;
            }
            let begun = Instant::now();
            let output = process.cycle(clock.now_s());
            unsolved_steps +=
                u64::from(output.status.unsolved_islands > 0 || output.status.dropped_contacts > 0);
            steps_out_of_budget += u64::from(output.status.islands_out_of_budget > 0);
            for (largest, object) in largest_penetration_m.iter_mut().zip(&output.objects) {
                *largest = largest.max(object.penetration_m);
            }
            for (number, touching) in touching_steps.iter_mut().enumerate() {
                let touches = |contact: &ContactOutput| contact.against == Collider::Device(number);
                *touching += u64::from(output.contacts.iter().any(touches));
            }
            let frame_due = ticks_per_frame > 0 && (tick >= frame_at || playback.is_paused());
            if frame_due {
                (frame_at, frame_step) = (tick + ticks_per_frame, process.steps());
                snapshot_writer.publish(process.steps(), process.input(), process.state());
            }
            let compute = begun.elapsed();
            if let Some(log) = &mut log_sender {
                log.record_step(|record| {
                    (record.step, record.tick) = (process.steps(), tick);
                    (record.lateness, record.compute) = (lateness, compute);
                    record.capture(process.input(), process.state());
                });
                if frame_due {
                    log.record_frame(|record| {
                        record.step = process.steps();
                        record.capture(process.input(), process.state());
                    });
                }
            }
            steps.store(process.steps(), Ordering::Relaxed);
            // After an overrun, the next tick is the first whose deadline has not passed.
            let is_over = Instant::now() > clock.deadline(tick + 1);
            let next = if is_over { clock.next_after(tick) } else { tick + 1 };
            let overrun =
                is_over.then_some(Overrun { by_compute: compute > period, skipped: next - tick - 1 });
            let cycle = Cycle { lateness, compute, overrun };
            timing.record(cycle);
            if let Some(cycles) = &mut cycles {
                cycles.send(cycle);
            }
            tick = next;
        }
        let wall_s = Instant::now().saturating_duration_since(first_deadline).as_secs_f64();
        let steal_time_s = steal_time().zip(steal_time_before).map(|(after, before)| after - before);
        let missed_records = log_sender.map_or(0, |log| log.missed());
        ForceResult {
            process,
            granted,
            timing,
            unsolved_steps,
            steps_out_of_budget,
            largest_penetration_m,
            touching_steps,
            wall_s,
            steal_time_s,
            missed_records,
        }
    }
}

/// Runs a haptic update by the clock on the calling thread until `ended` is set, then commands zero force.
pub fn run_haptic_update(
    mut update: HapticUpdate,
    clock: &Clock,
    scheduling: Scheduling,
    ended: &AtomicBool,
) -> DeviceReport {
    let granted = scheduling.apply();
    let mut timing = Timing::default();
    let mut tick = clock.next_after(0);
    while !ended.load(Ordering::Relaxed) {
        let lateness = clock.wait(tick);
        let begun = Instant::now();
        update.cycle(clock.now_s());
        timing.record(Cycle { lateness, compute: begun.elapsed(), overrun: None });
        tick = clock.next_after(tick);
    }
    update.release(clock.now_s());
    DeviceReport {
        spec: update.spec(),
        counts: update.counts(),
        granted,
        timing,
        motion_to_force: update.motion_to_force().clone(),
        failure: update.failure().cloned(),
    }
}

/// Haptic updates of local devices with their rates [Hz], and the device slots of all for the force process.
type Connected = (Vec<Option<(HapticUpdate, f64)>>, Vec<(ForcePort, DeviceMode)>);

fn connect(devices: Vec<SessionDevice>) -> Connected {
    let one = |device: SessionDevice| match device {
        SessionDevice::Local(attached) => {
            let (device_port, force_port) = port();
            let (mode, rate_hz) = (attached.mode, attached.rate_hz);
            (Some((attached.update(device_port), rate_hz)), (force_port, mode))
        }
        SessionDevice::Remote(force_port, mode) => (None, (force_port, mode)),
        SessionDevice::Path(_, mode) => (None, (port().1, mode)),
    };
    devices.into_iter().map(one).unzip()
}

impl SessionDevice {
    fn path(&self) -> Option<MotionPath> {
        match self {
            Self::Path(path, _) => Some(path.clone()),
            Self::Local(_) | Self::Remote(..) => None,
        }
    }
}

fn spawn<'scope, T: Send + 'scope>(
    scope: &'scope Scope<'scope, '_>,
    name: &str,
    body: impl FnOnce() -> T + Send + 'scope,
) -> Result<ScopedJoinHandle<'scope, T>, Error> {
    let thread = Builder::new().name(format!("palpate {name}")).spawn_scoped(scope, body);
    thread.map_err(|e| Error::ThreadSpawn { purpose: name.to_string(), reason: e.to_string() })
}

fn join<T>(thread: ScopedJoinHandle<'_, T>, name: &str) -> Result<T, Error> {
    thread.join().map_err(|_| Error::ThreadPanic { purpose: name.to_string() })
}
