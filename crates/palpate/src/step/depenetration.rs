//! Depenetration: sides that overlap are moved apart without velocity, as by split impulses.
//!
//! Contact forces leave a penetration as it is (C38), so they do no work on it. An object and an obstacle or another object, with
//! normal forces λ, normals n and gaps g of their contacts, move apart by
//!
//! ```text
//! δ = h/T·Σ λ·max(0, −g)·n / Σ λ
//! ```
//!
//! or by the mean over the penetrating contacts where none carries force. A face that is inside as a whole comes out with the
//! time constant T; one contact among many hardly lifts the others. Deformation and velocities stay, and so do the forces.
//! The work on the weight counts as input.
//!
//! Equations: docs/theory.md (C38), (C49).

use crate::collision::{Contact, OtherSide};
use crate::contact::{Constraint, SOLVER};
use crate::device::LET_OUT_S;
use crate::object::ObjectState;
use crate::scene::Model;
use glam::DVec3;

/// Penetration [m] up to which contacts themselves let an object out, if losses pay for it: what the solver leaves. Depenetration alone would
/// lift objects at rest off their contacts, or let them creep.
pub(super) fn slop(model: &Model, object: usize) -> f64 {
    let share = if model.parameters.max_contact_samples < usize::MAX {
        SOLVER.sample_slop
    } else {
        SOLVER.loose_tolerance
    };
    share * model.objects[object].radius
}

/// Move objects out of obstacles and out of each other, at the end of a step. An object that a device holds stays in its hand.
///
/// # Real time
/// Costs the contacts of the step.
pub(super) fn depenetrate(
    (model, gravity): (&Model, DVec3),
    objects: &mut [ObjectState],
    contacts: &[Contact],
    constraints: &[Constraint],
) {
    for contact in contacts.iter().filter(|contact| contact.is_held()) {
        objects[contact.object()].is_held = true;
    }
    let share = (model.parameters.step_s / LET_OUT_S).min(1.0);
    let mut first = 0;
    for group in contacts.chunk_by(|a, b| (a.id.collider, a.object()) == (b.id.collider, b.object())) {
        let constraints = &constraints[first..first + group.len()];
        first += group.len();
        let (object, other) = match (group[0].object(), group[0].other) {
            (_, OtherSide::Device(_) | OtherSide::Clamp { .. }) => continue,
            (object, OtherSide::Obstacle { .. }) => (object, None),
            (object, OtherSide::Object { number, .. }) => (object, Some(number)),
        };
        let slop = slop(model, object);
        let apart = mean_penetration(group, constraints, slop) * share;
        let inverse_mass = |at: usize| match &model.objects[at].inertia {
            Some(inertia) if !objects[at].is_held => 1.0 / inertia.mass,
            _ => 0.0,
        };
        let (own, of_other) = (inverse_mass(object), other.map_or(0.0, inverse_mass));
        if apart == DVec3::ZERO || own + of_other == 0.0 {
            continue;
        }
        shift((model, gravity), objects, object, -apart * (own / (own + of_other)));
        if let Some(other) = other {
            shift((model, gravity), objects, other, apart * (of_other / (own + of_other)));
        }
    }
}

/// Penetration of an object with one collider [m, world], out of the object: the mean over its contacts, weighted by their
/// normal forces.
fn mean_penetration(contacts: &[Contact], constraints: &[Constraint], slop: f64) -> DVec3 {
    let (mut loaded, mut load, mut free, mut count) = (DVec3::ZERO, 0.0, DVec3::ZERO, 0.0);
    for (contact, constraint) in contacts.iter().zip(constraints) {
        let force = (-contact.force.dot(contact.normal)).max(0.0);
        load += force;
        let gap = contact.gap(constraint.end);
        if gap < -slop {
            let depth = contact.normal * -gap;
            loaded += depth * force;
            (free, count) = (free + depth, count + 1.0);
        }
    }
    if load > 0.0 { loaded / load } else { free / f64::max(count, 1.0) }
}

/// Shift an object without velocity [m, world].
fn shift((model, gravity): (&Model, DVec3), objects: &mut [ObjectState], object: usize, by: DVec3) {
    let own = &mut objects[object];
    own.rigid.pose.position += by;
    own.ledger.input -= model.objects[object].body.recording.mass() * gravity.dot(by);
}
