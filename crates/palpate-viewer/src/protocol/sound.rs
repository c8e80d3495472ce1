//! Blocks of sound (docs/viewer-protocol.md, "Sound").

/// First bytes of a block: `PLPS`.
pub(crate) const SOUND_MAGIC: u32 = 0x5350_4c50;

/// Block of samples of a generation, −1 to 1.
pub(crate) fn encode_sound(generation: u32, sample_rate_hz: u32, samples: &[f32]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(16 + 4 * samples.len());
    for number in [SOUND_MAGIC, generation, sample_rate_hz, samples.len() as u32] {
        bytes.extend(number.to_le_bytes());
    }
    samples.iter().for_each(|sample| bytes.extend(sample.to_le_bytes()));
    bytes
}
