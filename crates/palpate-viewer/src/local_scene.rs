//! Live scene without threads: a function of time, for a page that runs its scene by itself, as in a Web Worker.
//!
//! Ticks are those of the server: at each one the pointers move, and a step is made where the playback says so. Ticks that are more than
//! [`MAX_BACKLOG_S`] late are skipped: after a page was hidden, or on a slow machine, simulated time falls behind, and the scene goes on.

use crate::current::CurrentScene;
use crate::error::SceneError;
use crate::local_device::{DevicePlace, LocalDevice};
use crate::local_log::LocalRecord;
use crate::page_requests::{Effect, SceneControls, SceneRequest, unreadable};
use crate::pointers::{Pointers, lock};
use crate::protocol::{
    FrameEncoder, FrameFormat, Hello, MaterialDescription, PROTOCOL, PhysicsSettings, ProcessTiming,
    SceneSummary, ServerMessage, Status, encode_sound,
};
use crate::scene_provider::{ViewerDevice, ViewerScene};
use crate::scene_start::{DEVICE_TIMEOUT_S, FRAME_RATE_HZ};
use crate::static_data::StaticData;
use glam::DVec3;
use palpate::{DeviceMode, Model, State};
use palpate_haptics::device::Reading;
use palpate_haptics::{
    Cycle, DevicePort, ForcePort, ForceProcess, InputRecord, Overrun, Playback, Snapshot, Timing, port,
    steps_per_frame,
};
use palpate_sound::{SoundParameters, StepRecord, Synthesiser};
use std::sync::Mutex;
use std::time::Duration;

/// Lateness from which ticks are skipped [s]: a timer of a browser wakes every 4 ms, and a frame of the page takes 16.
const MAX_BACKLOG_S: f64 = 0.05;

/// Longest time in which steps are made without a look at the page's messages [s].
const MAX_BURST_S: f64 = 0.01;

/// Shortest block of sound [s].
const SOUND_BLOCK_S: f64 = 0.004;

/// Interval of status messages [s].
const STATUS_INTERVAL_S: f64 = 0.5;

/// The one page of the scene, as viewers are numbered.
const VIEWER: u64 = 1;

/// Message to the page.
#[derive(Debug, Clone, PartialEq)]
pub enum PageMessage {
    /// JSON text.
    Text(String),
    /// Encoded frame.
    Frame(Vec<u8>),
    /// Encoded block of sound.
    Sound(Vec<u8>),
}

/// Request of the page for another scene, which the caller makes and starts.
#[derive(Debug, Clone, PartialEq)]
pub enum LocalRequest {
    /// Open a scene by id.
    Open(String),
    /// Change physics settings.
    ChangePhysics(PhysicsSettings),
    /// Change the material of an object, by index.
    ChangeMaterial(usize, MaterialDescription),
}

/// Live scene of one page.
pub struct LocalScene {
    current: CurrentScene,
    process: ForceProcess,
    pointers: Mutex<Pointers>,
    /// Haptic device, until the next start of a scene.
    device: Option<LocalDevice>,
    playback: Playback,
    encoder: FrameEncoder,
    snapshot: Snapshot,
    timing: Timing,
    /// Tick that comes next; deadlines are multiples of the step.
    tick: u64,
    /// Tick of the next frame, and step of the last one.
    frame_at: u64,
    frame_step: u64,
    /// Time of the next status message [s].
    status_at_s: f64,
    format: FrameFormat,
    /// Every n-th frame is sent; 0: none.
    stride: u32,
    frames: u32,
    /// Sound, while the page wants it.
    sound: Option<LocalSound>,
    /// Record for a log.
    record: Option<LocalRecord>,
}

/// Sound of the steps since the last block.
struct LocalSound {
    synthesiser: Synthesiser,
    record: StepRecord,
    sample_rate_hz: u32,
    samples: Vec<f32>,
}

impl LocalSound {
    fn new(model: &Model, state: &State) -> Self {
        let parameters = SoundParameters::default();
        let synthesiser = Synthesiser::new(model, state, &parameters);
        let record = StepRecord::new(&synthesiser);
        Self { synthesiser, record, sample_rate_hz: parameters.sample_rate_hz as u32, samples: Vec::new() }
    }

    fn add(&mut self, state: &State) {
        self.record.capture(state);
        self.synthesiser.synthesise(&self.record, &mut self.samples);
    }
}

