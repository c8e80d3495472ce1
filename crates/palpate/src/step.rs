//! One step of a scene, a function per stage.
//!
//! For each object: predict without new force; find the forces f that bring the held points to the
//! hands at the end of the step; advance deformation and rigid motion with f held; account for the energy.
//!
//! With R, R⁺ the orientation before and after, v = h·ω̄ the step's turn (see `motion`), a the
//! deformed arm in body axes, and A = R·a, A⁺ = R⁺·a⁺ in world axes, the Cayley map gives
//!
//! ```text
//! A⁺ − A = v × (A + A⁺)/2 + (1 + v̂/2)·R·(a⁺ − a)
//! ```
//!
//! So with torque ½(A + A⁺) × f and force in the body g = Rᵀ·(1 − v̂/2)·f = R⁺ᵀ·(1 + v̂/2)·f, the work
//! f·(Δx + ΔA) at the hand is, exactly, the work on the rigid motion, f·Δx + τ·v, plus that on
//! the deformation, g·Δa: the energy balance holds in every step, also while the body turns.

use crate::contact::{Grasp, HeldPoint, HeldPoints};
use crate::energy::EnergyLedger;
use crate::motion::{RigidState, RigidStep};
use crate::response::{Acting, ModalPoints, Responding};
use crate::scene::{Model, RigidCompliance, SceneObject};
use crate::state::{ActivePoint, DeviceInput, Input, ObjectState, Output, State, StepStatus, Workspace};
use glam::{DMat3, DVec3};

/// The forces are found by Newton's method with the matrix of the free motion, which gains a factor
/// of about h·|ω| + strain each time; this many reach round-off for any motion a hand can make.
const MAX_ITERATIONS: u32 = 40;

/// A miss of a held point below this share of (distance from the origin + size) is round-off:
/// a few roundings of the sum x + R·(r + u).
const ROUND_OFF: f64 = 8.0 * f64::EPSILON;

/// A miss above this share of the reach, or this angle [rad], is no solution: the hand or the body moves too far in a
/// step. The object then moves freely for the step, without force, and the status says so.
const UNSOLVED: f64 = 1e-9;

/// Advance a scene by one step.
///
/// # Real time
/// No allocation, lock or system call. The cost grows with modes × held points, not with the mesh.
pub fn step<'s>(model: &Model, state: &'s mut State, input: &Input) -> &'s Output {
    state.output.status = StepStatus::default();
    take_grasps(model, state, input);
    for (at, object) in model.objects.iter().enumerate() {
        let State { objects, held, modal_points, workspace, output, .. } = &mut *state;
        let own = &mut objects[at];
        gather(at, own, held, input, workspace);
        predict(model, object, own, modal_points, &mut workspace.active);
        let end = if workspace.active.is_empty() {
            advance_rigid(model, object, &own.rigid, DVec3::ZERO, DVec3::ZERO)
        } else {
            solve(model, object, own, held, workspace, &mut output.status)
        };
        if end.miss > UNSOLVED {
            output.status.unsolved_objects += 1;
        }
        advance(model, object, own, held, modal_points, &workspace.active, &end);
    }
    state.steps += 1;
    write_output(model, state, input);
    &state.output
}

/// The device's input if it can be used.
fn usable<'i>(model: &Model, input: &'i Input, device: usize) -> Option<(&'i DeviceInput, Grasp)> {
    let device_input = input.devices.get(device)?;
    let grasp = device_input.grasp?;
    (device_input.position.is_finite() && model.accepts(&grasp)).then_some((device_input, grasp))
}

/// Which point each device holds in this step; those that are new are prepared.
fn take_grasps(model: &Model, state: &mut State, input: &Input) {
    let State { objects, held, modal_points, output, .. } = state;
    // Released points first, so that new ones don't couple to them.
    for device in 0..held.points.len() {
        let wanted = usable(model, input, device).map(|(_, grasp)| grasp);
        let asked = input.devices.get(device).is_some_and(|d| d.grasp.is_some());
        if asked && wanted.is_none() {
            output.status.rejected_devices += 1;
        }
        if held.points[device].grasp != wanted {
            if let Some(grasp) = held.points[device].grasp {
                objects[grasp.object].response.release(device);
            }
            held.points[device] = HeldPoint::default();
        }
    }
    for device in 0..held.points.len() {
        let Some((_, grasp)) = usable(model, input, device) else {
            continue;
        };
        if held.points[device].grasp.is_none() {
            let object = &model.objects[grasp.object];
            let own = &mut objects[grasp.object];
            held.points[device] = HeldPoint {
                grasp: Some(grasp),
                rest: object.recording.surface.rest_position(&grasp.point),
                displacement: responding(model, object, own).hold(modal_points, device, &grasp.point),
                force_in_world: DVec3::ZERO,
            };
            held.couple(device, &grasp, |(a, at), (b, other)| {
                let points = ((a, &at.point), (b, &other.point));
                object.response.compliance(&object.recording, modal_points, points.0, points.1)
            });
        }
    }
}

