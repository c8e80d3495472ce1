//! State shared by all requests.

use super::content::{Live, RenderJob, ServedContent};
use super::guard::Guard;
use super::limits::Limits;
use crate::live::LiveScene;
use crate::log_frames::LogFrames;
use crate::protocol::SceneSummary;
use crate::static_data::StaticData;
use axum::body::Bytes;
use palpate::Model;
use std::collections::HashMap;
use std::sync::atomic::AtomicU64;
use std::sync::{Arc, Mutex, PoisonError};

/// Shared server state.
pub(super) struct ServerState {
    pub live: Option<LiveScene>,
    pub scenes: Vec<SceneSummary>,
    pub logs: Vec<Arc<LogFrames>>,
    pub render: Option<RenderJob>,
    pub guard: Guard,
    pub limits: Limits,
    pub cache: StaticDataCache,
    /// Number of the next viewer.
    pub next_viewer: AtomicU64,
}

impl ServerState {
    /// State for some content; starts a live scene.
    ///
    /// # Errors
    /// If a thread cannot be started.
    pub fn new(guard: Guard, limits: Limits, content: ServedContent) -> std::io::Result<Self> {
        let mut state = Self {
            live: None,
            scenes: Vec::new(),
            logs: Vec::new(),
            render: None,
            guard,
            limits,
            cache: StaticDataCache::default(),
            next_viewer: AtomicU64::new(1),
        };
        match content {
            ServedContent::Live(live) => {
                let Live { provider, first, scheduling } = *live;
                state.scenes = provider.scenes();
                state.live = Some(LiveScene::start(provider, first, scheduling)?);
            }
            ServedContent::Logs(logs) => state.logs = logs,
            ServedContent::Render(log, job) => (state.logs, state.render) = (vec![log], Some(job)),
        }
        Ok(state)
    }

    /// Model of a generation, if it is current.
    pub fn model(&self, generation: u32) -> Option<Arc<Model>> {
        match &self.live {
            Some(live) => {
                let current = live.current.borrow().clone();
                (current.generation == generation).then(|| current.scene.model.clone())
            }
            None => self.logs.get(generation as usize).map(|log| log.model.clone()),
        }
    }
}

/// Generation and data.
type StaticDataKey = (u32, StaticData);

/// Cache of encoded static data, shared by all pages.
#[derive(Default)]
pub(super) struct StaticDataCache(Mutex<HashMap<StaticDataKey, Bytes>>);

impl StaticDataCache {
    /// Cached bytes, encoded at the first request; `None` if there is no such data.
    pub fn get(&self, key: StaticDataKey, encode: impl FnOnce() -> Option<Vec<u8>>) -> Option<Bytes> {
        let mut cache = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        // Older generations are not requested any more; two logs have generations 0 and 1.
        cache.retain(|(generation, ..), _| *generation + 1 >= key.0);
        if let Some(bytes) = cache.get(&key) {
            return Some(bytes.clone());
        }
        let bytes = Bytes::from(encode()?);
        cache.insert(key, bytes.clone());
        Some(bytes)
    }
}
