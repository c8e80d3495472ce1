//! Manager thread of a live scene: executes commands, starts and stops sessions, sends status messages.

use super::channels::SceneChannels;
use super::command::Command;
use super::current::CurrentScene;
use super::running::{DeviceInputs, RunningScene, initial_snapshot, is_resumable};
use crate::error::SceneError;
use crate::pointers::{Pointers, lock};
use crate::protocol::{FrameEncoder, ServerMessage};
use crate::scene_provider::{PageNotifier, ProgressCallback, SceneProvider, ViewerScene};
use palpate::{ObjectSnapshot, State};
use palpate_haptics::Scheduling;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::thread::Builder;
use std::time::{Duration, Instant};

/// Interval of status messages.
const STATUS_INTERVAL: Duration = Duration::from_millis(500);

/// State of the manager thread.
pub(super) struct Manager {
    provider: Arc<dyn SceneProvider>,
    scheduling: Scheduling,
    channels: SceneChannels,
    running: Option<RunningScene>,
}

impl Manager {
    /// Manager without a running scene.
    pub fn new(provider: Arc<dyn SceneProvider>, scheduling: Scheduling, channels: SceneChannels) -> Self {
        Self { provider, scheduling, channels, running: None }
    }

    /// Executes commands until [`Command::End`].
    pub fn run(&mut self, commands: &Receiver<Command>) {
        let mut status_at = Instant::now();
        loop {
            match commands.recv_timeout(status_at.saturating_duration_since(Instant::now())) {
                Ok(Command::End) | Err(RecvTimeoutError::Disconnected) => break,
                Ok(command) => self.execute(command),
                Err(RecvTimeoutError::Timeout) => {
                    status_at = Instant::now() + STATUS_INTERVAL;
                    self.send_status();
                }
            }
        }
        self.stop();
    }

    fn execute(&mut self, command: Command) {
        match command {
            Command::Open(_) | Command::ChangeMaterial(..) if !self.channels.job_slot.claim() => {
                self.send_error(&SceneError::BUSY_JOB);
            }
            Command::Open(id) => {
                self.spawn_job("scene", move |provider, progress| provider.open(&id, progress));
            }
            Command::ChangeMaterial(object, material) => {
                self.spawn_job("material", move |provider, progress| {
                    provider.change_material(object, material, progress)
                });
            }
            Command::Record(upload) => {
                self.spawn_job("mesh", move |provider, progress| provider.record(upload, progress));
            }
            Command::ChangePhysics(_) if self.channels.job_slot.is_busy() => {
                self.send_error(&SceneError::BUSY_CHANGE);
            }
            Command::ChangePhysics(settings) => match self.provider.change_physics(&settings) {
                Ok(scene) => {
                    let resumed = self.stop().filter(|_| is_resumable(&scene));
                    self.start_scene(scene, resumed);
                }
                Err(error) => self.send_error(&error),
            },
            Command::Reset => {
                self.stop();
                let scene = self.channels.current.borrow().scene.clone();
                self.start_scene(scene, None);
            }
            Command::JobDone(result) => {
                self.channels.job_slot.release();
                match result {
                    Ok(scene) => {
                        self.stop();
                        self.start_scene(*scene, None);
                    }
                    Err(error) => self.send_error(&error),
                }
            }
            Command::SendStatus => self.send_status(),
            Command::End => {}
        }
    }

    /// Runs a job on its own thread while the scene keeps running; the job slot must be claimed.
    fn spawn_job(
        &mut self,
        job: &'static str,
        make: impl FnOnce(&dyn SceneProvider, ProgressCallback) -> Result<ViewerScene, SceneError>
        + Send
        + 'static,
    ) {
        let provider = self.provider.clone();
        let (events, commands) = (self.channels.events.clone(), self.channels.commands.clone());
        let work = move || {
            let send_progress = |phase: &str, fraction: Option<f64>, done: bool| {
                let _ = events.send(ServerMessage::Progress { job, phase, fraction, done }.to_json().into());
            };
            let result = make(&*provider, &mut |phase, fraction| send_progress(phase, fraction, false));
            send_progress("", Some(1.0), true);
            let _ = commands.send(Command::JobDone(result.map(Box::new)));
        };
        if let Err(error) = Builder::new().name(format!("palpate {job}")).spawn(work) {
            self.channels.job_slot.release();
            self.send_error(&SceneError::Thread(error));
        }
    }

    fn send(&self, message: &ServerMessage) {
        let _ = self.channels.events.send(message.to_json().into());
    }

    fn send_error(&self, error: &SceneError) {
        self.send(&ServerMessage::Error { text: &error.to_string() });
    }

    fn page_notifier(&self) -> PageNotifier {
        let events = self.channels.events.clone();
        Arc::new(move |text| drop(events.send(ServerMessage::Error { text }.to_json().into())))
    }

    /// Stops the running scene and returns the final snapshots of its objects.
    fn stop(&mut self) -> Option<Vec<ObjectSnapshot>> {
        let objects = self.running.take()?.stop();
        *lock(&self.channels.pointers) = Pointers::default();
        objects
    }

    /// Starts a scene from its initial state, or resumes it from object snapshots.
    pub fn start_scene(&mut self, scene: ViewerScene, resumed: Option<Vec<ObjectSnapshot>>) {
        let generation = self.channels.current.borrow().generation + 1;
        let state =
            resumed.map_or_else(|| State::new(&scene.model), |objects| State::resume(&scene.model, &objects));
        let current = Arc::new(CurrentScene::new(generation, scene.clone()));
        let message = current.message.clone();
        self.channels.current.send_replace(current);
        let _ = self.channels.events.send(message);
        match self.start_session(&scene, state, generation) {
            Ok(running) => self.running = Some(running),
            Err(error) => self.send_error(&error),
        }
    }

    fn start_session(
        &self,
        scene: &ViewerScene,
        state: State,
        generation: u32,
    ) -> Result<RunningScene, SceneError> {
        let mut encoder = FrameEncoder::new(scene.model.clone(), generation);
        self.channels.frames.publish_all(&mut encoder, &initial_snapshot(scene, &state));
        let inputs = DeviceInputs::open(scene);
        let log = scene.log.as_ref().map(|open| open(&state, self.page_notifier()));
        let log =
            log.and_then(|log| log.map_err(|error| self.send_error(&SceneError::Log(Box::new(error)))).ok());
        RunningScene::start(scene, state, inputs?, log, encoder, self.scheduling, &self.channels)
    }

    fn send_status(&mut self) {
        let generation = self.channels.current.borrow().generation;
        let viewers = self.channels.frames.viewer_count();
        let Some(running) = &mut self.running else { return };
        let status = running.status(generation, viewers, &self.channels.playback);
        self.send(&ServerMessage::Status(status));
    }
}
