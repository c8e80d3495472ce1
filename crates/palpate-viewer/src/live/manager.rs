//! Manager thread of a live scene: executes commands, starts and stops sessions, sends status messages.

use super::channels::SceneChannels;
use super::command::Command;
use super::job::JobPermit;
use super::running::{DeviceInputs, RunningScene, initial_snapshot};
use crate::current::CurrentScene;
use crate::error::SceneError;
use crate::pointers::{Pointers, lock};
use crate::protocol::{FrameEncoder, ServerMessage};
use crate::scene_provider::{JobControl, PageNotifier, SceneProvider, ViewerScene};
use palpate::{ObjectSnapshot, State};
use palpate_haptics::Scheduling;
use std::sync::Arc;
use std::thread::Builder;
use std::time::{Duration, Instant};

/// Interval of status messages.
const STATUS_INTERVAL: Duration = Duration::from_millis(500);

/// Message to all pages after a job that was cancelled.
const CANCELLED: &str = "the recording was cancelled";

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
    pub fn run(&mut self) {
        let mut status_at = Instant::now();
        let commands = self.channels.commands.clone();
        loop {
            match commands.next(status_at) {
                Some(Command::End) => break,
                Some(command) => self.execute(command),
                None => {
                    status_at = Instant::now() + STATUS_INTERVAL;
                    self.send_status();
                }
            }
        }
        self.stop();
    }

    fn execute(&mut self, command: Command) {
        match command {
            Command::Open(id, viewer) => {
                self.claim_and_spawn_job("scene", viewer, move |provider, job| provider.open(&id, job));
            }
            Command::ChangeMaterial(object, material, viewer) => {
                let before = self.current_scene();
                self.claim_and_spawn_job("material", viewer, move |provider, job| {
                    Ok(provider.change_material(object, material, job)?.changed_from(&before))
                });
            }
            Command::Record(upload, permit) => {
                self.spawn_job("mesh", permit, move |provider, job| provider.record(upload, job));
            }
            Command::ChangePhysics(_) if self.channels.job_slot.is_taken() => {
                self.send_error(&SceneError::BUSY_CHANGE);
            }
            Command::ChangePhysics(settings) => match self.provider.change_physics(&settings) {
                Ok(scene) => {
                    let scene = scene.changed_from(&self.current_scene());
                    let resumed = self.stop().filter(|_| scene.can_resume);
                    self.start_scene(scene, resumed);
                }
                Err(error) => self.send_error(&error),
            },
            Command::Reset => {
                self.stop();
                self.start_scene(self.current_scene(), None);
            }
            Command::JobDone(result, permit) => {
                let cancelled = permit.is_cancelled();
                drop(permit);
                match result {
                    Ok(scene) => {
                        self.stop();
                        self.start_scene(*scene, None);
                    }
                    Err(_) if cancelled => self.send(&ServerMessage::Info { text: CANCELLED }),
                    Err(error) => self.send_error(&error),
                }
            }
            Command::SendStatus => self.send_status(),
            Command::End => {}
        }
    }

    fn current_scene(&self) -> ViewerScene {
        self.channels.current.borrow().scene.clone()
    }

    /// Runs a job of a viewer, unless one runs already.
    fn claim_and_spawn_job(
        &mut self,
        job: &'static str,
        viewer: u64,
        make: impl FnOnce(&dyn SceneProvider, JobControl) -> Result<ViewerScene, SceneError> + Send + 'static,
    ) {
        match self.channels.job_slot.claim(Some(viewer)) {
            Some(permit) => self.spawn_job(job, permit, make),
            None => self.send_error(&SceneError::BUSY_JOB),
        }
    }

    /// Runs a job on its own thread while the scene keeps running.
    fn spawn_job(
        &mut self,
        job: &'static str,
        permit: JobPermit,
        make: impl FnOnce(&dyn SceneProvider, JobControl) -> Result<ViewerScene, SceneError> + Send + 'static,
    ) {
        let provider = self.provider.clone();
        let (events, commands) = (self.channels.events.clone(), self.channels.commands.clone());
        let work = move || {
            let send_progress = |phase: &str, fraction: Option<f64>, done: bool| {
                let _ = events.send(ServerMessage::Progress { job, phase, fraction, done }.to_json().into());
            };
            let mut report = |phase: &str, fraction| send_progress(phase, fraction, false);
            let control = JobControl { report: &mut report, cancelled: permit.cancelled() };
            let result = make(&*provider, control);
            send_progress("", Some(1.0), true);
            commands.push(Command::JobDone(result.map(Box::new), permit));
        };
        if let Err(error) = Builder::new().name(format!("palpate {job}")).spawn(work) {
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
        RunningScene::start(
            scene,
            state,
            inputs?,
            log,
            (encoder, generation),
            self.scheduling,
            &self.channels,
        )
    }

    fn send_status(&mut self) {
        let generation = self.channels.current.borrow().generation;
        let viewers = self.channels.frames.viewer_count();
        let Some(running) = &mut self.running else { return };
        let status = running.status(generation, viewers, &self.channels.playback);
        self.send(&ServerMessage::Status(status));
    }
}
