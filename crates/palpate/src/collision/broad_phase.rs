//! Broad phase: where two objects can meet in a step.
//!
//! Bounding spheres first, then a separating plane across the line between the centres: with upper bounds e_a and e_b of the
//! objects' support functions along it, they are apart when e_a + e_b is less than the distance of the centres.
//!
//! Equations: docs/theory.md (C19).

use super::context::CollisionContext;
use super::deformed_surface::{DeformedSurface, SurfaceTime};
use super::parameters::COLLISION;
use crate::response::Footprint;
use glam::DVec3;

/// Half-space of an object: points farther than `offset` [m] from its centre along a direction [world].
#[derive(Debug, Clone, Copy)]
pub(super) struct HalfSpace {
    pub(super) direction: DVec3,
    pub(super) offset: f64,
}

impl CollisionContext<'_> {
    /// Half-spaces of two objects within which they can meet in the step; none when a plane separates them.
    pub(super) fn overlap(&mut self, a: usize, b: usize) -> Option<[HalfSpace; 2]> {
        let motion = |at: usize| {
            let (own, radius) = (&self.states[at], self.scene.objects[at].radius);
            own.rigid.pose.motion_bound(&own.free.end.pose, radius) + own.surface_motion
        };
        let objects = self.scene.objects;
        let edge = objects[a].body.edge.max(objects[b].body.edge);
        let heights = objects[a].body.max_height + objects[b].body.max_height;
        let slack = heights + COLLISION.margin * edge + COLLISION.motion_factor * (motion(a) + motion(b));
        let between = self.states[b].rigid.pose.position - self.states[a].rigid.pose.position;
        let Some(along) = between.try_normalize() else {
            return Some([HalfSpace { direction: DVec3::X, offset: f64::NEG_INFINITY }; 2]);
        };
        let room = between.length() - slack;
        // The bounds by elastic energy are often enough.
        let pair = [(a, b), (b, a)];
        let extent = pair.map(|of| objects[of.0].radius + self.surface_against(of).max_displacement());
        if extent[0] + extent[1] < room {
            return None;
        }
        // A plane between them costs less than both support functions.
        let middle = room * extent[0] / (extent[0] + extent[1]);
        let mut end_a = self.support((a, b), along, middle);
        let end_b = self.support((b, a), -along, room - end_a);
        if end_a + end_b > room && end_a <= middle {
            end_a = self.support((a, b), along, room - end_b);
        }
        let [of_a, of_b] = [(along, room - end_b), (-along, room - end_a)];
        let half_spaces = [of_a, of_b].map(|(direction, offset)| HalfSpace { direction, offset });
        (end_a + end_b > room).then_some(half_spaces)
    }

    /// Upper bound of an object's support function along a direction [m, world], or `least` if that is larger.
    fn support(&mut self, of: (usize, usize), direction: DVec3, least: f64) -> f64 {
        let orientation = self.states[of.0].rigid.pose.orientation;
        self.surface_against(of).support(orientation.inverse() * direction, least)
    }

    /// Footprint with which an object is read against another.
    pub(super) fn footprint_against(&self, own: usize, other: usize) -> Footprint {
        let level = self.levels[self.level_against_object(own, other)].level;
        self.scene.objects[own].body.footprint_at_level(level)
    }

    /// Surface of an object as it is read against another, at the start of the step.
    fn surface_against(&mut self, (at, other): (usize, usize)) -> DeformedSurface<'_> {
        let footprint = self.footprint_against(at, other);
        let (own, body) = (&self.states[at], &self.scene.objects[at].body);
        let positions = &mut self.workspace.positions[at];
        let moment = SurfaceTime::StepStart(self.step);
        DeformedSurface::new(body, footprint, &own.response, &own.points, positions, moment)
    }
}
