//! Signals of Windows: those of the C library, of which Ctrl-C is the only one that the system sends.

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

/// Interval of checks for a signal.
const POLL: Duration = Duration::from_millis(20);

/// Installs the handler of Ctrl-C. A console that closes ends the process at once: a device is left to its guardian.
pub fn install_handler() {
    let last = Arc::new(AtomicUsize::new(0));
    for signal in [SIGINT, SIGTERM] {
        // Without a handler a signal leaves a hidden file behind.
        let _ = flag::register_usize(signal, last.clone(), signal as usize);
    }
    std::thread::spawn(move || {
        loop {
            let signal = last.swap(0, Ordering::Relaxed);
            if signal != 0 {
                super::end(signal as i32);
            }
            std::thread::sleep(POLL);
        }
    });
}

/// Nothing: a guardian has no console whose signals reach it.
pub fn ignore_signals() {}

/// Nothing: a process does not learn of its parent's end.
pub fn end_with_parent() {}
