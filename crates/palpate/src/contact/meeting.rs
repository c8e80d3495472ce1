//! A point against the deformed surface of an object: a node of another one, a corner of an obstacle.

use super::search::Search;
use super::sight::Sight;
use crate::surface::SurfacePoint;
use glam::DVec3;

/// Points within this share of the mean edge are taken in though they don't come nearer: what the others' forces move
/// is small beside it.
pub(crate) const MARGIN: f64 = 2e-3;

/// What would meet within so many times the way of a step is taken in.
pub(crate) const SPARE: f64 = 1.5;

/// A point deeper inside than this share of the mean edge, and not in contact before, has come there some other way.
const DEEPEST: f64 = 0.5;

/// A point that comes near a surface.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Approach {
    /// Where it is at the start [m, body].
    pub(crate) point: DVec3,
    /// How far it and the surface go relative to each other in the step [m], the surface's deformation apart.
    pub(crate) way: f64,
    /// The way that it faces itself [body], if it faces one: nothing that faces the same way comes against it.
    pub(crate) facing: DVec3,
    /// The triangle that it was in contact with.
    pub(crate) known: Option<u32>,
    /// The mean edge [m] that its distances are measured by.
    pub(crate) edge: f64,
}

impl Approach {
    /// How far from the point the surface can be for them to meet [m].
    pub(crate) fn reach(&self) -> f64 {
        let Self { way, known, edge, .. } = *self;
        MARGIN * edge + 2.0 * way + if known.is_some() { edge } else { DEEPEST * edge }
    }
}

/// The place and the outward normal [body] where a point meets a surface in the step, if it does.
///
/// # Real time
pub(crate) fn meeting(
    search: &mut Search,
    sight: &mut Sight,
    approach: &Approach,
) -> Option<(SurfacePoint, DVec3)> {
    let Approach { point, way, facing, known, edge } = *approach;
    let (near, reach) = (MARGIN * edge, approach.reach());
    search.closest(sight, (point, facing), reach, known);
    let nearest = search.found.first().copied()?;
    let inside = search.is_inside(point);
    let gap = if inside { -nearest.distance } else { nearest.distance };
    // From outside, what can close in the step; from inside, what was in contact or has just come in.
    let closes = gap < near + SPARE * (way + sight.deformation(&nearest));
    if !closes || gap < -DEEPEST * edge && known.is_none() {
        return None;
    }
    // Over an edge from outside the direction is the way to it, on a face the face's.
    let on_face = nearest.weights.iter().all(|w| *w > 1e-9);
    let clear = !inside && nearest.distance > 1e-3 * edge && !on_face;
    let normal = if clear { (point - nearest.position) / nearest.distance } else { nearest.normal };
    let place = SurfacePoint { triangle: nearest.triangle, weights: nearest.weights };
    (normal != DVec3::ZERO && normal.dot(facing) <= 0.0).then_some((place, normal))
}
