//! Refinement of contact samples: where a node between them penetrates, a finer sample is added there, in the end the node.
//!
//! An active set: a search passes over the nodes in the obstacle, a part of them in each step. A node that is deeper than the
//! tolerance gets the nearest sample of the next finer level that is not in contact yet. What was added stays while it carries
//! force.

use super::obstacle::ObstacleQuery;
use crate::collision::contact::{Contact, FeatureId};
use crate::collision::context::{CollisionContext, CollisionWorkspace};
use crate::collision::deformed_surface::{DeformedSurface, SurfaceTime};
use crate::collision::node_cache::NodePositionCache;
use crate::collision::parameters::COLLISION;
use crate::response::{ContactLocation, Footprint};
use crate::surface::Traversal;
use glam::DVec3;

impl ObstacleQuery<'_> {
    /// Keep the finer samples among the known contacts, and search on; `detail` is the index of the level of detail, `first` that of
    /// the first candidate against the obstacle.
    ///
    /// # Real time
    /// Costs the finer samples, and a limited number of visits.
    pub(super) fn refine(
        &self,
        context: &mut CollisionContext,
        known: &[Contact],
        detail: usize,
        first: usize,
    ) {
        let max_added = context.scene.max_contact_samples.saturating_mul(2);
        let CollisionWorkspace { positions, near_nodes, candidates, .. } = &mut *context.workspace;
        let mut added = 0;
        for contact in known {
            let Some(level) = contact.id.feature.level().filter(|level| *level < self.level) else {
                continue;
            };
            let point = self.own.points.of(contact.slot);
            debug_assert_eq!(point.location.footprint, self.body.footprint_at_level(level));
            let position = point.rest + point.state.displacement;
            let height = self.body.smooth_height(&point.location);
            if contact.force != DVec3::ZERO || self.distance(position, height) < height {
                self.meet(candidates, position, point.rest + point.free, point.location, contact.id.feature);
                added += 1;
            }
        }
        // Nodes that are too deep.
        let cache = &mut positions[self.object];
        let depth = COLLISION.sample_tolerance * self.body.recording.surface.radius();
        let search = &mut context.levels[detail].search;
        if search.is_finished() {
            *search = Traversal::START;
        }
        near_nodes.clear();
        let mut surface = self.surface(0, cache, context.step);
        let residual = surface.max_residual();
        surface.clear_marks();
        surface.resume_traversal(
            (search, COLLISION.search_visits),
            |_, _, centre, radius| {
                self.distance(centre, radius + self.body.max_height) < radius + self.body.max_height - depth
            },
            |surface, triangle| {
                for node in surface.surface().triangles[triangle as usize] {
                    let at = node as usize;
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
        for node in near_nodes.iter().map(|&node| node as usize) {
            if added >= max_added {
                return;
            }
            for level in (0..self.level).rev() {
                let Some(sample) = self.body.nearest_sample(level, node) else { continue };
                let feature = FeatureId::of_node(level, sample);
                if candidates.list[first..].iter().any(|candidate| candidate.id.feature == feature) {
                    continue;
                }
                let mut surface = self.surface(level, cache, context.step);
                let (from, to) = (surface.position(sample), surface.predicted_position(sample));
                let footprint = self.body.footprint_at_level(level);
                if self.gap(from, (footprint, sample), 0.0) >= 0.0 {
                    continue;
                }
                let location = ContactLocation { point: self.body.node_point(footprint, sample), footprint };
                let before = candidates.list.len();
                self.meet(candidates, from, to, location, feature);
                if candidates.list.len() > before {
                    added += 1;
                    break;
                }
            }
        }
    }

    /// Surface of the object at a level of detail, at the start of the step.
    fn surface<'s>(
        &'s self,
        level: usize,
        cache: &'s mut NodePositionCache,
        step: u64,
    ) -> DeformedSurface<'s> {
        let footprint = self.body.footprint_at_level(level);
        let moment = SurfaceTime::StepStart(step);
        DeformedSurface::new(self.body, footprint, &self.own.response, &self.own.points, cache, moment)
    }
}
