//! Free memory of the machine.

use crate::solve_error::SolveError;

/// Free memory [bytes]: addresses that are left.
#[cfg(target_arch = "wasm32")]
pub fn available_memory() -> Option<f64> {
    const PAGE: f64 = 65536.0;
    Some(PAGE * (PAGE - std::arch::wasm32::memory_size::<0>() as f64))
}

/// Free memory [bytes], if the system states it.
#[cfg(not(target_arch = "wasm32"))]
pub fn available_memory() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("MemAvailable:"))?;
    let kilobytes: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(1024.0 * kilobytes)
}

/// Refuses work that needs more memory than is free. Passes where the system does not state its free memory.
///
/// # Errors
/// [`SolveError::Memory`].
pub fn check_memory(needed_bytes: f64) -> Result<(), SolveError> {
    match available_memory() {
        Some(available) if needed_bytes > available => {
            Err(SolveError::Memory { needed_gb: needed_bytes / 1e9, available_gb: available / 1e9 })
        }
        _ => Ok(()),
    }
}
