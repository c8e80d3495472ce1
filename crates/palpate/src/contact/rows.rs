//! The held points of all devices, and their compliance within a step.
//!
//! C [m/N] in body axes, R_cc[0] of equation (9), depends on where points are held, not on time, so it is
//! computed when a grasp changes and kept while it lasts.

use super::Grasp;
use alloc::vec;
use alloc::vec::Vec;
use glam::{DMat3, DVec3};

/// What a device holds and what that point did in the last step; body axes.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct HeldPoint {
    pub(crate) grasp: Option<Grasp>,
    /// Rest position [m].
    pub(crate) rest: DVec3,
    /// Elastic displacement at the end of the last step [m].
    pub(crate) displacement: DVec3,
    /// Force on the object in world axes, held over the last step [N].
    pub(crate) force_in_world: DVec3,
}

/// All devices' held points; buffers are made once.
#[derive(Debug, Clone)]
pub(crate) struct HeldPoints {
    pub(crate) points: Vec<HeldPoint>,
    /// C between devices that hold the same object, devices × devices.
    compliance: Vec<DMat3>,
}

impl HeldPoints {
    pub(crate) fn new(devices: usize) -> Self {
        Self { points: vec![HeldPoint::default(); devices], compliance: vec![DMat3::ZERO; devices * devices] }
    }

    /// C [m/N, body]: displacement of one device's point per force on another's.
    pub(crate) fn compliance(&self, a: usize, b: usize) -> DMat3 {
        self.compliance[a * self.points.len() + b]
    }

    /// Renew C between a device and every other that holds the same object, itself included; `between` gives it
    /// for two devices and their points.
    ///
    /// # Real time
    pub(crate) fn couple(
        &mut self,
        device: usize,
        grasp: &Grasp,
        mut between: impl FnMut((usize, &Grasp), (usize, &Grasp)) -> DMat3,
    ) {
        let devices = self.points.len();
        for other in 0..devices {
            if let Some(held) = self.points[other].grasp.filter(|held| held.object == grasp.object) {
                self.compliance[device * devices + other] = between((device, grasp), (other, &held));
                self.compliance[other * devices + device] = between((other, &held), (device, grasp));
            }
        }
    }
}
