//! Energy accounting of a step: contacts and virtual couplings.
//!
//! Equations: docs/theory.md (C47), (C48), (C50), (C51), (C52), (C53).

use crate::collision::{Contact, OtherSide};
use crate::contact::Constraint;
use crate::device::{DeviceParameters, DeviceState, PrescribedForce};
use crate::energy::EnergyLedger;
use crate::object::ObjectState;
use glam::DVec3;

/// Travel of a contact point over the step [m, world].
fn travel(objects: &[ObjectState], object: usize, slot: usize) -> DVec3 {
    let (own, point) = (&objects[object], objects[object].points.of(slot));
    (own.end.end.pose.position - own.rigid.pose.position) + (point.end_arm - point.start_arm)
}

/// Add the work of a device's prescribed force over the step to the ledger of its object.
pub(super) fn prescribed_force(device: &DeviceState, objects: &mut [ObjectState]) {
    let Some(PrescribedForce { object, slot }) = device.prescribed else { return };
    let force = objects[object].points.of(slot).force;
    objects[object].ledger.input += force.dot(travel(objects, object, slot));
}

/// Add a contact's work over the step to the ledgers of its objects: the input by the other side, and the losses between. Gives the energy
/// that it gives back along its normal [J].
pub(super) fn contact(contact: &Contact, constraint: &Constraint, objects: &mut [ObjectState]) -> f64 {
    let work = contact.force.dot(travel(objects, contact.object(), contact.slot));
    let (impact, friction) = if contact.is_held() { (0.0, 0.0) } else { constraint.losses(contact) };
    let ledger = &mut objects[contact.object()].ledger;
    ledger.input += work + impact + friction;
    ledger.impact += impact;
    ledger.friction += friction;
    if let OtherSide::Object { number, slot } = contact.other {
        let work = contact.force.dot(travel(objects, number, slot));
        objects[number].ledger.input -= work;
    }
    (-impact).max(0.0)
}

/// Advance a device's proxy, and add what its coupling takes in, stores and dissipates over the step.
pub(super) fn coupling(
    parameters: &DeviceParameters,
    device: &mut DeviceState,
    couplings: &mut EnergyLedger,
) {
    let before = device.start - device.proxy;
    if !device.active {
        // An inactive device loses what its coupling stored.
        couplings.coupling -= parameters.stored(before);
        couplings.dissipated += parameters.stored(before);
        device.proxy = device.start;
        return;
    }
    // Without force the stretch relaxes as the damper lets it: a proxy that was pulled off a surface does not fall into it.
    let after = device.target - device.proxy_under_force();
    if parameters.coupling.is_some() {
        let (work, change) =
            (device.force.dot(after - before), parameters.stored(after) - parameters.stored(before));
        couplings.input += work;
        couplings.coupling += change;
        couplings.dissipated += work - change;
    }
    device.proxy = device.target - after;
    device.start = device.target;
}
