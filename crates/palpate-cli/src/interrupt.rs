//! Signals that end a process (Ctrl-C, `kill`, a terminal that closes): work that can end in good order stops, other work removes its
//! unfinished files and ends.

use palpate_export::remove_unfinished;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::iterator::Signals;
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

/// Installs the handler of SIGINT, SIGTERM and SIGHUP; the last stays ignored under `nohup`.
pub fn install_handler() {
    let hang_up = (!ignores_hang_up()).then_some(SIGHUP);
    // Without a handler a signal leaves a hidden file behind, and a device with its last force.
    let Ok(mut signals) = Signals::new([SIGINT, SIGTERM].into_iter().chain(hang_up)) else { return };
    std::thread::spawn(move || {
        for signal in signals.forever() {
            if STOPPABLE.load(Ordering::Relaxed) && !STOP.swap(true, Ordering::Relaxed) {
                continue;
            }
            remove_unfinished(|| std::process::exit(SIGNALLED + signal));
        }
    });
}

/// Whether the process was started with SIGHUP ignored.
fn ignores_hang_up() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (SIGHUP - 1) & 1 == 1)
}
