//! What goes between the viewer and its server (docs/viewer-protocol.md).

mod bytes;
mod description;
mod messages;
mod picture;
mod surface;

pub use description::{
    CouplingDescription, DeviceDescription, FrameTimes, MaterialDescription, ObjectDescription,
    ObstacleDescription, SceneDescription, ShapeDescription, View,
};
pub(crate) use messages::{Answer, Asked, Doing, Hello, LogTitle, ProcessTiming, Status, StreamForm};
pub use messages::{CameraView, PhysicsSettings, RenderRequest, SceneSummary};
pub use picture::{FrameEncoder, FrameFormat};
pub(crate) use surface::{shapes_bytes, surface_bytes};
