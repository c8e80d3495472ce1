//! Elastic objects against one another: the surface nodes of each against the surface of the other.

use super::meeting::{Approach, MARGIN, SPARE, meeting};
use super::search::Search;
use super::sight::Sight;
use super::wanted::{Finding, Key, Wanted, WantedOther};
use super::{Against, Contact, Law, Other};
use crate::response::{Place, Reading};
use crate::scene::SceneObject;
use crate::state::ObjectState;
use alloc::vec::Vec;
use glam::DVec3;

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
            if let Some([of_a, of_b]) = self.facing(a, b) {
                self.nodes_against(a, b, of_a);
                self.nodes_against(b, a, of_b);
            }
        }
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
        let most = [a, b].map(|at| self.model.objects[at].radius + self.sight(at).reach());
        if most[0] + most[1] < room {
            return None;
        }
        // A plane between them tells more cheaply than where each ends.
        let middle = room * most[0] / (most[0] + most[1]);
        let mut end_a = self.end(a, along, middle);
        let end_b = self.end(b, -along, room - end_a);
        if end_a + end_b > room && end_a <= middle {
            end_a = self.end(a, along, room - end_b);
        }
        let [of_a, of_b] = [(along, room - end_b), (-along, room - end_a)];
        let beyond = [of_a, of_b].map(|(direction, from)| Beyond { direction, from });
        (end_a + end_b > room).then_some(beyond)
    }

    /// How far from its centre an object goes in a direction [m, world], or `least` if it does not go so far.
    fn end(&mut self, at: usize, direction: DVec3, least: f64) -> f64 {
        let orientation = self.objects[at].rigid.pose.orientation;
        self.sight(at).support(orientation.inverse() * direction, least)
    }

    fn sight(&mut self, at: usize) -> Sight<'_> {
        let (own, body) = (&self.objects[at], &self.model.objects[at].body);
        Sight::new(body, Reading::Point, &own.response, &own.points, &mut self.caches[at], Ok(self.step))
    }

    /// The nodes of one object, beyond a plane, against the surface of another.
    fn nodes_against(&mut self, nodes_of: usize, surface_of: usize, beyond: Beyond) {
        let Finding { model, objects, contacts, caches, search, near, wanted, step, .. } = self;
        let Ok([cache, base_cache]) = caches.get_disjoint_mut([nodes_of, surface_of]) else { return };
        let side = |number: usize, cache| {
            let (own, object) = (&objects[number], &model.objects[number]);
            let sight =
                Sight::new(&object.body, Reading::Point, &own.response, &own.points, cache, Ok(*step));
            Side { number, own, object, sight }
        };
        let (mut nodes, mut base) = (side(nodes_of, cache), side(surface_of, base_cache));
        let way = nodes.way() + base.way();
        nodes.come_near(&base, &beyond, way, near);
        for &node in near.iter() {
            if let Some(contact) = meet(&mut nodes, &mut base, node as usize, way, contacts, search) {
                wanted.push(contact);
            }
        }
    }
}

/// One object of a pair.
struct Side<'a> {
    number: usize,
    own: &'a ObjectState,
    object: &'a SceneObject,
    sight: Sight<'a>,
}

impl Side<'_> {
    /// How far the rigid motion moves it in the step without contact force, at most [m].
    fn way(&self) -> f64 {
        self.own.rigid.pose.way(&self.own.free.end.pose, self.object.radius)
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
                for node in object.body.recording.surface.triangles[triangle as usize] {
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

/// The contact of a node that comes near the surface of another object.
fn meet(
    nodes: &mut Side,
    base: &mut Side,
    node: usize,
    way: f64,
    contacts: &[Contact],
    search: &mut Search,
) -> Option<Wanted> {
    let key = Key { other: Against::Object(nodes.number), object: base.number, feature: node as u64 };
    let known = contacts.binary_search_by(|c| c.key.cmp(&key)).ok().map(|at| &contacts[at]);
    let known = known.and_then(|contact| match contact.other {
        Other::Object { slot, .. } => Some((slot, base.own.points.of(contact.slot).place.point.triangle)),
        _ => None,
    });
    let smooth = nodes.sight.smooth(node);
    let deforms = (nodes.sight.free_node(node) - smooth).length();
    let (pose, base_pose) = (nodes.own.rigid.pose, base.own.rigid.pose);
    let in_base = |place: DVec3| base_pose.body_from_world(pose.world_from_body(place));
    let mut approach = Approach {
        point: in_base(smooth),
        way: way + deforms,
        known: known.map(|(_, triangle)| triangle),
        edge: nodes.object.body.edge.min(base.object.body.edge),
    };
    // Without its dent, which costs more, most that come near reach nothing.
    if !base.sight.may_reach(approach.point, approach.reach() + nodes.sight.most_dent()) {
        return None;
    }
    approach.point = in_base(match known {
        Some((slot, _)) => {
            let point = nodes.own.points.of(slot);
            point.rest + point.placed.displacement
        }
        None => nodes.sight.node(node),
    });
    let (point, normal) = meeting(search, &mut base.sight, &approach)?;
    Some(Wanted {
        key,
        place: Place { point, reading: Reading::Point },
        other: WantedOther::Object {
            number: nodes.number,
            place: Place { point: nodes.object.body.node_point(node), reading: Reading::Point },
        },
        law: Law::Touch { friction: libm::sqrt(nodes.object.friction * base.object.friction) },
        normal: base_pose.orientation * normal,
        distance: 0.0,
    })
}
