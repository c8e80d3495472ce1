//! What a thread asks of the system, and what it gets.

use std::fmt;
use thread_priority::{
    RealtimeThreadSchedulePolicy, ThreadPriority, ThreadPriorityValue, ThreadSchedulePolicy,
    set_thread_priority_and_policy, thread_native_id,
};

/// What a thread asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Scheduling {
    /// Real-time priority, 1 to 99 (SCHED_FIFO); none asks for nothing.
    pub priority: Option<u8>,
    /// The core that it stays on, counted from 0; none leaves it to the system.
    pub core: Option<usize>,
}

/// What it got; what was not granted says why.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Granted {
    /// Its real-time priority.
    pub priority: Result<Option<u8>, String>,
    /// Its core.
    pub core: Result<Option<usize>, String>,
    /// Whether all memory stays in memory.
    pub memory: Result<(), String>,
}

impl Scheduling {
    /// Ask the system, for the thread that calls. Whatever it refuses, the thread goes on without.
    pub fn claim(&self) -> Granted {
        Granted { priority: self.claim_priority(), core: self.claim_core(), memory: lock_memory() }
    }

    fn claim_priority(&self) -> Result<Option<u8>, String> {
        let Some(priority) = self.priority else { return Ok(None) };
        let value =
            ThreadPriorityValue::try_from(priority).map_err(|what| format!("priority {priority}: {what}"))?;
        let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
        let set =
            set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Crossplatform(value), policy);
        set.map(|()| Some(priority)).map_err(|_| {
            "the system grants no real-time priority: run as root, or allow it (`ulimit -r 99`, or rtprio in \
             /etc/security/limits.conf)"
                .to_string()
        })
    }

    fn claim_core(&self) -> Result<Option<usize>, String> {
        let Some(core) = self.core else { return Ok(None) };
        let cores = core_affinity::get_core_ids().unwrap_or_default();
        match cores.iter().find(|id| id.id == core) {
            Some(id) if core_affinity::set_for_current(*id) => Ok(Some(core)),
            Some(_) => Err(format!("the system does not let the thread stay on core {core}")),
            None => Err(format!("there is no core {core}, only {}", cores.len())),
        }
    }
}

/// Keep all memory of the process in memory, now and later.
fn lock_memory() -> Result<(), String> {
    use rustix::mm::{MlockAllFlags, mlockall};
    mlockall(MlockAllFlags::CURRENT | MlockAllFlags::FUTURE).map_err(|_| {
        "the system does not lock memory: run as root, or allow it (`ulimit -l unlimited`)".to_string()
    })
}

impl fmt::Display for Granted {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.priority {
            Ok(Some(priority)) => write!(f, "real-time priority {priority}")?,
            Ok(None) => write!(f, "ordinary priority")?,
            Err(why) => write!(f, "ordinary priority ({why})")?,
        }
        match &self.core {
            Ok(Some(core)) => write!(f, ", on core {core}")?,
            Ok(None) => write!(f, ", on any core")?,
            Err(why) => write!(f, ", on any core ({why})")?,
        }
        match &self.memory {
            Ok(()) => write!(f, ", memory locked"),
            Err(why) => write!(f, ", memory not locked ({why})"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_granted_says_why() {
        let asked = Scheduling { priority: None, core: Some(100_000) };
        let granted = std::thread::spawn(move || asked.claim()).join().expect("the thread ends");
        assert_eq!(granted.priority, Ok(None));
        let why = granted.core.clone().expect_err("no machine has so many");
        assert!(why.starts_with("there is no core 100000"), "{why}");
        assert!(granted.to_string().contains("on any core (there is no core"), "{granted}");
    }
}
