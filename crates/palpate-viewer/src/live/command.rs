//! Commands to the manager thread.

use super::job::JobPermit;
use crate::error::SceneError;
use crate::protocol::{MaterialDescription, PhysicsSettings};
use crate::scene_provider::{Upload, ViewerScene};
use std::mem::discriminant;

/// Command of a page session or job.
pub(crate) enum Command {
    /// Open a scene by id, for a viewer.
    Open(String, u64),
    /// Restart the current scene.
    Reset,
    /// Change physics settings.
    ChangePhysics(PhysicsSettings),
    /// Change the material of an object, by index, for a viewer.
    ChangeMaterial(usize, MaterialDescription, u64),
    /// Record a mesh.
    Record(Upload, JobPermit),
    /// A job has ended.
    JobDone(Result<Box<ViewerScene>, SceneError>, JobPermit),
    /// Send a status message now.
    SendStatus,
    /// Stop the scene and the manager.
    End,
}

/// Class of commands whose rate is bounded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Pace {
    /// Restart of the scene, or start of a job.
    Restart,
    /// Message to all pages.
    Status,
}

impl Command {
    /// Class of the command, if its rate is bounded: a job comes one at a time anyway.
    pub(super) fn pace(&self) -> Option<Pace> {
        match self {
            Self::Open(..) | Self::Reset | Self::ChangePhysics(_) | Self::ChangeMaterial(..) => {
                Some(Pace::Restart)
            }
            Self::SendStatus => Some(Pace::Status),
            Self::Record(..) | Self::JobDone(..) | Self::End => None,
        }
    }

    /// Whether a newer command of this kind takes the place of an older one.
    pub(super) fn replaces(&self, older: &Self) -> bool {
        discriminant(self) == discriminant(older)
    }

    /// Command in place of an older one of its kind: the newest value of each setting.
    pub(super) fn in_place_of(self, older: Self) -> Self {
        match (self, older) {
            (Self::ChangePhysics(newer), Self::ChangePhysics(older)) => Self::ChangePhysics(newer.or(&older)),
            (newer, _) => newer,
        }
    }
}
