//! Contact cache: candidates matched with the contacts of the last step, which keep their points and warm-start forces.
//!
//! Equations: docs/theory.md (C39), (C61).

use super::candidate::{CandidateList, CandidateSide, ContactCandidate};
use super::contact::{Collider, Contact, ContactLaw, OtherSide};
use crate::bounded_vec::BoundedVec;
use crate::object::{Object, ObjectState};
use crate::response::{ContactLocation, Footprint, LocatedLoad, ResidualMemory};
use alloc::vec::Vec;
use glam::DVec3;

/// Objects with their states, for adding and removing contact points.
struct Bodies<'a> {
    objects: &'a [Object],
    states: &'a mut [ObjectState],
    gravity: DVec3,
}

impl Bodies<'_> {
    /// Move loads of an object to other locations; the state of its contact points is read again afterwards.
    fn transfer_loads(&mut self, object: usize, from: &[LocatedLoad], to: &mut [LocatedLoad]) {
        let own = &mut self.states[object];
        let view =
            &mut self.objects[object].view(own.felt_gravity(self.gravity), &own.rigid, &mut own.response);
        own.ledger.dissipated += view.transfer_loads(from, to);
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

    /// Put a contact point at a location against a side: the known one, or a new one, which takes over its load after a change of level; none when the
    /// object has no room.
    fn settle(
        &mut self,
        level_changes: &LevelChanges,
        (object, against): (usize, Collider),
        known: Option<usize>,
        location: ContactLocation,
    ) -> Option<usize> {
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
            None => {
                let slot = own.points.add(view, location)?;
                own.points.set_load(slot, level_changes.load_of((object, against), &location));
                Some(slot)
            }
        }
    }
}

/// Contact point that contacts release or need in a step.
#[derive(Debug, Clone, Copy)]
struct Place {
    object: usize,
    /// The other side.
    against: Collider,
    located: LocatedLoad,
    /// Number among those of the step.
    order: usize,
}

impl Place {
    fn footprint(&self) -> Footprint {
        self.located.location.footprint
    }

    fn sides(&self) -> (usize, Collider) {
        (self.object, self.against)
    }
}

/// Contact points that a step releases and needs, for changes of the level of detail; the buffers are made once.
#[derive(Debug, Clone)]
pub(crate) struct LevelChanges {
    released: BoundedVec<Place>,
    needed: BoundedVec<Place>,
    /// Whether loads have moved in this step.
    have_moved: bool,
    /// Loads of one transfer.
    from: BoundedVec<LocatedLoad>,
    to: BoundedVec<LocatedLoad>,
}

impl LevelChanges {
    pub(crate) fn new(contacts: usize) -> Self {
        let places = || BoundedVec::new(2 * contacts);
        let loads = || BoundedVec::new(2 * contacts);
        Self { released: places(), needed: places(), have_moved: false, from: loads(), to: loads() }
    }

    /// Forget those of the last step.
    fn clear(&mut self) {
        self.released.clear();
        self.needed.clear();
        self.have_moved = false;
    }

    fn release(&mut self, object: usize, against: Collider, located: LocatedLoad) {
        let order = self.released.len();
        self.released.push(Place { object, against, located, order });
    }

    fn need(&mut self, object: usize, against: Collider, location: ContactLocation) {
        let order = self.needed.len();
        let located = LocatedLoad { location, load: ResidualMemory::default() };
        self.needed.push(Place { object, against, located, order });
    }

    /// Move loads from points that are released to those of another level of detail, against the same side.
    fn apply(&mut self, bodies: &mut Bodies) {
        let Self { released, needed, have_moved, from, to } = self;
        released.sort_unstable_by_key(|place| (place.sides(), place.order));
        for of_object in released.chunk_by(|a, b| a.object == b.object) {
            let mut has_moved = false;
            for group in of_object.chunk_by(|a, b| a.against == b.against) {
                let (sides, footprint) = (group[0].sides(), group[0].footprint());
                let is_taker = |place: &Place| place.sides() == sides && place.footprint() != footprint;
                from.clear();
                to.clear();
                to.extend(needed.iter().filter(|place| is_taker(place)).map(|place| place.located));
                if !to.is_empty() {
                    from.extend(group.iter().map(|place| place.located));
                    bodies.transfer_loads(sides.0, from, to);
                    let takers = needed.iter_mut().filter(|place| is_taker(place));
                    takers.zip(to.iter()).for_each(|(place, taken)| place.located = *taken);
                    has_moved = true;
                }
            }
            if has_moved {
                *have_moved = true;
                bodies.read_state(of_object[0].object);
            }
        }
    }

    /// Load that a new contact point takes over.
    fn load_of(&self, (object, against): (usize, Collider), location: &ContactLocation) -> ResidualMemory {
        if !self.have_moved {
            return ResidualMemory::default();
        }
        let is_it =
            |place: &&Place| place.sides() == (object, against) && place.located.location == *location;
        self.needed.iter().find(is_it).map_or(ResidualMemory::default(), |place| place.located.load)
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
    level_changes.clear();
    // Points that are no longer in contact go first, so that new ones do not couple to them.
    let mut next = 0;
    contacts.retain(|contact| {
        while next < candidates.len() && candidates[next].id < contact.id {
            next += 1;
        }
        let persists = candidates.get(next).is_some_and(|candidate| candidate.id == contact.id);
        if !persists {
            let mut release = |object: usize, against: Collider, slot: usize| {
                let point = bodies.states[object].points.of(slot);
                let located = LocatedLoad { location: point.location, load: point.load };
                level_changes.release(object, against, located);
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
            level_changes.need(object, against, candidate.location);
            if let CandidateSide::Object { number, location } = candidate.other {
                level_changes.need(number, Collider::Object(object), location);
            }
        }
        level_changes.apply(&mut bodies);
    }
    spare.clear();
    let mut known = contacts.iter().peekable();
    for candidate in candidates.iter() {
        let before = known.next_if(|contact| contact.id == candidate.id);
        match instantiate(&mut bodies, level_changes, candidate, before) {
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
    level_changes: &LevelChanges,
    candidate: &ContactCandidate,
    before: Option<&Contact>,
) -> Option<Contact> {
    let object = candidate.id.object;
    let stays =
        |contact: &&Contact| bodies.states[object].points.of(contact.slot).location == candidate.location;
    let is_new = before.filter(stays).is_none();
    let slot = bodies.settle(
        level_changes,
        (object, candidate.id.collider),
        before.map(|contact| contact.slot),
        candidate.location,
    )?;
    let other = match candidate.other {
        CandidateSide::Device(device) => OtherSide::Device(device),
        CandidateSide::Obstacle { number, start, end } => OtherSide::Obstacle { number, start, end },
        CandidateSide::Clamp { number, start, end } => OtherSide::Clamp { number, start, end },
        CandidateSide::Object { number, location } => {
            let known = before.and_then(|contact| match contact.other {
                OtherSide::Object { slot, .. } => Some(slot),
                _ => None,
            });
            match bodies.settle(level_changes, (number, Collider::Object(object)), known, location) {
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
