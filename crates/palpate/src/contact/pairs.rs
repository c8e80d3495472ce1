//! Elastic objects against one another: the surface nodes of each against the surface of the other. Where many come near,
//! some of them stand for all, on both sides: places against the coarser surface between places.

use super::against::{FEATURES, ON_EDGE};
use super::meeting::{Approach, MARGIN, SPARE, meeting};
use super::search::Search;
use super::sight::Sight;
use super::wanted::{Finding, Key, Wanted, WantedOther};
use super::{Collider, Contact, Law, Other};
use crate::response::{Place, Reading};
use crate::scene::SceneObject;
use crate::state::ObjectState;
use alloc::vec::Vec;
use glam::DVec3;

/// More than there are levels of places.
const LEVELS: u64 = 1 << 5;

/// A place on a coarse surface stays the same until what it meets has gone farther than this share of the mean edge.
const STAYS: f64 = 0.01;

/// Half of space as an object sees it: what goes farther than `from` [m] from its centre in a direction [world].
#[derive(Debug, Clone, Copy)]
struct Beyond {
    direction: DVec3,
    from: f64,
}

impl Finding<'_> {
    /// Find the contacts of all pairs of objects.
    ///
    /// # Real time
    /// Costs the pairs, and the nodes that are near another object.
    pub(crate) fn pairs(&mut self) {
        let count = self.objects.len();
        for (a, b) in (0..count).flat_map(|a| (a + 1..count).map(move |b| (a, b))) {
            if !self.model.objects[a].is_searched() || !self.model.objects[b].is_searched() {
                continue;
            }
            self.pair(a, b);
        }
    }

    /// Find the contacts of two objects, as coarsely as they are few enough.
    fn pair(&mut self, a: usize, b: usize) {
        let most = self.model.parameters.max_contact_samples;
        let (first, left_out) = (self.wanted.list.len(), self.wanted.left_out);
        loop {
            let found = match self.facing(a, b) {
                Some([of_a, of_b]) => {
                    [self.nodes_against(a, b, of_a, first), self.nodes_against(b, a, of_b, first)]
                }
                None => [0; 2],
            };
            let sides = [(a, b, found[0]), (b, a, found[1])];
            let near =
                sides.map(|(own, other, found)| if self.can_be_coarser(own, other) { found } else { 0 });
            let too_many = self.wanted.list.len() - first > most;
            // A side that has too many near, or the one that has more of them.
            let coarser =
                near.map(|found| found > most || too_many && found > 0 && found == near[0].max(near[1]));
            for ((own, other, found), coarser) in sides.into_iter().zip(coarser) {
                let at = self.level_at(own, other);
                let level = self.levels[at];
                self.levels[at] =
                    if coarser { level.coarser(self.step) } else { level.after(found, most, self.step) };
            }
            if !coarser.contains(&true) {
                return;
            }
            self.wanted.list.truncate(first);
            self.wanted.left_out = left_out;
        }
    }

    /// Where the level of an object against another stands.
    fn level_at(&self, own: usize, other: usize) -> usize {
        own * self.model.others() + self.model.parameters.obstacles.len() + other
    }

    fn can_be_coarser(&self, own: usize, other: usize) -> bool {
        self.levels[self.level_at(own, other)].number < self.model.objects[own].body.coarsest_surface()
    }

    /// How an object is read against another.
    fn reading(&self, own: usize, other: usize) -> Reading {
        self.model.objects[own].body.level(self.levels[self.level_at(own, other)].number)
    }

    /// Where two objects can meet in the step: what of each is beyond a plane across the line between their centres at
    /// which the other ends. Nothing when such a plane keeps them apart.
    fn facing(&mut self, a: usize, b: usize) -> Option<[Beyond; 2]> {
        let moves = |at: usize| {
            let (own, radius) = (&self.objects[at], self.model.objects[at].radius);
            own.rigid.pose.way(&own.free.end.pose, radius) + own.surface_motion
        };
        let edge = self.model.objects[a].body.edge.max(self.model.objects[b].body.edge);
        let slack = MARGIN * edge + SPARE * (moves(a) + moves(b));
        let way = self.objects[b].rigid.pose.position - self.objects[a].rigid.pose.position;
        let Some(along) = way.try_normalize() else {
            return Some([Beyond { direction: DVec3::X, from: f64::NEG_INFINITY }; 2]);
        };
        let room = way.length() - slack;
        // What the energies allow is often enough to tell.
        let pair = [(a, b), (b, a)];
        let most = pair.map(|of| self.model.objects[of.0].radius + self.sight(of).reach());
        if most[0] + most[1] < room {
            return None;
        }
        // A plane between them tells more cheaply than where each ends.
        let middle = room * most[0] / (most[0] + most[1]);
        let mut end_a = self.end((a, b), along, middle);
        let end_b = self.end((b, a), -along, room - end_a);
        if end_a + end_b > room && end_a <= middle {
            end_a = self.end((a, b), along, room - end_b);
        }
        let [of_a, of_b] = [(along, room - end_b), (-along, room - end_a)];
        let beyond = [of_a, of_b].map(|(direction, from)| Beyond { direction, from });
        (end_a + end_b > room).then_some(beyond)
    }

    /// How far from its centre an object goes in a direction [m, world], or `least` if it does not go so far.
    fn end(&mut self, of: (usize, usize), direction: DVec3, least: f64) -> f64 {
        let orientation = self.objects[of.0].rigid.pose.orientation;
        self.sight(of).support(orientation.inverse() * direction, least)
    }

    /// An object as it is read against another.
    fn sight(&mut self, (at, other): (usize, usize)) -> Sight<'_> {
        let reading = self.reading(at, other);
        let (own, body) = (&self.objects[at], &self.model.objects[at].body);
        Sight::new(body, reading, &own.response, &own.points, &mut self.caches[at], Ok(self.step))
    }

    /// The nodes of one object, beyond a plane, against the surface of another. Gives how many come near it, as far as that is
    /// no more than are allowed, where fewer can stand for them.
    fn nodes_against(&mut self, nodes_of: usize, surface_of: usize, beyond: Beyond, first: usize) -> usize {
        let can_be_coarser = self.can_be_coarser(nodes_of, surface_of);
        let enough = if can_be_coarser { self.model.parameters.max_contact_samples } else { usize::MAX };
        let readings = [self.reading(nodes_of, surface_of), self.reading(surface_of, nodes_of)];
        let levels = [(nodes_of, surface_of), (surface_of, nodes_of)]
            .map(|(own, other)| self.levels[self.level_at(own, other)].number as u64);
        let features = (levels[0] * LEVELS + levels[1]) * FEATURES;
        // What places of one side keep apart between them needs none of the other.
        let thinned = levels != [0; 2];
        let other_features = (levels[1] * LEVELS + levels[0]) * FEATURES;
        let Finding { model, objects, contacts, caches, search, near, wanted, step, .. } = self;
        let Ok([cache, base_cache]) = caches.get_disjoint_mut([nodes_of, surface_of]) else { return 0 };
        let side = |number: usize, reading, cache| {
            let (own, object) = (&objects[number], &model.objects[number]);
            let sight = Sight::new(&object.body, reading, &own.response, &own.points, cache, Ok(*step));
            Side { number, own, object, reading, sight }
        };
        let (mut nodes, mut base) =
            (side(nodes_of, readings[0], cache), side(surface_of, readings[1], base_cache));
        let way = nodes.way() + base.way();
        nodes.come_near(&base, &beyond, way, near);
        let mut found = 0;
        for &node in near.iter() {
            let feature = features + u64::from(node);
            let key = Key { other: Collider::Object(nodes_of), object: surface_of, feature };
            let known = contacts.binary_search_by(|c| c.key.cmp(&key)).ok().map(|at| &contacts[at]);
            let node = node as usize;
            let Some(approach) = approach(&mut nodes, &mut base, node, way, known) else { continue };
            found += 1;
            if let Some(contact) = meet(&mut nodes, &mut base, (node, approach), key, known, search) {
                let is_wanted = |node: usize| {
                    let feature = other_features + node as u64;
                    let other = Key { other: Collider::Object(surface_of), object: nodes_of, feature };
                    wanted.list[first..].iter().any(|wanted| wanted.key == other)
                };
                let mut corners = base.object.body.corners(&contact.place).into_iter();
                if !(thinned && corners.all(|(node, weight)| weight < ON_EDGE || is_wanted(node))) {
                    wanted.push(contact);
                }
            }
            if found.max(wanted.list.len() - first) > enough {
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
    object: &'a SceneObject,
    reading: Reading,
    sight: Sight<'a>,
}

impl Side<'_> {
    /// How far the rigid motion moves it in the step without contact force, at most [m].
    fn way(&self) -> f64 {
        self.own.rigid.pose.way(&self.own.free.end.pose, self.object.radius)
    }

    /// A place [m] or a direction in its body as the other has it in its own.
    fn seen_from(&self, base: &Side, place: DVec3) -> DVec3 {
        base.own.rigid.pose.body_from_world(self.own.rigid.pose.world_from_body(place))
    }

    fn direction_from(&self, base: &Side, direction: DVec3) -> DVec3 {
        base.own.rigid.pose.orientation.inverse() * (self.own.rigid.pose.orientation * direction)
    }

    /// The nodes beyond a plane that are near the box around the other, which is moved out as far as the other can deform.
    fn come_near(&mut self, base: &Side, beyond: &Beyond, way: f64, near: &mut Vec<u32>) {
        let Self { own, object, sight, .. } = self;
        let (pose, base_pose) = (own.rigid.pose, base.own.rigid.pose);
        let grown = base.sight.reach() + way + MARGIN * object.body.edge.min(base.object.body.edge);
        let direction = pose.orientation.inverse() * beyond.direction;
        let dent = sight.most_dent();
        let is_near = |place: DVec3, radius: f64| {
            place.dot(direction) + radius > beyond.from
                && base
                    .object
                    .body
                    .is_near(base_pose.body_from_world(pose.world_from_body(place)), radius + grown)
        };
        near.clear();
        sight.begin_visit();
        sight.walk(
            |_, _, centre, radius| is_near(centre, radius),
            |sight, triangle, _| {
                for node in sight.surface().triangles[triangle as usize] {
                    if sight.first_visit(node as usize)
                        && is_near(sight.smooth(node as usize), dent)
                        && near.len() < near.capacity()
                    {
                        near.push(node);
                    }
                }
            },
        );
    }
}

/// Where a contact has its points: the slot of the node's, and the place on the surface.
fn points_of(base: &Side, contact: &Contact) -> Option<(usize, Place)> {
    match contact.other {
        Other::Object { slot, .. } => Some((slot, base.own.points.of(contact.slot).place)),
        _ => None,
    }
}

/// How a node that the modes move comes near the surface of another object, if it does.
fn approach(
    nodes: &mut Side,
    base: &mut Side,
    node: usize,
    way: f64,
    known: Option<&Contact>,
) -> Option<Approach> {
    let smooth = nodes.sight.smooth(node);
    let deforms = (nodes.sight.free_node(node) - smooth).length();
    let approach = Approach {
        point: nodes.seen_from(base, smooth),
        way: way + deforms,
        facing: nodes.direction_from(base, nodes.object.body.facing(nodes.reading, node)),
        known: known.and_then(|contact| points_of(base, contact)).map(|(_, place)| place.point.triangle),
        edge: nodes.object.body.edge.min(base.object.body.edge),
    };
    // Without its dent, which costs more, most that come near reach nothing.
    let reach = approach.reach() + nodes.sight.most_dent();
    base.sight.may_reach(approach.point, reach).then_some(approach)
}

/// The contact of a node that comes near the surface of another object.
fn meet(
    nodes: &mut Side,
    base: &mut Side,
    (node, approach): (usize, Approach),
    key: Key,
    known: Option<&Contact>,
    search: &mut Search,
) -> Option<Wanted> {
    let known = known.and_then(|contact| points_of(base, contact));
    let place = match known {
        Some((slot, _)) => {
            let point = nodes.own.points.of(slot);
            point.rest + point.placed.displacement
        }
        None => nodes.sight.node(node),
    };
    let approach = Approach { point: nodes.seen_from(base, place), ..approach };
    let (point, normal) = meeting(search, &mut base.sight, &approach)?;
    let mut place = Place { point, reading: base.reading };
    if let (Some((_, last)), Reading::Patch(_)) = (known, base.reading) {
        let rest = |place| base.object.body.rest_position(place);
        if (rest(&place) - rest(&last)).length() < STAYS * approach.edge {
            place = last;
        }
    }
    let Side { reading, .. } = *nodes;
    let of_node = Place { point: nodes.object.body.node_point(reading, node), reading };
    Some(Wanted {
        key,
        place,
        other: WantedOther::Object { number: nodes.number, place: of_node },
        law: Law::Touch { friction: libm::sqrt(nodes.object.friction * base.object.friction) },
        normal: base.own.rigid.pose.orientation * normal,
        distance: 0.0,
    })
}
