//! Refinement of contact samples: a node between them that penetrates is added.
//!
//! An active set: a search passes over the nodes in the obstacle, a part of them in each step, and adds those that are deeper than
//! the tolerance. They stay while they carry force or are within the tolerance.

use super::obstacle::ObstacleQuery;
use crate::collision::candidate::Mark;
use crate::collision::contact::{Contact, FeatureId};
use crate::collision::context::{CollisionContext, CollisionWorkspace};
use crate::collision::deformed_surface::{DeformedSurface, SurfaceTime};
use crate::collision::parameters::COLLISION;
use crate::response::{ContactLocation, Footprint};
use crate::surface::Traversal;
use glam::DVec3;

impl ObstacleQuery<'_> {
    /// Keep the nodes among the known contacts, and search on; `mark` is where the candidates against the obstacle begin, which has so many
    /// contact points `available`.
    ///
    /// # Real time
    /// Costs the nodes that were added, and a limited number of visits.
    pub(super) fn refine(
        &self,
        context: &mut CollisionContext,
        known: &[Contact],
        (mark, available): (Mark, usize),
    ) {
        let max_samples = context.scene.max_contact_samples;
        // Contact samples come first: of the room for contact points, one set of them is left free.
        let points = &self.own.points;
        let room = points.capacity().saturating_sub(points.points.len()).saturating_sub(max_samples);
        let CollisionWorkspace { positions, near_nodes, candidates, .. } = &mut *context.workspace;
        let depth = COLLISION.sample_tolerance * self.body.recording.surface.radius();
        let mut added = 0;
        for contact in known {
            let FeatureId::Node(node) = contact.id.feature else { continue };
            let point = self.own.points.of(contact.slot);
            let position = point.rest + point.state.displacement;
            let height = self.body.smooth_height(&point.location);
            let is_kept =
                contact.force != DVec3::ZERO || self.distance(position, height + depth) < height + depth;
            if is_kept && candidates.since(mark) < available {
                let facing = self.body.outward_normal(Footprint::Point, node as usize);
                let over_step = [position, point.rest + point.free];
                self.meet(candidates, over_step, facing, point.location, contact.id.feature);
                added += 1;
            }
        }
        // Nodes that are too deep.
        let cache = &mut positions[self.object];
        let search = &mut context.levels.against_obstacle(self.object, self.number).search;
        if search.is_finished() {
            *search = Traversal::START;
        }
        near_nodes.clear();
        let moment = SurfaceTime::StepStart(context.step);
        let (response, points) = (&self.own.response, &self.own.points);
        let mut surface = DeformedSurface::new(self.body, Footprint::Point, response, points, cache, moment);
        surface.localise_residual(&self.own.response, context.step);
        surface.clear_marks();
        surface.resume_traversal(
            (search, COLLISION.search_visits),
            |_, _, centre, radius| {
                self.distance(centre, radius + self.body.max_height) < radius + self.body.max_height - depth
            },
            |surface, triangle| {
                for node in surface.surface().triangles[triangle as usize] {
                    let at = node as usize;
                    let residual = surface.max_residual_of(at);
                    let is_deep = surface.mark_node(at)
                        && self.gap(surface.modal_position(at), (Footprint::Point, at), residual)
                            < residual - depth
                        && self.gap(surface.position(at), (Footprint::Point, at), 0.0) < -depth;
                    if is_deep && !near_nodes.is_full() {
                        near_nodes.push(node);
                    }
                }
            },
        );
        let max_new = room
            .min(max_samples.saturating_mul(2).saturating_sub(added))
            .min(available.saturating_sub(candidates.since(mark)));
        for node in near_nodes.iter().map(|&node| node as usize).take(max_new) {
            let feature = FeatureId::of_node(0, node);
            let is_beside = |location: &ContactLocation| {
                location.footprint == Footprint::Point
                    && (self.body.rest_position(location) - self.body.recording.surface.positions[node])
                        .length()
                        < self.body.node_spacing
            };
            let mut known = candidates.list[mark.len..].iter();
            if known.any(|other| other.id.feature == feature || is_beside(&other.location)) {
                continue;
            }
            let over_step = [surface.position(node), surface.predicted_position(node)];
            let footprint = Footprint::Point;
            let location = ContactLocation { point: self.body.node_point(footprint, node), footprint };
            let facing = self.body.outward_normal(footprint, node);
            self.meet(candidates, over_step, facing, location, feature);
        }
    }
}
