//! Logs of one page, computed without a thread: the page calls [`advance`](LocalLogs::advance), and asks for frames as of a server.

use crate::local_scene::PageMessage;
use crate::log_frames::LogFrames;
use crate::log_player::{FrameSteps, LogPlayer};
use crate::protocol::{Hello, LogEntry, PROTOCOL};
use crate::static_data::StaticData;
use palpate_scene::{LogReplay, ReplayError};
use std::path::Path;
use std::sync::Arc;

/// Frame rate of logs [Hz].
const FRAME_RATE_HZ: f64 = 60.0;

/// Largest answer to a request for frames [bytes].
const MAX_FRAMES_BYTES: usize = 8 << 20;

/// Longest time in which steps are made without a look at the page's requests [s].
const MAX_BURST_S: f64 = 0.02;

/// Interval of progress messages [s].
const PROGRESS_INTERVAL_S: f64 = 0.25;

/// Logs that one page plays.
#[derive(Default)]
pub struct LocalLogs {
    frames: Vec<Arc<LogFrames>>,
    /// Logs that are computed, one step of each in turn.
    players: Vec<LogPlayer>,
    /// Time of the next progress messages [s].
    progress_at_s: f64,
}

impl LocalLogs {
    /// Adds a log of the bytes of a file; returns its warning, if it was cut.
    ///
    /// # Errors
    /// When it cannot be read, or its scene is refused.
    pub fn add(&mut self, name: &str, bytes: Vec<u8>) -> Result<Option<String>, ReplayError> {
        let log = LogReplay::from_bytes(Path::new(name), bytes)?;
        let (warning, steps) = (log.warning(), FrameSteps::at_rate(&log, FRAME_RATE_HZ));
        let player = LogPlayer::new(log, name.to_string(), self.frames.len(), steps)?;
        self.frames.push(player.frames.clone());
        self.players.push(player);
        Ok(warning)
    }

    /// Adds a log whose frames are computed elsewhere.
    pub fn show(&mut self, frames: Arc<LogFrames>) {
        self.frames.push(frames);
    }

    /// Sends the first messages: hello, and the scene of each log.
    pub fn greet(&self, send: &mut dyn FnMut(PageMessage)) {
        let hello = Hello {
            protocol: PROTOCOL,
            version: env!("CARGO_PKG_VERSION"),
            kind: "logs",
            viewer: 1,
            records: false,
            scenes: Vec::new(),
            logs: self.frames.iter().map(|log| LogEntry { name: log.name.clone() }).collect(),
            render: None,
        };
        send(PageMessage::Text(serde_json::to_string(&hello).unwrap_or_default()));
        self.frames.iter().for_each(|log| send(PageMessage::Text(log.scene_message())));
    }

    /// Computes steps for some milliseconds; returns whether there are more. `now_s` reads the clock [s].
    pub fn advance(&mut self, now_s: &dyn Fn() -> f64, send: &mut dyn FnMut(PageMessage)) -> bool {
        let end_s = now_s() + MAX_BURST_S;
        while !self.players.is_empty() && now_s() < end_s {
            self.players = std::mem::take(&mut self.players)
                .into_iter()
                .filter_map(|mut player| {
                    let advanced = player.advance();
                    if matches!(advanced, Ok(true)) {
                        return Some(player);
                    }
                    let frames = player.frames.clone();
                    // The failure is that of the frames, which is sent.
                    let _ = player.finish(advanced.err().map(|error| error.to_string()));
                    send(PageMessage::Text(frames.progress().0));
                    None
                })
                .collect();
        }
        if end_s >= self.progress_at_s {
            self.progress_at_s = end_s + PROGRESS_INTERVAL_S;
            for player in &self.players {
                send(PageMessage::Text(player.frames.progress().0));
            }
        }
        !self.players.is_empty()
    }

    /// Encoded data of a path that the server would answer, as `log/0/frames?from=0&count=60`.
    pub fn data(&self, path: &str) -> Option<Vec<u8>> {
        if let Some((number, data)) = StaticData::parse(path) {
            return data.encode(&self.frames.get(number as usize)?.model);
        }
        let (number, request) = path.strip_prefix("log/")?.split_once('/')?;
        let log = self.frames.get(number.parse::<usize>().ok()?)?;
        if request == "series" {
            return serde_json::to_vec(&log.series()).ok();
        }
        let (from, count) = request.strip_prefix("frames?from=")?.split_once("&count=")?;
        Some(log.frames(from.parse().ok()?, count.parse().ok()?, MAX_FRAMES_BYTES))
    }
}
