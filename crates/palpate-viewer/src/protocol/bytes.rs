//! Little-endian byte writer.

use glam::DVec3;
use palpate::Pose;

/// Growing byte buffer.
#[derive(Debug, Default)]
pub(super) struct Bytes(pub Vec<u8>);

impl Bytes {
    /// Appends an integer.
    pub fn u32(&mut self, value: u32) {
        self.0.extend_from_slice(&value.to_le_bytes());
    }

    /// Appends a number in double precision.
    pub fn f64(&mut self, value: f64) {
        self.0.extend_from_slice(&value.to_le_bytes());
    }

    /// Appends a number in single precision.
    pub fn f32(&mut self, value: f64) {
        self.0.extend_from_slice(&(value as f32).to_le_bytes());
    }

    /// Appends three components in single precision.
    pub fn vector(&mut self, value: DVec3) {
        value.to_array().into_iter().for_each(|x| self.f32(x));
    }

    /// Appends position, then orientation x, y, z, w.
    pub fn pose(&mut self, pose: &Pose) {
        self.vector(pose.position);
        pose.orientation.to_array().into_iter().for_each(|x| self.f32(x));
    }

    /// Pads with zeros to a multiple of 4 bytes.
    pub fn pad(&mut self) {
        self.0.resize(self.0.len().next_multiple_of(4), 0);
    }
}
