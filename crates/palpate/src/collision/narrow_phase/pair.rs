//! Elastic objects against one another: surface nodes of each against the surface of the other. Where many come near, contact
//! samples stand for them on both sides, against the decimated surface between samples.

use super::point_surface::{MovingPoint, point_against_surface};
use crate::bounded_vec::BoundedVec;
use crate::collision::broad_phase::HalfSpace;
use crate::collision::candidate::{CandidateSide, ContactCandidate, Mark};
use crate::collision::contact::{Collider, Contact, ContactId, ContactLaw, FeatureId, OtherSide};
use crate::collision::context::{CollisionContext, CollisionWorkspace};
use crate::collision::deformed_surface::{DeformedSurface, SurfaceTime};
use crate::collision::level_of_detail::ObjectPair;
use crate::collision::parameters::COLLISION;
use crate::collision::proximity::ProximityQuery;
use crate::object::{Object, ObjectState};
use crate::response::{ContactLocation, Footprint};
use glam::DVec3;

impl CollisionContext<'_> {
    /// Find the contacts of two objects, at the finest levels of detail that have few enough samples near.
    pub(crate) fn find_contacts_of_pair(&mut self, objects: [usize; 2]) {
        let mark = self.workspace.candidates.mark();
        let mut pair = self.levels.of_pair(objects, self.step);
        for (detail, &object) in pair.details.iter_mut().zip(&pair.objects) {
            let body = &self.scene.objects[object].body;
            detail.begin(self.step, 0, body.finest_level().min(body.coarsest_surface_level()));
        }
        let max_samples = self.scene.max_contact_samples.min(self.levels.points_of_pair(&pair));
        loop {
            let overlap = self.overlap(&pair);
            pair.is_near |= overlap.is_some();
            let found = match overlap {
                Some(of) => [0, 1].map(|side| self.nodes_against(&pair, side, of[side], (mark, max_samples))),
                None => [0; 2],
            };
            let near = [0, 1].map(|side| if self.can_be_coarser(&pair, side) { found[side] } else { 0 });
            let is_too_much = self.workspace.candidates.since(mark) > max_samples;
            // Coarsen a side that has too many near, or the one that has more of them.
            let coarsens = [0, 1].map(|side| {
                let is_larger = near[side] > 0 && near[side] == near[0].max(near[1]);
                near[side] > pair.details[side].allowed(max_samples) || is_too_much && is_larger
            });
            if !coarsens.contains(&true) {
                break;
            }
            for (detail, _) in pair.details.iter_mut().zip(coarsens).filter(|(_, coarsens)| *coarsens) {
                detail.coarsen(self.step);
            }
            self.workspace.candidates.rewind(mark);
        }
        pair.points = self.workspace.candidates.since(mark);
        self.levels.keep_pair(pair);
    }

    fn can_be_coarser(&self, pair: &ObjectPair, side: usize) -> bool {
        pair.details[side].level < self.scene.objects[pair.objects[side]].body.coarsest_surface_level()
    }

    /// Find the contacts of the nodes of one of two objects in a half-space with the surface of the other. Gives the number of nodes that
    /// come near it; where a coarser level could stand for them, counting stops beyond the allowed.
    fn nodes_against(
        &mut self,
        pair: &ObjectPair,
        side: usize,
        half_space: HalfSpace,
        (mark, max_samples): (Mark, usize),
    ) -> usize {
        let [nodes_of, surface_of] = [pair.objects[side], pair.objects[1 - side]];
        let can_be_coarser = self.can_be_coarser(pair, side);
        let enough = if can_be_coarser { max_samples } else { usize::MAX };
        let footprints = [self.footprint_of(pair, side), self.footprint_of(pair, 1 - side)];
        let [own_level, other_level] = [side, 1 - side].map(|side| pair.details[side].level as u8);
        let uses_samples = [own_level, other_level] != [0; 2];
        let Self { scene, states, contacts, step, .. } = self;
        let CollisionWorkspace { query, positions, near_nodes, candidates, .. } = &mut *self.workspace;
        let Ok([cache, base_cache]) = positions.get_disjoint_mut([nodes_of, surface_of]) else { return 0 };
        let side = |number: usize, footprint, cache| {
            let (own, object) = (&states[number], &scene.objects[number]);
            let moment = SurfaceTime::StepStart(*step);
            let mut surface =
                DeformedSurface::new(&object.body, footprint, &own.response, &own.points, cache, moment);
            surface.localise_residual(&own.response, *step);
            Side { number, own, object, footprint, surface }
        };
        let (mut nodes, mut base) =
            (side(nodes_of, footprints[0], cache), side(surface_of, footprints[1], base_cache));
        let travel = nodes.travel() + base.travel();
        nodes.collect_near_nodes(&base, &half_space, travel, near_nodes);
        let mut found = 0;
        for &node in near_nodes.iter() {
            let feature = FeatureId::NodeOnSurface { levels: [own_level, other_level], node };
            let id = ContactId { collider: Collider::Object(nodes_of), object: surface_of, feature };
            let known = contacts.binary_search_by(|c| c.id.cmp(&id)).ok().map(|at| &contacts[at]);
            let node = node as usize;
            let Some(moving) = approach(&mut nodes, &mut base, node, travel, known) else { continue };
            found += 1;
            if let Some(candidate) = meet(&mut nodes, &mut base, (node, moving), id, known, query) {
                // A sample whose triangle is held apart at its corners by the other side's samples needs no contact.
                let is_candidate = |node: usize| {
                    let levels = [other_level, own_level];
                    let feature = FeatureId::NodeOnSurface { levels, node: node as u32 };
                    let id = ContactId { collider: Collider::Object(surface_of), object: nodes_of, feature };
                    candidates.list[mark.len..].iter().any(|candidate| candidate.id == id)
                };
                let mut corners = base.object.body.corners(&candidate.location).into_iter();
                let is_redundant = uses_samples
                    && corners
                        .all(|(node, weight)| weight < COLLISION.location_tolerance[1] || is_candidate(node));
                if !is_redundant {
                    candidates.push(candidate);
                }
            }
            if found.max(candidates.since(mark)) > enough {
                break;
            }
        }
        found
    }
}

