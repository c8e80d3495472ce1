//! Objects against planes and rigid obstacles.
//!
//! A surface node or contact sample that comes near becomes a contact with the tangent plane of the obstacle at its nearest
//! point, which moves with the obstacle. Round obstacles also meet the interior of triangles, and the corners of others
//! meet the surface between the nodes.
//!
//! Equations: docs/theory.md (C17), (C18), (C24).

use super::point_surface::{MovingPoint, point_against_surface};
use crate::collision::candidate::{CandidateList, CandidateSide, ContactCandidate, Mark};
use crate::collision::contact::{Collider, Contact, ContactId, ContactLaw, FeatureId, contacts_between};
use crate::collision::context::CollisionContext;
use crate::collision::deformed_surface::{DeformedSurface, SurfaceTime};
use crate::collision::parameters::{COLLISION, MAX_ITERATIONS};
use crate::collision::proximity::opposes;
use crate::object::ObjectState;
use crate::obstacle::Obstacle;
use crate::response::{Body, ContactLocation, Footprint};
use crate::spatial::Pose;
use crate::surface::{Centre, SurfacePoint, at_weights};
use glam::{DAffine3, DVec3};

/// An object and an obstacle over a step.
pub(super) struct ObstacleQuery<'a> {
    pub(super) object: usize,
    pub(super) number: usize,
    pub(super) body: &'a Body,
    pub(super) own: &'a ObjectState,
    obstacle: &'a Obstacle,
    /// Level of detail of the object: 0 for all nodes.
    pub(super) level: usize,
    /// Obstacle at the start and at the end.
    before: Pose,
    after: Pose,
    /// Maps from the body to the obstacle's frame at the start, and at the end without contact force.
    obstacle_from_body: DAffine3,
    obstacle_from_body_after: DAffine3,
    /// Bound of the relative rigid motion of body and obstacle [m].
    travel: f64,
    /// Distance within which nodes become candidates [m], and the addition to it where the travel could lead through the
    /// obstacle.
    margin: f64,
    sweep_margin: f64,
}

impl CollisionContext<'_> {
    /// Find the contacts of an object with an obstacle that moves from one pose to another.
    ///
    /// # Real time
    /// Costs the nodes that are near, and the logarithm of all.
    pub(crate) fn find_obstacle_contacts(&mut self, at: usize, number: usize, before: Pose, after: Pose) {
        let (object, obstacle) = (&self.scene.objects[at], &self.scene.obstacles[number]);
        let (body, own) = (&object.body, &self.states[at]);
        let (start, free) = (own.rigid.pose, own.free.end.pose);
        let apart = (before.position - start.position).length();
        let travel =
            before.motion_bound(&after, apart + object.radius) + start.motion_bound(&free, object.radius);
        let mut query = ObstacleQuery {
            object: at,
            number,
            body,
            own,
            obstacle,
            level: 0,
            before,
            after,
            obstacle_from_body: start.relative_to(&before),
            obstacle_from_body_after: free.relative_to(&after),
            travel,
            margin: COLLISION.margin * body.edge
                + COLLISION.neighbour_displacement * own.contact_displacement,
            sweep_margin: if travel > 0.5 * obstacle.shape.size() { travel } else { 0.0 },
        };
        let mark = self.workspace.candidates.mark();
        let known = contacts_between(self.contacts, Collider::Obstacle(number), at);
        let detail = &mut self.levels.against_obstacle(at, number).detail;
        let before_level = detail.level;
        detail.begin(self.step, known.len(), body.finest_level());
        let available = self.levels.points_against_obstacle(at, number);
        let max_samples = self.scene.max_contact_samples.min(available);
        let detail = &mut self.levels.against_obstacle(at, number).detail;
        let is_near = loop {
            query.level = detail.level;
            let footprint = body.footprint_at_level(query.level);
            let positions = &mut self.workspace.positions[at];
            let moment = SurfaceTime::StepStart(self.step);
            let surface =
                &mut DeformedSurface::new(body, footprint, &own.response, &own.points, positions, moment);
            surface.cover_prediction();
            surface.localise_residual(&own.response, self.step);
            let reach = object.radius + surface.max_displacement() + travel + query.margin + body.max_height;
            let candidates = &mut self.workspace.candidates;
            let is_near = apart - reach <= obstacle.shape.radius();
            let allowed = detail.allowed(max_samples).min(available);
            if is_near {
                query.nodes(surface, known, candidates, (mark, allowed));
            }
            if candidates.since(mark) <= allowed || query.level == body.coarsest_level() {
                break is_near;
            }
            candidates.rewind(mark);
            detail.coarsen(self.step);
        };
        if is_near && query.level > 0 {
            let is_coarser = query.level > before_level;
            query.refine(self, if is_coarser { &[] } else { known }, (mark, available));
        }
        if obstacle.shape.has_corners() {
            query.corners(self);
        }
        let found = self.workspace.candidates.since(mark);
        self.levels.ask_against_obstacle(at, number, found);
    }
}

