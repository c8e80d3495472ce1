//! Prescribed forces: loads on material points, given and not solved for.
//!
//! A prescribed force F [N] is held over the step like a contact force, with the same exact work: it enters deformation and motion as
//!
//! ```text
//! g = Rᵀ·(1 − v̂/2)·F        τ = ½·(A + A⁺) × F
//! ```
//!
//! It belongs to the motion without contact force, which contacts start from: no law, no sweep and no fallback changes it.
//!
//! Equations: docs/theory.md (C44), (C45), (C62).

use super::usable;
use crate::contact::ContactProblem;
use crate::device::PrescribedForce;
use crate::io::{AppliedForce, DeviceMode, Input};
use crate::object::Object;
use crate::response::ContactLocation;
use crate::scene::Model;
use crate::state::{State, Workspace};
use crate::surface::SurfacePoint;

/// Put the prescribed forces of a step on their points, and take away those that are over.
pub(super) fn place(model: &Model, state: &mut State, input: &Input) {
    let gravity = state.gravity;
    let State { objects, devices, output, .. } = state;
    for (number, device) in devices.iter_mut().enumerate() {
        let applied = match usable(model, input, number).map(|given| given.mode) {
            Some(DeviceMode::Force(applied)) => Some(applied),
            _ => None,
        };
        if let Some(PrescribedForce { object, slot }) = device.prescribed
            && applied.is_none_or(|applied| applied.grasp.object != object)
        {
            objects[object].points.remove(slot);
            device.prescribed = None;
        }
        let Some(AppliedForce { grasp, force }) = applied else { continue };
        let (object, own) = (&model.objects[grasp.object], &mut objects[grasp.object]);
        let location = location(object, grasp.point, model.parameters.devices[number].patch_radius);
        let view = &mut object.view(own.felt_gravity(gravity), &own.rigid, &mut own.response);
        let slot = match device.prescribed {
            Some(PrescribedForce { slot, .. }) => {
                if own.points.of(slot).location != location {
                    own.points.set_location(view, slot, location);
                }
                Some(slot)
            }
            None => own.points.add(view, location),
        };
        match slot {
            Some(slot) => {
                own.points.prescribe(slot, force);
                device.prescribed = Some(PrescribedForce { object: grasp.object, slot });
            }
            None => output.status.dropped_contacts += 1,
        }
    }
}

/// Point, or patch about it.
fn location(object: &Object, point: SurfacePoint, patch_radius: f64) -> ContactLocation {
    ContactLocation { point, footprint: object.body.footprint(patch_radius) }
}

/// Predict the objects that prescribed forces act on: their motion without contact force.
pub(super) fn predict(model: &Model, state: &mut State, workspace: &mut Workspace) {
    let rules = model.step_rules(state.gravity);
    let State { objects, devices, contacts, sleepers, output, .. } = state;
    let mut problem = ContactProblem {
        objects: &model.objects,
        rules,
        awake: sleepers.awake(),
        states: objects,
        devices,
        contacts,
        constraints: &mut workspace.constraints,
    };
    for at in sleepers.awake_indices() {
        if problem.states[at].has_prescribed_forces() {
            let holds = problem.predict_under_prescribed_forces(at);
            output.status.unsolved_islands += u32::from(!holds);
        }
    }
}
