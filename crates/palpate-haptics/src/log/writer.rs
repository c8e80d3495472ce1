//! Writing a log beside the force process, by a thread that can't disturb it.

use super::messages::{ModesOf, Names, StartMessage, StepOf, contacts, transforms};
use super::record::{Picture, Record};
use crate::error::Error;
use mcap::records::{MessageHeader, Metadata};
use mcap::{Attachment, Compression, WriteOptions, Writer};
use palpate::{Input, Model, State};
use serde::Serialize;
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::{Seek, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, SystemTime};

/// Steps and pictures that may wait for the writer.
const STEPS_WAITING: usize = 8192;
const PICTURES_WAITING: usize = 64;

/// The record that tells how the objects begin.
pub(super) const START: &str = "start";

/// How long the writer sleeps when there is nothing to write.
const NAP: Duration = Duration::from_millis(5);

/// One end of a round: what is full goes one way, what is spare comes back.
struct Giver<T> {
    full: rtrb::Producer<Box<T>>,
    spare: rtrb::Consumer<Box<T>>,
    /// How often nothing was spare.
    missed: u64,
}

/// The other end.
struct Taker<T> {
    full: rtrb::Consumer<Box<T>>,
    spare: rtrb::Producer<Box<T>>,
}

/// A round of so many.
fn round<T>(places: usize, make: impl Fn() -> T) -> (Giver<T>, Taker<T>) {
    let (full_in, full_out) = rtrb::RingBuffer::new(places);
    let (mut spare_in, spare_out) = rtrb::RingBuffer::new(places);
    // Not clones, whose buffers would have no room.
    while spare_in.push(Box::new(make())).is_ok() {}
    (Giver { full: full_in, spare: spare_out, missed: 0 }, Taker { full: full_out, spare: spare_in })
}

impl<T> Giver<T> {
    fn give(&mut self, fill: impl FnOnce(&mut T)) {
        let Ok(mut one) = self.spare.pop() else {
            self.missed += 1;
            return;
        };
        fill(&mut one);
        // There are no more of them than places.
        self.missed += u64::from(self.full.push(one).is_err());
    }
}

impl<T> Taker<T> {
    fn each<E>(&mut self, mut take: impl FnMut(&T) -> Result<(), E>) -> Result<(), E> {
        while let Ok(one) = self.full.pop() {
            take(&one)?;
            // There are no more of them than places.
            let _ = self.spare.push(one);
        }
        Ok(())
    }
}

/// The force process's end of a log.
pub struct LogSender {
    steps: Giver<Record>,
    pictures: Giver<Picture>,
}

/// The writer's end.
pub struct LogWriter<W: Write + Seek> {
    steps: Taker<Record>,
    pictures: Taker<Picture>,
    out: Out<W>,
}

/// The file, and what it takes to write to it.
struct Out<W: Write + Seek> {
    writer: Writer<W>,
    names: Names,
    channels: Channels,
    text: Vec<u8>,
    start_ns: u64,
    steps: u64,
}

struct Channels {
    step: u16,
    contacts: u16,
    modes: u16,
    tf: u16,
}

/// What a log came to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LogSummary {
    /// Steps that were written.
    pub steps: u64,
    /// Steps that the writer was too slow for: a replay ends there.
    pub missed: u64,
}

impl LogSender {
    /// Hand a step to the log, if a record is free.
    ///
    /// # Real time
    /// No allocation, lock or system call.
    pub fn take(&mut self, fill: impl FnOnce(&mut Record)) {
        self.steps.give(fill);
    }

    /// The same with what a picture takes.
    ///
    /// # Real time
    /// No allocation, lock or system call.
    pub fn take_picture(&mut self, fill: impl FnOnce(&mut Picture)) {
        self.pictures.give(fill);
    }

    /// Steps for which the writer was too slow.
    pub fn missed(&self) -> u64 {
        self.steps.missed
    }
}

/// With what the error came from: that the disk is full stands there.
fn failed(error: impl std::error::Error) -> Error {
    let mut text = format!("cannot write the log: {error}");
    let mut source = error.source();
    while let Some(inner) = source {
        text += &format!(": {inner}");
        source = inner.source();
    }
    Error::Log(text)
}