/// The response of an object with its state.
fn responding<'a>(model: &Model, object: &'a SceneObject, own: &'a mut ObjectState) -> Responding<'a> {
    Responding {
        response: &object.response,
        recording: &object.recording,
        gravity: object.gravity_in_body(model.parameters.gravity, &own.rigid.pose),
        state: &mut own.response,
    }
}

/// The held points of one object, with where their hands will be.
fn gather(at: usize, own: &ObjectState, held: &HeldPoints, input: &Input, workspace: &mut Workspace) {
    workspace.active.clear();
    for (device, point) in held.points.iter().enumerate() {
        if point.grasp.is_some_and(|grasp| grasp.object == at) {
            workspace.active.push(ActivePoint {
                device,
                target: input.devices[device].position,
                start_arm: own.rigid.pose.orientation * (point.rest + point.displacement),
                ..ActivePoint::default()
            });
        }
    }
}

/// Stage 1: the held points at the end of the step without new force.
fn predict(
    model: &Model,
    object: &SceneObject,
    own: &mut ObjectState,
    modal_points: &mut ModalPoints,
    active: &mut [ActivePoint],
) {
    let mut responding = responding(model, object, own);
    responding.predict(modal_points, !active.is_empty());
    for active in active {
        active.free = responding.free(modal_points, active.device);
    }
}

/// Rigid motion over the step under contact force and torque, with weight; a fixed body stays.
fn advance_rigid(
    model: &Model,
    object: &SceneObject,
    start: &RigidState,
    force: DVec3,
    torque: DVec3,
) -> RigidStep {
    let parameters = &model.parameters;
    match &object.inertia {
        Some(inertia) => {
            let force = force + parameters.gravity * inertia.mass;
            inertia.advance(parameters.motion, start, parameters.step_s, force, torque)
        }
        None => RigidStep { end: *start, turn: DVec3::ZERO, miss: 0.0 },
    }
}

/// Stages 2 and 3: the Delassus operator and the forces that bring the points to the hands.
#[allow(non_snake_case)]
fn solve(
    model: &Model,
    object: &SceneObject,
    own: &ObjectState,
    held: &HeldPoints,
    workspace: &mut Workspace,
    status: &mut StepStatus,
) -> RigidStep {
    let Workspace { system, active, .. } = workspace;
    let free = advance_rigid(model, object, &own.rigid, DVec3::ZERO, DVec3::ZERO);
    let rigid_counts = model.parameters.rigid_compliance == RigidCompliance::Included;

    // W = R·C·Rᵀ + rigid mobility, at the end of the free motion.
    let R = DMat3::from_quat(free.end.pose.orientation);
    for point in active.iter_mut() {
        point.displacement = point.free;
        point.end_arm = R * (held.points[point.device].rest + point.free);
    }
    let mobile = object.inertia.filter(|_| rigid_counts);
    let inverse = mobile.map(|inertia| inertia.inverse_in_world(free.end.pose.orientation));
    let dependent = system.factorise(active.len(), |a, b| {
        let (a, b) = (&active[a], &active[b]);
        let elastic = R * held.compliance(a.device, b.device) * R.transpose();
        match (&mobile, inverse) {
            (Some(inertia), Some(inverse)) => {
                let (rule, h) = (model.parameters.motion, model.parameters.step_s);
                elastic + inertia.mobility(rule, h, inverse, a.end_arm, b.end_arm)
            }
            _ => elastic,
        }
    });
    status.dependent_rows += dependent as u32;

    let reach = own.rigid.pose.position.length() + object.radius;
    let (mut end, mut least_miss, mut first_miss, mut iterations) = (free, f64::INFINITY, f64::INFINITY, 0);
    loop {
        let miss = evaluate(model, object, own, held, active, &mut end);
        iterations += 1;
        // Done at round-off, or near it when no more digits are gained.
        let stalled = miss > 0.5 * least_miss && miss < 1e3 * ROUND_OFF * reach;
        if miss <= ROUND_OFF * reach || stalled || iterations == MAX_ITERATIONS {
            status.iterations = status.iterations.max(iterations);
            // Points that repeat others can't be met where their hands differ, and need not be.
            let solved = miss <= UNSOLVED * reach || dependent > 0 && miss <= first_miss;
            if !solved {
                status.unsolved_objects += 1;
                return let_go(held, active, free);
            }
            status.solver_residual_m = status.solver_residual_m.max(miss);
            break;
        }
        first_miss = if iterations == 1 { miss } else { first_miss };
        least_miss = least_miss.min(miss);
        // f += W⁻¹·(hand − point).
        system.solve(|point| active[point].miss);
        for (at, point) in active.iter_mut().enumerate() {
            point.force += system.force(at);
        }
    }
    if !rigid_counts {
        let (force, torque) = wrench(active);
        end = advance_rigid(model, object, &own.rigid, force, torque);
        for point in active.iter_mut() {
            point.end_arm = end.end.pose.orientation * (held.points[point.device].rest + point.displacement);
        }
    }
    end
}