impl LocalScene {
    /// Scene from its initial state.
    ///
    /// # Errors
    /// If it has a device that only a machine has.
    pub fn new(scene: ViewerScene) -> Result<Self, SceneError> {
        let state = State::new(&scene.model);
        Self::at(1, scene, state)
    }

    /// Scene of a generation at a state, with the settings of a new page.
    fn at(generation: u32, scene: ViewerScene, state: State) -> Result<Self, SceneError> {
        let (process, ports) = force_process(&scene, state)?;
        Ok(Self {
            encoder: FrameEncoder::new(scene.model.clone(), generation),
            snapshot: Snapshot::new(&scene.model, process.state(), process.input()),
            current: CurrentScene::new(generation, scene),
            process,
            pointers: Mutex::new(Pointers::new(ports)),
            device: None,
            playback: Playback::default(),
            timing: Timing::default(),
            tick: 0,
            frame_at: 0,
            frame_step: 0,
            status_at_s: 0.0,
            format: FrameFormat::Modal,
            stride: 1,
            frames: 0,
            sound: None,
            record: None,
        })
    }

    /// Starts another scene in place of this one; `resumes`: from the state of this one, where both scenes allow it.
    ///
    /// # Errors
    /// If it has a device that only a machine has; then this scene goes on.
    pub fn start(
        &mut self,
        scene: ViewerScene,
        resumes: bool,
        send: &mut dyn FnMut(PageMessage),
    ) -> Result<(), SceneError> {
        let state = if resumes && scene.can_resume {
            State::resume(&scene.model, &self.process.state().snapshots())
        } else {
            State::new(&scene.model)
        };
        let next = Self::at(self.current.generation + 1, scene, state)?;
        let is_heard = self.sound.is_some();
        let record = self.record.take().map(|record| LocalRecord { has_ended: true, ..record });
        *self = Self {
            playback: std::mem::take(&mut self.playback),
            status_at_s: self.status_at_s,
            format: self.format,
            stride: self.stride,
            frames: self.frames,
            record,
            ..next
        };
        self.switch_sound(is_heard);
        self.send_scene(send);
        Ok(())
    }

    /// Begins a record for a log, at a start of the scene: from its present state, where the scene allows it.
    ///
    /// # Errors
    /// As [`start`](Self::start).
    pub fn begin_record(&mut self, send: &mut dyn FnMut(PageMessage)) -> Result<(), SceneError> {
        self.start(self.current.scene.clone(), true, send)?;
        let inputs = InputRecord::new(&self.process.state().snapshots());
        self.record = Some(LocalRecord { inputs, has_ended: false });
        Ok(())
    }

    /// Ends the record, if one was begun: of the scene from its start to now, to the next start of a scene, or to its limits.
    pub fn end_record(&mut self) -> Option<InputRecord> {
        self.record.take().map(|record| record.inputs)
    }

    /// Sends the first messages: hello, scene and frame. `scenes` can be opened.
    pub fn greet(&mut self, scenes: Vec<SceneSummary>, send: &mut dyn FnMut(PageMessage)) {
        let version = env!("CARGO_PKG_VERSION");
        let kind = "live";
        let hello = Hello {
            protocol: PROTOCOL,
            version,
            kind,
            viewer: VIEWER,
            records: false,
            scenes,
            logs: Vec::new(),
            render: None,
        };
        send(PageMessage::Text(serde_json::to_string(&hello).unwrap_or_default()));
        self.send_scene(send);
    }

    /// Receives a message of the page; returns a request that is left to the caller.
    pub fn receive(&mut self, text: &str, send: &mut dyn FnMut(PageMessage)) -> Option<LocalRequest> {
        let message = match serde_json::from_str(text) {
            Ok(message) => message,
            Err(error) => {
                send(PageMessage::Text(unreadable(&error)));
                return None;
            }
        };
        let controls = SceneControls {
            model: &self.current.scene.model,
            pointers: &self.pointers,
            playback: &self.playback,
        };
        match controls.apply(VIEWER, message) {
            Effect::None | Effect::Scene(SceneRequest::CancelJob) => {}
            Effect::Reply(text) => send(PageMessage::Text(text)),
            Effect::Stream(format, stride) => {
                (self.format, self.stride) = (format, stride);
                // A page that has loaded a paused scene needs a frame.
                if stride > 0 {
                    self.send_state(send);
                }
            }
            Effect::Sound(on) => self.switch_sound(on),
            Effect::Scene(SceneRequest::SendStatus) => self.send_status(send),
            Effect::Scene(SceneRequest::Reset) => {
                let scene = self.current.scene.clone();
                if let Err(error) = self.start(scene, false, send) {
                    send_error(&error, send);
                }
            }
            Effect::Scene(SceneRequest::Open(id)) => return Some(LocalRequest::Open(id)),
            Effect::Scene(SceneRequest::ChangePhysics(settings)) => {
                return Some(LocalRequest::ChangePhysics(settings));
            }
            Effect::Scene(SceneRequest::ChangeMaterial(object, material)) => {
                return Some(LocalRequest::ChangeMaterial(object, material));
            }
        }
        None
    }

