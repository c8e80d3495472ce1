//! Limits on what a client may hold, and for how long.

use std::time::Duration;

/// Limits on clients.
#[derive(Debug, Clone)]
pub struct Limits {
    /// Connections at a time. By default 256: 32 pages with their session and the six further connections that a browser opens.
    pub connections: usize,
    /// Longest time until the head of a request, or the TLS handshake, is complete; also of an idle connection.
    pub header_time: Duration,
    /// Time that a request body may take beyond what [`Self::body_rate`] allows.
    pub body_grace: Duration,
    /// Lowest mean rate of a request body [bytes/s]. By default 64 kB/s, a slow mobile network: the largest mesh takes 17 minutes.
    pub body_rate: f64,
    /// Time that a client may be behind [`Self::take_rate`] with what is sent to it; also the longest time to take a message.
    pub write_time: Duration,
    /// Lowest mean rate at which a client takes what is sent to it [bytes/s]. By default 8 kB/s, the slowest mobile network.
    pub take_rate: f64,
    /// Longest time in which a session hears nothing of its page, which answers a ping every third of it.
    pub silence: Duration,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            connections: 256,
            header_time: Duration::from_secs(10),
            body_grace: Duration::from_secs(10),
            body_rate: 64e3,
            write_time: Duration::from_secs(10),
            take_rate: 8e3,
            // Longer than a browser suspends a page in the background.
            silence: Duration::from_secs(60),
        }
    }
}
