//! Scheduling on Linux, macOS and other Unix.

use thread_priority::{
    RealtimeThreadSchedulePolicy, ThreadPriority, ThreadPriorityValue, ThreadSchedulePolicy,
    set_thread_priority_and_policy, thread_native_id,
};

/// Gives the calling thread a real-time priority, 1 to 99.
pub(super) fn set_priority(priority: u8) -> Result<(), String> {
    let value =
        ThreadPriorityValue::try_from(priority).map_err(|what| format!("priority {priority}: {what}"))?;
    let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    let set =
        set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Crossplatform(value), policy);
    set.map_err(|_| {
        "the system grants no real-time priority: run as root, or allow it (`ulimit -r 99`, or rtprio in \
         /etc/security/limits.conf)"
            .to_string()
    })
}

/// Locks all present and future memory of the process.
#[cfg(not(target_vendor = "apple"))]
pub(super) fn lock_memory() -> Result<(), String> {
    use rustix::mm::{MlockAllFlags, mlockall};
    mlockall(MlockAllFlags::CURRENT | MlockAllFlags::FUTURE).map_err(|_| {
        "the system does not lock memory: run as root, or allow it (`ulimit -l unlimited`)".to_string()
    })
}

/// Nothing: macOS has no call for it.
#[cfg(target_vendor = "apple")]
pub(super) fn lock_memory() -> Result<(), String> {
    Err("macOS locks no memory of a whole process".to_string())
}
