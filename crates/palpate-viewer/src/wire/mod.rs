//! What goes between the viewer and its server (docs/viewer-protocol.md).

mod bytes;
mod messages;
mod picture;
mod surface;

pub(crate) use messages::{Answer, Asked, Doing, Hello, LogTitle, ProcessTiming, Status, StreamForm};
pub use messages::{
    CameraView, CouplingDescription, DeviceDescription, FrameTimes, MaterialDescription, ObjectDescription,
    ObstacleDescription, RenderWish, Rules, SceneDescription, SceneTitle, ShapeDescription, View,
};
pub use picture::{Form, PictureMaker};
pub use surface::{mode_scales, shapes_bytes, surface_bytes};
