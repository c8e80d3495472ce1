//! Elastic objects against one another: the surface nodes of each against the surface of the other.

use super::meeting::{Approach, MARGIN, meeting};
use super::sight::Sight;
use super::wanted::{Finding, Key, Wanted, WantedOther};
use super::{Against, Law, Other};
use crate::response::{Place, Reading};

impl Finding<'_> {
    /// Find the contacts of all pairs of objects.
    ///
    /// # Real time
    /// Costs the pairs, and the nodes that are near another object.
    pub(crate) fn pairs(&mut self) {
        let count = self.objects.len();
        for (a, b) in (0..count).flat_map(|a| (a + 1..count).map(move |b| (a, b))) {
            if self.model.objects[a].is_searched() && self.model.objects[b].is_searched() && !self.apart(a, b)
            {
                self.nodes_against(a, b);
                self.nodes_against(b, a);
            }
        }
    }

    /// Whether a plane across the line between the centres of two objects keeps them apart in the step.
    fn apart(&mut self, a: usize, b: usize) -> bool {
        let way = self.objects[b].rigid.pose.position - self.objects[a].rigid.pose.position;
        let Some(along) = way.try_normalize() else { return false };
        let edge = self.model.objects[a].body.edge.max(self.model.objects[b].body.edge);
        let mut left = way.length() - MARGIN * edge;
        for (at, direction) in [(a, along), (b, -along)] {
            let (own, object) = (&self.objects[at], &self.model.objects[at]);
            let (pose, cache, moment) = (own.rigid.pose, &mut self.caches[at], Ok(self.step));
            let mut sight =
                Sight::new(&object.body, Reading::Point, &own.response, &own.points, cache, moment);
            // What the energies allow is often enough to tell.
            let most = object.radius + sight.reach();
            let far = if 2.2 * most < way.length() {
                most
            } else {
                sight.support(pose.orientation.inverse() * direction)
            };
            left -= far + pose.way(&own.free.end.pose, object.radius) + own.surface_motion;
        }
        left > 0.0
    }

    /// The nodes of one object against the surface of another.
    fn nodes_against(&mut self, nodes_of: usize, surface_of: usize) {
        let (own, other) = (&self.objects[nodes_of], &self.objects[surface_of]);
        let (object, base) = (&self.model.objects[nodes_of], &self.model.objects[surface_of]);
        let (pose, base_pose) = (own.rigid.pose, other.rigid.pose);
        // How far the two go relative to each other in the step, at most.
        let moves =
            pose.way(&own.free.end.pose, object.radius) + base_pose.way(&other.free.end.pose, base.radius);
        let edge = object.body.edge.min(base.body.edge);

        // The nodes near the box around the other, which is moved out as far as the other can deform.
        let cache = &mut self.caches[surface_of];
        let sight =
            Sight::new(&base.body, Reading::Point, &other.response, &other.points, cache, Ok(self.step));
        let grown = sight.reach() + moves + MARGIN * edge;
        let cache = &mut self.caches[nodes_of];
        let sight =
            &mut Sight::new(&object.body, Reading::Point, &own.response, &own.points, cache, Ok(self.step));
        sight.begin_visit();
        let near = &mut *self.near;
        near.clear();
        sight.walk(
            |_, _, centre, radius| {
                base.body.is_near(base_pose.body_from_world(pose.world_from_body(centre)), radius + grown)
            },
            |sight, triangle, _| {
                for node in object.body.recording.surface.triangles[triangle as usize] {
                    if sight.first_visit(node as usize) && near.len() < near.capacity() {
                        near.push(node);
                    }
                }
            },
        );
        for at in 0..self.near.len() {
            let node = self.near[at] as usize;
            self.meet(nodes_of, surface_of, node, moves, edge);
        }
    }

    /// Want a contact if a node comes near the surface of another object.
    fn meet(&mut self, nodes_of: usize, surface_of: usize, node: usize, moves: f64, edge: f64) {
        let (own, other) = (&self.objects[nodes_of], &self.objects[surface_of]);
        let (object, base) = (&self.model.objects[nodes_of], &self.model.objects[surface_of]);
        let key = Key { other: Against::Object(nodes_of), object: surface_of, feature: node as u64 };
        let known = self.contacts.binary_search_by(|c| c.key.cmp(&key)).ok().map(|at| &self.contacts[at]);
        let node_slot = known.and_then(|contact| match contact.other {
            Other::Object { slot, .. } => Some(slot),
            _ => None,
        });
        let cache = &mut self.caches[nodes_of];
        let mut sight =
            Sight::new(&object.body, Reading::Point, &own.response, &own.points, cache, Ok(self.step));
        let place = match node_slot {
            Some(slot) => {
                let point = own.points.of(slot);
                point.rest + point.placed.displacement
            }
            None => sight.node(node),
        };
        let free = sight.free_node(node);
        let deforms = (free - sight.smooth(node)).length();
        let p = other.rigid.pose.body_from_world(own.rigid.pose.world_from_body(place));

        let cache = &mut self.caches[surface_of];
        let mut sight =
            Sight::new(&base.body, Reading::Point, &other.response, &other.points, cache, Ok(self.step));
        let approach = Approach { point: p, way: moves + deforms, known: known.is_some(), edge };
        let Some((point, normal)) = meeting(self.search, &mut sight, &approach) else { return };
        self.wanted.push(Wanted {
            key,
            place: Place { point, reading: Reading::Point },
            other: WantedOther::Object {
                number: nodes_of,
                place: Place { point: object.body.node_point(node), reading: Reading::Point },
            },
            law: Law::Touch { friction: libm::sqrt(object.friction * base.friction) },
            normal: other.rigid.pose.orientation * normal,
            distance: 0.0,
        });
    }
}
