//! Log writer: a thread beside the force process that cannot disturb it.

use super::file::{LogFile, LogStart};
use super::records::{FrameRecord, StepRecord};
use crate::buffer_pool::{PoolConsumer, PoolProducer, buffer_pool};
use crate::error::Error;
use crate::scene_names::SceneNames;
use palpate::{Input, Model, State};
use std::collections::BTreeMap;
use std::io::{Seek, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant, SystemTime};

/// Buffers for steps: 2 s at 4 kHz.
const STEP_BUFFERS: usize = 8192;

/// Buffers for frames: 1 s at 60 Hz.
const FRAME_BUFFERS: usize = 64;

/// Sleep of the writer when there is nothing to write.
const POLL_INTERVAL: Duration = Duration::from_millis(5);

/// Wall-clock time after which a chunk is ended and handed to the disk: what a kill or a power cut takes. Shorter chunks compress worse.
const CHUNK_INTERVAL: Duration = Duration::from_millis(500);

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
        let start_ns = SystemTime::UNIX_EPOCH.elapsed().map_or(0, |time| time.as_nanos() as u64);
        let file = LogFile::new(out, LogStart { names, facts: metadata, files, state, start_ns })?;
        let (step_producer, steps) = buffer_pool(STEP_BUFFERS, || StepRecord::new(state, input));
        let (frame_producer, frames) = buffer_pool(FRAME_BUFFERS, || FrameRecord::new(model, state, input));
        let sender = LogSender { steps: step_producer, frames: frame_producer };
        Ok((sender, Self { steps, frames, file }))
    }

    /// Writes until `done` is set and all buffers are empty, or writing fails, for example on a full disk.
    pub fn run(self, done: &AtomicBool) -> WrittenLog<W> {
        let Self { mut steps, mut frames, mut file } = self;
        let written = write_until(&mut file, done, (&mut steps, &mut frames));
        let (steps, failure) = (file.whole_steps(), written.err());
        WrittenLog { steps, sink: file.into_sink(), failure }
    }
}

/// Writes until `done` is set and all buffers are empty.
fn write_until<W: Write + Seek>(
    file: &mut LogFile<W>,
    done: &AtomicBool,
    (steps, frames): (&mut PoolConsumer<StepRecord>, &mut PoolConsumer<FrameRecord>),
) -> Result<(), Error> {
    let mut chunk_begun = Instant::now();
    loop {
        // Read before the buffers: whatever was recorded before `done` was set is written.
        let last = done.load(Ordering::Acquire);
        steps.consume(|record| file.write_step(record))?;
        frames.consume(|record| file.write_frame(record))?;
        if last {
            return file.finish();
        }
        if chunk_begun.elapsed() >= CHUNK_INTERVAL {
            file.end_chunk()?;
            chunk_begun = Instant::now();
        }
        std::thread::sleep(POLL_INTERVAL);
    }
}