impl ObstacleQuery<'_> {
    /// Distance of a body point from the obstacle at the start [m]; infinite where it is more than `most`.
    pub(super) fn distance(&self, p: DVec3, most: f64) -> f64 {
        let local = self.obstacle_from_body.transform_point3(p);
        self.obstacle.shape.signed_distance(local, most).map_or(f64::INFINITY, |(distance, _)| distance)
    }

    /// Gap [m] of the smooth surface over a footprint's node at a body position; infinite where it is more than `most`.
    pub(super) fn gap(&self, p: DVec3, (footprint, node): (Footprint, usize), most: f64) -> f64 {
        let height = self.body.node_height(footprint, node);
        self.distance(p, most + height) - height
    }

    /// Direction from a body point into the obstacle at the start [body].
    fn towards(&self, p: DVec3) -> DVec3 {
        let local = self.obstacle_from_body.transform_point3(p);
        let outward =
            self.obstacle.shape.signed_distance(local, f64::INFINITY).map_or(DVec3::ZERO, |(_, n)| n);
        -self.obstacle_from_body.matrix3.transpose() * outward
    }

    /// Distance of a body point at the end of the step without contact force [m].
    fn distance_after(&self, p: DVec3, most: f64) -> f64 {
        let local = self.obstacle_from_body_after.transform_point3(p);
        self.obstacle.shape.signed_distance(local, most).map_or(f64::INFINITY, |(distance, _)| distance)
    }

    /// Whether a point is within a reach [m] at the start or at the end of the step. Its end is computed only if it can
    /// be near.
    fn approaches(&self, start: DVec3, end: impl FnOnce() -> DVec3, reach: f64) -> bool {
        let most = reach + self.travel + self.own.surface_motion;
        let distance = self.distance(start, most);
        distance < reach || distance < most && self.distance_after(end(), reach) < reach
    }

    /// Nodes or contact samples, and for round obstacles the interiors of triangles.
    fn nodes(
        &self,
        surface: &mut DeformedSurface,
        known: &[Contact],
        candidates: &mut CandidateList,
        (mark, allowed): (Mark, usize),
    ) {
        let footprint = self.body.footprint_at_level(self.level);
        let triangles = &self.body.surface(footprint).triangles;
        let is_full = core::cell::Cell::new(false);
        surface.clear_marks();
        surface.traverse(
            |surface, of, centre, radius| {
                if is_full.get() {
                    return false;
                }
                let reach = radius + self.margin + self.sweep_margin + self.body.max_height;
                match of {
                    Centre::Rest => self.distance(centre, reach + self.travel) < reach + self.travel,
                    Centre::Deformed(node) => {
                        self.approaches(centre, || surface.predicted_position(node), reach)
                    }
                }
            },
            |surface, triangle| {
                for node in triangles[triangle as usize].map(|n| n as usize) {
                    if !surface.mark_node(node) {
                        continue;
                    }
                    let feature = FeatureId::of_node(self.level, node);
                    let contact = known.binary_search_by(|c| c.id.feature.cmp(&feature)).ok();
                    let point = contact.map(|at| self.own.points.of(known[at].slot));
                    let start = match point {
                        Some(point) => point.rest + point.state.displacement,
                        None => {
                            let height = self.body.node_height(footprint, node);
                            let residual = surface.max_residual_of(node);
                            let reach = self.margin + residual + self.sweep_margin + height;
                            let modal = surface.modal_position(node);
                            if !self.approaches(modal, || surface.predicted_position(node), reach) {
                                continue;
                            }
                            modal
                        }
                    };
                    let vertex = self.body.facing_vertex(footprint, node, || self.towards(start));
                    let position = match point.filter(|point| point.node == Some(vertex)) {
                        Some(_) => start,
                        None => surface.position(vertex),
                    };
                    let free = surface.predicted_position(vertex);
                    let location =
                        ContactLocation { point: self.body.node_point(footprint, vertex), footprint };
                    let facing = self.body.outward_normal(footprint, vertex);
                    self.meet(candidates, [position, free], facing, location, feature);
                }
                if self.level == 0 {
                    self.triangle_interior(surface, triangle, candidates);
                }
                is_full.set(candidates.since(mark) > allowed && self.level < self.body.coarsest_level());
            },
        );
    }

    /// Interior of a triangle, where a round obstacle comes nearer to it than to its nodes.
    fn triangle_interior(
        &self,
        surface: &mut DeformedSurface,
        triangle: u32,
        candidates: &mut CandidateList,
    ) {
        if !self.obstacle.shape.is_round() {
            return;
        }
        let corners = self.body.recording.surface.triangles[triangle as usize].map(|n| n as usize);
        let positions = corners.map(|node| surface.modal_position(node));
        let local = positions.map(|p| self.obstacle_from_body.transform_point3(p));
        let Some(weights) = self.obstacle.shape.deepest(local) else { return };
        // Inside the triangle, or on an edge, which counts for one of its two triangles.
        let is_thin = |k: &usize| weights[*k] < COLLISION.location_tolerance[1];
        let edge = (0..3).find(is_thin).map(|k| (corners[(k + 1) % 3], corners[(k + 2) % 3]));
        if (0..3).filter(is_thin).count() > 1 || edge.is_some_and(|(a, b)| a > b) {
            return;
        }
        let residual = corners.map(|node| surface.max_residual_of(node)).into_iter().fold(0.0, f64::max);
        let far = f64::INFINITY;
        let deepest = self.distance(at_weights(positions, weights), far);
        let is_nearer = |p: &DVec3| self.distance(*p, far) < deepest + 0.5 * self.margin;
        if deepest > self.margin + residual + self.sweep_margin || positions.iter().any(is_nearer) {
            return;
        }
        let starts = corners.map(|node| surface.position(node));
        let ends = corners.map(|node| surface.predicted_position(node));
        let location =
            ContactLocation { point: SurfacePoint { triangle, weights }, footprint: Footprint::Point };
        let feature = FeatureId::Triangle(triangle);
        let over_step = [starts, ends].map(|positions| at_weights(positions, weights));
        self.meet(candidates, over_step, DVec3::ZERO, location, feature);
    }

    /// Push a candidate if a point that moves from one body position to another comes near the obstacle. Of a box, it meets faces that
    /// oppose its outward normal `facing` [body]; all, where that is zero.
    pub(super) fn meet(
        &self,
        candidates: &mut CandidateList,
        [from, to]: [DVec3; 2],
        facing: DVec3,
        location: ContactLocation,
        feature: FeatureId,
    ) {
        let shape = &self.obstacle.shape;
        let (start, end) = (
            self.obstacle_from_body.transform_point3(from),
            self.obstacle_from_body_after.transform_point3(to),
        );
        let height = self.body.smooth_height(&location);
        let travel = (end - start).length();
        let facing = self.obstacle_from_body.matrix3 * facing;
        let depths = [COLLISION.max_depth * self.body.edge, self.margin + travel];
        let limits = (depths, COLLISION.overhang * self.body.edge);
        let distance = |p: DVec3| {
            let found = shape.pressed_face(p, |normal| opposes(normal, facing), limits);
            let found = found.or_else(|| shape.signed_distance(p, f64::INFINITY));
            found.map(|(distance, outward)| (distance - height, outward))
        };
        let (Some((first, _)), Some((last, _))) = (distance(start), distance(end)) else { return };
        // In the obstacle's frame: where a fast point first touches, else where it is.
        let mut position = start;
        if travel > 0.5 * shape.size() && first > 0.0 {
            let mut t = 0.0;
            for _ in 0..MAX_ITERATIONS {
                position = start.lerp(end, t);
                let Some((gap, _)) = distance(position) else { return };
                if gap < 0.5 * self.margin {
                    break;
                }
                t += (gap / travel).max(1e-3);
                if t >= 1.0 {
                    return;
                }
            }
        } else if first.min(last) > self.margin + libm::fabs(last - first) {
            return;
        }
        let Some((gap, outward)) = distance(position) else { return };
        let nearest = position - outward * (gap + height);
        let normal = -(self.before.orientation * outward);
        self.push(candidates, feature, location, normal, nearest);
    }

    /// Push a contact of a location with a point of the obstacle, in its frame.
    fn push(
        &self,
        candidates: &mut CandidateList,
        feature: FeatureId,
        location: ContactLocation,
        normal: DVec3,
        other: DVec3,
    ) {
        candidates.push(ContactCandidate {
            id: ContactId { collider: Collider::Obstacle(self.number), object: self.object, feature },
            location,
            other: CandidateSide::Obstacle {
                number: self.number,
                start: self.before.world_from_body(other),
                end: self.after.world_from_body(other),
            },
            law: ContactLaw::Unilateral { friction: self.obstacle.friction },
            normal,
            distance: self.body.smooth_height(&location),
        });
    }

    /// Corners of the obstacle against the surface.
    fn corners(&self, context: &mut CollisionContext) {
        let (start, free) = (self.own.rigid.pose, self.own.free.end.pose);
        let contacts = context.contacts;
        let workspace = &mut *context.workspace;
        let (query, candidates) = (&mut workspace.query, &mut workspace.candidates);
        let positions = &mut workspace.positions[self.object];
        let moment = SurfaceTime::StepStart(context.step);
        let (response, points) = (&self.own.response, &self.own.points);
        let surface =
            &mut DeformedSurface::new(self.body, Footprint::Point, response, points, positions, moment);
        let grown = surface.max_displacement() + self.margin + self.travel + self.body.max_height;
        self.obstacle.shape.corners(
            |centre, radius| {
                let centre = start.body_from_world(self.before.world_from_body(centre));
                self.body.rest_box_is_within(centre, radius + grown)
            },
            |corner, position, outward| {
                let feature = FeatureId::Corner(corner as u32);
                let id =
                    ContactId { collider: Collider::Obstacle(self.number), object: self.object, feature };
                let known = contacts.binary_search_by(|c| c.id.cmp(&id)).ok();
                let known = known.map(|at| self.own.points.of(contacts[at].slot).location.point.triangle);
                let point = start.body_from_world(self.before.world_from_body(position));
                let travel = (free.body_from_world(self.after.world_from_body(position)) - point).length();
                let facing = start.orientation.inverse() * (self.before.orientation * outward);
                let (heights, edge) = (self.body.max_height, self.body.edge);
                let moving = MovingPoint { point, travel, facing, known, heights, edge };
                if let Some((point, normal)) = point_against_surface(query, surface, &moving) {
                    let location = ContactLocation { point, footprint: Footprint::Point };
                    self.push(candidates, feature, location, start.orientation * normal, position);
                }
            },
        );
    }
}
