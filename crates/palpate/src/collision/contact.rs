//! Contacts: their identity from step to step, their law, and the two sides.
//!
//! Equations: docs/theory.md (C31), (C32), (C34).

use crate::surface::SurfacePoint;
use glam::DVec3;

/// A surface point of an object that a device holds in all three directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grasp {
    /// Number of the object in the model.
    pub object: usize,
    /// The material point.
    pub point: SurfacePoint,
}

/// The other side of an object's contact; numbers in the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Collider {
    /// The proxy of a device.
    Device(usize),
    /// A plane or a rigid obstacle.
    Obstacle(usize),
    /// Another object.
    Object(usize),
}

/// Feature that a contact belongs to, between two given sides. The order is that of the solver's sweeps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum FeatureId {
    /// Surface node of the object against an obstacle.
    Node(u32),
    /// Interior of a triangle of the object against a round obstacle.
    Triangle(u32),
    /// Corner of an obstacle against the object's surface.
    Corner(u32),
    /// Contact sample of a level of detail, by its node, against an obstacle.
    Sample { level: u8, node: u32 },
    /// Node of another object against the object's surface, with the levels of detail of node and surface.
    NodeOnSurface { levels: [u8; 2], node: u32 },
    /// Contact of a tip with the object, numbered.
    Tip(u8),
    /// Held point.
    HeldPoint,
    /// Cell of a clamp, by its number among those of the object; its collider is the object itself.
    ClampedCell(u32),
}

impl FeatureId {
    /// Node of an object against an obstacle at a level of detail.
    pub(super) fn of_node(level: usize, node: usize) -> Self {
        match level {
            0 => Self::Node(node as u32),
            level => Self::Sample { level: level as u8, node: node as u32 },
        }
    }
}

/// Identity of a contact: the two sides and the feature between them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct ContactId {
    pub(crate) collider: Collider,
    pub(crate) object: usize,
    pub(crate) feature: FeatureId,
}

/// Law of a contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum ContactLaw {
    /// Bilateral constraint of a held point: both sides stay together, equation (9) of the paper.
    Bilateral,
    /// Unilateral contact: Signorini's conditions, and Coulomb's law with this coefficient [1].
    Unilateral { friction: f64 },
}

/// The side that the object's contact point meets, in a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum OtherSide {
    /// Proxy of a device.
    Device(usize),
    /// Point of an obstacle at the start and at the end of the step [m, world].
    Obstacle { number: usize, start: DVec3, end: DVec3 },
    /// Point of a clamp's frame at the start and at the end of the step [m, world].
    Clamp { number: usize, start: DVec3, end: DVec3 },
    /// Contact point of another object, by its slot.
    Object { number: usize, slot: usize },
}

/// Contact of a step. It persists while its id is found again.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Contact {
    pub(crate) id: ContactId,
    /// Slot of its contact point on the object.
    pub(crate) slot: usize,
    pub(crate) other: OtherSide,
    pub(crate) law: ContactLaw,
    /// Whether it is new, or its contact point has moved over the surface.
    pub(crate) is_new: bool,
    /// Unit normal, out of the object [world].
    pub(crate) normal: DVec3,
    /// Distance that the two sides keep along the normal [m]: the tip's radius.
    pub(crate) distance: f64,
    /// Force on the object, held over the step [N, world]; before the solver, the warm start.
    pub(crate) force: DVec3,
}

impl Contact {
    /// Number of the object whose surface normal it has.
    pub(crate) fn object(&self) -> usize {
        self.id.object
    }

    /// Gap [m] of two sides that are `apart` (other minus own, [m, world]); negative when they penetrate.
    pub(crate) fn gap(&self, apart: DVec3) -> f64 {
        self.normal.dot(apart) - self.distance
    }

    /// Whether it is a held point.
    pub(crate) fn is_held(&self) -> bool {
        self.law == ContactLaw::Bilateral
    }
}

/// Contacts of an object with one collider: they are stored together, in the order of their features.
pub(crate) fn contacts_between(contacts: &[Contact], collider: Collider, object: usize) -> &[Contact] {
    let first = contacts.partition_point(|c| (c.id.collider, c.id.object) < (collider, object));
    let count = contacts[first..].partition_point(|c| (c.id.collider, c.id.object) == (collider, object));
    &contacts[first..first + count]
}
