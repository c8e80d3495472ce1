//! The held points of all devices: their rows J·Φ, and their compliance within a step.
//!
//! C = J·(Φ·B·Φᵀ + S)·Jᵀ [m/N] in body axes depends on where points are held, not on time, so it is
//! computed when a grasp changes and kept while it lasts.

use super::Grasp;
use crate::response::{compliance, project_rows};
use crate::scene::SceneObject;
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
    /// The residual compliance's part of it [m].
    pub(crate) residual: DVec3,
    /// Residual displacement under the body's weight [m]; it lasts as long as the grasp, since only bodies that stay
    /// where they are have one.
    pub(crate) sag: DVec3,
    /// Force on the object, held over the last step [N].
    pub(crate) force: DVec3,
    /// The same in world axes.
    pub(crate) force_in_world: DVec3,
}

/// All devices' held points; buffers are made once.
#[derive(Debug, Clone)]
pub(crate) struct HeldPoints {
    pub(crate) points: Vec<HeldPoint>,
    /// Grasps and forces of the last step, for points that are new in this one.
    before: Vec<HeldPoint>,
    /// Three rows of modes per device, `stride` numbers apart.
    rows: Vec<f64>,
    stride: usize,
    /// C and its residual part between devices that hold the same object, devices × devices.
    compliance: Vec<DMat3>,
    residual: Vec<DMat3>,
}

impl HeldPoints {
    pub(crate) fn new(devices: usize, most_modes: usize) -> Self {
        Self {
            points: vec![HeldPoint::default(); devices],
            before: vec![HeldPoint::default(); devices],
            rows: vec![0.0; devices * 3 * most_modes],
            stride: 3 * most_modes,
            compliance: vec![DMat3::ZERO; devices * devices],
            residual: vec![DMat3::ZERO; devices * devices],
        }
    }

    /// J·Φ of a device's point: three rows of m numbers.
    pub(crate) fn rows(&self, device: usize, modes: usize) -> &[f64] {
        &self.rows[device * self.stride..][..3 * modes]
    }

    /// C between two devices' points, body axes [m/N].
    pub(crate) fn compliance(&self, a: usize, b: usize) -> DMat3 {
        self.compliance[a * self.points.len() + b]
    }

    /// The residual part of [`Self::compliance`].
    pub(crate) fn residual(&self, a: usize, b: usize) -> DMat3 {
        self.residual[a * self.points.len() + b]
    }

    /// Keep what the last step ended with, before grasps change.
    ///
    /// # Real time
    pub(crate) fn begin(&mut self) {
        self.before.copy_from_slice(&self.points);
    }

    /// Let a device hold nothing.
    ///
    /// # Real time
    pub(crate) fn release(&mut self, device: usize) {
        self.points[device] = HeldPoint::default();
    }

    /// Let a device hold a point. `q` are the object's modal coordinates, `sag` the residual
    /// displacement of the point under its weight.
    ///
    /// # Real time
    /// Costs modes × points on the same object; only when the grasp is new.
    pub(crate) fn hold(
        &mut self,
        device: usize,
        grasp: Grasp,
        object: &SceneObject,
        q: impl Iterator<Item = f64> + Clone,
        sag: DVec3,
    ) {
        let recording = &*object.recording;
        let m = recording.modes.len();
        let corners = recording.surface.corners(&grasp.point);

        // J·Φ: the weighted rows of the triangle's corners.
        let rows = &mut self.rows[device * self.stride..][..3 * m];
        rows.fill(0.0);
        for (node, weight) in corners {
            for axis in 0..3 {
                let shape = recording.modes.row(node, axis);
                for (row, phi) in rows[axis * m..(axis + 1) * m].iter_mut().zip(shape) {
                    *row += weight * phi;
                }
            }
        }

        // Where the point is now, with the forces of the last step.
        let mut residual = sag;
        for other in &self.before {
            if let Some(held) = other.grasp.filter(|held| held.object == grasp.object) {
                residual += residual_between(object, &grasp, &held) * other.force;
            }
        }
        self.points[device] = HeldPoint {
            grasp: Some(grasp),
            rest: recording.surface.rest_position(&grasp.point),
            displacement: project_rows(self.rows(device, m), q) + residual,
            residual,
            sag,
            ..HeldPoint::default()
        };

        // C with every point that is held on the same object.
        let devices = self.points.len();
        for other in 0..devices {
            if let Some(held) = self.points[other].grasp.filter(|held| held.object == grasp.object) {
                let s = residual_between(object, &grasp, &held);
                let c = compliance(&object.modes, self.rows(device, m), self.rows(other, m)) + s;
                self.residual[device * devices + other] = s;
                self.residual[other * devices + device] = s.transpose();
                self.compliance[device * devices + other] = c;
                self.compliance[other * devices + device] = c.transpose();
            }
        }
    }
}

/// J_a·S·J_bᵀ [m/N].
fn residual_between(object: &SceneObject, a: &Grasp, b: &Grasp) -> DMat3 {
    let recording = &*object.recording;
    let mut sum = DMat3::ZERO;
    for (i, wi) in recording.surface.corners(&a.point) {
        for (j, wj) in recording.surface.corners(&b.point) {
            if wi != 0.0 && wj != 0.0 {
                sum += recording.residual.block(i, j) * (wi * wj);
            }
        }
    }
    sum
}
