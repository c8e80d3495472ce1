//! Errors of the processes, their devices and logs.

/// Why something in real time can't be had.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum Error {
    /// A number or a combination that can't be.
    #[error("{0}")]
    Setup(String),
    /// A device.
    #[error("{0}")]
    Device(String),
    /// A log that can't be written or read.
    #[error("{0}")]
    Log(String),
    /// A thread that could not be started.
    #[error("{0}")]
    Thread(String),
}
