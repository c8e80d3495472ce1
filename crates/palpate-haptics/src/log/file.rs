//! File of a log: MCAP records of steps and frames, without a thread or a clock.

use super::messages::{ModesMessage, STEP_TOPIC, StartMessage, StepMessageOf, contacts, transforms};
use super::records::{FrameRecord, StepRecord};
use super::schemas;
use crate::error::{Error, LogError, with_sources};
use crate::scene_names::SceneNames;
use mcap::records::{MessageHeader, Metadata};
use mcap::{Attachment, WriteOptions, Writer};
use palpate::State;
use serde::Serialize;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::{Seek, Write};

/// Name of the metadata record with the initial state of every object.
pub(super) const START: &str = "start";

/// Length of the messages after which a chunk is ended [bytes]: the usual length of MCAP chunks.
pub(super) const CHUNK_BYTES: usize = 1 << 20;

/// MCAP file that is being written.
pub struct LogFile<W: Write + Seek> {
    /// Writer; `None` once the sink was taken.
    writer: Option<Writer<W>>,
    names: SceneNames,
    channels: Channels,
    text: Vec<u8>,
    start_ns: u64,
    /// Written steps, and those of them in whole chunks.
    steps: u64,
    whole_steps: u64,
    /// Length of the messages in the chunk that is being written, and of all of them [bytes].
    chunk_bytes: usize,
    message_bytes: usize,
}

/// Channel ids of the topics.
struct Channels {
    step: u16,
    contacts: u16,
    modes: u16,
    tf: u16,
}

/// Begin of a log: the scene as it starts.
pub struct LogStart<'a> {
    /// Names of the scene's parts.
    pub names: SceneNames,
    /// Facts about the scene.
    pub facts: BTreeMap<String, String>,
    /// Names and contents of the files that the scene was read from.
    pub files: &'a [(String, Vec<u8>)],
    /// State before the first step.
    pub state: &'a State,
    /// Wall-clock time [ns since 1970].
    pub start_ns: u64,
}

pub(super) fn failed(error: impl std::error::Error) -> Error {
    LogError::Write { reason: with_sources(&error) }.into()
}

/// Options of every log. Chunks are written at once, when they are whole, and end with a flush.
pub(super) fn write_options() -> WriteOptions {
    let options = WriteOptions::new().library(concat!("palpate ", env!("CARGO_PKG_VERSION")));
    // The compressor is C.
    #[cfg(not(target_family = "wasm"))]
    let options = options.compression(Some(mcap::Compression::Zstd)).compression_level(1);
    #[cfg(target_family = "wasm")]
    let options = options.compression(None);
    options.chunk_size(None).disable_seeking(true)
}

impl<W: Write + Seek> LogFile<W> {
    /// Begins a log: its scene, initial state and schemas.
    ///
    /// # Errors
    /// If writing fails.
    pub fn new(out: W, start: LogStart) -> Result<Self, Error> {
        let LogStart { names, facts, files, state, start_ns } = start;
        let mut writer = write_options().create(out).map_err(failed)?;
        for (name, data) in files {
            let attachment = Attachment {
                log_time: start_ns,
                create_time: start_ns,
                name: name.clone(),
                media_type: "application/octet-stream".to_string(),
                data: Cow::Borrowed(data),
            };
            writer.attach(&attachment).map_err(failed)?;
        }
        let start = |(name, motion)| {
            serde_json::to_string(&StartMessage::from(motion)).map(|text| (String::clone(name), text))
        };
        let motions = state.snapshots();
        let starts: Result<_, _> = names.objects.iter().zip(&motions).map(start).collect();
        for (name, metadata) in [("palpate", facts), (START, starts.map_err(failed)?)] {
            writer.write_metadata(&Metadata { name: name.to_string(), metadata }).map_err(failed)?;
        }
        let mut channel = |topic: &str, schema: &str, text: &str| -> Result<u16, Error> {
            let schema = writer.add_schema(schema, "jsonschema", text.as_bytes()).map_err(failed)?;
            writer.add_channel(schema, topic, "json", &BTreeMap::new()).map_err(failed)
        };
        let channels = Channels {
            step: channel(STEP_TOPIC, "palpate.Step", &schemas::step(&names).to_string())?,
            contacts: channel("/contacts", "palpate.Contacts", &schemas::contacts().to_string())?,
            modes: channel("/modes", "palpate.Modes", &schemas::modes(&names).to_string())?,
            tf: channel("/tf", "foxglove.FrameTransforms", TRANSFORMS_SCHEMA)?,
        };
        Ok(Self {
            writer: Some(writer),
            names,
            channels,
            text: Vec::new(),
            start_ns,
            steps: 0,
            whole_steps: 0,
            chunk_bytes: 0,
            message_bytes: 0,
        })
    }

