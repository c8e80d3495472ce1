//! Constraint of a contact within one step.

use crate::collision::Contact;
use glam::{DMat3, DVec3};

/// Constraint of one contact; made anew in each step, in the order of the contacts.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Constraint {
    /// The other side minus the object's point, at the start and at the end of the step [m, world].
    pub(crate) start: DVec3,
    pub(crate) end: DVec3,
    /// Least gap at the end of the step [m]: 0, or what is left of a penetration.
    pub(crate) min_gap: f64,
    /// Axes (−n, t₁, t₂) [world], the contact's own compliance W in them [m/N], and its inverse.
    pub(super) axes: DMat3,
    pub(super) compliance: DMat3,
    pub(super) stiffness: DMat3,
}

impl Constraint {
    /// Constraint of a contact whose sides are apart by `start` [m, world].
    pub(crate) fn new(start: DVec3) -> Self {
        Self { start, ..Self::default() }
    }

    /// Work [J] that a contact dissipates over the step; 0 for held points.
    pub(crate) fn dissipated(&self, contact: &Contact) -> f64 {
        if contact.is_held() { 0.0 } else { contact.force.dot(self.end - self.start) }
    }

    /// Work [J] that a contact dissipates over the step: normal to the surface, and by friction.
    pub(crate) fn losses(&self, contact: &Contact) -> (f64, f64) {
        let moved = self.end - self.start;
        let normal = contact.force.dot(contact.normal) * contact.normal.dot(moved);
        (normal, contact.force.dot(moved) - normal)
    }

    /// Slip over the step [m, world].
    pub(crate) fn slip(&self, contact: &Contact) -> DVec3 {
        let moved = self.end - self.start;
        moved - contact.normal * contact.normal.dot(moved)
    }
}
