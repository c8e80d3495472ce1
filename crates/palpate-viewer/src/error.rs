//! Errors of the viewer server.

use std::error::Error;
use std::io;
use std::net::SocketAddr;
use std::path::PathBuf;

/// Error of the HTTP server.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ServerError {
    /// An address beyond loopback without a token.
    #[error(
        "{0} can be reached from other machines: give a token (--token-file, or PALPATE_TOKEN), without which nobody \
         gets in"
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

/// Error of a token.
#[derive(Debug, Clone, thiserror::Error)]
#[non_exhaustive]
pub enum TokenError {
    /// A token that could be guessed.
    #[error(
        "the token has {characters} characters, expected {least} or more: random hexadecimal digits have 4 bits each, \
         and 64 bits can't be guessed; `openssl rand -hex 16` makes a good one"
    )]
    Short {
        /// Characters of the token.
        characters: usize,
        /// Fewest characters.
        least: usize,
    },
    /// The operating system gives no random numbers.
    #[error("cannot make a token: {0}")]
    NoRandomness(String),
}

/// Error of the files of TLS.
#[derive(Debug, Clone, thiserror::Error)]
#[non_exhaustive]
pub enum TlsError {
    /// A file cannot be read.
    #[error("cannot read {}: {reason}", path.display())]
    Unreadable {
        /// File.
        path: PathBuf,
        /// Cause.
        reason: String,
    },
    /// A file without what it should hold.
    #[error("cannot read {}: {reason}; expected a PEM file", path.display())]
    NoPem {
        /// File.
        path: PathBuf,
        /// Cause.
        reason: String,
    },
    /// A file without a certificate.
    #[error("{} has no certificate: expected a PEM file with the server's, and those that sign it", .0.display())]
    NoCertificate(PathBuf),
    /// Certificate and key cannot be used together.
    #[error("cannot serve with the certificate {} and the key {}: {reason}", certificate.display(), key.display())]
    Refused {
        /// File of the certificate.
        certificate: PathBuf,
        /// File of the key.
        key: PathBuf,
        /// Cause.
        reason: String,
    },
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
