//! Logs: a complete record of a run in real time, as an MCAP file.
//!
//! | topic | rate | contents |
//! |---|---|---|
//! | `/step` | every step | input of devices and obstacles; forces, proxies, poses, velocities, energies, status, timing |
//! | `/contacts` | every frame | contacts that carry force |
//! | `/modes` | every frame | modal coordinates of every object |
//! | `/tf` | every frame | poses, as `foxglove.FrameTransforms` |
//!
//! Each topic has a JSON Schema whose fields have their units in their descriptions. Messages are JSON, in which every number keeps its last bit. The files that the scene was read from are attached, and the metadata
//! record `start` holds the initial state of every object, so that a log replays bit for bit anywhere.
//!
//! A log is a series of chunks, each of at most half a second and whole by itself: one that was cut is read up to its last whole
//! chunk, and [`recover`] makes a whole one of it.

mod file;
mod messages;
mod reader;
mod record_layout;
mod record_reader;
mod records;
#[cfg(feature = "real-time")]
mod recovery;
mod scan;
mod schemas;
mod summary;
#[cfg(feature = "real-time")]
mod writer;

pub use file::{LogFile, LogStart};
pub use reader::{LogReader, LoggedDevice, LoggedStep, StepCursor};
pub use records::{FrameRecord, StepRecord};
#[cfg(feature = "real-time")]
pub use recovery::{Recovered, recover};
#[cfg(feature = "real-time")]
pub use writer::{LogSender, LogSummary, LogWriter, WrittenLog};