/// The step without force: sound whatever the hands ask for.
fn let_go(held: &HeldPoints, active: &mut [ActivePoint], free: RigidStep) -> RigidStep {
    for point in active {
        point.force = DVec3::ZERO;
        point.force_in_body = DVec3::ZERO;
        point.displacement = point.free;
        point.end_arm = free.end.pose.orientation * (held.points[point.device].rest + point.free);
    }
    free
}

/// Displacements, arms and misses of the points under their present forces, with the rotation of the
/// last repetition; renews the rigid step. Gives the largest miss [m], the rotation's own included.
fn evaluate(
    model: &Model,
    object: &SceneObject,
    own: &ObjectState,
    held: &HeldPoints,
    active: &mut [ActivePoint],
    end: &mut RigidStep,
) -> f64 {
    let (orientation, turn) = (end.end.pose.orientation, end.turn);
    for point in active.iter_mut() {
        point.force_in_body = orientation.inverse() * (point.force + turn.cross(point.force) * 0.5);
    }
    for at in 0..active.len() {
        let device = active[at].device;
        let elastic: DVec3 =
            active.iter().map(|other| held.compliance(device, other.device) * other.force_in_body).sum();
        let point = &mut active[at];
        point.displacement = point.free + elastic;
        point.end_arm = orientation * (held.points[device].rest + point.displacement);
    }
    let mut miss = 0.0_f64;
    if model.parameters.rigid_compliance == RigidCompliance::Included {
        let (force, torque) = wrench(active);
        let next = advance_rigid(model, object, &own.rigid, force, torque);
        miss = (next.turn - turn).length() * object.radius;
        *end = next;
    }
    let pose = end.end.pose;
    for point in active.iter_mut() {
        point.end_arm = pose.orientation * (held.points[point.device].rest + point.displacement);
        point.miss = point.target - (pose.position + point.end_arm);
        miss = miss.max(point.miss.length());
    }
    miss
}

/// Force [N] and torque [N·m] about the centre of mass, with the mean of the arms before and after.
fn wrench(active: &[ActivePoint]) -> (DVec3, DVec3) {
    let force = active.iter().map(|point| point.force).sum();
    let torque =
        active.iter().map(|point| ((point.start_arm + point.end_arm) * 0.5).cross(point.force)).sum();
    (force, torque)
}

/// Stages 4 and 5: hold the forces over the step, and account for the energy.
fn advance(
    model: &Model,
    object: &SceneObject,
    own: &mut ObjectState,
    held: &mut HeldPoints,
    modal_points: &mut ModalPoints,
    active: &[ActivePoint],
    end: &RigidStep,
) {
    let acting = active.iter().filter_map(|active| {
        let point = &held.points[active.device];
        Some(Acting {
            device: active.device,
            point: &point.grasp.as_ref()?.point,
            force: active.force_in_body,
            travel: active.displacement - point.displacement,
        })
    });
    let dissipated = responding(model, object, own).advance(modal_points, acting);

    let travel = end.end.pose.position - own.rigid.pose.position;
    let mut input = 0.0;
    for active in active {
        input += active.force.dot(travel + (active.end_arm - active.start_arm));
        let point = &mut held.points[active.device];
        point.displacement = active.displacement;
        point.force_in_world = active.force;
    }
    own.rigid = end.end;
    own.ledger.input += input;
    own.ledger.dissipated += dissipated;
    own.weigh(object, model.parameters.gravity);
    let EnergyLedger { input, dissipated, .. } = own.ledger;
    own.ledger.defect = own.ledger.stored() - own.stored_at_start - (input - dissipated);
}

fn write_output(model: &Model, state: &mut State, input: &Input) {
    let State { steps, objects, held, output, .. } = state;
    output.time_s = *steps as f64 * model.parameters.step_s;
    for ((out, object), own) in output.objects.iter_mut().zip(&model.objects).zip(&*objects) {
        out.pose = own.rigid.pose;
        if let Some(inertia) = &object.inertia {
            out.twist = inertia.twist(&own.rigid);
        }
        out.energy = own.ledger;
    }
    output.energy = objects.iter().fold(EnergyLedger::default(), |sum, own| sum.plus(&own.ledger));
    for (device, out) in output.devices.iter_mut().enumerate() {
        let point = &held.points[device];
        match point.grasp {
            Some(grasp) => {
                let pose = objects[grasp.object].rigid.pose;
                out.force_on_hand = -point.force_in_world;
                out.point = pose.world_from_body(point.rest + point.displacement);
            }
            None => {
                out.force_on_hand = DVec3::ZERO;
                out.point = input.devices.get(device).map_or(DVec3::ZERO, |device| device.position);
            }
        }
    }
}
