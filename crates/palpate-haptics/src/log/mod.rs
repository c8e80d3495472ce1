//! Logs: everything that a run in real time was, as an MCAP file.
//!
//! | topic | each | holds |
//! |---|---|---|
//! | `/step` | step | what the devices and obstacles did, forces, proxies, poses, velocities, energies, how it went, timing |
//! | `/contacts` | picture | every contact that carries force |
//! | `/modes` | picture | modal coordinates of every object |
//! | `/tf` | picture | poses, as Foxglove's 3D panel takes them |
//!
//! Messages are JSON, in which every number stands to the last bit. The files that the scene was read from are attached, so
//! that a log can be replayed, and drawn, anywhere.

mod messages;
mod reader;
mod record;
mod writer;

pub use messages::Names;
pub use reader::{LoggedStep, Reader};
pub use record::{Picture, Record};
pub use writer::{LogSender, LogSummary, LogWriter};