impl<W: Write + Seek> LogWriter<W> {
    /// Begin a log of a scene that goes from a state on, with facts about it and the files that it was read from.
    ///
    /// # Errors
    /// When it can't be written.
    pub fn new(
        out: W,
        names: Names,
        facts: BTreeMap<String, String>,
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
        let begins = |(name, motion)| {
            serde_json::to_string(&StartMessage::from(motion)).map(|text| (String::clone(name), text))
        };
        let motions = state.snapshots();
        let starts: Result<_, _> = names.objects.iter().zip(&motions).map(begins).collect();
        for (name, metadata) in [("palpate", facts), (START, starts.map_err(failed)?)] {
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
            tf: channel("/tf", "foxglove.FrameTransforms", TRANSFORMS)?,
        };
        let (give_steps, steps) = round(STEPS_WAITING, || Record::new(state, input));
        let (give_pictures, pictures) = round(PICTURES_WAITING, || Picture::new(model, state, input));
        let hand = LogSender { steps: give_steps, pictures: give_pictures };
        let out = Out { writer, names, channels, text: Vec::new(), start_ns, steps: 0 };
        Ok((hand, Self { steps, pictures, out }))
    }

    /// Write until `done` is set and nothing is left; gives how many steps were written, and what they were written to.
    ///
    /// # Errors
    /// When the log can't be written: the disk is full, for one.
    pub fn run(self, done: &AtomicBool) -> Result<(u64, W), Error> {
        let Self { mut steps, mut pictures, mut out } = self;
        loop {
            // Whatever was handed over before it was done is written.
            let last = done.load(Ordering::Acquire);
            steps.each(|record| out.step(record))?;
            pictures.each(|picture| out.picture(picture))?;
            if last {
                break;
            }
            std::thread::sleep(NAP);
        }
        out.writer.finish().map_err(failed)?;
        let mut to = out.writer.into_inner();
        to.flush().map_err(failed)?;
        Ok((out.steps, to))
    }
}

impl<W: Write + Seek> Out<W> {
    fn step(&mut self, record: &Record) -> Result<(), Error> {
        self.steps += 1;
        let time = self.stamp(record.time_s);
        self.put(self.channels.step, record.step, time, |names| StepOf(record, names))
    }

    fn picture(&mut self, picture: &Picture) -> Result<(), Error> {
        let (step, time) = (picture.step, self.stamp(picture.time_s));
        self.put(self.channels.contacts, step, time, |names| contacts(picture, names))?;
        self.put(self.channels.modes, step, time, |names| ModesOf(picture, names))?;
        self.put(self.channels.tf, step, time, |names| transforms(picture, names, time))
    }

    /// Simulated time as nanoseconds of the day that the log began.
    fn stamp(&self, time_s: f64) -> u64 {
        self.start_ns + (time_s * 1e9) as u64
    }

    fn put<'s, M: Serialize>(
        &'s mut self,
        channel_id: u16,
        step: u64,
        time: u64,
        message: impl FnOnce(&'s Names) -> M,
    ) -> Result<(), Error> {
        self.text.clear();
        serde_json::to_writer(&mut self.text, &message(&self.names)).map_err(failed)?;
        let header = MessageHeader { channel_id, sequence: step as u32, log_time: time, publish_time: time };
        self.writer.write_to_known_channel(&header, &self.text).map_err(failed)
    }
}

/// Foxglove's own schema of the same name, as far as its 3D panel needs it.
const TRANSFORMS: &str = r#"{"title":"foxglove.FrameTransforms","type":"object","properties":{"transforms":{"type":"array","items":{
"type":"object","properties":{"timestamp":{"type":"object","properties":{"sec":{"type":"integer"},"nsec":{"type":"integer"}}},
"parent_frame_id":{"type":"string"},"child_frame_id":{"type":"string"},
"translation":{"type":"object","properties":{"x":{"type":"number"},"y":{"type":"number"},"z":{"type":"number"}}},
"rotation":{"type":"object","properties":{"x":{"type":"number"},"y":{"type":"number"},"z":{"type":"number"},"w":{"type":"number"}}}}}}}}"#;
