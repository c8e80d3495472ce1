//! Signals that end a process (Ctrl-C, `kill`, a terminal that closes): work that can end in good order stops, other work removes its
//! unfinished files and ends.

#[cfg(unix)]
#[path = "unix.rs"]
mod system;
#[cfg(windows)]
#[path = "windows.rs"]
mod system;

pub use system::{end_with_parent, ignore_signals, install_handler};

use palpate_export::remove_unfinished;
use std::sync::atomic::{AtomicBool, Ordering};

/// Set by the first signal once [`stop_on_interrupt`] was called.
static STOP: AtomicBool = AtomicBool::new(false);
static STOPPABLE: AtomicBool = AtomicBool::new(false);

/// Exit status of a process that a signal ended, less the signal's number: that of a shell.
const SIGNALLED: i32 = 128;

/// Flag that the first signal sets from now on; a second one ends the process.
pub fn stop_on_interrupt() -> &'static AtomicBool {
    STOPPABLE.store(true, Ordering::Relaxed);
    &STOP
}

/// Ends the work in good order, or the process by a signal's number.
fn end(signal: i32) {
    if STOPPABLE.load(Ordering::Relaxed) && !STOP.swap(true, Ordering::Relaxed) {
        return;
    }
    remove_unfinished(|| std::process::exit(SIGNALLED + signal));
}
