//! Errors of the viewer server.

use std::error::Error;
use std::io;
use std::net::SocketAddr;

/// Error of the HTTP server.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ServerError {
    /// An address beyond loopback without a token of sufficient length.
    #[error(
        "{0} can be reached from other machines: give a token of 8 characters or more (--token), without which \
         nobody gets in"
    )]
    MissingToken(SocketAddr),
    /// The address is in use.
    #[error("something listens at {0} already: stop it, or take another port (--listen)")]
    AddressInUse(SocketAddr),
    /// The address cannot be bound.
    #[error("cannot listen at {address}: {source}")]
    Bind {
        /// Requested address.
        address: SocketAddr,
        /// Cause.
        source: io::Error,
    },
    /// A socket or thread cannot be set up.
    #[error(transparent)]
    Io(#[from] io::Error),
}

/// Error of a scene provider, or of starting a scene.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// Another job is running.
    #[error("a recording is under way: {advice} when it is done")]
    Busy {
        /// Advice to the user.
        advice: &'static str,
    },
    /// A thread cannot be started.
    #[error("cannot start a thread: {0}")]
    Thread(io::Error),
    /// The log cannot be opened.
    #[error("there is no log: {0}")]
    Log(Box<Self>),
    /// A scene, device or log cannot be made; the cause says why.
    #[error(transparent)]
    Other(Box<dyn Error + Send + Sync>),
}

impl SceneError {
    /// Refusal of a second job.
    pub(crate) const BUSY_JOB: Self = Self::Busy { advice: "ask again" };

    /// Refusal of a change of settings while a job is running.
    pub(crate) const BUSY_CHANGE: Self = Self::Busy { advice: "change this" };

    /// Error with a cause of the provider, or with a text.
    pub fn other(cause: impl Into<Box<dyn Error + Send + Sync>>) -> Self {
        Self::Other(cause.into())
    }
}

impl From<String> for SceneError {
    fn from(text: String) -> Self {
        Self::other(text)
    }
}

impl From<&str> for SceneError {
    fn from(text: &str) -> Self {
        Self::other(text)
    }
}
