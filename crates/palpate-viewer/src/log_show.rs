//! A log that is looked at: its pictures, which are made while it is computed again.

use crate::wire::{Answer, FrameEncoder, FrameFormat, FrameTimes, SceneDescription};
use palpate::{EnergyLedger, Model};
use palpate_haptics::Snapshot;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::sync::{Arc, PoisonError, RwLock};

/// Moments that a plot is given at most.
const MOST_MOMENTS: usize = 4000;

/// The pictures of a log so far.
pub struct LogFrames {
    /// Its file's name.
    pub name: String,
    /// What it shows.
    pub model: Arc<Model>,
    description: SceneDescription,
    devices: Vec<String>,
    made: RwLock<Made>,
}

#[derive(Default)]
struct Made {
    pictures: Vec<Vec<u8>>,
    times: Vec<f64>,
    /// Per device [N].
    forces: Vec<Vec<[f64; 3]>>,
    energies: Vec<EnergyLedger>,
    done: bool,
    failure: Option<String>,
}

/// Makes the pictures of a log.
pub struct LogFrameBuilder {
    show: Arc<LogFrames>,
    maker: FrameEncoder,
}

impl LogFrames {
    /// A log of so many frames, a time [s] apart; `number` is its place among those that are shown together.
    pub fn new(
        number: usize,
        name: String,
        model: Arc<Model>,
        description: SceneDescription,
        frames: u64,
        frame_s: f64,
    ) -> (Arc<Self>, LogFrameBuilder) {
        let devices = description.devices.iter().map(|device| device.name.clone()).collect::<Vec<_>>();
        let made = Made { forces: vec![Vec::new(); devices.len()], ..Made::default() };
        let times = FrameTimes { log: number, frames, frame_s };
        let show = Arc::new(Self {
            name,
            model: model.clone(),
            description: SceneDescription { frames: Some(times), ..description },
            devices,
            made: RwLock::new(made),
        });
        (show.clone(), LogFrameBuilder { show, maker: FrameEncoder::new(model, number as u32) })
    }

    fn read<T>(&self, look: impl FnOnce(&Made) -> T) -> T {
        look(&self.made.read().unwrap_or_else(PoisonError::into_inner))
    }

    fn write(&self, change: impl FnOnce(&mut Made)) {
        change(&mut self.made.write().unwrap_or_else(PoisonError::into_inner));
    }

    fn times(&self) -> FrameTimes {
        self.description.frames.unwrap_or(FrameTimes { log: 0, frames: 0, frame_s: 1.0 })
    }

    /// Its `scene` message; a log's generation is its number.
    pub(crate) fn message(&self) -> String {
        Answer::Scene { generation: self.times().log as u32, scene: &self.description }.text()
    }

    /// How far it is, as a message; and whether it is at its end.
    pub(crate) fn progress(&self) -> (String, bool) {
        let FrameTimes { log, frames, .. } = self.times();
        self.read(|made| {
            if let Some(text) = &made.failure {
                return (Answer::Error { text }.text(), true);
            }
            let share = made.pictures.len() as f64 / frames.max(1) as f64;
            let job = format!("log {log}");
            let what = format!("{} of {frames} pictures", made.pictures.len());
            let progress = Answer::Progress { job: &job, what: &what, share: Some(share), done: made.done };
            (progress.text(), made.done)
        })
    }

    /// Pictures from a number on, each after its length, within so many bytes.
    pub(crate) fn frames(&self, from: usize, count: usize, most_bytes: usize) -> Vec<u8> {
        let mut out = Vec::new();
        self.read(|made| {
            for picture in made.pictures.iter().skip(from).take(count) {
                if !out.is_empty() && out.len() + picture.len() > most_bytes {
                    break;
                }
                out.extend_from_slice(&(picture.len() as u32).to_le_bytes());
                out.extend_from_slice(picture);
            }
        });
        out
    }

    /// What plots take.
    pub(crate) fn series(&self) -> Value {
        self.read(|made| {
            let every = made.times.len().div_ceil(MOST_MOMENTS).max(1);
            let devices = self.devices.iter().zip(&made.forces).map(|(name, forces)| {
                let force: Vec<[f64; 3]> = forces.iter().step_by(every).copied().collect();
                json!({ "name": name, "force": force })
            });
            let mut energy: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
            for ledger in made.energies.iter().step_by(every) {
                ledger
                    .named()
                    .into_iter()
                    .for_each(|(name, value)| energy.entry(name).or_default().push(value));
            }
            let times: Vec<f64> = made.times.iter().step_by(every).copied().collect();
            json!({ "t": times, "devices": devices.collect::<Vec<_>>(), "energy": energy })
        })
    }
}

impl LogFrameBuilder {
    /// Add the next frame.
    pub fn take(&mut self, moment: &Snapshot) {
        let picture = self.maker.make(moment, FrameFormat::Modal);
        self.show.write(|made| {
            made.pictures.push(picture);
            made.times.push(moment.time_s);
            made.energies.push(moment.energy);
            for (forces, device) in made.forces.iter_mut().zip(&moment.devices) {
                forces.push(device.force_on_hand.to_array());
            }
        });
    }

    /// There are no more; if so, why.
    pub fn finish(self, failure: Option<String>) {
        self.show.write(|made| (made.done, made.failure) = (failure.is_none(), failure));
    }
}
