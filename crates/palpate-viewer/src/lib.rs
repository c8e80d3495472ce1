//! Viewer server: a page in the browser shows a running scene and touches it, or plays logs.
//!
//! ```text
//! page ⇄ WebSocket session ⇄ live scene (manager thread, pointers at 1 kHz) ⇄ session of palpate-haptics
//!      ← frames: modal coordinates, poses and residual displacements, 60 per second
//! ```
//!
//! Without the feature `server` there is the protocol and a [`LocalScene`], which a page runs by itself, as in a Web Worker; with the feature `logs`
//! logs as well, [`LocalLogs`].
//!
//! `docs/viewer-protocol.md` defines the protocol with the page, `viewer/`, which is embedded here. A [`SceneProvider`]
//! makes the scenes: the server knows neither scene files nor recording. No page can delay the force process: frames
//! are encoded from its newest snapshot, and a slow page skips frames.

// Parts that only the server uses.
#![cfg_attr(not(feature = "server"), allow(dead_code))]

mod current;
mod describe;
mod error;
#[cfg(feature = "server")]
mod live;
mod local_device;
mod local_log;
#[cfg(feature = "logs")]
mod local_logs;
mod local_scene;
#[cfg(feature = "logs")]
mod log_frames;
#[cfg(feature = "logs")]
mod log_player;
mod page_requests;
mod pointers;
mod protocol;
mod scene_provider;
mod scene_start;
#[cfg(feature = "server")]
mod server;
mod static_data;

pub use describe::describe_scene;
pub use error::SceneError;
#[cfg(feature = "server")]
pub use error::{ServerError, TlsError, TokenError};
pub use local_device::DevicePlace;
pub use local_log::{LARGEST_RECORD_BYTES, LONGEST_RECORD_S};
#[cfg(feature = "logs")]
pub use local_logs::LocalLogs;
pub use local_scene::{LocalRequest, LocalScene, PageMessage};
#[cfg(feature = "logs")]
pub use log_frames::{LogFrameBuilder, LogFrames};
#[cfg(feature = "logs")]
pub use log_player::{FrameSpacing, FrameSteps, LogPlayer};
pub use protocol::{
    CameraView, CouplingDescription, DeviceDescription, FrameEncoder, FrameFormat, FrameTimes,
    MaterialDescription, ObjectDescription, ObstacleDescription, OwnSettings, PhysicsSettings, RenderRequest,
    SceneDescription, SceneSummary, ShapeDescription, View, decodes,
};
#[cfg(feature = "server")]
pub use scene_provider::{DeviceOpener, LogFile, LogOpener, OpenLog, PageNotifier};
pub use scene_provider::{JobControl, JobReport, SceneProvider, Upload, ViewerDevice, ViewerScene};
#[cfg(feature = "server")]
pub use server::{
    FrameAncestor, Limits, Live, RenderJob, ServedContent, Server, Settings, TlsIdentity, Token,
};