    /// Number of steps in whole chunks.
    pub fn whole_steps(&self) -> u64 {
        self.whole_steps
    }

    /// Length of all messages, before compression [bytes].
    pub fn message_bytes(&self) -> usize {
        self.message_bytes
    }

    /// Ends the file with its summary.
    ///
    /// # Errors
    /// If writing fails.
    pub fn finish(&mut self) -> Result<(), Error> {
        self.end_chunk()?;
        let Some(writer) = &mut self.writer else { return Ok(()) };
        writer.finish().map(drop).map_err(failed)
    }

    /// Sink, as far as it was written.
    pub fn into_sink(mut self) -> W {
        match self.writer.take() {
            Some(writer) => writer.into_inner(),
            None => unreachable!("the sink is taken once"),
        }
    }

    /// Ends the chunk and hands it to the disk, if it has steps.
    ///
    /// # Errors
    /// If writing fails.
    pub fn end_chunk(&mut self) -> Result<(), Error> {
        if let Some(writer) = &mut self.writer
            && self.steps > self.whole_steps
        {
            writer.flush().map_err(failed)?;
            (self.whole_steps, self.chunk_bytes) = (self.steps, 0);
        }
        Ok(())
    }

    /// Writes a step, and ends a chunk that is long.
    ///
    /// # Errors
    /// If writing fails.
    pub fn write_step(&mut self, record: &StepRecord) -> Result<(), Error> {
        self.steps += 1;
        let time = self.time_ns(record.time_s);
        self.write(self.channels.step, record.step, time, |names| StepMessageOf(record, names))?;
        if self.chunk_bytes >= CHUNK_BYTES { self.end_chunk() } else { Ok(()) }
    }

    /// Writes a frame.
    ///
    /// # Errors
    /// If writing fails.
    pub fn write_frame(&mut self, record: &FrameRecord) -> Result<(), Error> {
        let (step, time) = (record.step, self.time_ns(record.time_s));
        self.write(self.channels.contacts, step, time, |names| contacts(record, names))?;
        self.write(self.channels.modes, step, time, |names| ModesMessage(record, names))?;
        self.write(self.channels.tf, step, time, |names| transforms(record, names, time))
    }

    /// Log time [ns since 1970]: wall-clock time of the log's beginning plus simulated time.
    fn time_ns(&self, time_s: f64) -> u64 {
        self.start_ns + (time_s * 1e9) as u64
    }

    fn write<'s, M: Serialize>(
        &'s mut self,
        channel_id: u16,
        step: u64,
        time: u64,
        message: impl FnOnce(&'s SceneNames) -> M,
    ) -> Result<(), Error> {
        self.text.clear();
        serde_json::to_writer(&mut self.text, &message(&self.names)).map_err(failed)?;
        let header = MessageHeader { channel_id, sequence: step as u32, log_time: time, publish_time: time };
        let Some(writer) = &mut self.writer else { return Ok(()) };
        writer.write_to_known_channel(&header, &self.text).map_err(failed)?;
        self.chunk_bytes += self.text.len();
        self.message_bytes += self.text.len();
        Ok(())
    }
}

impl<W: Write + Seek> Drop for LogFile<W> {
    fn drop(&mut self) {
        // A writer that is dropped finishes its file: that of a scene which never ran would stay.
        drop(self.writer.take().map(Writer::into_inner));
    }
}

/// Foxglove's schema `foxglove.FrameTransforms`, as far as its 3D panel needs it.
const TRANSFORMS_SCHEMA: &str = r#"{"title":"foxglove.FrameTransforms","type":"object","properties":{"transforms":{"type":"array","items":{
"type":"object","properties":{"timestamp":{"type":"object","properties":{"sec":{"type":"integer"},"nsec":{"type":"integer"}}},
"parent_frame_id":{"type":"string"},"child_frame_id":{"type":"string"},
"translation":{"type":"object","properties":{"x":{"type":"number"},"y":{"type":"number"},"z":{"type":"number"}}},
"rotation":{"type":"object","properties":{"x":{"type":"number"},"y":{"type":"number"},"z":{"type":"number"},"w":{"type":"number"}}}}}}}}"#;
