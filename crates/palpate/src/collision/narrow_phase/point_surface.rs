//! Point against surface: a node of another object, or a corner of an obstacle, against a deformed surface.
//!
//! Equations: docs/theory.md (C25), (C58).

use crate::collision::deformed_surface::DeformedSurface;
use crate::collision::parameters::{COLLISION, ROUND_OFF};
use crate::collision::proximity::{ProximityQuery, opposes};
use crate::surface::SurfacePoint;
use glam::DVec3;

/// A point that moves relative to a surface over a step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MovingPoint {
    /// Position at the start [m, body].
    pub(crate) point: DVec3,
    /// Relative motion of point and surface over the step, the surface's deformation excluded [m].
    pub(crate) travel: f64,
    /// Outward normal of the surface that the point belongs to [body]; zero for none. It meets triangles that oppose it.
    pub(crate) facing: DVec3,
    /// Triangle that it was in contact with.
    pub(crate) known: Option<u32>,
    /// Heights of the smooth surfaces over the point and, at most, over the other surface [m].
    pub(crate) heights: f64,
    /// Mean edge that distances are scaled with [m].
    pub(crate) edge: f64,
}

impl MovingPoint {
    /// Distance within which the surface can be met [m].
    pub(crate) fn reach(&self) -> f64 {
        let Self { travel, known, heights, edge, .. } = *self;
        heights
            + COLLISION.margin * edge
            + 2.0 * travel
            + if known.is_some() { edge } else { COLLISION.max_depth * edge }
    }
}

/// Contact location and outward normal [body] of a point that meets a surface within the step.
///
/// # Real time
pub(crate) fn point_against_surface(
    query: &mut ProximityQuery,
    surface: &mut DeformedSurface,
    moving: &MovingPoint,
) -> Option<(SurfacePoint, DVec3)> {
    let MovingPoint { point, travel, facing, known, heights, edge } = *moving;
    let (margin, reach) = (COLLISION.margin * edge, moving.reach());
    query.nearest_triangles(surface, (point, facing), reach, known);
    let nearest = query.found.first().copied()?;
    let allowed = heights + margin + travel + surface.predicted_motion(nearest.triangle);
    let on_face = nearest.weights.iter().all(|w| *w > ROUND_OFF);
    let mut inside = query.is_inside(surface.body, point);
    let mut at_border = false;
    if facing != DVec3::ZERO && (!on_face || inside && known.is_none()) {
        // All faces tell on which side the point is, and whether it is beside those that oppose it.
        query.nearest_triangles(surface, (point, DVec3::ZERO), nearest.distance * (1.0 + ROUND_OFF), known);
        inside = query.is_inside(surface.body, point);
        at_border = query.found.iter().any(|one| !opposes(one.normal, facing));
    }
    let height = nearest.normal.dot(point - nearest.position);
    let overhang = (point - nearest.position - nearest.normal * height).length();
    // A point in contact that has slid over a border stays on the face for a while, or rims of aligned faces would lose
    // each other.
    let overhangs = !inside && at_border && known.is_some() && overhang < COLLISION.overhang * edge;
    let gap = match inside {
        _ if overhangs => height,
        true => -nearest.distance,
        false => nearest.distance,
    };
    // From outside, points that can close the gap; from inside, those that were in contact or have just come in, beside a face
    // only by the motion of a step.
    let depth = if at_border { allowed } else { COLLISION.max_depth * edge };
    if gap > allowed || gap < -depth && known.is_none() {
        return None;
    }
    // Outside an edge the normal leads to the point, on a face it is the face's.
    let is_clear = !inside && nearest.distance > margin && !on_face && !overhangs;
    let normal = if is_clear { (point - nearest.position) / nearest.distance } else { nearest.normal };
    let location = SurfacePoint { triangle: nearest.triangle, weights: nearest.weights };
    (normal != DVec3::ZERO && opposes(normal, facing)).then_some((location, normal))
}
