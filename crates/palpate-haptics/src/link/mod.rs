//! Links to devices in other processes or on other machines: encrypted QUIC datagrams between two ends that share a secret.
//!
//! The client sends the motions of a device, the server the efforts of the force process. A lost datagram is not sent again: the next
//! one is newer. Late, duplicate and reordered datagrams are recognised by their sequence numbers and dropped. A broken link is
//! connected again, as often as needed.

mod client;
mod identity;
mod sequence;
mod server;
#[cfg(test)]
mod simulated;
mod transport;

pub use client::{LinkClient, LinkState};
pub use identity::Secret;
pub use server::{LinkCounts, LinkServer};

use std::sync::{Mutex, MutexGuard, PoisonError};

/// Locks a mutex, also after a panic of another thread: all guarded values are replaced whole.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
