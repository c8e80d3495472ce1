//! Commands to the manager thread.

use crate::error::SceneError;
use crate::protocol::{MaterialDescription, PhysicsSettings};
use crate::scene_provider::{Upload, ViewerScene};

/// Command of a page session or job.
pub(crate) enum Command {
    /// Open a scene by id.
    Open(String),
    /// Restart the current scene.
    Reset,
    /// Change physics settings.
    ChangePhysics(PhysicsSettings),
    /// Change the material of an object, by index.
    ChangeMaterial(usize, MaterialDescription),
    /// Record a mesh; the sender has claimed the job slot.
    Record(Upload),
    /// A job has ended.
    JobDone(Result<Box<ViewerScene>, SceneError>),
    /// Send a status message now.
    SendStatus,
    /// Stop the scene and the manager.
    End,
}
