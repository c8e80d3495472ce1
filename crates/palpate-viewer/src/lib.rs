//! Viewer server: a page in the browser shows a running scene and touches it, or plays logs.
//!
//! ```text
//! page ⇄ WebSocket session ⇄ live scene (manager thread, pointers at 1 kHz) ⇄ session of palpate-haptics
//!      ← frames: modal coordinates, poses and residual displacements, 60 per second
//! ```
//!
//! `docs/viewer-protocol.md` defines the protocol with the page, `viewer/`, which is embedded here. A [`SceneProvider`]
//! makes the scenes: the server knows neither scene files nor recording. No page can delay the force process: frames
//! are encoded from its newest snapshot, and a slow page skips frames.

mod error;
mod live;
mod log_frames;
mod pointers;
mod protocol;
mod scene_provider;
mod server;

pub use error::{SceneError, ServerError, TlsError, TokenError};
pub use log_frames::{LogFrameBuilder, LogFrames};
pub use protocol::{
    CameraView, CouplingDescription, DeviceDescription, FrameEncoder, FrameFormat, FrameTimes,
    MaterialDescription, ObjectDescription, ObstacleDescription, PhysicsSettings, RenderRequest,
    SceneDescription, SceneSummary, ShapeDescription, View, decodes,
};
pub use scene_provider::{
    DeviceOpener, JobControl, JobReport, LogFile, LogOpener, OpenLog, PageNotifier, SceneProvider,
    SharedTrajectory, Upload, ViewerDevice, ViewerScene,
};
pub use server::{Limits, Live, RenderJob, ServedContent, Server, Settings, TlsIdentity, Token};
