//! Frames and time series of a log, encoded while the log is recomputed.

use crate::protocol::{FrameEncoder, FrameFormat, FrameTimes, SceneDescription, ServerMessage};
use palpate::{EnergyLedger, Model};
use palpate_haptics::Snapshot;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::sync::{Arc, PoisonError, RwLock};

/// Maximum number of samples of a time series.
const MAX_SERIES_SAMPLES: usize = 4000;

/// Encoded frames of a log; grows while a [`LogFrameBuilder`] adds frames.
pub struct LogFrames {
    /// File name.
    pub name: String,
    /// Model of the logged scene.
    pub model: Arc<Model>,
    description: SceneDescription,
    devices: Vec<String>,
    content: RwLock<Content>,
}

#[derive(Default)]
struct Content {
    frames: Vec<Vec<u8>>,
    /// Simulation time per frame [s].
    times: Vec<f64>,
    /// Force on the hand per device and frame [N, world].
    forces: Vec<Vec<[f64; 3]>>,
    energies: Vec<EnergyLedger>,
    done: bool,
    failure: Option<String>,
}

/// Adds frames to a [`LogFrames`].
pub struct LogFrameBuilder {
    log: Arc<LogFrames>,
    encoder: FrameEncoder,
}

impl LogFrames {
    /// Empty log of `frames` expected frames, `frame_interval_s` [s] apart; `number` is its index on the page.
    pub fn new(
        number: usize,
        name: String,
        model: Arc<Model>,
        description: SceneDescription,
        frames: u64,
        frame_interval_s: f64,
    ) -> (Arc<Self>, LogFrameBuilder) {
        let devices = description.devices.iter().map(|device| device.name.clone()).collect::<Vec<_>>();
        let content = Content { forces: vec![Vec::new(); devices.len()], ..Content::default() };
        let times = FrameTimes { log: number, frames, frame_interval_s };
        let log = Arc::new(Self {
            name,
            model: model.clone(),
            description: SceneDescription { frames: Some(times), ..description },
            devices,
            content: RwLock::new(content),
        });
        (log.clone(), LogFrameBuilder { log, encoder: FrameEncoder::new(model, number as u32) })
    }

    fn read<T>(&self, query: impl FnOnce(&Content) -> T) -> T {
        query(&self.content.read().unwrap_or_else(PoisonError::into_inner))
    }

    fn write(&self, change: impl FnOnce(&mut Content)) {
        change(&mut self.content.write().unwrap_or_else(PoisonError::into_inner));
    }

    fn times(&self) -> FrameTimes {
        self.description.frames.unwrap_or(FrameTimes { log: 0, frames: 0, frame_interval_s: 1.0 })
    }

    /// `scene` message; the generation of a log is its number.
    pub(crate) fn scene_message(&self) -> String {
        ServerMessage::Scene { generation: self.times().log as u32, scene: &self.description }.to_json()
    }

    /// Progress message, and whether it is the last one.
    pub(crate) fn progress(&self) -> (String, bool) {
        let FrameTimes { log, frames, .. } = self.times();
        self.read(|content| {
            if let Some(text) = &content.failure {
                return (ServerMessage::Error { text }.to_json(), true);
            }
            let fraction = content.frames.len() as f64 / frames.max(1) as f64;
            let job = format!("log {log}");
            let phase = format!("{} of {frames} frames", content.frames.len());
            let progress = ServerMessage::Progress {
                job: &job,
                phase: &phase,
                fraction: Some(fraction),
                done: content.done,
            };
            (progress.to_json(), content.done)
        })
    }

    /// Length-prefixed frames from index `from` on, at most `count` frames and about `max_bytes` bytes.
    pub(crate) fn frames(&self, from: usize, count: usize, max_bytes: usize) -> Vec<u8> {
        let mut out = Vec::new();
        self.read(|content| {
            for frame in content.frames.iter().skip(from).take(count) {
                if !out.is_empty() && out.len() + frame.len() > max_bytes {
                    break;
                }
                out.extend_from_slice(&(frame.len() as u32).to_le_bytes());
                out.extend_from_slice(frame);
            }
        });
        out
    }

    /// Time series for the plots: times [s], forces [N, world], energies [J].
    pub(crate) fn series(&self) -> Value {
        self.read(|content| {
            let stride = content.times.len().div_ceil(MAX_SERIES_SAMPLES).max(1);
            let devices = self.devices.iter().zip(&content.forces).map(|(name, forces)| {
                let force: Vec<[f64; 3]> = forces.iter().step_by(stride).copied().collect();
                json!({ "name": name, "force": force })
            });
            let mut energy: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
            for ledger in content.energies.iter().step_by(stride) {
                for (name, value) in ledger.named() {
                    energy.entry(name).or_default().push(value);
                }
            }
            let times: Vec<f64> = content.times.iter().step_by(stride).copied().collect();
            json!({ "t": times, "devices": devices.collect::<Vec<_>>(), "energy": energy })
        })
    }
}

impl LogFrameBuilder {
    /// Adds the next frame.
    pub fn push(&mut self, snapshot: &Snapshot) {
        let frame = self.encoder.encode(snapshot, FrameFormat::Modal);
        self.log.write(|content| {
            content.frames.push(frame);
            content.times.push(snapshot.output.time_s);
            content.energies.push(snapshot.output.energy);
            for (forces, device) in content.forces.iter_mut().zip(&snapshot.output.devices) {
                forces.push(device.force_on_hand.to_array());
            }
        });
    }

    /// Ends the log, with a text if it is incomplete.
    pub fn finish(self, failure: Option<String>) {
        self.log.write(|content| (content.done, content.failure) = (failure.is_none(), failure));
    }
}
