//! Objects against planes and rigid obstacles, many nodes at a time.
//!
//! A surface node that comes near becomes a contact with the tangent plane of the obstacle at its nearest point,
//! which moves with the obstacle. Round obstacles also meet the middle of a triangle, and the corners of others the
//! surface between the nodes.

use super::meeting::{Approach, MARGIN, meeting};
use super::sight::Sight;
use super::wanted::{Finding, Key, Wanted, WantedList, WantedOther};
use super::{Collider, Contact, Law, known_contacts};
use crate::obstacle::Obstacle;
use crate::response::{Body, Place, Reading};
use crate::spatial::Pose;
use crate::state::ObjectState;
use crate::surface::{Centre, SurfacePoint, at_weights};
use glam::{DAffine3, DVec3};

/// What a force moves on a node that is not pushed itself, as a share of what it moves where it acts: below it, from
/// one node to the next.
const PUSHED: f64 = 0.3;

/// What numbers of one level's features are below.
pub(super) const FEATURES: u64 = 1 << 40;

/// Steps of conservative advancement.
const ADVANCES: usize = 30;

/// A weight below this is none: the point is on the edge, or nearly.
pub(super) const ON_EDGE: f64 = 0.02;

/// An object and an obstacle over a step.
struct Encounter<'a> {
    at: usize,
    number: usize,
    body: &'a Body,
    own: &'a ObjectState,
    obstacle: &'a Obstacle,
    /// Which level of places stands for the surface: 0 for all nodes.
    level: usize,
    /// The obstacle at the start and at the end.
    before: Pose,
    after: Pose,
    /// What takes points of the body to the obstacle's frame at the start, and at the end without contact force.
    seen: DAffine3,
    seen_after: DAffine3,
    /// How far the body and the obstacle move relative to each other at most, deformation apart [m].
    way: f64,
    /// Distance [m] within which nodes are taken in, and more of it where the way could lead through the obstacle.
    margin: f64,
    beside: f64,
}

/// Find the contacts of an object with an obstacle that goes from one pose to another.
///
/// # Real time
/// Costs the nodes that are near, and the logarithm of all.
pub(crate) fn against(scene: &mut Finding, at: usize, number: usize, before: Pose, after: Pose) {
    let (object, obstacle) = (&scene.model.objects[at], &scene.model.parameters.obstacles[number]);
    let (body, own) = (&object.body, &scene.objects[at]);
    let (start, free) = (own.rigid.pose, own.free.end.pose);
    let apart = (before.position - start.position).length();
    let way = before.way(&after, apart + object.radius) + start.way(&free, object.radius);
    let mut encounter = Encounter {
        at,
        number,
        body,
        own,
        obstacle,
        level: 0,
        before,
        after,
        seen: start.seen_from(&before),
        seen_after: free.seen_from(&after),
        way,
        // Forces on the nodes around move a node too, though less than those.
        margin: MARGIN * body.edge + PUSHED * own.pushed,
        beside: if way > 0.5 * obstacle.shape.size() { way } else { 0.0 },
    };
    let most = scene.model.parameters.max_contact_samples;
    let level = at * scene.model.others() + number;
    let (first, left_out) = (scene.wanted.list.len(), scene.wanted.left_out);
    loop {
        encounter.level = scene.levels[level].number;
        let reading = body.level(encounter.level);
        let (cache, step) = (&mut scene.caches[at], Ok(scene.step));
        let sight = &mut Sight::new(body, reading, &own.response, &own.points, cache, step);
        sight.widen();
        let all = object.radius + sight.reach() + way + encounter.margin;
        if apart - all <= obstacle.shape.radius() {
            let known = known_contacts(scene.contacts, Collider::Obstacle(number), at);
            encounter.nodes(sight, known, scene.wanted, first.saturating_add(most));
        }
        let found = scene.wanted.list.len() - first;
        if found > most && encounter.level < body.coarsest() {
            // Too many: fewer stand for them.
            scene.wanted.list.truncate(first);
            scene.wanted.left_out = left_out;
            scene.levels[level] = scene.levels[level].coarser(scene.step);
            continue;
        }
        scene.levels[level] = scene.levels[level].after(found, most, scene.step);
        break;
    }
    if obstacle.shape.has_corners() {
        encounter.corners(scene, at);
    }
}

