//! A hand that follows a path, whatever it feels.

use super::{Device, Reading, Traits};
use crate::error::Error;
use crate::motion_path::MotionPath;
use glam::DVec3;

/// A path over time as a device.
pub struct Scripted {
    path: MotionPath,
}

impl Scripted {
    /// The path's time 0 is the start of all processes.
    pub fn new(path: MotionPath) -> Self {
        Self { path }
    }
}

impl Device for Scripted {
    fn traits(&self) -> Traits {
        Traits { kind: "path", ..Traits::NONE }
    }

    fn read(&mut self, now_s: f64) -> Result<Reading, Error> {
        let pose = self.path.at(now_s);
        let orientation = self.path.turns().then_some(pose.orientation);
        Ok(Reading { position: pose.position, orientation, buttons: 0 })
    }

    fn push(&mut self, _: DVec3, _: f64) -> Result<(), Error> {
        Ok(())
    }
}
