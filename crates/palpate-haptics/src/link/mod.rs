//! Devices on other machines, or in other processes: QUIC datagrams, encrypted, between two ends that know one secret.
//!
//! A device's end sends its motions as they come; the force process's end sends every effort on as soon as it is there. Whatever is lost
//! is lost: the next one is newer. What is late, doubled or out of order is told by its sequence and passed over. An end that hears
//! nothing more begins anew, as often as it takes.

mod client;
mod identity;
mod messages;
mod server;
mod transport;

pub(crate) use client::LinkSender;
pub use client::{LinkClient, LinkState};
pub use identity::Secret;
pub use server::{LinkCounts, LinkServer};

use std::sync::{Mutex, MutexGuard, PoisonError};

/// What was left by a thread that ended by a bug is still what it was.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
