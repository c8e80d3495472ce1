//! Sleep of a step: what wakes objects, and which fall asleep.
//!
//! An object is still while its kinetic energy is below that of its mass at a small speed, nothing that moves is near it, and no device
//! holds or pushes it. All objects of a group fall asleep when they have been still for the time that the model says, each until a step in
//! which its forces balance, and contacts press on each: velocities are set to zero and the objects are left as they are, with their contacts
//! and forces. What the velocities stored is dissipated. A body that nothing touches never sleeps: small vibrations and slow drift go on, and
//! it costs little.
//!
//! Equations: docs/theory.md (C84).

use super::{accepts_gravity, collision_context, net_forces, predict_object, usable, usable_base};
use crate::collision::OtherSide;
use crate::io::{ContactOutput, DeviceMode, Input, ObjectOutput};
use crate::object::{Object, ObjectState};
use crate::scene::Model;
use crate::spatial::Twist;
use crate::state::{State, Workspace};
use core::cmp::Ordering;
use glam::DVec3;

/// Speed of still objects, as a share of their radius per second: above what contact samples at rest move by, below what one sees or feels.
const STILL_SPEED: f64 = 0.02;

/// Net force, and net torque, at which forces balance, as shares of the sum of the forces and of that times the radius. Slow vibrations pass
/// through balance; where they turn, the forces that sleep would keep are those of the motion.
const BALANCE: f64 = 0.01;

/// Wake what the input of a step acts on: held points, prescribed forces, bases that move; all objects when gravity changes.
pub(super) fn wake_by_input(model: &Model, state: &mut State, input: &Input) {
    if model.parameters.steps_until_sleep().is_none() {
        return;
    }
    let State { sleepers, objects, .. } = state;
    for number in 0..input.devices.len().min(state.devices.len()) {
        match usable(model, input, number).map(|given| given.mode) {
            Some(DeviceMode::Held(grasp)) => sleepers.disturb(grasp.object),
            Some(DeviceMode::Force(applied)) => sleepers.disturb(applied.grasp.object),
            _ => {}
        }
    }
    for (at, (object, own)) in model.objects.iter().zip(&*objects).enumerate().take(input.bases.len()) {
        if usable_base(object, input, at).is_some_and(|given| own.base_is_elsewhere(object, given)) {
            sleepers.disturb(at);
        }
    }
    if input.gravity.is_some_and(|gravity| gravity != state.gravity && accepts_gravity(model, gravity)) {
        sleepers.disturb_all();
    }
    wake(state);
}

/// Wake what tips, moving obstacles and objects that are awake come near.
pub(super) fn wake_near(model: &Model, state: &mut State, workspace: &mut Workspace) {
    if model.parameters.steps_until_sleep().is_none() {
        return;
    }
    let (mut context, devices, [before, after]) = collision_context(model, state, workspace);
    context.mark_disturbed(devices, (before, after));
    let sleepers = &mut state.sleepers;
    for (at, is_disturbed) in workspace.collision.disturbed.iter_mut().enumerate() {
        if core::mem::take(is_disturbed) {
            sleepers.disturb(at);
        }
    }
    wake(state);
}

/// Wake the groups that were disturbed: their contacts go on with the forces that they had.
fn wake(state: &mut State) {
    let State { steps, sleepers, resting, contacts, levels, output, objects, obstacles, .. } = state;
    let wakes = sleepers.wake(|at| {
        levels.keep_for_now(at, *steps);
        contacts.append(&mut resting.contacts[at]);
        output.objects[at].is_asleep = false;
    });
    if wakes {
        contacts.sort_unstable_by_key(|contact| contact.id);
        resting.update_energy(objects, sleepers);
        // Contacts of objects that are awake are written at the end of the step.
        output.contacts.truncate(resting.outputs);
        output.contacts.retain(|contact| !sleepers.is_awake(contact.object));
        resting.outputs = output.contacts.len();
        net_forces::update_resting(resting, &output.contacts, obstacles);
    }
}

