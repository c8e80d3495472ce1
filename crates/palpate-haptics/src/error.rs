//! Errors of sessions, devices, links, logs and paths, as kinds that a program can match.

use crate::motion_path::PathError;
use crate::safety_limits::{ImplausibleMotion, LimitError};
use std::net::{IpAddr, SocketAddr};
use thiserror::Error as ThisError;

/// Any error of this crate.
#[derive(Debug, Clone, PartialEq, ThisError)]
#[non_exhaustive]
pub enum Error {
    /// Invalid settings of a session.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// Failure of a device, of its driver or of the vendor's software.
    #[error(transparent)]
    Device(#[from] DeviceError),
    /// Failure to set up a link.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// Failure to write or read a log.
    #[error(transparent)]
    Log(#[from] LogError),
    /// Invalid path file.
    #[error(transparent)]
    Path(#[from] PathError),
    /// Motion that can't be one of a hand.
    #[error(transparent)]
    Motion(#[from] ImplausibleMotion),
    /// Limit that can't be set.
    #[error(transparent)]
    Limit(#[from] LimitError),
    /// The operating system started no thread.
    #[error("cannot start a thread for the {purpose}: {reason}")]
    ThreadSpawn {
        /// Purpose of the thread.
        purpose: String,
        /// Reason of the operating system.
        reason: String,
    },
    /// A thread panicked.
    #[error("the thread of the {purpose} panicked: a bug")]
    ThreadPanic {
        /// Purpose of the thread.
        purpose: String,
    },
}

/// Invalid settings of a session.
#[derive(Debug, Clone, Copy, PartialEq, ThisError)]
#[non_exhaustive]
pub enum SessionError {
    /// Step of the scene outside 0.2 to 10 ms.
    #[error(
        "the step is {step_s} s: in real time it is 0.0002 s to 0.01 s (5 kHz to 100 Hz; hands want 1 kHz)"
    )]
    Step {
        /// Step of the scene [s].
        step_s: f64,
    },
    /// Update rate of a device outside 50 to 5000 Hz.
    #[error("a device is to be updated at {rate_hz} Hz, expected 50 to 5000")]
    DeviceRate {
        /// Update rate [Hz].
        rate_hz: f64,
    },
    /// Number of devices that differs from the model's.
    #[error("{given} devices for a scene of {expected}")]
    DeviceCount {
        /// Devices of the session.
        given: usize,
        /// Devices of the model.
        expected: usize,
    },
}

/// Failure of a device, of its driver or of the vendor's software. `driver` is the driver's name.
#[derive(Debug, Clone, PartialEq, Eq, ThisError)]
#[non_exhaustive]
pub enum DeviceError {
    /// The vendor's library could not be loaded.
    #[error(
        "{driver}: no library could be loaded as {files} ({reason}): install {software}, or name the library's file in the \
         environment variable {variable}"
    )]
    LibraryNotLoaded {
        /// Driver.
        driver: &'static str,
        /// File names that were tried.
        files: String,
        /// Reason of the loader.
        reason: String,
        /// Software that brings the library.
        software: &'static str,
        /// Environment variable that names another file.
        variable: &'static str,
    },
    /// The library lacks a function: it is another library, or an old version.
    #[error(
        "{driver}: {file} has no function {function}: it is not the library of {software}, or an old one"
    )]
    FunctionMissing {
        /// Driver.
        driver: &'static str,
        /// Library file.
        file: String,
        /// Function.
        function: String,
        /// Expected software.
        software: &'static str,
    },
    /// The vendor's service does not answer.
    #[error(
        "haply: no Inverse Service at {address} ({reason}): install and start Haply's Inverse Service (3.5 or later), or give \
         its address in the environment variable {variable}"
    )]
    ServiceUnreachable {
        /// Host and port.
        address: String,
        /// Reason.
        reason: String,
        /// Environment variable that gives another address.
        variable: &'static str,
    },
    /// The vendor's software lists no device.
    #[error("{driver}: {message}")]
    NoDevice {
        /// Driver.
        driver: &'static str,
        /// Finding and advice.
        message: String,
    },
    /// No device has the requested serial number or index.
    #[error("{driver}: there is no device {which:?}, only {available}")]
    NotFound {
        /// Driver.
        driver: &'static str,
        /// Requested serial number or index.
        which: String,
        /// Devices that are there.
        available: String,
    },
    /// The device exists but cannot be opened.
    #[error("{driver}: {device} can't be had: {reason}")]
    Unavailable {
        /// Driver.
        driver: &'static str,
        /// Device.
        device: String,
        /// Reason.
        reason: String,
    },
    /// A call of the vendor's software failed.
    #[error("{driver}: {call}: {reason}")]
    Call {
        /// Driver.
        driver: &'static str,
        /// Failed operation.
        call: String,
        /// Message of the vendor's software.
        reason: String,
    },
    /// The device or its service has stopped answering.
    #[error("{driver}: {reason}")]
    Silent {
        /// Driver.
        driver: &'static str,
        /// Details.
        reason: String,
    },
    /// The device was disconnected.
    #[error("{driver}: {device} is gone")]
    Disconnected {
        /// Driver.
        driver: &'static str,
        /// Device.
        device: String,
    },
    /// No guardian could be started.
    #[error(
        "no guardian could be started ({reason}): a real device is not opened without one, since nothing would take its force \
         away after a crash"
    )]
    NoGuardian {
        /// Reason.
        reason: String,
    },
    /// The guardian has ended before the device.
    #[error("the guardian of the device has ended ({reason}): without one it gives no force, start again")]
    GuardianGone {
        /// Reason of the operating system.
        reason: String,
    },
}

