//! Sound of a run as a WAV file: 16 bits, one channel.
//!
//! RIFF with a `fmt ` and a `data` chunk, little-endian (Microsoft and IBM, Multimedia Programming Interface and Data Specifications 1.0,
//! 1991). Samples are rounded to multiples of 1/32767.

use crate::atomic_file::AtomicFile;
use crate::error::ExportError;
use palpate::{Model, State};
use palpate_sound::{SoundParameters, StepRecord, Synthesiser};
use std::io::{Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// Length of the header [bytes], and the part of it that the length in the file counts.
const HEADER: u64 = 44;
const COUNTED: u64 = 36;

/// Length of a sample [bytes].
const SAMPLE: u64 = 2;

/// Writer of the sound of a run.
pub(crate) struct SoundFile {
    file: AtomicFile,
    synthesiser: Synthesiser,
    record: StepRecord,
    samples: Vec<f32>,
    bytes: Vec<u8>,
    sample_rate_hz: u32,
    written: u64,
    peak: f32,
}

impl SoundFile {
    /// Creates the file for a run of `steps` steps from a state.
    pub fn new(
        path: &Path,
        inputs: &[&Path],
        (model, state): (&Model, &State),
        parameters: &SoundParameters,
        steps: usize,
    ) -> Result<Self, ExportError> {
        let seconds = steps as f64 * model.parameters().step_s;
        let bytes = (seconds * parameters.sample_rate_hz) as u64 * SAMPLE + COUNTED;
        if bytes > u64::from(u32::MAX) {
            return Err(ExportError::SoundTooLong { path: path.to_path_buf(), seconds });
        }
        let mut file = AtomicFile::create(path, inputs)?;
        let sample_rate_hz = parameters.sample_rate_hz as u32;
        file.write(&header(sample_rate_hz, 0))?;
        let synthesiser = Synthesiser::new(model, state, parameters);
        let record = StepRecord::new(&synthesiser);
        let (samples, bytes) = (Vec::new(), Vec::new());
        Ok(Self { file, synthesiser, record, samples, bytes, sample_rate_hz, written: 0, peak: 0.0 })
    }

    /// Adds the last step of a state.
    pub fn write(&mut self, state: &State) -> Result<(), ExportError> {
        self.samples.clear();
        self.bytes.clear();
        self.record.capture(state);
        self.synthesiser.synthesise(&self.record, &mut self.samples);
        for sample in &self.samples {
            self.peak = self.peak.max(sample.abs());
            let rounded = (f64::from(*sample) * f64::from(i16::MAX)).round() as i16;
            self.bytes.extend(rounded.to_le_bytes());
        }
        self.written += self.bytes.len() as u64;
        self.file.write(&self.bytes)
    }

    /// Largest size of a sample so far [1, of full scale].
    pub fn peak(&self) -> f32 {
        self.peak
    }

    /// Completes the file.
    pub fn finish(mut self) -> Result<PathBuf, ExportError> {
        let path = self.file.path().to_path_buf();
        self.file.seek(SeekFrom::Start(0)).map_err(|e| ExportError::io("write", &path, e))?;
        self.file.write(&header(self.sample_rate_hz, self.written as u32))?;
        self.file.finish()
    }
}

/// Header of a file with a length of samples [bytes].
fn header(sample_rate_hz: u32, length: u32) -> [u8; HEADER as usize] {
    let mut header = [0; HEADER as usize];
    let mut at = 0;
    let mut put = |bytes: &[u8]| {
        header[at..at + bytes.len()].copy_from_slice(bytes);
        at += bytes.len();
    };
    put(b"RIFF");
    put(&(length + COUNTED as u32).to_le_bytes());
    put(b"WAVEfmt ");
    put(&16_u32.to_le_bytes());
    // PCM, one channel.
    put(&1_u16.to_le_bytes());
    put(&1_u16.to_le_bytes());
    put(&sample_rate_hz.to_le_bytes());
    put(&(sample_rate_hz * SAMPLE as u32).to_le_bytes());
    put(&(SAMPLE as u16).to_le_bytes());
    put(&(8 * SAMPLE as u16).to_le_bytes());
    put(b"data");
    put(&length.to_le_bytes());
    header
}
