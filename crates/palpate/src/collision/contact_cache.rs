//! Contact cache: candidates matched with the contacts of the last step, which keep their points and warm-start forces.
//!
//! Equations: docs/theory.md (C39).

use super::candidate::{CandidateList, CandidateSide, ContactCandidate};
use super::contact::{Contact, ContactLaw, OtherSide};
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
    /// Free a contact point.
    fn release(&mut self, object: usize, slot: usize) {
        let own = &mut self.states[object];
        let view = &mut self.objects[object].view(self.gravity, &own.rigid, &mut own.response);
        own.points.remove(view, slot);
    }

    /// Put a contact point at a location: the known one, or a new one; none when the object has no room.
    fn settle(&mut self, object: usize, known: Option<usize>, location: ContactLocation) -> Option<usize> {
        let own = &mut self.states[object];
        let view = &mut self.objects[object].view(self.gravity, &own.rigid, &mut own.response);
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
) -> u32 {
    let mut bodies = Bodies { objects, states, gravity };
    let mut dropped = candidates.dropped;
    let candidates = &mut candidates.list;
    candidates.sort_unstable_by_key(|candidate| candidate.id);
    // Points that are no longer in contact go first, so that new ones do not couple to them.
    let mut next = 0;
    contacts.retain(|contact| {
        while next < candidates.len() && candidates[next].id < contact.id {
            next += 1;
        }
        let persists = candidates.get(next).is_some_and(|candidate| candidate.id == contact.id);
        if !persists {
            bodies.release(contact.object(), contact.slot);
            if let OtherSide::Object { number, slot } = contact.other {
                bodies.release(number, slot);
            }
        }
        persists
    });
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
    let (force, last_force) =
        before.map_or((DVec3::ZERO, None), |known| warm_start(known, candidate, is_new));
    Some(Contact {
        id: candidate.id,
        slot,
        other,
        law: candidate.law,
        is_new,
        normal: candidate.normal,
        distance: candidate.distance,
        force,
        force_trend: DVec3::ZERO,
        last_force,
    })
}

/// Warm start: the force of the last step extrapolated by its trend, turned with the normal, and the force that it was
/// extrapolated from.
fn warm_start(known: &Contact, candidate: &ContactCandidate, is_new: bool) -> (DVec3, Option<DVec3>) {
    if candidate.law == ContactLaw::Bilateral {
        return (if is_new { DVec3::ZERO } else { known.force }, None);
    }
    let turn = glam::DQuat::from_rotation_arc(known.normal, candidate.normal);
    let (force, next) = (turn * known.force, turn * (known.force + known.force_trend));
    // No further than the force can go: contacts do not pull.
    let pulls = next.dot(candidate.normal) > 0.0;
    if pulls || force == DVec3::ZERO { (force, None) } else { (next, Some(force)) }
}
