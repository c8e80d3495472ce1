//! Scheduling on Windows.

use thread_priority::{ThreadPriority, WinAPIThreadPriority, set_current_thread_priority};

/// Makes the calling thread time-critical, the highest of the system's levels within the class of the process.
pub(super) fn set_priority(_: u8) -> Result<(), String> {
    let critical = ThreadPriority::Os(WinAPIThreadPriority::TimeCritical.into());
    let set = set_current_thread_priority(critical);
    set.map_err(|error| format!("the system grants no time-critical priority: {error:?}"))
}

/// Nothing: Windows has no call for it.
pub(super) fn lock_memory() -> Result<(), String> {
    Err("Windows locks no memory of a whole process".to_string())
}
