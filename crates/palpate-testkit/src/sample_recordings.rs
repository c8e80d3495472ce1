//! The released sample recordings: a block of 0.2 × 0.1 × 0.1 m, free and with one end fixed.

use palpate::{Damping, Recording};
use std::sync::{Arc, OnceLock};

/// File of the block that moves freely.
pub const FREE_BLOCK_FILE: &[u8] = include_bytes!("../recordings/free.palp");

/// File of the block with fixed nodes at one end.
pub const FIXED_BLOCK_FILE: &[u8] = include_bytes!("../recordings/fixed.palp");

fn read_once(cache: &'static OnceLock<Arc<Recording>>, file: &[u8]) -> Arc<Recording> {
    let read = || Arc::new(Recording::from_bytes(file).expect("a released recording"));
    cache.get_or_init(read).clone()
}

/// The block that moves freely.
pub fn free_block() -> Arc<Recording> {
    static FREE: OnceLock<Arc<Recording>> = OnceLock::new();
    read_once(&FREE, FREE_BLOCK_FILE)
}

/// The block with fixed nodes at one end.
pub fn fixed_block() -> Arc<Recording> {
    static FIXED: OnceLock<Arc<Recording>> = OnceLock::new();
    read_once(&FIXED, FIXED_BLOCK_FILE)
}

/// A recording with damping βK in place of its own, β [s].
pub fn with_stiffness_damping(recording: &Recording, beta: f64) -> Arc<Recording> {
    let mut damped = recording.clone();
    damped.metadata.damping = Damping::Rayleigh { alpha: 0.0, beta };
    damped.modes.damping_ratios = damped.modes.angular_frequencies.iter().map(|w| 0.5 * beta * w).collect();
    Arc::new(damped)
}
