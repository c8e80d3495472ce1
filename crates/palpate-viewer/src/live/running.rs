//! Running session of a live scene, with its pointer thread.

use super::channels::SceneChannels;
use super::sound::SoundThread;
use crate::error::SceneError;
use crate::pointers::{Pointers, SharedPointers, lock};
use crate::protocol::{FrameEncoder, ProcessTiming, ServerMessage, Status};
use crate::scene_provider::{OpenLog, ViewerDevice, ViewerScene};
use crate::scene_start::{DEVICE_TIMEOUT_S, FRAME_RATE_HZ};
use palpate::{DeviceInput, DeviceMode, Input, ObjectSnapshot, State};
use palpate_haptics::{
    Clock, CycleReceiver, DevicePort, Playback, Report, Scheduling, Session, SessionDevice, Snapshot, Timing,
    cycle_channel, port,
};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::{Builder, JoinHandle};
use std::time::Instant;

/// Update rate of the pointers [Hz].
const POINTER_RATE_HZ: f64 = 1000.0;

/// Capacity of the channel of cycle records: some seconds at 4 kHz.
const CYCLES: usize = 16_384;

/// Snapshot before the first step.
pub(super) fn initial_snapshot(scene: &ViewerScene, state: &State) -> Snapshot {
    let input = Input {
        devices: vec![DeviceInput::inactive(); scene.devices.len()],
        obstacles: (scene.motion)().obstacles.iter_mut().map(|pose| pose(0.0)).collect(),
        bases: vec![None; scene.model.recordings().count()],
        clamps: scene.model.parameters().clamps.iter().map(|clamp| clamp.frame).collect(),
        ..Input::default()
    };
    Snapshot::new(&scene.model, state, &input)
}

/// Opened devices of a scene.
pub(super) struct DeviceInputs {
    devices: Vec<SessionDevice>,
    /// Ports of the pointers, by device index.
    pointer_ports: Vec<(usize, DevicePort)>,
}

impl DeviceInputs {
    /// Opens the devices of a scene.
    pub fn open(scene: &ViewerScene) -> Result<Self, SceneError> {
        let mut pointer_ports = Vec::new();
        let open = |(index, device): (usize, &ViewerDevice)| match device {
            ViewerDevice::Pointer => {
                let (device_port, force_port) = port();
                pointer_ports.push((index, device_port));
                Ok(SessionDevice::Remote(force_port, DeviceMode::Touch))
            }
            ViewerDevice::Path(path, mode) => Ok(SessionDevice::Path(path.clone(), *mode)),
            ViewerDevice::Local(open) => open().map(SessionDevice::Local),
        };
        let devices = scene.devices.iter().enumerate().map(open).collect::<Result<_, SceneError>>()?;
        Ok(Self { devices, pointer_ports })
    }
}

/// Session and pointer thread of a scene.
pub(super) struct RunningScene {
    stop: Arc<AtomicBool>,
    steps: Arc<AtomicU64>,
    session: JoinHandle<Option<Vec<ObjectSnapshot>>>,
    pointer_thread: JoinHandle<()>,
    /// Ends with the scene.
    _sound: SoundThread,
    timing: Timing,
    cycle_receiver: CycleReceiver,
}

impl RunningScene {
    /// Starts the threads of a scene.
    pub fn start(
        scene: &ViewerScene,
        state: State,
        inputs: DeviceInputs,
        log: Option<OpenLog>,
        (mut encoder, generation): (FrameEncoder, u32),
        scheduling: Scheduling,
        channels: &SceneChannels,
    ) -> Result<Self, SceneError> {
        let (cycle_sender, cycle_receiver) = cycle_channel(CYCLES);
        let (sound, listener) =
            SoundThread::start((&scene.model, &state), generation, &channels.sound, &channels.playback)
                .map_err(SceneError::Thread)?;
        let start = Instant::now();
        let session = Session {
            model: scene.model.clone(),
            state: Some(state),
            start,
            devices: inputs.devices,
            motion: (scene.motion)(),
            steps: None,
            frame_rate_hz: FRAME_RATE_HZ,
            scheduling,
            device_timeout_s: DEVICE_TIMEOUT_S,
            playback: channels.playback.clone(),
            cycles: Some(cycle_sender),
            listener: Some(listener),
        };
        *lock(&channels.pointers) = Pointers::new(inputs.pointer_ports);
        let stop = Arc::new(AtomicBool::new(false));
        let steps = Arc::new(AtomicU64::new(0));
        let pointer_thread = {
            let (stop, pointers) = (stop.clone(), channels.pointers.clone());
            let clock = Clock::new(start, 1.0 / POINTER_RATE_HZ).without_spinning();
            let advance = move || advance_pointers(&stop, &pointers, &clock);
            Builder::new().name("palpate pointers".into()).spawn(advance).map_err(SceneError::Thread)?
        };
        let (frames, events) = (channels.frames.clone(), channels.events.clone());
        let (stop_session, step_count) = (stop.clone(), steps.clone());
        let run = move || {
            let publish = |snapshot: &Snapshot| frames.publish(&mut encoder, snapshot);
            match session.run(log, &stop_session, &step_count, publish) {
                Ok((Report { state, log, .. }, written)) => {
                    // The log file itself reports failed writes.
                    if let (Some(written), Some(summary)) = (written, log) {
                        written.sink.finish(summary);
                    }
                    Some(state.snapshots())
                }
                Err(error) => {
                    let text = error.to_string();
                    let _ = events.send(ServerMessage::Error { text: &text }.to_json().into());
                    None
                }
            }
        };
        let session = Builder::new().name("palpate session".into()).spawn(run).map_err(SceneError::Thread)?;
        Ok(Self {
            stop,
            steps,
            session,
            pointer_thread,
            _sound: sound,
            timing: Timing::default(),
            cycle_receiver,
        })
    }

    /// Stops the threads; returns the final object snapshots, if the session ended without error.
    pub fn stop(self) -> Option<Vec<ObjectSnapshot>> {
        self.stop.store(true, Ordering::Release);
        let objects = self.session.join().ok().flatten();
        let _ = self.pointer_thread.join();
        objects
    }

    /// Status with the timing so far.
    pub fn status(&mut self, generation: u32, viewers: usize, playback: &Playback) -> Status {
        let Self { steps, timing, cycle_receiver, .. } = self;
        cycle_receiver.drain_into(timing);
        let granted = cycle_receiver.granted();
        Status {
            generation,
            paused: playback.is_paused(),
            slowdown: playback.slowdown(),
            steps: steps.load(Ordering::Relaxed),
            viewers,
            force_process: ProcessTiming::new(
                timing,
                granted.is_some_and(|granted| matches!(granted.priority, Ok(Some(_)))),
            ),
            haptic_device: None,
        }
    }
}

/// Advances the pointers at [`POINTER_RATE_HZ`] until `stop` is set.
fn advance_pointers(stop: &AtomicBool, pointers: &SharedPointers, clock: &Clock) {
    let mut tick = clock.next_after(0);
    let mut last = clock.now_s();
    while !stop.load(Ordering::Relaxed) {
        clock.wait(tick);
        let now = clock.now_s();
        lock(pointers).advance(now - last, now);
        last = now;
        tick = clock.next_after(tick);
    }
}
