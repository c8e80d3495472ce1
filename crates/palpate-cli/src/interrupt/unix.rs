//! Signals of Unix.

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::iterator::Signals;
use std::os::unix::process::parent_id;
use std::sync::Once;
use std::time::Duration;

/// Interval of checks for the parent: an ended one is answered as fast as a closed terminal.
const PARENT_POLL: Duration = Duration::from_millis(50);

/// Installs the handler of SIGINT, SIGTERM and SIGHUP; the last stays ignored under `nohup`.
pub fn install_handler() {
    let hang_up = (!ignores_hang_up()).then_some(SIGHUP);
    // Without a handler a signal leaves a hidden file behind, and a device to its guardian.
    let Ok(mut signals) = Signals::new([SIGINT, SIGTERM].into_iter().chain(hang_up)) else { return };
    std::thread::spawn(move || signals.forever().for_each(super::end));
}

/// Lets SIGINT, SIGTERM and SIGHUP pass without effect from now on.
pub fn ignore_signals() {
    let Ok(mut signals) = Signals::new([SIGINT, SIGTERM, SIGHUP]) else { return };
    std::thread::spawn(move || signals.forever().for_each(|_| ()));
}

/// Ends, as by SIGHUP, when the process that has started this one ends; not under `nohup`.
pub fn end_with_parent() {
    static WATCHED: Once = Once::new();
    let parent = parent_id();
    WATCHED.call_once(|| {
        if !ignores_hang_up() {
            std::thread::spawn(move || {
                while parent_id() == parent {
                    std::thread::sleep(PARENT_POLL);
                }
                super::end(SIGHUP);
            });
        }
    });
}

/// Whether the process was started with SIGHUP ignored, where the system tells.
fn ignores_hang_up() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (SIGHUP - 1) & 1 == 1)
}
