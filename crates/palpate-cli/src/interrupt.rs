//! Ctrl-C: stops work that can end in good order, or removes unfinished files and ends the process.

use palpate_export::remove_unfinished;
use std::sync::atomic::{AtomicBool, Ordering};

/// Set by the first interrupt once [`stop_on_interrupt`] was called.
static STOP: AtomicBool = AtomicBool::new(false);
static STOPPABLE: AtomicBool = AtomicBool::new(false);

/// Exit status of a process that an interrupt ended.
const INTERRUPTED: i32 = 130;

/// Flag that the first interrupt sets from now on; a second one ends the process.
pub fn stop_on_interrupt() -> &'static AtomicBool {
    STOPPABLE.store(true, Ordering::Relaxed);
    &STOP
}

/// Installs the handler.
pub fn install_handler() {
    // Without a handler an interrupt leaves a hidden file behind, nothing worse.
    let _ = ctrlc::set_handler(|| {
        if STOPPABLE.load(Ordering::Relaxed) && !STOP.swap(true, Ordering::Relaxed) {
            return;
        }
        remove_unfinished(|| std::process::exit(INTERRUPTED));
    });
}
