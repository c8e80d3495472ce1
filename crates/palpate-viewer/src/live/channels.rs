//! Channels between the manager, the running scene and the page sessions.

use super::command_queue::CommandQueue;
use super::frames::FramePublisher;
use super::job::JobSlot;
use super::sound::SoundBlocks;
use crate::current::CurrentScene;
use crate::pointers::SharedPointers;
use palpate_haptics::Playback;
use std::sync::Arc;
use tokio::sync::{broadcast, watch};

/// Manager's ends of the channels.
pub(super) struct SceneChannels {
    pub current: watch::Sender<Arc<CurrentScene>>,
    pub frames: FramePublisher,
    /// JSON messages to all pages.
    pub events: broadcast::Sender<Arc<str>>,
    pub commands: Arc<CommandQueue>,
    pub pointers: SharedPointers,
    pub playback: Arc<Playback>,
    pub sound: Arc<SoundBlocks>,
    pub job_slot: Arc<JobSlot>,
}
