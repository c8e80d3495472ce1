//! Output of a step.

use super::net_forces;
use crate::collision::OtherSide;
use crate::device::PrescribedForce;
use crate::io::{ClampOutput, ContactOutput, Input};
use crate::scene::Model;
use crate::state::{State, Workspace};
use glam::DVec3;

/// Write the output of a step from the state at its end.
pub(super) fn write(model: &Model, state: &mut State, workspace: &Workspace, input: &Input) {
    let State { steps, objects, devices, obstacles, clamps, contacts, couplings, output, .. } = state;
    let (sleepers, resting) = (&state.sleepers, &state.resting);
    let h = model.parameters.step_s;
    output.time_s = *steps as f64 * h;
    for at in sleepers.awake_indices() {
        let (out, object, own) = (&mut output.objects[at], &model.objects[at], &objects[at]);
        out.pose = own.rigid.pose;
        if let Some(inertia) = &object.inertia {
            out.twist = inertia.twist(&own.rigid);
        } else if own.base.moves() {
            out.twist.linear = own.base.end_velocity;
        }
        out.energy = own.ledger;
        out.penetration_m = 0.0;
        (out.force, out.torque) = (DVec3::ZERO, DVec3::ZERO);
    }
    output.energy = resting.scene_energy(couplings, objects, sleepers);
    for (number, out) in output.devices.iter_mut().enumerate() {
        let device = &devices[number];
        out.force_on_hand = if device.active { -device.force } else { DVec3::ZERO };
        out.offset = if device.active { device.offset } else { [DVec3::ZERO; 2] };
        if let Some(PrescribedForce { object, slot }) = device.prescribed {
            let (own, point) = (&objects[object], objects[object].points.of(slot));
            out.force_on_hand = -point.force;
            out.proxy = own.rigid.pose.position + point.end_arm;
            net_forces::add(&mut output.objects[object], point.force, out.proxy);
        } else if device.active {
            out.proxy = device.proxy;
        } else if let Some(given) = input.devices.get(number).filter(|given| given.position.is_finite()) {
            out.proxy = given.position;
        }
    }
    output.contacts.truncate(resting.outputs);
    output.clamps.fill(ClampOutput::default());
    for (contact, constraint) in contacts.iter().zip(workspace.constraints.iter()) {
        let own = &objects[contact.object()];
        let point = own.rigid.pose.position + own.points.of(contact.slot).end_arm;
        let carries_force = contact.force != DVec3::ZERO;
        net_forces::add(&mut output.objects[contact.object()], contact.force, point);
        if let OtherSide::Clamp { number, .. } = contact.other {
            let out = &mut output.clamps[number];
            out.force -= contact.force;
            out.torque -= (point - clamps[number].end.position).cross(contact.force);
        }
        if !contact.is_held() {
            let other = match contact.other {
                OtherSide::Object { number, .. } => Some(number),
                OtherSide::Device(_) | OtherSide::Obstacle { .. } | OtherSide::Clamp { .. } => None,
            };
            let penetration = -contact.gap(constraint.end);
            for object in [Some(contact.object()), other].into_iter().flatten() {
                let out = &mut output.objects[object];
                out.penetration_m = out.penetration_m.max(penetration);
            }
            if let Some(other) = other {
                net_forces::add(&mut output.objects[other], -contact.force, point);
            }
        }
        if let (true, true, OtherSide::Device(device)) = (carries_force, contact.is_held(), contact.other) {
            // A rigidly held point is the proxy, to the last digit that the solver gives.
            if model.parameters.devices[device].coupling.is_none() {
                output.devices[device].proxy = point;
            }
        }
        if carries_force && !contact.is_held() {
            output.contacts.push(ContactOutput {
                object: contact.object(),
                against: contact.id.collider,
                point,
                normal: contact.normal,
                force: contact.force,
                gap: contact.gap(constraint.end),
                slip_speed: constraint.slip(contact).length() / h,
            });
        }
    }
    net_forces::write_obstacles(output, resting, obstacles);
}
