//! Little-endian numbers, one after the other.

use glam::DVec3;
use palpate::Pose;

/// Bytes that grow.
#[derive(Debug, Default)]
pub(super) struct Bytes(pub Vec<u8>);

impl Bytes {
    pub fn u32(&mut self, value: u32) {
        self.0.extend_from_slice(&value.to_le_bytes());
    }

    pub fn f64(&mut self, value: f64) {
        self.0.extend_from_slice(&value.to_le_bytes());
    }

    /// In single precision.
    pub fn f32(&mut self, value: f64) {
        self.0.extend_from_slice(&(value as f32).to_le_bytes());
    }

    pub fn vector(&mut self, value: DVec3) {
        value.to_array().into_iter().for_each(|x| self.f32(x));
    }

    /// Position, then x, y, z, w.
    pub fn pose(&mut self, pose: &Pose) {
        self.vector(pose.position);
        pose.orientation.to_array().into_iter().for_each(|x| self.f32(x));
    }

    /// To a multiple of 4.
    pub fn pad(&mut self) {
        self.0.resize(self.0.len().next_multiple_of(4), 0);
    }
}
