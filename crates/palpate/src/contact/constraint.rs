//! Constraint of a contact within one step.

use super::parameters::RIGID;
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
    /// Directions in which a side can give way.
    pub(super) yields: Yielding,
}

/// Directions in which a side of a contact can give way: fixed nodes on an obstacle move in none, and a force there is not determined.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) enum Yielding {
    /// Not along the normal: the contact carries no force.
    #[default]
    Nowhere,
    /// Along the normal alone, as on rollers: the contact carries no friction.
    AlongNormal,
    /// Along and across the normal.
    Everywhere,
}

impl Yielding {
    /// Directions of a compliance in a contact's axes.
    fn of(compliance: &DMat3) -> Self {
        let [along, across] = [compliance.x_axis.x, compliance.y_axis.y.min(compliance.z_axis.z)];
        let round_off = RIGID * (compliance.x_axis.x + compliance.y_axis.y + compliance.z_axis.z);
        match (along > round_off, across > round_off) {
            (false, _) => Self::Nowhere,
            (true, false) => Self::AlongNormal,
            (true, true) => Self::Everywhere,
        }
    }
}

impl Constraint {
    /// Constraint of a contact whose sides are apart by `start` [m, world].
    pub(crate) fn new(start: DVec3) -> Self {
        Self { start, ..Self::default() }
    }

    /// Linearise about axes (−n, t₁, t₂) [world] with the contact's own compliance in them [m/N].
    pub(super) fn linearise(&mut self, axes: DMat3, compliance: DMat3) {
        (self.axes, self.compliance) = (axes, compliance);
        self.yields = Yielding::of(&compliance);
        self.stiffness = if self.yields == Yielding::Everywhere { compliance.inverse() } else { DMat3::ZERO };
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn directions_without_compliance_carry_no_force() {
        let of = |diagonal: [f64; 3]| {
            let mut constraint = Constraint::default();
            constraint.linearise(DMat3::IDENTITY, DMat3::from_diagonal(DVec3::from(diagonal)));
            (constraint.yields, constraint.stiffness)
        };
        assert_eq!(of([0.0; 3]), (Yielding::Nowhere, DMat3::ZERO));
        assert_eq!(of([1e-20, 1e-3, 1e-3]), (Yielding::Nowhere, DMat3::ZERO));
        assert_eq!(of([1e-3, 0.0, 0.0]), (Yielding::AlongNormal, DMat3::ZERO));
        assert_eq!(of([1e-3, 1e-3, 0.0]), (Yielding::AlongNormal, DMat3::ZERO));
        let (yields, stiffness) = of([1e-3, 2e-3, 4e-3]);
        assert_eq!(yields, Yielding::Everywhere);
        assert!((stiffness * DVec3::new(1e-3, 2e-3, 4e-3) - DVec3::ONE).length() < 1e-12);
    }
}