    /// Attaches a haptic device in place of a pointer; returns its index, or none where the scene has no free one. It stays until a scene
    /// starts.
    pub fn attach_device(&mut self, place: DevicePlace) -> Option<usize> {
        self.detach_device();
        let (device, port) = lock(&self.pointers).take_port()?;
        self.device = Some(LocalDevice::new(device, port, place));
        Some(device)
    }

    /// Update of the attached device with its newest reading, or none if it gives none: returns the force to command [N, device frame],
    /// and none where no device is attached.
    pub fn exchange(&mut self, reading: Option<Reading>, now_s: f64) -> Option<DVec3> {
        Some(self.device.as_mut()?.exchange(reading, now_s))
    }

    /// Gives the slot of the attached device back to the pointers.
    pub fn detach_device(&mut self) {
        if let Some((device, port)) = self.device.take().and_then(LocalDevice::into_slot) {
            lock(&self.pointers).give_back(device, port);
        }
    }

    /// Makes the steps whose deadlines have passed; `now_s` reads the clock [s].
    pub fn advance(&mut self, now_s: &dyn Fn() -> f64, send: &mut dyn FnMut(PageMessage)) {
        let step_s = self.step_s();
        let begun_s = now_s();
        let newest = (begun_s / step_s) as u64;
        if self.tick == 0 {
            self.tick = newest.max(1);
        }
        let backlog = (MAX_BACKLOG_S / step_s) as u64;
        let skipped = newest.saturating_sub(backlog).saturating_sub(self.tick);
        if skipped > 0 {
            self.timing.overruns += 1;
            self.timing.skipped += skipped;
        }
        self.tick = self.tick.max(newest.saturating_sub(backlog));
        let mut time_s = begun_s;
        while self.tick as f64 * step_s <= time_s && time_s - begun_s < MAX_BURST_S {
            self.cycle(time_s, now_s, send);
            time_s = now_s();
        }
        self.send_sound(send);
        if time_s >= self.status_at_s {
            self.status_at_s = time_s + STATUS_INTERVAL_S;
            self.send_status(send);
        }
    }

    /// Time of the next deadline [s].
    pub fn deadline_s(&self) -> f64 {
        self.tick as f64 * self.step_s()
    }

    /// Encoded data of a path that the server would answer, as `scene/1/object/0/surface`.
    pub fn static_data(&self, path: &str) -> Option<Vec<u8>> {
        let (generation, data) = StaticData::parse(path)?;
        (generation == self.current.generation).then(|| data.encode(&self.current.scene.model))?
    }

    /// Scene that runs.
    pub fn scene(&self) -> &ViewerScene {
        &self.current.scene
    }

    fn step_s(&self) -> f64 {
        self.current.scene.model.parameters().step_s
    }

    /// One tick at a time [s].
    fn cycle(&mut self, time_s: f64, now_s: &dyn Fn() -> f64, send: &mut dyn FnMut(PageMessage)) {
        let step_s = self.step_s();
        let lateness = (time_s - self.deadline_s()).max(0.0);
        lock(&self.pointers).advance(step_s, time_s);
        let is_due = self.playback.is_due(self.tick);
        if is_due {
            self.process.cycle(time_s);
            if let Some(record) = &mut self.record {
                record.push(self.process.input(), step_s);
            }
            // In slow motion and in a pause its frequencies would be wrong.
            if let Some(sound) = self.sound.as_mut().filter(|_| self.playback.is_at_full_speed()) {
                sound.add(self.process.state());
            }
        }
        let is_paused = self.playback.is_paused();
        let has_news = self.frame_step < self.process.steps();
        if has_news && (self.tick >= self.frame_at || is_paused) {
            self.send_frame(send);
        }
        if is_due {
            let end_s = now_s();
            let compute = end_s - time_s;
            let is_over = end_s > (self.tick + 1) as f64 * step_s;
            let overrun = is_over.then_some(Overrun { by_compute: compute > step_s, skipped: 0 });
            self.timing.record(Cycle { lateness: seconds(lateness), compute: seconds(compute), overrun });
        }
        self.tick += 1;
    }

