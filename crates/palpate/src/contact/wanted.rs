//! Which contacts a step has: those that were found, matched with those of the last step.

use super::search::Search;
use super::sight::NodeCache;
use super::{Contact, Law, Level, Other, Vicinity};
use crate::response::{Place, Responding};
use crate::scene::Model;
use crate::state::{ObjectState, StepStatus};
use alloc::vec::Vec;
use glam::{DMat3, DVec3};

/// What makes a contact the same from step to step: the two sides, and a number of the place between them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Key {
    pub(crate) other: super::Collider,
    pub(crate) object: usize,
    pub(crate) feature: u64,
}

/// The feature of a held point.
pub(crate) const HELD: u64 = u64::MAX;

/// A contact that a step should have.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Wanted {
    pub(crate) key: Key,
    pub(crate) place: Place,
    pub(crate) other: WantedOther,
    pub(crate) law: Law,
    pub(crate) normal: DVec3,
    pub(crate) distance: f64,
}

/// The other side of a wanted contact.
#[derive(Debug, Clone, Copy)]
pub(crate) enum WantedOther {
    Device(usize),
    Obstacle { number: usize, start: DVec3, end: DVec3 },
    Object { number: usize, place: Place },
}

/// The contacts that a step should have; the buffer is made once.
#[derive(Debug, Clone)]
pub(crate) struct WantedList {
    pub(crate) list: Vec<Wanted>,
    /// How many there was no room for.
    pub(crate) left_out: u32,
}

impl WantedList {
    pub(crate) fn new(capacity: usize) -> Self {
        Self { list: Vec::with_capacity(capacity), left_out: 0 }
    }

    pub(crate) fn clear(&mut self) {
        self.list.clear();
        self.left_out = 0;
    }

    pub(crate) fn push(&mut self, wanted: Wanted) {
        if self.list.len() < self.list.capacity() {
            self.list.push(wanted);
        } else {
            self.left_out += 1;
        }
    }
}

/// What finding contacts needs of the scene.
pub(crate) struct Finding<'a> {
    pub(crate) model: &'a Model,
    pub(crate) objects: &'a [ObjectState],
    /// Those of the last step.
    pub(crate) contacts: &'a [Contact],
    pub(crate) caches: &'a mut [NodeCache],
    pub(crate) search: &'a mut Search,
    /// Of each device on each object.
    pub(crate) vicinities: &'a mut [Vicinity],
    /// How coarsely each object meets each obstacle, and each other object.
    pub(crate) levels: &'a mut [Level],
    /// Room for nodes, and for modal coordinates.
    pub(crate) near: &'a mut Vec<u32>,
    pub(crate) modes: &'a mut [f64],
    pub(crate) wanted: &'a mut WantedList,
    pub(crate) step: u64,
}

/// Make the contacts those that are wanted: in the order of their keys, the known ones with their points and forces.
///
/// # Real time
/// Costs the contacts, and for each new place modes × points of its object.
pub(crate) fn renew(
    model: &Model,
    objects: &mut [ObjectState],
    contacts: &mut Vec<Contact>,
    spare: &mut Vec<Contact>,
    wanted: &mut WantedList,
    status: &mut StepStatus,
) {
    status.dropped_contacts += wanted.left_out;
    let wanted = &mut wanted.list;
    wanted.sort_unstable_by_key(|wanted| wanted.key);
    // Points that are not wanted any more go first, so that new ones don't couple to them.
    let mut next = 0;
    contacts.retain(|contact| {
        while next < wanted.len() && wanted[next].key < contact.key {
            next += 1;
        }
        let stays = wanted.get(next).is_some_and(|wanted| wanted.key == contact.key);
        if !stays {
            let mut release = |object: usize, slot: usize| {
                let own = &mut objects[object];
                own.points.remove(&mut Responding::new(model, object, &own.rigid, &mut own.response), slot);
            };
            release(contact.object, contact.slot);
            if let Other::Object { number, slot } = contact.other {
                release(number, slot);
            }
        }
        stays
    });
    spare.clear();
    let mut known = contacts.iter().peekable();
    for wanted in wanted.iter() {
        let before = known.next_if(|contact| contact.key == wanted.key);
        match take(model, objects, wanted, before) {
            Some(contact) => spare.push(contact),
            None => status.dropped_contacts += 1,
        }
    }
    core::mem::swap(contacts, spare);
}

/// The contact, with its points in place; none when an object has no room for another point.
fn take(
    model: &Model,
    objects: &mut [ObjectState],
    wanted: &Wanted,
    before: Option<&Contact>,
) -> Option<Contact> {
    let object = wanted.key.object;
    let stays = |contact: &&Contact| objects[contact.object].points.of(contact.slot).place == wanted.place;
    let fresh = before.filter(stays).is_none();
    let mut settle = |object: usize, slot: Option<usize>, place: Place| {
        let own = &mut objects[object];
        let responding = &mut Responding::new(model, object, &own.rigid, &mut own.response);
        match slot {
            Some(slot) => {
                if own.points.of(slot).place != place {
                    own.points.set_place(responding, slot, place);
                }
                Some(slot)
            }
            None => own.points.add(responding, place),
        }
    };
    let slot = settle(object, before.map(|contact| contact.slot), wanted.place)?;
    let other = match wanted.other {
        WantedOther::Device(device) => Other::Device(device),
        WantedOther::Obstacle { number, start, end } => Other::Obstacle { number, start, end },
        WantedOther::Object { number, place } => {
            let known = before.and_then(|contact| match contact.other {
                Other::Object { slot, .. } => Some(slot),
                _ => None,
            });
            match settle(number, known, place) {
                Some(slot) => Other::Object { number, slot },
                None => {
                    let own = &mut objects[object];
                    let responding = &mut Responding::new(model, object, &own.rigid, &mut own.response);
                    own.points.remove(responding, slot);
                    return None;
                }
            }
        }
    };
    let (force, guessed_from) = before.map_or((DVec3::ZERO, None), |known| guess(known, wanted, fresh));
    Some(Contact {
        key: wanted.key,
        object,
        slot,
        other,
        law: wanted.law,
        fresh,
        normal: wanted.normal,
        distance: wanted.distance,
        start: DVec3::ZERO,
        end: DVec3::ZERO,
        least_gap: 0.0,
        trend: DVec3::ZERO,
        guessed_from,
        before: DVec3::ZERO,
        along: DVec3::ZERO,
        axes: DMat3::ZERO,
        compliance: DMat3::ZERO,
        stiffness: DMat3::ZERO,
        force,
    })
}

/// The force of a known contact to begin with: that of the last step with its trend, from which it is guessed then.
fn guess(known: &Contact, wanted: &Wanted, fresh: bool) -> (DVec3, Option<DVec3>) {
    if wanted.law == Law::Held {
        return (if fresh { DVec3::ZERO } else { known.force }, None);
    }
    // When the normal turns, it turns along.
    let turn = glam::DQuat::from_rotation_arc(known.normal, wanted.normal);
    let (force, next) = (turn * known.force, turn * (known.force + known.trend));
    // Not beyond where it would pull.
    let pulls = next.dot(wanted.normal) > 0.0;
    if pulls || force == DVec3::ZERO { (force, None) } else { (next, Some(force)) }
}
