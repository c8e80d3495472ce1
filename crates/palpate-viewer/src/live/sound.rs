//! Sound of the running scene: step records from the force process, blocks of samples to the pages that asked for them.
//!
//! ```text
//! force process → buffer pool → sound thread → blocks of samples → pages
//! ```
//!
//! While no page listens nothing is recorded. In slow motion and in a pause there is no sound: its frequencies would be wrong.

use crate::protocol::encode_sound;
use axum::body::Bytes;
use palpate::{Model, State};
use palpate_haptics::{Playback, PoolConsumer, PoolProducer, StepListener, buffer_pool};
use palpate_sound::{SoundParameters, StepRecord, Synthesiser};
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;
use tokio::sync::broadcast;

/// Interval of the blocks.
const BLOCK_INTERVAL: Duration = Duration::from_millis(4);

/// Interval at which the thread looks for pages that listen, while none does.
const IDLE_INTERVAL: Duration = Duration::from_millis(20);

/// Capacity of the pool of step records [s, steps]: several blocks.
const POOL_S: f64 = 0.05;
const POOL_STEPS: (usize, usize) = (32, 512);

/// Capacity of the queue of each page [blocks].
const QUEUE: usize = 16;

/// Blocks of sound to the pages that listen.
pub(crate) struct SoundBlocks {
    sender: broadcast::Sender<Bytes>,
    listeners: AtomicUsize,
}

impl Default for SoundBlocks {
    fn default() -> Self {
        Self { sender: broadcast::channel(QUEUE).0, listeners: AtomicUsize::new(0) }
    }
}

impl SoundBlocks {
    /// Receiver of the blocks from now on.
    pub fn subscribe(&self) -> broadcast::Receiver<Bytes> {
        self.sender.subscribe()
    }

    /// Counts a page that begins or ends to listen.
    pub fn count(&self, listens: bool) {
        if listens {
            self.listeners.fetch_add(1, Ordering::Relaxed);
        } else {
            self.listeners.fetch_sub(1, Ordering::Relaxed);
        }
    }

    fn has_listeners(&self) -> bool {
        self.listeners.load(Ordering::Relaxed) > 0
    }
}

/// Thread that makes the sound of a scene, until it is dropped.
pub(super) struct SoundThread {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl SoundThread {
    /// Starts the thread for a scene from a state on; returns the listener for its force process.
    pub fn start(
        (model, state): (&Model, &State),
        generation: u32,
        blocks: &Arc<SoundBlocks>,
        playback: &Arc<Playback>,
    ) -> io::Result<(Self, StepListener)> {
        let parameters = SoundParameters::default();
        let synthesiser = Synthesiser::new(model, state, &parameters);
        let (least, most) = POOL_STEPS;
        let capacity = ((POOL_S / model.parameters().step_s) as usize).clamp(least, most);
        let (producer, records) = buffer_pool(capacity, || StepRecord::new(&synthesiser));
        let stop = Arc::new(AtomicBool::new(false));
        let maker = SoundMaker {
            synthesiser,
            records,
            blocks: blocks.clone(),
            playback: playback.clone(),
            generation,
            sample_rate_hz: parameters.sample_rate_hz as u32,
            samples: Vec::new(),
        };
        let stopped = stop.clone();
        let thread = Builder::new().name("palpate sound".into()).spawn(move || maker.run(&stopped))?;
        Ok((Self { stop, thread: Some(thread) }, listener(producer, blocks.clone())))
    }
}

impl Drop for SoundThread {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Listener that records steps while a page listens.
fn listener(mut producer: PoolProducer<StepRecord>, blocks: Arc<SoundBlocks>) -> StepListener {
    Box::new(move |_, state| {
        if blocks.has_listeners() {
            producer.produce(|record| record.capture(state));
        }
    })
}

/// State of the sound thread.
struct SoundMaker {
    synthesiser: Synthesiser,
    records: PoolConsumer<StepRecord>,
    blocks: Arc<SoundBlocks>,
    playback: Arc<Playback>,
    generation: u32,
    sample_rate_hz: u32,
    samples: Vec<f32>,
}

impl SoundMaker {
    fn run(mut self, stop: &AtomicBool) {
        while !stop.load(Ordering::Relaxed) {
            self.make_block();
            let is_idle = !self.blocks.has_listeners();
            std::thread::sleep(if is_idle { IDLE_INTERVAL } else { BLOCK_INTERVAL });
        }
    }

    /// Makes a block of the steps that have been recorded, and sends it.
    fn make_block(&mut self) {
        let Self { synthesiser, records, samples, .. } = self;
        samples.clear();
        let is_heard = self.playback.is_at_full_speed();
        let taken: Result<(), ()> = records.consume(|record| {
            if is_heard {
                synthesiser.synthesise(record, samples);
            }
            Ok(())
        });
        if taken.is_ok() && !samples.is_empty() {
            // Without listeners there is nobody to receive it.
            let _ =
                self.blocks.sender.send(encode_sound(self.generation, self.sample_rate_hz, samples).into());
        }
    }
}
