//! The viewer's server: a page in the browser sees a scene and touches it, or looks at a log.
//!
//! ```text
//! page ⇄ socket ⇄ live scene (stage's manager, pointers at 1 kHz) ⇄ session of palpate-haptics
//!               ↖ pictures: modal coordinates, poses and dents, 60 times a second
//! ```
//!
//! docs/viewer-protocol.md is the contract with the page, `viewer/`, which is embedded here. A [`SceneProvider`] makes the scenes: the
//! server knows neither scene files nor recording. No page can make the force process wait: pictures are taken from
//! its newest state, and a page that is slow misses some.

mod live;
mod log_show;
mod pointers;
mod server;
mod stage;
mod wire;

pub use log_show::{LogFrameBuilder, LogFrames};
pub use server::{Live, RenderJob, ServedContent, Server, Settings};
pub use stage::{
    DeviceOpener, LogFile, LogOpener, OpenLog, PageNotifier, ProgressCallback, SceneProvider,
    SharedTrajectory, Upload, ViewerDevice, ViewerScene,
};
pub use wire::{
    CameraView, CouplingDescription, DeviceDescription, FrameEncoder, FrameFormat, FrameTimes,
    MaterialDescription, ObjectDescription, ObstacleDescription, PhysicsSettings, RenderRequest,
    SceneDescription, SceneSummary, ShapeDescription, View,
};
