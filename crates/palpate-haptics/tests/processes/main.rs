//! The processes in simulated time and as threads.

mod allocations;
mod clocks;
mod closed_loop;
mod cut_logs;
mod links;
mod logs;
mod scenes;
mod sessions;
mod silence;