impl Encounter<'_> {
    /// Distance [m] of a body point from the obstacle at the start; infinite where it is more than `most`.
    fn distance(&self, p: DVec3, most: f64) -> f64 {
        let local = self.seen.transform_point3(p);
        self.obstacle.shape.signed_distance(local, most).map_or(f64::INFINITY, |(distance, _)| distance)
    }

    /// The same at the end of the step without contact force.
    fn distance_after(&self, p: DVec3, most: f64) -> f64 {
        let local = self.seen_after.transform_point3(p);
        self.obstacle.shape.signed_distance(local, most).map_or(f64::INFINITY, |(distance, _)| distance)
    }

    /// Whether a place comes within a reach [m] at the start or at the end of the step. Where it is then is asked for only
    /// if it can be near.
    fn comes_near(&self, start: DVec3, end: impl FnOnce() -> DVec3, reach: f64) -> bool {
        let most = reach + self.way + self.own.surface_motion;
        let distance = self.distance(start, most);
        distance < reach || distance < most && self.distance_after(end(), reach) < reach
    }

    /// The nodes, and for round obstacles the middles of triangles.
    fn nodes(&self, sight: &mut Sight, known: &[Contact], wanted: &mut WantedList, most: usize) {
        let reading = self.body.level(self.level);
        let triangles = &self.body.surface(reading).triangles;
        let enough = core::cell::Cell::new(false);
        let dent = sight.most_dent();
        sight.begin_visit();
        sight.walk(
            |sight, of, centre, radius| {
                if enough.get() {
                    return false;
                }
                let reach = radius + self.margin + self.beside;
                match of {
                    // At rest: nothing is known but how far the deformation can go.
                    Centre::Rest => self.distance(centre, reach + self.way) < reach + self.way,
                    Centre::Low(node) => self.comes_near(centre, || sight.free_low(node), reach),
                    Centre::Moved(node) => self.comes_near(centre, || sight.free_node(node), reach),
                }
            },
            |sight, triangle, high| {
                for node in triangles[triangle as usize].map(|n| n as usize) {
                    if !sight.first_visit(node) {
                        continue;
                    }
                    let place = match known.binary_search_by(|c| c.key.feature.cmp(&self.feature(node))) {
                        Ok(contact) => {
                            let point = self.own.points.of(known[contact].slot);
                            point.rest + point.placed.displacement
                        }
                        Err(_) => {
                            let reach = self.margin + dent + self.beside;
                            // The low modes alone can tell that it does not.
                            let (low, end) = (sight.low(node), || sight.free_low(node));
                            if !self.comes_near(low, end, reach + high) {
                                continue;
                            }
                            let smooth = sight.smooth(node);
                            if !self.comes_near(smooth, || sight.free_node(node), reach) {
                                continue;
                            }
                            sight.node(node)
                        }
                    };
                    let free = sight.free_node(node);
                    let place_of = Place { point: self.body.node_point(reading, node), reading };
                    self.meet(wanted, place, free, place_of, self.feature(node));
                }
                if self.level == 0 {
                    self.middle(sight, triangle, dent, wanted);
                }
                enough.set(wanted.list.len() > most && self.level < self.body.coarsest());
            },
        );
    }

    /// The middle of a triangle, where a round obstacle comes nearer to it than to its nodes.
    fn middle(&self, sight: &mut Sight, triangle: u32, dent: f64, wanted: &mut WantedList) {
        if !self.obstacle.shape.is_round() {
            return;
        }
        let corners = self.body.recording.surface.triangles[triangle as usize].map(|n| n as usize);
        let places = corners.map(|node| sight.smooth(node));
        let local = places.map(|p| self.seen.transform_point3(p));
        let Some(weights) = self.obstacle.shape.deepest(local) else { return };
        // Inside the triangle, or on an edge, which counts for one of its two triangles.
        let thin = |k: &usize| weights[*k] < ON_EDGE;
        let edge = (0..3).find(thin).map(|k| (corners[(k + 1) % 3], corners[(k + 2) % 3]));
        if (0..3).filter(thin).count() > 1 || edge.is_some_and(|(a, b)| a > b) {
            return;
        }
        let far = f64::INFINITY;
        let deep = self.distance(at_weights(places, weights), far);
        let nearer = |p: &DVec3| self.distance(*p, far) < deep + 1e-3 * self.body.edge;
        if deep > self.margin + dent + self.beside || places.iter().any(nearer) {
            return;
        }
        let (exact, ends) = (corners.map(|node| sight.node(node)), corners.map(|node| sight.free_node(node)));
        let feature = self.body.recording.surface.positions.len() + triangle as usize;
        let place = Place { point: SurfacePoint { triangle, weights }, reading: Reading::Point };
        self.meet(wanted, at_weights(exact, weights), at_weights(ends, weights), place, feature as u64);
    }

    /// Want a contact if a place that goes from one body point to another comes near the obstacle.
    fn meet(&self, wanted: &mut WantedList, from: DVec3, to: DVec3, of: Place, feature: u64) {
        let shape = &self.obstacle.shape;
        let (start, end) = (self.seen.transform_point3(from), self.seen_after.transform_point3(to));
        let distance = |p: DVec3| shape.signed_distance(p, f64::INFINITY);
        let (Some((first, _)), Some((last, _))) = (distance(start), distance(end)) else { return };
        let way = (end - start).length();
        // In the obstacle's frame, where it touches first if it is fast, else where it is.
        let mut place = start;
        if way > 0.5 * shape.size() && first > 0.0 {
            let mut t = 0.0;
            for _ in 0..ADVANCES {
                place = start.lerp(end, t);
                let Some((gap, _)) = distance(place) else { return };
                if gap < 0.5 * self.margin {
                    break;
                }
                t += (gap / way).max(1e-3);
                if t >= 1.0 {
                    return;
                }
            }
        } else if first.min(last) > self.margin + libm::fabs(last - first) {
            return;
        }
        let Some((gap, outward)) = distance(place) else { return };
        let nearest = place - outward * gap;
        let normal = -(self.before.orientation * outward);
        self.want(wanted, feature, of, normal, nearest);
    }

    /// What a node is called among the contacts.
    fn feature(&self, node: usize) -> u64 {
        self.level as u64 * FEATURES + node as u64
    }

    /// Want a contact of a surface point with a point of the obstacle, in its frame.
    fn want(&self, wanted: &mut WantedList, feature: u64, place: Place, normal: DVec3, other: DVec3) {
        wanted.push(Wanted {
            key: Key { other: Collider::Obstacle(self.number), object: self.at, feature },
            place,
            other: WantedOther::Obstacle {
                number: self.number,
                start: self.before.world_from_body(other),
                end: self.after.world_from_body(other),
            },
            law: Law::Touch { friction: self.obstacle.friction },
            normal,
            distance: 0.0,
        });
    }

    /// The obstacle's corners against the surface.
    fn corners(&self, scene: &mut Finding, at: usize) {
        let (start, free) = (self.own.rigid.pose, self.own.free.end.pose);
        let cache = &mut scene.caches[at];
        let step = Ok(scene.step);
        let sight =
            &mut Sight::new(self.body, Reading::Point, &self.own.response, &self.own.points, cache, step);
        let grown = sight.reach() + self.margin + self.way;
        let surface = &self.body.recording.surface;
        let first = surface.positions.len() + surface.triangles.len();
        let Finding { contacts, search, wanted, .. } = scene;
        self.obstacle.shape.corners(
            |centre, radius| {
                let place = start.body_from_world(self.before.world_from_body(centre));
                self.body.is_near(place, radius + grown)
            },
            |corner, place| {
                let feature = first + corner;
                let key =
                    Key { other: Collider::Obstacle(self.number), object: self.at, feature: feature as u64 };
                let known = contacts.binary_search_by(|c| c.key.cmp(&key)).ok();
                let known = known.map(|at| self.own.points.of(contacts[at].slot).place.point.triangle);
                let point = start.body_from_world(self.before.world_from_body(place));
                let way = (free.body_from_world(self.after.world_from_body(place)) - point).length();
                let approach = Approach { point, way, facing: DVec3::ZERO, known, edge: self.body.edge };
                if let Some((point, normal)) = meeting(search, sight, &approach) {
                    let of = Place { point, reading: Reading::Point };
                    self.want(wanted, feature as u64, of, start.orientation * normal, place);
                }
            },
        );
    }
}
