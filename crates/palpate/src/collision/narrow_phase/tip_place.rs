//! Places of device tips that appear, or end up, inside objects: on the surface, from where they press (god-object).
//!
//! The centre y of a ball of radius r [m] has the signed distance d [m] to the deformed surface, negative inside, with the direction e
//! out of the object there. A ball that overlaps, d < r, moves to the nearest place at which it touches:
//!
//! ```text
//! y ← y + (r − d)·e
//! ```
//!
//! Where its centre is then inside another object, or another part of this one, it goes on in the same direction.
//!
//! Equations: docs/theory.md (C70).

use crate::collision::context::{CollisionContext, CollisionWorkspace};
use crate::collision::deformed_surface::{DeformedSurface, SurfaceTime};
use crate::collision::parameters::{MAX_ITERATIONS, ROUND_OFF};
use crate::collision::proximity::ProximityQuery;
use crate::device::{DeviceState, LastTouch};
use crate::surface::{area_normal, at_weights};
use glam::DVec3;

/// Ball against the surface of an object.
#[derive(Clone, Copy)]
struct Clearance {
    /// Signed distance of the centre [m], negative inside.
    distance: f64,
    /// Gap between ball and surface [m].
    gap: f64,
    /// Direction out of the object [world].
    out: DVec3,
}

impl CollisionContext<'_> {
    /// Place of a proxy outside all objects [m, world]: where it is, if it is outside; beside the material point that it touched last;
    /// or the nearest one. None if none is found.
    ///
    /// # Real time
    /// Costs some distance queries for each object around the proxy.
    pub(crate) fn place_outside(&mut self, number: usize, device: &DeviceState) -> Option<DVec3> {
        let touched =
            device.last_touch.and_then(|touch| self.beside_last_touch(number, &touch, device.proxy));
        let start = touched.unwrap_or(device.proxy);
        let Some(first) = self.least_clearance(number, start).filter(|c| c.gap < 0.0) else {
            return Some(start);
        };
        let mut place = start - first.out * first.gap;
        for _ in 0..MAX_ITERATIONS {
            match self.least_clearance(number, place).filter(|c| c.distance < 0.0) {
                None => return Some(place),
                // In a slot that is narrower than the tip.
                Some(_) if first.distance >= 0.0 => return Some(start),
                Some(next) => place -= first.out * next.gap,
            }
        }
        None
    }

    /// Proxy [m, world] beside the material point of a touch, if a place is inside that object.
    fn beside_last_touch(&mut self, number: usize, touch: &LastTouch, place: DVec3) -> Option<DVec3> {
        self.clearance(number, touch.object, place).filter(|c| c.distance < 0.0)?;
        let radius = self.scene.devices[number].tip_radius;
        let pose = self.states[touch.object].rigid.pose;
        let (_, mut surface) = self.query_and_surface(number, touch.object);
        let corners = surface.corners(touch.point.triangle);
        let normal = area_normal(corners).normalize_or_zero();
        Some(pose.world_from_body(at_weights(corners, touch.point.weights) + normal * radius))
    }

    /// Least clearance of a place [m, world] from the objects around it.
    fn least_clearance(&mut self, number: usize, place: DVec3) -> Option<Clearance> {
        let clearances = (0..self.scene.objects.len()).filter_map(|at| self.clearance(number, at, place));
        clearances.min_by(|a, b| a.gap.total_cmp(&b.gap))
    }

    /// Clearance of a place [m, world] from an object; none far from it, and from one that can't be touched.
    fn clearance(&mut self, number: usize, at: usize, place: DVec3) -> Option<Clearance> {
        let (object, pose) = (&self.scene.objects[at], self.states[at].rigid.pose);
        let (body, parameters) = (&object.body, &self.scene.devices[number]);
        let (centre, tip) = (pose.body_from_world(place), parameters.ball_radius(body));
        let (query, mut surface) = self.query_and_surface(number, at);
        if centre.length() - tip > object.radius + surface.max_displacement() {
            return None;
        }
        let nearest = ProximityQuery::nearest(&mut surface, centre, f64::INFINITY)?;
        query.triangles_within(
            &mut surface,
            centre,
            nearest.distance * (1.0 + ROUND_OFF) + ROUND_OFF * body.edge,
        );
        let sign = if query.is_inside(body, centre) { -1.0 } else { 1.0 };
        let is_apart = nearest.distance > ROUND_OFF * body.edge;
        let away =
            if is_apart { (centre - nearest.position) * (sign / nearest.distance) } else { nearest.normal };
        let distance = sign * nearest.distance;
        Some(Clearance { distance, gap: distance - tip, out: pose.orientation * away })
    }

    /// Query buffer, and the surface of an object at the start of the step as a device reads it.
    fn query_and_surface(&mut self, number: usize, at: usize) -> (&mut ProximityQuery, DeformedSurface<'_>) {
        let (own, body) = (&self.states[at], &self.scene.objects[at].body);
        let footprint = body.footprint(self.scene.devices[number].patch_radius);
        let CollisionWorkspace { query, positions, .. } = &mut *self.workspace;
        let moment = SurfaceTime::StepStart(self.step);
        let positions = &mut positions[at];
        (query, DeformedSurface::new(body, footprint, &own.response, &own.points, positions, moment))
    }
}