    fn send_frame(&mut self, send: &mut dyn FnMut(PageMessage)) {
        let frame_ticks = steps_per_frame(FRAME_RATE_HZ, self.step_s());
        (self.frame_at, self.frame_step) = (self.tick + frame_ticks, self.process.steps());
        self.frames = self.frames.wrapping_add(1);
        if self.stride == 0 || !self.frames.is_multiple_of(self.stride) {
            return;
        }
        self.send_state(send);
    }

    /// Sends the present state as a frame.
    fn send_state(&mut self, send: &mut dyn FnMut(PageMessage)) {
        self.snapshot.capture(self.process.steps(), self.process.input(), self.process.state());
        send(PageMessage::Frame(self.encoder.encode(&self.snapshot, self.format)));
    }

    fn switch_sound(&mut self, on: bool) {
        self.sound = on.then(|| LocalSound::new(&self.current.scene.model, self.process.state()));
    }

    /// Sends the sound of some milliseconds: blocks of single steps would be a thousand messages a second.
    fn send_sound(&mut self, send: &mut dyn FnMut(PageMessage)) {
        let Some(sound) = &mut self.sound else { return };
        if sound.samples.len() as f64 >= SOUND_BLOCK_S * f64::from(sound.sample_rate_hz) {
            let block = encode_sound(self.current.generation, sound.sample_rate_hz, &sound.samples);
            sound.samples.clear();
            send(PageMessage::Sound(block));
        }
    }

    fn send_scene(&mut self, send: &mut dyn FnMut(PageMessage)) {
        send(PageMessage::Text(self.current.message.to_string()));
        self.send_state(send);
        self.send_status(send);
    }

    fn send_status(&mut self, send: &mut dyn FnMut(PageMessage)) {
        let status = Status {
            generation: self.current.generation,
            paused: self.playback.is_paused(),
            slowdown: self.playback.slowdown(),
            steps: self.process.steps(),
            viewers: 1,
            force_process: ProcessTiming::new(&self.timing, false),
            haptic_device: self.device.as_mut().map(LocalDevice::status),
        };
        send(PageMessage::Text(ServerMessage::Status(status).to_json()));
    }
}

/// Sends an error to the page.
fn send_error(error: &SceneError, send: &mut dyn FnMut(PageMessage)) {
    send(PageMessage::Text(ServerMessage::Error { text: &error.to_string() }.to_json()));
}

fn seconds(time_s: f64) -> Duration {
    Duration::from_secs_f64(time_s.clamp(0.0, 1e6))
}

/// Force process of a scene at a state, warmed up, with the ports of its pointers by device index.
fn force_process(
    scene: &ViewerScene,
    state: State,
) -> Result<(ForceProcess, Vec<(usize, DevicePort)>), SceneError> {
    let mut ports = Vec::new();
    let mut slots: Vec<(ForcePort, DeviceMode)> = Vec::new();
    for (index, device) in scene.devices.iter().enumerate() {
        let (device_port, force_port) = port();
        let mode = match device {
            ViewerDevice::Pointer => {
                ports.push((index, device_port));
                DeviceMode::Touch
            }
            ViewerDevice::Path(_, mode) => *mode,
            #[cfg(feature = "server")]
            ViewerDevice::Local(_) => {
                return Err(SceneError::from("a device of this machine needs `palpate serve`"));
            }
        };
        slots.push((force_port, mode));
    }
    let motion = (scene.motion)();
    let mut process = ForceProcess::from_state(state, scene.model.clone(), slots, motion, DEVICE_TIMEOUT_S);
    for (index, device) in scene.devices.iter().enumerate() {
        if let ViewerDevice::Path(path, _) = device {
            process.follow(index, path.clone());
        }
    }
    process.warm_up();
    Ok((process, ports))
}
