//! Log writer: a thread beside the force process that cannot disturb it.

use super::messages::{ModesMessage, STEP_TOPIC, StartMessage, StepMessageOf, contacts, transforms};
use super::records::{FrameRecord, StepRecord};
use super::schemas;
use crate::buffer_pool::{PoolConsumer, PoolProducer, buffer_pool};
use crate::error::{Error, LogError, with_sources};
use crate::scene_names::SceneNames;
use mcap::records::{MessageHeader, Metadata};
use mcap::{Attachment, Compression, WriteOptions, Writer};
use palpate::{Input, Model, State};
use serde::Serialize;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::{Seek, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant, SystemTime};

/// Buffers for steps: 2 s at 4 kHz.
const STEP_BUFFERS: usize = 8192;

/// Buffers for frames: 1 s at 60 Hz.
const FRAME_BUFFERS: usize = 64;

/// Name of the metadata record with the initial state of every object.
pub(super) const START: &str = "start";

/// Sleep of the writer when there is nothing to write.
const POLL_INTERVAL: Duration = Duration::from_millis(5);

/// Wall-clock time after which a chunk is ended and handed to the disk: what a kill or a power cut takes. Shorter chunks compress worse.
const CHUNK_INTERVAL: Duration = Duration::from_millis(500);

/// Length of the messages after which a chunk is ended [bytes]: the usual length of MCAP chunks.
pub(super) const CHUNK_BYTES: usize = 1 << 20;

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
    /// Writer; `None` once the sink was taken.
    writer: Option<Writer<W>>,
    names: SceneNames,
    channels: Channels,
    text: Vec<u8>,
    start_ns: u64,
    /// Written steps, and those of them in whole chunks.
    steps: u64,
    whole_steps: u64,
    /// Length of the messages in the chunk that is being written [bytes].
    chunk_bytes: usize,
    chunk_begun: Instant,
}

/// Channel ids of the topics.
struct Channels {
    step: u16,
    contacts: u16,
    modes: u16,
    tf: u16,
}

/// Summary of a log.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LogSummary {
    /// Steps that can be read; of a log that is cut at least these.
    pub steps: u64,
    /// Steps that were dropped because the writer was too slow, or had failed. A replay ends before the first.
    pub missed: u64,
    /// Whether writing failed, for example on a full disk: the log has no summary.
    pub is_cut: bool,
}

/// Log whose writing has ended.
#[derive(Debug)]
pub struct WrittenLog<W> {
    /// Steps that can be read; after a failure at least these: its chunk may be whole.
    pub steps: u64,
    /// Sink, as far as it was written.
    pub sink: W,
    /// First failure: the log ends with the chunk before.
    pub failure: Option<Error>,
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

pub(super) fn failed(error: impl std::error::Error) -> Error {
    LogError::Write { reason: with_sources(&error) }.into()
}

/// Options of every log. Chunks are written at once, when they are whole, and end with a flush.
pub(super) fn write_options() -> WriteOptions {
    WriteOptions::new()
        .library(concat!("palpate ", env!("CARGO_PKG_VERSION")))
        .compression(Some(Compression::Zstd))
        .compression_level(1)
        .chunk_size(None)
        .disable_seeking(true)
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
        let mut writer = write_options().create(out).map_err(failed)?;
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
        let channels = Channels {
            step: channel(STEP_TOPIC, "palpate.Step", &schemas::step(&names).to_string())?,
            contacts: channel("/contacts", "palpate.Contacts", &schemas::contacts().to_string())?,
            modes: channel("/modes", "palpate.Modes", &schemas::modes(&names).to_string())?,
            tf: channel("/tf", "foxglove.FrameTransforms", TRANSFORMS_SCHEMA)?,
        };
        let (step_producer, steps) = buffer_pool(STEP_BUFFERS, || StepRecord::new(state, input));
        let (frame_producer, frames) = buffer_pool(FRAME_BUFFERS, || FrameRecord::new(model, state, input));
        let sender = LogSender { steps: step_producer, frames: frame_producer };
        let file = LogFile {
            writer: Some(writer),
            names,
            channels,
            text: Vec::new(),
            start_ns,
            steps: 0,
            whole_steps: 0,
            chunk_bytes: 0,
            chunk_begun: Instant::now(),
        };
        Ok((sender, Self { steps, frames, file }))
    }

    /// Writes until `done` is set and all buffers are empty, or writing fails, for example on a full disk.
    pub fn run(self, done: &AtomicBool) -> WrittenLog<W> {
        let Self { mut steps, mut frames, mut file } = self;
        let written = file.write_until(done, &mut steps, &mut frames);
        let (steps, failure) = (file.whole_steps, written.err());
        WrittenLog { steps, sink: file.into_sink(), failure }
    }
}

impl<W: Write + Seek> LogFile<W> {
    fn write_until(
        &mut self,
        done: &AtomicBool,
        steps: &mut PoolConsumer<StepRecord>,
        frames: &mut PoolConsumer<FrameRecord>,
    ) -> Result<(), Error> {
        loop {
            // Read before the buffers: whatever was recorded before `done` was set is written.
            let last = done.load(Ordering::Acquire);
            steps.consume(|record| self.write_step(record))?;
            frames.consume(|record| self.write_frame(record))?;
            if last {
                break;
            }
            if self.chunk_begun.elapsed() >= CHUNK_INTERVAL {
                self.end_chunk()?;
            }
            std::thread::sleep(POLL_INTERVAL);
        }
        self.end_chunk()?;
        let Some(writer) = &mut self.writer else { return Ok(()) };
        writer.finish().map(drop).map_err(failed)
    }

    fn into_sink(mut self) -> W {
        match self.writer.take() {
            Some(writer) => writer.into_inner(),
            None => unreachable!("the sink is taken once"),
        }
    }

    /// Ends the chunk and hands it to the disk, if it has steps.
    fn end_chunk(&mut self) -> Result<(), Error> {
        self.chunk_begun = Instant::now();
        if let Some(writer) = &mut self.writer
            && self.steps > self.whole_steps
        {
            writer.flush().map_err(failed)?;
            (self.whole_steps, self.chunk_bytes) = (self.steps, 0);
        }
        Ok(())
    }

    fn write_step(&mut self, record: &StepRecord) -> Result<(), Error> {
        self.steps += 1;
        let time = self.time_ns(record.time_s);
        self.write(self.channels.step, record.step, time, |names| StepMessageOf(record, names))?;
        if self.chunk_bytes >= CHUNK_BYTES { self.end_chunk() } else { Ok(()) }
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
        let Some(writer) = &mut self.writer else { return Ok(()) };
        writer.write_to_known_channel(&header, &self.text).map_err(failed)?;
        self.chunk_bytes += self.text.len();
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
