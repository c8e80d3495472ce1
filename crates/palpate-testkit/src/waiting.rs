//! Conditions that other threads or processes bring about.

use std::time::{Duration, Instant};

/// Time after which a wait has failed: it bounds a failure, not a success, so a busy machine has plenty.
const TIMEOUT: Duration = Duration::from_secs(60);

/// Pause between two looks.
const POLL_INTERVAL: Duration = Duration::from_millis(1);

/// Wait until a condition holds.
///
/// # Panics
/// If it does not within a minute.
pub fn wait_until(what: &str, mut holds: impl FnMut() -> bool) {
    let begun = Instant::now();
    while !holds() {
        assert!(begun.elapsed() < TIMEOUT, "not within {} s: {what}", TIMEOUT.as_secs());
        std::thread::sleep(POLL_INTERVAL);
    }
}
