//! Log writer: a thread beside the force process that cannot disturb it.

use super::buffer_pool::{PoolConsumer, PoolProducer, buffer_pool};
use super::messages::{ModesMessage, SceneNames, StartMessage, StepMessageOf, contacts, transforms};
use super::records::{FrameRecord, StepRecord};
use crate::error::{Error, LogError, with_sources};
use mcap::records::{MessageHeader, Metadata};
use mcap::{Attachment, Compression, WriteOptions, Writer};
use palpate::{Input, Model, State};
use serde::Serialize;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::{Seek, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, SystemTime};

/// Buffers for steps: 2 s at 4 kHz.
const STEP_BUFFERS: usize = 8192;

/// Buffers for frames: 1 s at 60 Hz.
const FRAME_BUFFERS: usize = 64;

/// Name of the metadata record with the initial state of every object.
pub(super) const START: &str = "start";

/// Sleep of the writer when there is nothing to write.
const POLL_INTERVAL: Duration = Duration::from_millis(5);

/// Force process's end of a log.
pub struct LogSender {
    steps: PoolProducer<StepRecord>,
    frames: PoolProducer<FrameRecord>,
}

/// Writer's end of a log.
pub struct LogWriter<W: Write + Seek> {
    steps: PoolConsumer<StepRecord>,
    frames: PoolConsumer<FrameRecord>,
    file: LogFile<W>,
}

/// MCAP file that is being written.
struct LogFile<W: Write + Seek> {
    writer: Writer<W>,
    names: SceneNames,
    channels: Channels,
    text: Vec<u8>,
    start_ns: u64,
    steps: u64,
}

/// Channel ids of the topics.
struct Channels {
    step: u16,
    contacts: u16,
    modes: u16,
    tf: u16,
}

/// Summary of a finished log.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LogSummary {
    /// Written steps.
    pub steps: u64,
    /// Steps that were dropped because the writer was too slow. A replay ends before the first.
    pub missed: u64,
}

impl LogSender {
    /// Records a step, if a buffer is free.
    ///
    /// # Real time
    /// No allocation, lock or system call.
    pub fn record_step(&mut self, fill: impl FnOnce(&mut StepRecord)) {
        self.steps.produce(fill);
    }

    /// Records a frame, if a buffer is free.
    ///
    /// # Real time
    /// No allocation, lock or system call.
    pub fn record_frame(&mut self, fill: impl FnOnce(&mut FrameRecord)) {
        self.frames.produce(fill);
    }

    /// Number of steps that were dropped because the writer was too slow.
    pub fn missed(&self) -> u64 {
        self.steps.missed()
    }
}

fn failed(error: impl std::error::Error) -> Error {
    LogError::Write { reason: with_sources(&error) }.into()
}

impl<W: Write + Seek> LogWriter<W> {
    /// Begins a log of a scene with its current state, metadata about the scene, and the files that it was read from.
    ///
    /// # Errors
    /// If writing fails.
    pub fn new(
        out: W,
        names: SceneNames,
        metadata: BTreeMap<String, String>,
        files: &[(String, Vec<u8>)],
        (model, state, input): (&Model, &State, &Input),
    ) -> Result<(LogSender, Self), Error> {
        let options = WriteOptions::new()
            .library(concat!("palpate ", env!("CARGO_PKG_VERSION")))
            .compression(Some(Compression::Zstd))
            .compression_level(1);
        let mut writer = options.create(out).map_err(failed)?;
        let start_ns = SystemTime::UNIX_EPOCH.elapsed().map_or(0, |time| time.as_nanos() as u64);
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
        for (name, metadata) in [("palpate", metadata), (START, starts.map_err(failed)?)] {
            writer.write_metadata(&Metadata { name: name.to_string(), metadata }).map_err(failed)?;
        }
        let mut channel = |topic: &str, schema: &str, text: &str| -> Result<u16, Error> {
            let schema = writer.add_schema(schema, "jsonschema", text.as_bytes()).map_err(failed)?;
            writer.add_channel(schema, topic, "json", &BTreeMap::new()).map_err(failed)
        };
        let object = r#"{"type":"object"}"#;
        let channels = Channels {
            step: channel("/step", "palpate.Step", object)?,
            contacts: channel("/contacts", "palpate.Contacts", object)?,
            modes: channel("/modes", "palpate.Modes", object)?,
            tf: channel("/tf", "foxglove.FrameTransforms", TRANSFORMS_SCHEMA)?,
        };
        let (step_producer, steps) = buffer_pool(STEP_BUFFERS, || StepRecord::new(state, input));
        let (frame_producer, frames) = buffer_pool(FRAME_BUFFERS, || FrameRecord::new(model, state, input));
        let sender = LogSender { steps: step_producer, frames: frame_producer };
        let file = LogFile { writer, names, channels, text: Vec::new(), start_ns, steps: 0 };
        Ok((sender, Self { steps, frames, file }))
    }

    /// Writes until `done` is set and all buffers are empty. Returns the number of written steps and the finished sink.
    ///
    /// # Errors
    /// If writing fails, for example on a full disk.
    pub fn run(self, done: &AtomicBool) -> Result<(u64, W), Error> {
        let Self { mut steps, mut frames, mut file } = self;
        loop {
            // Read before the buffers: whatever was recorded before `done` was set is written.
            let last = done.load(Ordering::Acquire);
            steps.consume(|record| file.write_step(record))?;
            frames.consume(|record| file.write_frame(record))?;
            if last {
                break;
            }
            std::thread::sleep(POLL_INTERVAL);
        }
        file.writer.finish().map_err(failed)?;
        let mut out = file.writer.into_inner();
        out.flush().map_err(failed)?;
        Ok((file.steps, out))
    }
}

impl<W: Write + Seek> LogFile<W> {
    fn write_step(&mut self, record: &StepRecord) -> Result<(), Error> {
        self.steps += 1;
        let time = self.time_ns(record.time_s);
        self.write(self.channels.step, record.step, time, |names| StepMessageOf(record, names))
    }

    fn write_frame(&mut self, record: &FrameRecord) -> Result<(), Error> {
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
        self.writer.write_to_known_channel(&header, &self.text).map_err(failed)
    }
}

/// Foxglove's schema `foxglove.FrameTransforms`, as far as its 3D panel needs it.
const TRANSFORMS_SCHEMA: &str = r#"{"title":"foxglove.FrameTransforms","type":"object","properties":{"transforms":{"type":"array","items":{
"type":"object","properties":{"timestamp":{"type":"object","properties":{"sec":{"type":"integer"},"nsec":{"type":"integer"}}},
"parent_frame_id":{"type":"string"},"child_frame_id":{"type":"string"},
"translation":{"type":"object","properties":{"x":{"type":"number"},"y":{"type":"number"},"z":{"type":"number"}}},
"rotation":{"type":"object","properties":{"x":{"type":"number"},"y":{"type":"number"},"z":{"type":"number"},"w":{"type":"number"}}}}}}}}"#;
