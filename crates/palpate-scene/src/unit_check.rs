//! Checks of lengths: whether they look as if given in millimetres.

use crate::scene::Scene;
use crate::warning::{Warning, WarningKind};
use glam::DVec3;
use palpate::{Pose, Surface};

/// Diagonal of an object [m] above which it looks as if given in millimetres.
const LARGE_OBJECT_M: f64 = 20.0;

impl Scene {
    /// Warning about positions [m, world] that a caller gives to a part, if some are far from the objects at the start and from where these
    /// are now. Their poses are asked for only then.
    pub fn far_positions(
        &self,
        name: &str,
        mut positions: impl Iterator<Item = DVec3> + Clone,
        poses: impl FnOnce() -> Vec<Pose>,
    ) -> Option<Warning> {
        let bounds = &self.object_bounds;
        let farthest = bounds.farthest(positions.clone())?;
        let objects = poses().into_iter().zip(self.model.recordings());
        let now: Vec<(Pose, f64)> = objects.map(|(pose, own)| (pose, own.surface.radius())).collect();
        let is_far =
            |x: DVec3| now.iter().all(|(pose, radius)| (x - pose.position).length() - radius > bounds.far());
        positions.any(is_far).then(|| bounds.warning("the motion", name, farthest))
    }
}

/// Warning about an object that is large for something that is touched.
pub(crate) fn large_object(name: &str, surface: &Surface) -> Option<Warning> {
    let diagonal = surface.diagonal();
    (diagonal > LARGE_OBJECT_M).then(|| {
        let message = format!(
            "the object {name:?} is {diagonal:.1} m across: if its mesh is in millimetres, record it with --scale 0.001"
        );
        Warning::new(WarningKind::Units, name, message)
    })
}
