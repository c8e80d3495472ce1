//! Log of a run that was recorded by its inputs: its steps are computed again and written, without a file system.

use crate::error::{SceneError, SceneErrorKind};
use crate::file::{PartsInMemory, RunMode, read_scene_text};
use crate::log_facts::log_facts;
use crate::scene::Scene;
use palpate::{State, step};
use palpate_haptics::log::{FrameRecord, LogFile, LogStart, StepRecord};
use palpate_haptics::{InputReader, steps_per_frame};
use std::io::Cursor;
use std::path::Path;

/// Name of the scene in the log.
const SCENE: &str = "scene.toml";

/// Frames per second of the log's contacts, modes and poses [Hz].
const FRAME_RATE_HZ: f64 = 60.0;

/// Length of the messages at which a log ends [bytes]: it is held in memory.
const LARGEST_BYTES: usize = 200_000_000;

/// Log that is being made.
pub struct LogMaker {
    scene: Scene,
    state: State,
    inputs: InputReader,
    step: u64,
    frame_steps: u64,
    steps: StepRecord,
    frames: FrameRecord,
    file: LogFile<Cursor<Vec<u8>>>,
}

impl LogMaker {
    /// Log of a scene's text with its parts, from the numbers of an [`InputRecord`](palpate_haptics::InputRecord); `start_ns` is the wall-clock time of its start [ns since
    /// 1970].
    ///
    /// # Errors
    /// When the scene is refused, or the numbers are no record.
    pub fn new(
        text: String,
        parts: &PartsInMemory,
        numbers: Vec<f64>,
        start_ns: u64,
    ) -> Result<Self, SceneError> {
        let failed = |reason: String| SceneError::new(SceneErrorKind::Log, reason);
        let mut files = vec![(SCENE.to_string(), text.as_bytes().to_vec())];
        for (name, recording) in &parts.recordings {
            let bytes = recording.to_bytes().map_err(|error| failed(error.to_string()))?;
            files.push((name.display().to_string(), bytes));
        }
        for (name, path) in &parts.paths {
            files.push((name.display().to_string(), path.clone().into_bytes()));
        }
        files[1..].sort();
        let scene = read_scene_text(Path::new(SCENE), &text, parts, RunMode::RealTime)?;
        let (inputs, start) =
            InputReader::new(numbers).ok_or_else(|| failed("the inputs are no record".into()))?;
        let state = State::resume(&scene.model, &start);
        let input = scene.input_at(0.0);
        let step_s = scene.model.parameters().step_s;
        let facts = log_facts(SCENE.to_string(), step_s);
        let begin = LogStart { names: scene.names(), facts, files: &files, state: &state, start_ns };
        let file = LogFile::new(Cursor::new(Vec::new()), begin).map_err(|error| failed(error.to_string()))?;
        Ok(Self {
            steps: StepRecord::new(&state, &input),
            frames: FrameRecord::new(&scene.model, &state, &input),
            frame_steps: steps_per_frame(FRAME_RATE_HZ, step_s),
            scene,
            state,
            inputs,
            step: 0,
            file,
        })
    }

    /// Number of steps so far.
    pub fn steps(&self) -> u64 {
        self.step
    }

    /// Computes and writes the next step; false when there is none, or the log is full.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn advance(&mut self) -> Result<bool, SceneError> {
        if self.file.message_bytes() >= LARGEST_BYTES {
            return Ok(false);
        }
        let Some(input) = self.inputs.input() else { return Ok(false) };
        step(&self.scene.model, &mut self.state, &input);
        self.step += 1;
        self.steps.capture(&input, &self.state);
        (self.steps.step, self.steps.tick) = (self.step, self.step);
        let mut written = self.file.write_step(&self.steps);
        if self.step.is_multiple_of(self.frame_steps) {
            self.frames.capture(&input, &self.state);
            self.frames.step = self.step;
            written = written.and_then(|()| self.file.write_frame(&self.frames));
        }
        written.map(|()| true).map_err(|error| SceneError::new(SceneErrorKind::Log, error))
    }

    /// Bytes of the whole log.
    ///
    /// # Errors
    /// When there is no step, or it cannot be written.
    pub fn finish(mut self) -> Result<Vec<u8>, SceneError> {
        let failed = |reason: String| SceneError::new(SceneErrorKind::Log, reason);
        if self.step == 0 {
            return Err(failed("no step was made".into()));
        }
        self.file.finish().map_err(|error| failed(error.to_string()))?;
        Ok(self.file.into_sink().into_inner())
    }
}
