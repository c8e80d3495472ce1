//! Contacts of a step: where objects are held or touched, by what, and the forces that obey their laws.

mod against;
mod cone;
mod held;
mod level;
mod meeting;
mod pairs;
mod parts;
mod points;
mod projection;
mod search;
mod sight;
mod solver;
mod touch;
mod vicinity;
mod wanted;

pub(crate) use against::against;
pub(crate) use held::HeldSystem;
pub(crate) use level::Level;
pub(crate) use parts::{Lift, Parts};
pub(crate) use points::{ContactPoint, ContactPoints};
pub(crate) use search::Search;
pub(crate) use sight::{MOST_FACES, NodeCache};
pub(crate) use solver::Solver;
pub(crate) use touch::{DeviceState, look_ahead, touch};
pub(crate) use vicinity::Vicinity;
pub(crate) use wanted::{Finding, HELD, Key, Wanted, WantedList, WantedOther, renew};

use crate::surface::SurfacePoint;
use glam::{DMat3, DVec3};

/// A surface point of an object that a device holds in all three directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grasp {
    /// Position of the object in the model.
    pub object: usize,
    /// The material point.
    pub point: SurfacePoint,
}

/// What an object is in contact with; positions in the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Collider {
    /// An interface point.
    Device(usize),
    /// A plane or a rigid obstacle.
    Obstacle(usize),
    /// Another object.
    Object(usize),
}

/// The law of a contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Law {
    /// Equation (9) of the paper: both sides stay together.
    Held,
    /// Signorini, and Coulomb with this coefficient.
    Touch { friction: f64 },
}

/// The side that the object's point meets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Other {
    /// The proxy of a device.
    Device(usize),
    /// A point of an obstacle, at the start and at the end of the step [m, world].
    Obstacle { number: usize, start: DVec3, end: DVec3 },
    /// A contact point of another object, by its slot.
    Object { number: usize, slot: usize },
}

/// A contact of a step. It lasts as long as its key is wanted.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Contact {
    pub(crate) key: Key,
    pub(crate) object: usize,
    pub(crate) slot: usize,
    pub(crate) other: Other,
    pub(crate) law: Law,
    /// Whether it is new, or at a new place.
    pub(crate) fresh: bool,
    /// Out of the object [world].
    pub(crate) normal: DVec3,
    /// What the two sides keep apart along the normal [m]: the tip's radius.
    pub(crate) distance: f64,
    /// The other side minus the object's point, at the start and at the end of the step [m, world].
    pub(crate) start: DVec3,
    pub(crate) end: DVec3,
    /// Least gap at the end of the step [m]: 0, or what was left of it at the start.
    pub(crate) least_gap: f64,
    /// Force on the object, held over the step [N, world].
    pub(crate) force: DVec3,
    /// How the force changed in the last step, and the force that it is guessed from with that, if it is.
    pub(crate) trend: DVec3,
    pub(crate) guessed_from: Option<DVec3>,
    /// The force before a sweep, and along the direction of search (see `solver`).
    pub(crate) before: DVec3,
    pub(crate) along: DVec3,
    /// The axes (−n, t₁, t₂) in world, its own compliance in them [m/N], and the inverse of that.
    pub(crate) axes: DMat3,
    pub(crate) compliance: DMat3,
    pub(crate) stiffness: DMat3,
}

impl Contact {
    /// Gap [m] when the sides are so far apart; negative when they penetrate.
    pub(crate) fn gap(&self, apart: DVec3) -> f64 {
        self.normal.dot(apart) - self.distance
    }

    pub(crate) fn against(&self) -> Collider {
        match self.other {
            Other::Device(device) => Collider::Device(device),
            Other::Obstacle { number, .. } => Collider::Obstacle(number),
            Other::Object { number, .. } => Collider::Object(number),
        }
    }

    /// Slip over the step [m, world].
    pub(crate) fn slip(&self) -> DVec3 {
        let moved = self.end - self.start;
        moved - self.normal * self.normal.dot(moved)
    }

    /// Work [J] that the contact takes over the step in all; held points take none.
    pub(crate) fn taken(&self) -> f64 {
        if self.law == Law::Held { 0.0 } else { self.force.dot(self.end - self.start) }
    }

    /// Work [J] that the contact takes over the step: normal to the surface, and by friction.
    pub(crate) fn losses(&self) -> (f64, f64) {
        let moved = self.end - self.start;
        let normal = self.force.dot(self.normal) * self.normal.dot(moved);
        (normal, self.force.dot(moved) - normal)
    }
}

/// The contacts of an object with one other side: they stand together, in the order of their features.
fn known_contacts(contacts: &[Contact], other: Collider, object: usize) -> &[Contact] {
    let first = contacts.partition_point(|c| (c.key.other, c.key.object) < (other, object));
    let count = contacts[first..].partition_point(|c| (c.key.other, c.key.object) == (other, object));
    &contacts[first..first + count]
}
