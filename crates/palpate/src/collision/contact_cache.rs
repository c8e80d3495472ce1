//! Contact cache: candidates matched with the contacts of the last step, which keep their points and warm-start forces.
//!
//! Equations: docs/theory.md (C39), (C61).

use super::candidate::{CandidateList, CandidateSide, ContactCandidate};
use super::contact::{Collider, Contact, ContactLaw, OtherSide};
use crate::object::{Object, ObjectState};
use crate::response::ContactLocation;
use alloc::vec::Vec;
use glam::DVec3;

/// Objects with their states, for adding and removing contact points.
struct Bodies<'a> {
    objects: &'a [Object],
    states: &'a mut [ObjectState],
    gravity: DVec3,
}

impl Bodies<'_> {
    /// Move spring forces of an object between locations; the state of its contact points is read again afterwards.
    fn move_spring_forces(
        &mut self,
        object: usize,
        from: impl Iterator<Item = ContactLocation>,
        to: impl Iterator<Item = ContactLocation> + Clone,
    ) {
        let own = &mut self.states[object];
        let view =
            &mut self.objects[object].view(own.felt_gravity(self.gravity), &own.rigid, &mut own.response);
        own.ledger.dissipated += view.move_spring_forces(from, to);
    }

    /// Read the state of an object's contact points again.
    fn read_state(&mut self, object: usize) {
        let own = &mut self.states[object];
        let view =
            &mut self.objects[object].view(own.felt_gravity(self.gravity), &own.rigid, &mut own.response);
        own.points.read_state(view);
    }

    /// Free a contact point.
    fn release(&mut self, object: usize, slot: usize) {
        self.states[object].points.remove(slot);
    }

    /// Put a contact point at a location: the known one, or a new one; none when the object has no room.
    fn settle(&mut self, object: usize, known: Option<usize>, location: ContactLocation) -> Option<usize> {
        let own = &mut self.states[object];
        let view =
            &mut self.objects[object].view(own.felt_gravity(self.gravity), &own.rigid, &mut own.response);
        match known {
            Some(slot) => {
                if own.points.of(slot).location != location {
                    own.points.set_location(view, slot, location);
                }
                Some(slot)
            }
            None => own.points.add(view, location),
        }
    }
}

/// Contact point that contacts release or need in a step.
#[derive(Debug, Clone, Copy)]
struct Place {
    object: usize,
    /// The other side.
    against: Collider,
    location: ContactLocation,
    /// Number among those of the step.
    order: usize,
}

/// Contact points that a step releases and needs, for changes of the level of detail; the buffers are made once.
#[derive(Debug, Clone)]
pub(crate) struct LevelChanges {
    released: Vec<Place>,
    needed: Vec<Place>,
}

impl LevelChanges {
    pub(crate) fn new(contacts: usize) -> Self {
        let places = || Vec::with_capacity(2 * contacts);
        Self { released: places(), needed: places() }
    }

    /// Move spring forces from points that are released to those of another level of detail, against the same side.
    fn apply(&self, bodies: &mut Bodies) {
        let same_sides = |a: &Place, b: &Place| (a.object, a.against) == (b.object, b.against);
        let mut rest = &*self.released;
        let mut has_moved = false;
        while let Some((first, others)) = rest.split_first() {
            // Places with the same sides lie together.
            let count = others.iter().take_while(|place| same_sides(place, first)).count();
            let (group, next) = rest.split_at(count + 1);
            rest = next;
            let is_other_level = |place: &&Place| {
                same_sides(place, first) && place.location.footprint != first.location.footprint
            };
            let needed = self.needed.iter().filter(is_other_level).map(|place| place.location);
            if needed.clone().next().is_some() {
                bodies.move_spring_forces(first.object, group.iter().map(|place| place.location), needed);
                has_moved = true;
            }
            if has_moved && next.first().is_none_or(|place| place.object != first.object) {
                bodies.read_state(first.object);
                has_moved = false;
            }
        }
    }
}

