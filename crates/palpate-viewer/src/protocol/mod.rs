//! Protocol with the page: JSON messages and binary frames (docs/viewer-protocol.md).

mod bytes;
mod description;
mod frame;
mod messages;
mod sound;
mod surface;

pub use description::{
    CouplingDescription, DeviceDescription, FrameTimes, MaterialDescription, ObjectDescription,
    ObstacleDescription, OwnSettings, SceneDescription, ShapeDescription, View,
};
pub use frame::{FrameEncoder, FrameFormat};
#[cfg(feature = "logs")]
pub(crate) use messages::LogEntry;
pub use messages::{CameraView, PhysicsSettings, RenderRequest, SceneSummary, decodes};
pub(crate) use messages::{
    ClientMessage, DeviceStatus, ForceStatus, Hello, PROTOCOL, PressMode, ProcessTiming, ServerMessage,
    Status,
};
pub(crate) use sound::encode_sound;
pub(crate) use surface::{mode_shapes_bytes, surface_bytes};
