//! Images of a log: its frames are computed again, and drawn by the viewer's page in a headless browser.
//!
//! ```text
//! log → LogReplay → LogFramePlayer → LogFrames → viewer's server ⇄ page in a browser → PNG → GIF
//! ```
//!
//! The same frames are what the viewer shows of a log.

#![deny(missing_docs)]

mod browser;
mod error;
mod gif;
mod log_frames;

pub use browser::{ImageSink, find_browser, program_runs, render_log};

pub use error::RenderError;
pub use gif::write_gif;
pub use log_frames::LogFramePlayer;
pub use palpate_viewer::FrameSpacing;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