/// One object of a pair.
struct Side<'a> {
    number: usize,
    own: &'a ObjectState,
    object: &'a Object,
    footprint: Footprint,
    surface: DeformedSurface<'a>,
}

impl Side<'_> {
    /// Bound of the rigid motion over the step without contact force [m].
    fn travel(&self) -> f64 {
        self.own.rigid.pose.motion_bound(&self.own.free.end.pose, self.object.radius)
    }

    /// Point of this body [m] in the frame of the other.
    fn point_in(&self, base: &Side, point: DVec3) -> DVec3 {
        base.own.rigid.pose.body_from_world(self.own.rigid.pose.world_from_body(point))
    }

    /// Direction of this body in the frame of the other.
    fn direction_in(&self, base: &Side, direction: DVec3) -> DVec3 {
        base.own.rigid.pose.orientation.inverse() * (self.own.rigid.pose.orientation * direction)
    }

    /// Collect the nodes in a half-space that are near the other's bounding box at rest, grown by its deformation.
    fn collect_near_nodes(
        &mut self,
        base: &Side,
        half_space: &HalfSpace,
        travel: f64,
        near_nodes: &mut BoundedVec<u32>,
    ) {
        let Self { own, object, surface, .. } = self;
        let (pose, base_pose) = (own.rigid.pose, base.own.rigid.pose);
        let grown = base.surface.max_displacement()
            + travel
            + COLLISION.margin * object.body.edge.min(base.object.body.edge)
            + object.body.max_height
            + base.object.body.max_height;
        let direction = pose.orientation.inverse() * half_space.direction;
        let is_near = |point: DVec3, radius: f64| {
            let in_base = || base_pose.body_from_world(pose.world_from_body(point));
            point.dot(direction) + radius > half_space.offset
                && base.object.body.rest_box_is_within(in_base(), radius + grown)
        };
        near_nodes.clear();
        surface.clear_marks();
        surface.traverse(
            |_, _, centre, radius| is_near(centre, radius),
            |surface, triangle| {
                for node in surface.surface().triangles[triangle as usize] {
                    let at = node as usize;
                    let residual = surface.max_residual_of(at);
                    if surface.mark_node(at)
                        && is_near(surface.modal_position(at), residual)
                        && !near_nodes.is_full()
                    {
                        near_nodes.push(node);
                    }
                }
            },
        );
    }
}

