//! Live scene: a manager thread owns the running session, one thread moves the pointers, jobs run on threads of their own.

mod channels;
mod command;
mod command_queue;
mod frames;
mod job;
mod manager;
mod running;
mod sound;

pub(crate) use command::Command;
pub(crate) use command_queue::CommandQueue;

pub(crate) use frames::Viewers;
pub(crate) use job::JobSlot;
pub(crate) use sound::SoundBlocks;

use crate::current::CurrentScene;
use crate::pointers::SharedPointers;
use crate::scene_provider::{SceneProvider, ViewerScene};
use axum::body::Bytes;
use channels::SceneChannels;
use frames::FramePublisher;
use manager::Manager;
use palpate_haptics::{Playback, Scheduling};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{Builder, JoinHandle};
use tokio::sync::{broadcast, watch};

/// Capacity of the event queue of each page [messages].
const EVENT_CAPACITY: usize = 256;

/// Handle of a live scene, shared by the page sessions.
pub(crate) struct LiveScene {
    pub current: watch::Receiver<Arc<CurrentScene>>,
    /// Newest modal frame.
    pub modal: watch::Receiver<Bytes>,
    /// Newest vertex frame.
    pub vertices: watch::Receiver<Bytes>,
    /// JSON messages to all pages.
    pub events: broadcast::Sender<Arc<str>>,
    pub commands: Arc<CommandQueue>,
    pub pointers: SharedPointers,
    pub playback: Arc<Playback>,
    pub viewers: Arc<Viewers>,
    pub sound: Arc<SoundBlocks>,
    pub job_slot: Arc<JobSlot>,
    manager: Mutex<Option<JoinHandle<()>>>,
}

impl LiveScene {
    /// Starts a scene and its manager thread.
    ///
    /// # Errors
    /// If the thread cannot be started.
    pub fn start(
        provider: Arc<dyn SceneProvider>,
        first: ViewerScene,
        scheduling: Scheduling,
    ) -> std::io::Result<Self> {
        let commands = Arc::new(CommandQueue::new());
        let (modal_sender, modal) = watch::channel(Bytes::new());
        let (vertices_sender, vertices) = watch::channel(Bytes::new());
        let (events, _) = broadcast::channel(EVENT_CAPACITY);
        let (current_sender, current) = watch::channel(Arc::new(CurrentScene::new(0, first.clone())));
        let viewers = Arc::new(Viewers::default());
        let pointers: SharedPointers = Arc::default();
        let playback: Arc<Playback> = Arc::default();
        let job_slot: Arc<JobSlot> = Arc::default();
        let sound: Arc<SoundBlocks> = Arc::default();
        let channels = SceneChannels {
            current: current_sender,
            frames: FramePublisher::new(modal_sender, vertices_sender, viewers.clone()),
            events: events.clone(),
            commands: commands.clone(),
            pointers: pointers.clone(),
            playback: playback.clone(),
            sound: sound.clone(),
            job_slot: job_slot.clone(),
        };
        let mut manager = Manager::new(provider, scheduling, channels);
        // Before the first page connects, so that it gets this scene.
        manager.start_scene(first, None);
        let manager = Builder::new().name("palpate scene".into()).spawn(move || manager.run())?;
        let manager = Mutex::new(Some(manager));
        Ok(Self {
            current,
            modal,
            vertices,
            events,
            commands,
            pointers,
            playback,
            viewers,
            sound,
            job_slot,
            manager,
        })
    }

    /// Stops the scene and waits until its log is complete.
    pub fn end(&self) {
        self.job_slot.cancel();
        self.commands.push(Command::End);
        let manager = self.manager.lock().unwrap_or_else(PoisonError::into_inner).take();
        if let Some(manager) = manager {
            let _ = manager.join();
        }
    }
}

impl Drop for LiveScene {
    fn drop(&mut self) {
        self.end();
    }
}
