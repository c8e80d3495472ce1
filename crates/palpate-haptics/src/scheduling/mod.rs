//! Real-time scheduling of a thread: priority, core affinity, locked memory; steal time.

#[cfg(unix)]
#[path = "unix.rs"]
mod system;
#[cfg(windows)]
#[path = "windows.rs"]
mod system;

use std::fmt;

/// Requested scheduling of a thread.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Scheduling {
    /// Real-time priority, 1 to 99 (SCHED_FIFO; on Windows any is time-critical), with locked memory; `None` keeps the ordinary one, and the
    /// memory as it is.
    pub priority: Option<u8>,
    /// Core that the thread is pinned to, from 0; `None` leaves the choice to the system.
    pub core: Option<usize>,
}

/// Granted scheduling of a thread. An `Err` holds the reason of a refusal.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GrantedScheduling {
    /// Real-time priority.
    pub priority: Result<Option<u8>, String>,
    /// Core that the thread is pinned to.
    pub core: Result<Option<usize>, String>,
    /// Whether the memory of the process was locked (never swapped out).
    pub memory: Result<bool, String>,
}

impl Scheduling {
    /// Applies the request to the calling thread. The thread goes on without what the system refuses.
    pub fn apply(&self) -> GrantedScheduling {
        GrantedScheduling {
            priority: self.apply_priority(),
            core: self.apply_core(),
            memory: if self.priority.is_some() { system::lock_memory().map(|()| true) } else { Ok(false) },
        }
    }

    pub(crate) fn apply_priority(&self) -> Result<Option<u8>, String> {
        let Some(priority) = self.priority else { return Ok(None) };
        system::set_priority(priority).map(|()| Some(priority))
    }

    fn apply_core(&self) -> Result<Option<usize>, String> {
        let Some(core) = self.core else { return Ok(None) };
        let cores = core_affinity::get_core_ids().unwrap_or_default();
        match cores.iter().find(|id| id.id == core) {
            Some(id) if core_affinity::set_for_current(*id) => Ok(Some(core)),
            Some(_) => Err(format!("the system does not let the thread stay on core {core}")),
            None => Err(format!("there is no core {core}, only {}", cores.len())),
        }
    }
}

/// Steal time [s] since boot: time in which the hypervisor ran something else while a core of this virtual machine was ready to
/// run. Of one core, or the sum over all cores. `None` where `/proc/stat` does not tell. Resolution 0.01 s.
pub fn steal_time_s(core: Option<usize>) -> Option<f64> {
    parse_steal_time(&std::fs::read_to_string("/proc/stat").ok()?, core)
}

fn parse_steal_time(text: &str, core: Option<usize>) -> Option<f64> {
    let name = core.map_or_else(|| "cpu".to_string(), |core| format!("cpu{core}"));
    let mut numbers =
        text.lines().map(str::split_whitespace).find(|line| line.clone().next() == Some(&name))?;
    numbers.nth(8)?.parse::<f64>().ok().map(|hundredths| hundredths / 100.0)
}

impl fmt::Display for GrantedScheduling {
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
            Ok(true) => write!(f, ", memory locked"),
            Ok(false) => write!(f, ", memory not locked"),
            Err(why) => write!(f, ", memory not locked ({why})"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steal_time_is_that_of_the_core() {
        let text =
            "cpu  4 5 4 1 2 0 5 5555 0 0\ncpu1 2 3 0 0 7 0 9 2866 0 0\ncpu10 1 1 1 1 1 1 1 1 0 0\ncpu2 1 2\n";
        let of = |core| parse_steal_time(text, core);
        assert_eq!((of(None), of(Some(1)), of(Some(10))), (Some(55.55), Some(28.66), Some(0.01)));
        assert_eq!((of(Some(0)), of(Some(2))), (None, None));
    }

    #[test]
    fn what_is_not_granted_says_why() {
        let asked = Scheduling { priority: None, core: Some(100_000) };
        let granted = std::thread::spawn(move || asked.apply()).join().expect("the thread ends");
        assert_eq!(granted.priority, Ok(None));
        let why = granted.core.clone().expect_err("no machine has so many");
        assert!(why.starts_with("there is no core 100000"), "{why}");
        assert!(granted.to_string().contains("on any core (there is no core"), "{granted}");
    }
}