/// Let still groups fall asleep, at the end of a step whose output is written.
pub(super) fn fall_asleep(model: &Model, state: &mut State) {
    let Some(steps) = model.parameters.steps_until_sleep() else { return };
    let rules = model.step_rules(state.gravity);
    let State { sleepers, objects, obstacles, contacts, levels, resting, couplings, output, .. } = state;
    let mut could_sleep = false;
    for index in 0..sleepers.awake().len() {
        let at = sleepers.awake()[index] as usize;
        let (object, own) = (&model.objects[at], &objects[at]);
        let is_balanced = || is_balanced(object, own, &output.objects[at], rules.gravity);
        could_sleep |= sleepers.count(at, steps, is_still(object, own), is_balanced) >= steps;
    }
    if !could_sleep {
        return;
    }
    sleepers.begin_groups();
    for contact in contacts.iter() {
        if let OtherSide::Object { number, .. } = contact.other {
            sleepers.connect(contact.object(), number);
        }
    }
    levels.near_pairs(state.steps - 1).for_each(|[a, b]| sleepers.connect(a, b));
    let mut fell_asleep = false;
    sleepers.fall_asleep(steps, |at| {
        fell_asleep = true;
        let (object, own, out) = (&model.objects[at], &mut objects[at], &mut output.objects[at]);
        own.stop(object, rules.gravity);
        predict_object(object, own, &rules);
        (out.twist, out.energy, out.is_asleep) = (Twist::ZERO, own.ledger, true);
    });
    if !fell_asleep {
        return;
    }
    contacts.retain(|contact| {
        let is_awake = sleepers.is_awake(contact.object());
        if !is_awake {
            resting.contacts[contact.object()].push(*contact);
        }
        is_awake
    });
    // The order, in which forces are added up, is the same whatever the sorting algorithm: those that are equal have the same force.
    let sides =
        |contact: &ContactOutput| (sleepers.is_awake(contact.object), contact.against, contact.object);
    output.contacts.sort_unstable_by(|a, b| {
        let axes = || {
            let of = |a: DVec3, b: DVec3| [0, 1, 2].map(|axis| a[axis].total_cmp(&b[axis]));
            of(a.point, b.point).into_iter().chain(of(a.force, b.force))
        };
        sides(a).cmp(&sides(b)).then_with(|| axes().fold(Ordering::Equal, Ordering::then))
    });
    resting.outputs = output.contacts.partition_point(|contact| !sleepers.is_awake(contact.object));
    output.contacts[..resting.outputs].iter_mut().for_each(|contact| contact.slip_speed = 0.0);
    net_forces::update_resting(resting, &output.contacts, obstacles);
    net_forces::write_obstacles(output, resting, obstacles);
    resting.update_energy(objects, sleepers);
    output.energy = resting.scene_energy(couplings, objects, sleepers);
}

/// Whether an object is still at the end of a step, in contact. Objects with clamps, or with tables, never are.
fn is_still(object: &Object, own: &ObjectState) -> bool {
    let speed = STILL_SPEED * object.radius;
    object.is_modal()
        && object.body.cells() == 0
        && !own.base.moves()
        && own.points.points.iter().any(|point| point.force != DVec3::ZERO)
        && own.ledger.kinetic <= 0.5 * object.body.recording.mass() * speed * speed
}

/// Whether the contact forces on an object, whose output is written, and its weight balance. Fixed nodes take up what is missing.
fn is_balanced(object: &Object, own: &ObjectState, out: &ObjectOutput, gravity: DVec3) -> bool {
    let Some(inertia) = &object.inertia else { return true };
    let allowed = BALANCE * own.points.points.iter().map(|point| point.force.length()).sum::<f64>();
    let net = out.force + gravity * inertia.mass;
    net.length() <= allowed && out.torque.length() <= allowed * object.radius
}
