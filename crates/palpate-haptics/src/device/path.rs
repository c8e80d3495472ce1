//! Path device: follows a path in time, and ignores forces.

use super::{Device, DeviceSpec, Reading};
use crate::error::Error;
use crate::motion_path::MotionPath;
use glam::DVec3;

/// Device whose position follows a path.
pub struct PathDevice {
    path: MotionPath,
}

impl PathDevice {
    /// Device on a path; time 0 of the path is the start of all processes.
    pub fn new(path: MotionPath) -> Self {
        Self { path }
    }
}

impl Device for PathDevice {
    fn spec(&self) -> DeviceSpec {
        DeviceSpec { kind: "path", ..DeviceSpec::NONE }
    }

    fn read(&mut self, now_s: f64) -> Result<Reading, Error> {
        let pose = self.path.at(now_s);
        let orientation = self.path.has_orientations().then_some(pose.orientation);
        Ok(Reading { position: pose.position, orientation, buttons: 0 })
    }

    fn set_force(&mut self, _: DVec3, _: f64) -> Result<(), Error> {
        Ok(())
    }
}