/// Failure to set up a link.
#[derive(Debug, Clone, PartialEq, Eq, ThisError)]
#[non_exhaustive]
pub enum LinkError {
    /// Secret shorter than 12 bytes.
    #[error("the secret has {bytes} bytes, expected at least 12: `openssl rand -hex 16` makes a good one")]
    SecretTooShort {
        /// Length [bytes].
        bytes: usize,
    },
    /// Link beyond this machine without a secret.
    #[error("{address} is reached from other machines: a link there needs a secret")]
    SecretRequired {
        /// Address of the link.
        address: IpAddr,
    },
    /// No certificate could be made of the secret.
    #[error("no certificate can be made for the link: {reason}")]
    Certificate {
        /// Reason.
        reason: String,
    },
    /// TLS could not be set up.
    #[error("the link can't be encrypted: {reason}")]
    Encryption {
        /// Reason.
        reason: String,
    },
    /// The server could not bind its address.
    #[error("cannot listen at {address}: {reason}")]
    Bind {
        /// Requested address.
        address: SocketAddr,
        /// Reason of the operating system.
        reason: String,
    },
    /// The client got no socket.
    #[error("no socket for the link: {reason}")]
    NoSocket {
        /// Reason of the operating system.
        reason: String,
    },
    /// The operating system does not tell the server's address.
    #[error("the link has no address: {reason}")]
    NoAddress {
        /// Reason of the operating system.
        reason: String,
    },
}

/// Failure to write or read a log.
#[derive(Debug, Clone, PartialEq, Eq, ThisError)]
#[non_exhaustive]
pub enum LogError {
    /// Writing failed, for example on a full disk.
    #[error("cannot write the log: {reason}")]
    Write {
        /// Reason with its sources.
        reason: String,
    },
    /// The bytes are no MCAP file, or a damaged one.
    #[error("the log can't be read: {reason}")]
    Unreadable {
        /// Reason.
        reason: String,
    },
    /// The file ends before its first whole chunk: its writer was killed at once.
    #[error("the log ends before its first whole step: nothing of it can be read")]
    NoWholeStep,
    /// The log to be recovered is whole.
    #[error("the log is whole: there is nothing to recover")]
    Whole,
    /// The MCAP file was not written by palpate.
    #[error("it is an MCAP file, but no log of palpate's")]
    NotPalpate,
    /// The initial state of an object is missing.
    #[error("the log has no initial state of {object:?}")]
    StartMissing {
        /// Object.
        object: String,
    },
    /// A step lacks a device or an obstacle.
    #[error("step {step} of the log has no {name:?}")]
    PartMissing {
        /// Step, from 1.
        step: u64,
        /// Device or obstacle.
        name: String,
    },
}

/// Message of an error with the messages of all its sources, separated by colons.
pub(crate) fn with_sources(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut source = error.source();
    while let Some(inner) = source {
        text += &format!(": {inner}");
        source = inner.source();
    }
    text
}