/// Contact points of a contact between objects: the slot of the node's, and the location on the surface.
fn points_of(base: &Side, contact: &Contact) -> Option<(usize, ContactLocation)> {
    match contact.other {
        OtherSide::Object { slot, .. } => Some((slot, base.own.points.of(contact.slot).location)),
        _ => None,
    }
}

/// Motion of a node relative to the surface of another object, if bounds leave it open that they meet.
fn approach(
    nodes: &mut Side,
    base: &mut Side,
    node: usize,
    travel: f64,
    known: Option<&Contact>,
) -> Option<MovingPoint> {
    let modal = nodes.surface.modal_position(node);
    let deformation = (nodes.surface.predicted_position(node) - modal).length();
    let known = known.and_then(|contact| points_of(base, contact));
    let moving = MovingPoint {
        point: nodes.point_in(base, modal),
        travel: travel + deformation,
        facing: nodes.direction_in(base, nodes.object.body.outward_normal(nodes.footprint, node)),
        known: known.map(|(_, location)| location.point.triangle),
        heights: nodes.object.body.node_height(nodes.footprint, node) + base.object.body.max_height,
        edge: nodes.object.body.edge.min(base.object.body.edge),
    };
    // Residual displacement costs more: it is bounded here.
    let reach = moving.reach() + nodes.surface.max_residual_of(node);
    base.surface.may_be_within(moving.point, reach).then_some(moving)
}

/// Contact candidate of a node that comes near the surface of another object.
fn meet(
    nodes: &mut Side,
    base: &mut Side,
    (node, moving): (usize, MovingPoint),
    id: ContactId,
    known: Option<&Contact>,
    query: &mut ProximityQuery,
) -> Option<ContactCandidate> {
    let known = known.and_then(|contact| points_of(base, contact));
    let position = match known {
        Some((slot, _)) => {
            let point = nodes.own.points.of(slot);
            point.rest + point.state.displacement
        }
        None => nodes.surface.position(node),
    };
    let moving = MovingPoint { point: nodes.point_in(base, position), ..moving };
    let (point, normal) = point_against_surface(query, &mut base.surface, &moving)?;
    let mut location = ContactLocation { point, footprint: base.footprint };
    if let (Some((_, last)), Footprint::Patch(_)) = (known, base.footprint) {
        let rest = |location| base.object.body.rest_position(location);
        if (rest(&location) - rest(&last)).length() < COLLISION.location_tolerance[1] * moving.edge {
            location = last;
        }
    }
    let Side { footprint, .. } = *nodes;
    let of_node = ContactLocation { point: nodes.object.body.node_point(footprint, node), footprint };
    Some(ContactCandidate {
        id,
        location,
        other: CandidateSide::Object { number: nodes.number, location: of_node },
        law: ContactLaw::Unilateral { friction: libm::sqrt(nodes.object.friction * base.object.friction) },
        normal: base.own.rigid.pose.orientation * normal,
        distance: base.object.body.smooth_height(&location) + nodes.object.body.smooth_height(&of_node),
    })
}
