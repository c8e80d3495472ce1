//! The processes in simulated time and as threads.

mod allocations;
mod closed_loop;
mod logs;
mod scenes;
mod sessions;
mod silence;
