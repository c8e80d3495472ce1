//! The released sample recordings: a block of 0.2 × 0.1 × 0.1 m, free and with one end fixed.

use palpate::Recording;
use std::sync::{Arc, OnceLock};

fn read_once(cache: &'static OnceLock<Arc<Recording>>, bytes: &[u8]) -> Arc<Recording> {
    let read = || Arc::new(Recording::from_bytes(bytes).expect("a released recording"));
    cache.get_or_init(read).clone()
}

/// The block that moves freely.
pub fn free_block() -> Arc<Recording> {
    static FREE: OnceLock<Arc<Recording>> = OnceLock::new();
    read_once(&FREE, include_bytes!("../../../data/recordings/v1/free.palp"))
}

/// The block with fixed nodes at one end.
pub fn fixed_block() -> Arc<Recording> {
    static FIXED: OnceLock<Arc<Recording>> = OnceLock::new();
    read_once(&FIXED, include_bytes!("../../../data/recordings/v1/fixed.palp"))
}