/// Replace the contacts by the candidates, in the order of their ids; known ones keep their points and forces. Gives the
/// number of candidates for which there was no room.
///
/// # Real time
/// Costs the contacts, and for each new location modes × points of its object.
pub(crate) fn match_contacts(
    (objects, gravity): (&[Object], DVec3),
    states: &mut [ObjectState],
    contacts: &mut Vec<Contact>,
    spare: &mut Vec<Contact>,
    candidates: &mut CandidateList,
    level_changes: &mut LevelChanges,
) -> u32 {
    let mut bodies = Bodies { objects, states, gravity };
    let mut dropped = candidates.dropped;
    let candidates = &mut candidates.list;
    candidates.sort_unstable_by_key(|candidate| candidate.id);
    level_changes.released.clear();
    level_changes.needed.clear();
    // Points that are no longer in contact go first, so that new ones do not couple to them.
    let mut next = 0;
    contacts.retain(|contact| {
        while next < candidates.len() && candidates[next].id < contact.id {
            next += 1;
        }
        let persists = candidates.get(next).is_some_and(|candidate| candidate.id == contact.id);
        if !persists {
            let mut release = |object: usize, against: Collider, slot: usize| {
                let location = bodies.states[object].points.of(slot).location;
                let order = level_changes.released.len();
                level_changes.released.push(Place { object, against, location, order });
                bodies.release(object, slot);
            };
            release(contact.object(), contact.id.collider, contact.slot);
            if let OtherSide::Object { number, slot } = contact.other {
                release(number, Collider::Object(contact.object()), slot);
            }
        }
        persists
    });
    if !level_changes.released.is_empty() {
        let mut known = contacts.iter().peekable();
        for candidate in candidates.iter() {
            if known.next_if(|contact| contact.id == candidate.id).is_some() {
                continue;
            }
            let (object, against) = (candidate.id.object, candidate.id.collider);
            let order = level_changes.needed.len();
            level_changes.needed.push(Place { object, against, location: candidate.location, order });
            if let CandidateSide::Object { number, location } = candidate.other {
                let against = Collider::Object(object);
                let order = level_changes.needed.len();
                level_changes.needed.push(Place { object: number, against, location, order });
            }
        }
        level_changes.released.sort_unstable_by_key(|place| (place.object, place.against, place.order));
        level_changes.apply(&mut bodies);
    }
    spare.clear();
    let mut known = contacts.iter().peekable();
    for candidate in candidates.iter() {
        let before = known.next_if(|contact| contact.id == candidate.id);
        match instantiate(&mut bodies, candidate, before) {
            Some(contact) => spare.push(contact),
            None => dropped += 1,
        }
    }
    core::mem::swap(contacts, spare);
    dropped
}

/// Contact of a candidate with its points in place; none when an object has no room for another point.
fn instantiate(
    bodies: &mut Bodies,
    candidate: &ContactCandidate,
    before: Option<&Contact>,
) -> Option<Contact> {
    let object = candidate.id.object;
    let stays =
        |contact: &&Contact| bodies.states[object].points.of(contact.slot).location == candidate.location;
    let is_new = before.filter(stays).is_none();
    let slot = bodies.settle(object, before.map(|contact| contact.slot), candidate.location)?;
    let other = match candidate.other {
        CandidateSide::Device(device) => OtherSide::Device(device),
        CandidateSide::Obstacle { number, start, end } => OtherSide::Obstacle { number, start, end },
        CandidateSide::Clamp { number, start, end } => OtherSide::Clamp { number, start, end },
        CandidateSide::Object { number, location } => {
            let known = before.and_then(|contact| match contact.other {
                OtherSide::Object { slot, .. } => Some(slot),
                _ => None,
            });
            match bodies.settle(number, known, location) {
                Some(slot) => OtherSide::Object { number, slot },
                None => {
                    bodies.release(object, slot);
                    return None;
                }
            }
        }
    };
    let force = before.map_or(DVec3::ZERO, |known| warm_start(known, candidate, is_new));
    Some(Contact {
        id: candidate.id,
        slot,
        other,
        law: candidate.law,
        is_new,
        normal: candidate.normal,
        distance: candidate.distance,
        force,
    })
}

/// Warm start: the force of the last step, turned with the normal.
fn warm_start(known: &Contact, candidate: &ContactCandidate, is_new: bool) -> DVec3 {
    if candidate.law == ContactLaw::Bilateral {
        return if is_new { DVec3::ZERO } else { known.force };
    }
    glam::DQuat::from_rotation_arc(known.normal, candidate.normal) * known.force
}
