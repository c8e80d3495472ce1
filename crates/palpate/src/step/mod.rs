//! One step of a scene, a function per stage:
//!
//! ```text
//! predict → collision (broad phase, narrow phase, contact cache) → contact problem → solve → integrate → account → output
//! ```
//!
//! Forces are held over the step. With R, R⁺ the orientation before and after, v = h·ω̄ the step's rotation (see `motion`), a
//! the deformed arm in body axes, and A = R·a, A⁺ = R⁺·a⁺ in world axes, the Cayley map gives
//!
//! ```text
//! A⁺ − A = v × (A + A⁺)/2 + (1 + v̂/2)·R·(a⁺ − a)
//! ```
//!
//! So with torque ½(A + A⁺) × f and force in the body g = Rᵀ·(1 − v̂/2)·f = R⁺ᵀ·(1 + v̂/2)·f, the work
//! f·(Δx + ΔA) at a contact is, exactly, the work on the rigid motion, f·Δx + τ·v, plus that on
//! the deformation, g·Δa: the energy balance holds in every step, also while the body turns.
//!
//! The work that a contact dissipates over a step is f·Δapart, in the normal direction −λ·(gap⁺ − gap). With
//! gap⁺ ≥ min(0, gap) and Coulomb's law for the slip of the whole step it is never negative: contacts are passive, whatever
//! the shape, the normal and the location that were chosen for the step.
//!
//! Equations: docs/theory.md (C38), (C44), (C45), (C46), (C49).

mod accounting;
mod clamps;
mod depenetration;
mod net_forces;
mod output;
mod prescribed_forces;
mod sleep;

use crate::collision::{
    CandidateSide, Collider, CollisionContext, Contact, ContactCandidate, ContactId, ContactLaw, FeatureId,
    OtherSide, TipPair, match_contacts,
};
use crate::contact::{Constraint, ContactProblem, SOLVER, SolverReport, StepRules, UNSOLVED};
use crate::device::{DeviceState, LastTouch};
use crate::io::{AppliedForce, DeviceInput, DeviceMode, Input, Output, StepStatus};
use crate::object::{Object, ObjectState};
use crate::response::{ContactLocation, Footprint};
use crate::scene::{Model, RigidCompliance};
use crate::spatial::Pose;
use crate::state::{State, Workspace};
use alloc::boxed::Box;
use glam::DVec3;

impl Model {
    /// Rules of a step under a gravity [m/s², world].
    fn step_rules(&self, gravity: DVec3) -> StepRules {
        let parameters = &self.parameters;
        StepRules {
            step_s: parameters.step_s,
            gravity,
            integrator: parameters.motion,
            includes_rigid_compliance: parameters.rigid_compliance == RigidCompliance::Included,
        }
    }
}

/// Advance a scene by one step.
///
/// # Real time
/// No allocation, lock or system call. The cost grows with modes × contacts, not with the mesh.
pub fn step<'s>(model: &Model, state: &'s mut State, input: &Input) -> &'s Output {
    let mut workspace = state.workspace.take().unwrap_or_else(|| Box::new(Workspace::new(model)));
    advance(model, state, &mut workspace, input);
    state.workspace = Some(workspace);
    &state.output
}

/// Advance a scene by one step in buffers that its model has made, as [`step`] does in those of the state. Many states of one model that share
/// the buffers of a thread need less memory, and less of it passes through the caches.
///
/// # Real time
/// As [`step`].
pub fn step_in<'s>(
    model: &Model,
    state: &'s mut State,
    workspace: &mut Workspace,
    input: &Input,
) -> &'s Output {
    workspace.collision.forget_positions();
    advance(model, state, workspace, input);
    &state.output
}

/// The stages of a step.
fn advance(model: &Model, state: &mut State, workspace: &mut Workspace, input: &Input) {
    state.output.status = StepStatus::default();
    sleep::wake_by_input(model, state, input);
    change_gravity(model, state, input);
    move_bases(model, state, input);
    prescribed_forces::place(model, state, input);
    predict(model, state);
    move_obstacles(state, workspace, input);
    clamps::move_frames(state, input);
    begin_devices(model, state, input);
    collision_context(model, state, workspace).0.begin_broad_phase();
    sleep::wake_near(model, state, workspace);
    find_contacts(model, state, workspace, input);
    set_up_constraints(model, state, workspace);
    prescribed_forces::predict(model, state, workspace);
    solve(model, state, workspace);
    integrate(model, state, workspace);
    state.steps += 1;
    output::write(model, state, workspace, input);
    sleep::fall_asleep(model, state);
}

/// Change gravity between two steps. What this adds to the potential energy of an object is input; the sag of bodies with fixed nodes
/// beyond their modes follows at once.
fn change_gravity(model: &Model, state: &mut State, input: &Input) {
    let Some(gravity) = input.gravity.filter(|&gravity| gravity != state.gravity) else { return };
    if !accepts_gravity(model, gravity) {
        state.output.status.rejected_inputs += 1;
        return;
    }
    state.gravity = gravity;
    for (object, own) in model.objects.iter().zip(&mut state.objects) {
        let felt = own.felt_gravity(gravity);
        own.points.change_gravity(&mut object.view(felt, &own.rigid, &mut own.response));
        let potential = own.potential(object, gravity);
        own.ledger.input += potential - own.ledger.potential;
        own.ledger.potential = potential;
    }
}

/// Whether gravity may change to a value [m/s², world].
fn accepts_gravity(model: &Model, gravity: DVec3) -> bool {
    gravity.is_finite() && model.objects.iter().all(Object::allows_gravity_change)
}

/// Begin the motion of bases. Bodies with fixed nodes feel their acceleration as gravity.
fn move_bases(model: &Model, state: &mut State, input: &Input) {
    let (gravity, h) = (state.gravity, model.parameters.step_s);
    for (number, object) in model.objects.iter().enumerate().take(input.bases.len()) {
        let is_rejected = input.bases[number].is_some() && usable_base(object, input, number).is_none();
        state.output.status.rejected_inputs += u32::from(is_rejected);
    }
    for number in state.sleepers.awake_indices() {
        let (object, own) = (&model.objects[number], &mut state.objects[number]);
        let usable = usable_base(object, input, number);
        if object.has_movable_base() && (usable.is_some() || own.base.moves()) {
            let before = own.felt_gravity(gravity);
            own.begin_base_motion(object, usable, h);
            let felt = own.felt_gravity(gravity);
            if felt != before {
                own.points.change_gravity(&mut object.view(felt, &own.rigid, &mut own.response));
            }
        }
    }
}

/// Position [m, world] that a base is to go to, if it can be used.
fn usable_base(object: &Object, input: &Input, number: usize) -> Option<DVec3> {
    let given = input.bases.get(number).copied().flatten();
    given.filter(|position| position.is_finite() && object.has_movable_base())
}

/// Predict every object at the end of the step without contact force.
fn predict(model: &Model, state: &mut State) {
    let rules = model.step_rules(state.gravity);
    for at in state.sleepers.awake_indices() {
        predict_object(&model.objects[at], &mut state.objects[at], &rules);
    }
}

/// Predict an object at the end of the step without contact force; prescribed forces act with the arms at its start.
fn predict_object(object: &Object, own: &mut ObjectState, rules: &StepRules) {
    let mut view = object.view(own.felt_gravity(rules.gravity), &own.rigid, &mut own.response);
    // A step predicts the next one, if gravity and step size stay.
    if !view.predict() {
        own.points.predict(&mut view);
    }
    let motion = (rules.integrator, rules.step_s, rules.gravity);
    own.free = object.advance_rigid(motion, &own.rigid, own.prescribed_wrench(), None);
    own.carry_with_base();
    own.surface_motion =
        object.body.displacement_bound(own.response.coordinates(), own.response.free_coordinates());
}

/// Obstacle poses at the end of the step; unusable ones stay.
fn move_obstacles(state: &mut State, workspace: &mut Workspace, input: &Input) {
    let State { obstacles, output, .. } = state;
    for (number, next) in workspace.next_obstacles.iter_mut().enumerate() {
        *next = moved(obstacles[number], input.obstacles.get(number), &mut output.status);
    }
}

/// Given pose, if it can be used; otherwise, and without one, the present pose.
fn moved(present: Pose, given: Option<&Pose>, status: &mut StepStatus) -> Pose {
    let Some(given) = given else { return present };
    let length = given.orientation.length();
    if given.position.is_finite() && (0.99..=1.01).contains(&length) {
        return Pose { orientation: given.orientation.normalize(), ..*given };
    }
    status.rejected_inputs += 1;
    present
}

/// A device's input, if it can be used.
fn usable<'i>(model: &Model, input: &'i Input, device: usize) -> Option<&'i DeviceInput> {
    let device_input = input.devices.get(device)?;
    let is_allowed = match &device_input.mode {
        DeviceMode::Inactive | DeviceMode::Suspended => false,
        DeviceMode::Held(grasp) => model.can_hold(grasp),
        DeviceMode::Touch => true,
        DeviceMode::Force(AppliedForce { grasp, force }) => model.accepts(grasp) && force.is_finite(),
    };
    (is_allowed && device_input.position.is_finite()).then_some(device_input)
}

/// Context of the step's collision detection; devices; and the poses of the obstacles before and after the step.
fn collision_context<'a>(
    model: &'a Model,
    state: &'a mut State,
    workspace: &'a mut Workspace,
) -> (CollisionContext<'a>, &'a mut [DeviceState], [&'a [Pose]; 2]) {
    let State { steps, objects, devices, obstacles, contacts, levels, sleepers, caches, .. } = state;
    let Workspace { collision, next_obstacles, .. } = workspace;
    let scene = model.collision_scene();
    let context = CollisionContext {
        scene,
        states: objects,
        contacts,
        sleepers,
        levels,
        caches,
        workspace: collision,
        step: *steps,
    };
    (context, devices, [obstacles, next_obstacles])
}

/// Devices that touch or hold begin the step; unusable ones become inactive.
fn begin_devices(model: &Model, state: &mut State, input: &Input) {
    let State { devices, contacts, output, .. } = state;
    for (number, device) in devices.iter_mut().enumerate() {
        let is_asked = input.devices.get(number).is_some_and(|d| d.mode.is_active());
        let Some(device_input) = usable(model, input, number) else {
            output.status.rejected_inputs += u32::from(is_asked);
            device.active = false;
            let is_suspended = input.devices.get(number).is_some_and(|d| d.mode == DeviceMode::Suspended);
            device.last_touch = device.last_touch.filter(|_| is_suspended);
            continue;
        };
        if let DeviceMode::Force(_) = device_input.mode {
            (device.active, device.last_touch) = (false, None);
            continue;
        }
        // A device that was inactive, or held a point, starts where it is.
        let first = contacts.partition_point(|contact| contact.id.collider < Collider::Device(number));
        let held = contacts.get(first).is_some_and(|c| c.is_held() && c.other == OtherSide::Device(number));
        let touches = device_input.mode == DeviceMode::Touch;
        device.active &= touches != held;
        if !device.active {
            device.activate(device_input.position);
            device.may_be_inside = touches;
        }
        device.begin(&model.parameters.devices[number], model.parameters.step_s, device_input.position);
    }
}

/// Collision detection: all contacts of the step between objects that are awake.
fn find_contacts(model: &Model, state: &mut State, workspace: &mut Workspace, input: &Input) {
    workspace.collision.candidates.clear();
    // First, so that they find room.
    clamps::find_contacts(model, state, workspace);
    let (mut context, devices, [before, after]) = collision_context(model, state, workspace);
    for (number, device) in devices.iter_mut().enumerate().filter(|(_, device)| device.active) {
        if let DeviceMode::Held(grasp) = input.devices[number].mode {
            let collider = Collider::Device(number);
            context.workspace.candidates.push(ContactCandidate {
                id: ContactId { collider, object: grasp.object, feature: FeatureId::HeldPoint },
                location: ContactLocation { point: grasp.point, footprint: Footprint::Point },
                other: CandidateSide::Device(number),
                law: ContactLaw::Bilateral,
                normal: DVec3::ZERO,
                distance: 0.0,
            });
            continue;
        }
        let mark = context.workspace.candidates.mark();
        for _ in 0..2 {
            if device.may_be_inside {
                let Some(place) = context.place_outside(number, device) else { break };
                device.let_out(place - device.proxy);
            }
            // Again, where it is found inside without contact.
            context.workspace.candidates.rewind(mark);
            context.find_near_objects(number, device);
            device.may_be_inside = false;
            for near in 0..context.workspace.near_objects.len() {
                let object = context.workspace.near_objects[near] as usize;
                device.may_be_inside |= context.find_tip_contacts(TipPair { number, device, object });
            }
            if !device.may_be_inside {
                break;
            }
        }
    }
    for object in context.sleepers.awake_indices() {
        for (number, (before, after)) in before.iter().zip(after).enumerate() {
            context.find_obstacle_contacts(object, number, *before, *after);
        }
    }
    context.find_pair_contacts();
    // Last, since it looks at the surface of another moment.
    (0..devices.len()).for_each(|number| context.rebuild_ahead(number));
    let State { gravity, objects, contacts, output, .. } = state;
    let Workspace { collision, spare, .. } = workspace;
    output.status.dropped_contacts += match_contacts(
        (&*model.objects, *gravity),
        objects,
        contacts,
        spare,
        &mut collision.candidates,
        &mut collision.level_changes,
    );
}

/// Set up the constraints: where the sides of each contact start, and which penetration may remain.
fn set_up_constraints(model: &Model, state: &mut State, workspace: &mut Workspace) {
    let gravity = state.gravity;
    let State { steps, objects, devices, contacts, recovery, sleepers, output, .. } = state;
    for at in sleepers.awake_indices() {
        let (object, own) = (&model.objects[at], &mut objects[at]);
        let orientation = own.rigid.pose.orientation;
        let mut view = object.view(own.felt_gravity(gravity), &own.rigid, &mut own.response);
        own.points.predict_new(&mut view);
        own.points.resum_next(*steps);
        for point in &mut own.points.points {
            point.start_arm = orientation * (point.rest + point.state.displacement);
        }
    }
    // Losses pay for pushing out tips, and recent losses for pushing out objects within the slop; deeper objects are moved apart at the end of
    // the step.
    let (mut tip_budget, mut object_budget) = (0.5 * output.energy.lost().max(0.0), recovery.available());
    workspace.constraints.clear();
    for contact in contacts.iter() {
        let at = |object: usize, slot: usize| {
            objects[object].rigid.pose.position + objects[object].points.of(slot).start_arm
        };
        let other = match contact.other {
            OtherSide::Device(device) => devices[device].proxy,
            OtherSide::Obstacle { start, .. } | OtherSide::Clamp { start, .. } => start,
            OtherSide::Object { number, slot } => at(number, slot),
        };
        if contact.is_held() {
            if let (true, OtherSide::Device(number)) = (contact.is_new, contact.other) {
                // The hand takes the point where it is.
                let (parameters, h) = (&model.parameters.devices[number], model.parameters.step_s);
                let device = &mut devices[number];
                device.activate(at(contact.object(), contact.slot));
                device.begin(parameters, h, device.target);
            }
            workspace.constraints.push(Constraint::default());
            continue;
        }
        let mut constraint = Constraint::new(other - at(contact.object(), contact.slot));
        let gap = contact.gap(constraint.start);
        constraint.min_gap = gap.min(0.0);
        let is_tip = matches!(contact.other, OtherSide::Device(_));
        if gap < 0.0 && (is_tip || gap > -depenetration::slop(model, contact.object())) {
            let push = SOLVER.recovery * -gap;
            let budget = if is_tip { &mut tip_budget } else { &mut object_budget };
            let cost = 2.0 * contact.force.length() * push;
            let paid = if cost > *budget { 0.0 } else { push };
            *budget -= if paid > 0.0 { cost } else { 0.0 };
            constraint.min_gap = gap + paid;
        }
        workspace.constraints.push(constraint);
    }
}

/// Solve for the contact forces. Losses of earlier steps must pay for pushing out tips: if they do not, penetrations stay as
/// they are, and in the last resort contacts carry no force.
fn solve(model: &Model, state: &mut State, workspace: &mut Workspace) {
    let rules = model.step_rules(state.gravity);
    let State { objects, devices, contacts, sleepers, output, .. } = state;
    let paid = output.energy.lost().max(0.0);
    let Workspace { solver, constraints, .. } = workspace;
    let budget = model.parameters.solver_budget;
    let mut problem = ContactProblem {
        objects: &model.objects,
        rules,
        awake: sleepers.awake(),
        states: objects,
        devices,
        contacts,
        constraints,
    };
    for attempt in 0..3 {
        let SolverReport { residual_m, iterations, dependent_rows, unsolved_islands, islands_out_of_budget } =
            solver.solve(&mut problem, budget);
        if problem.dissipated() + paid >= -problem.rounding() || attempt == 2 {
            let status = &mut output.status;
            (status.solver_residual_m, status.iterations) = (residual_m, iterations);
            status.dependent_rows = dependent_rows;
            status.unsolved_islands += unsolved_islands;
            status.islands_out_of_budget = islands_out_of_budget;
            return;
        }
        let pairs = problem.contacts.iter_mut().zip(&mut *problem.constraints);
        for (contact, constraint) in pairs {
            let ContactLaw::Unilateral { friction } = contact.law else { continue };
            if attempt == 0 {
                // Sides that sink by what the solver leaves, in the gap and in the slip, take the work that they could give.
                let left = 2.0 * (1.0 + friction) * residual_m;
                constraint.min_gap = contact.gap(constraint.start).min(0.0) - left;
            } else {
                (constraint.min_gap, contact.force) = (f64::NEG_INFINITY, DVec3::ZERO);
            }
        }
    }
}

/// Integrate deformation and rigid motion with the forces held, and account for the energy.
fn integrate(model: &Model, state: &mut State, workspace: &Workspace) {
    let gravity = state.gravity;
    let State { objects, devices, contacts, obstacles, couplings, recovery, output, .. } = state;
    let (sleepers, resting) = (&state.sleepers, &state.resting);
    let mut given_back = 0.0;
    for (contact, constraint) in contacts.iter().zip(workspace.constraints.iter()) {
        let given = accounting::contact(contact, constraint, objects);
        given_back += if matches!(contact.other, OtherSide::Device(_)) { 0.0 } else { given };
    }
    for device in devices.iter() {
        accounting::prescribed_force(device, objects);
    }
    remember_touches(objects, devices, contacts, &workspace.constraints);
    for at in sleepers.awake_indices() {
        let (object, own) = (&model.objects[at], &mut objects[at]);
        let is_unsolved = own.end.residual * object.radius > UNSOLVED * own.reach(object);
        output.status.unsolved_islands += u32::from(is_unsolved);
        // The indentation by a tip's patch moves no other contact.
        let coupled = own.points.points.iter().filter(|p| !object.body.is_tip(p.location.footprint));
        let displaced = coupled.map(|point| (point.displacement - point.free).length());
        own.contact_displacement = displaced.fold(0.0, f64::max);
        own.rigid = own.end.end;
        let mut view = object.view(own.felt_gravity(gravity), &own.rigid, &mut own.response);
        own.ledger.dissipated += view.advance(&mut own.points.points);
        own.points.points.iter_mut().for_each(|point| point.state.displacement = point.displacement);
    }
    sleepers.awake_indices().for_each(|at| objects[at].is_held = false);
    depenetration::depenetrate((model, gravity), objects, contacts, &workspace.constraints);
    for at in sleepers.awake_indices() {
        let (object, own) = (&model.objects[at], &mut objects[at]);
        own.ledger.input += own.base_work(object, gravity);
        own.update_ledger(object, gravity);
        own.ledger.defect =
            own.ledger.stored() - own.stored_at_start - (own.ledger.input - own.ledger.lost());
    }
    for (parameters, device) in model.parameters.devices.iter().zip(devices) {
        accounting::coupling(parameters, device, couplings);
    }
    obstacles.copy_from_slice(&workspace.next_obstacles);
    let of_awake = sleepers.awake_indices().map(|at| objects[at].ledger.lost());
    let lost = of_awake.fold(couplings.lost() + resting.lost(), |sum, own| sum + own);
    recovery.close(model.parameters.step_s, lost - output.energy.lost(), given_back);
}

/// Remember where each tip touches, and which have come through a surface because their contacts could not be solved.
fn remember_touches(
    objects: &[ObjectState],
    devices: &mut [DeviceState],
    contacts: &[Contact],
    constraints: &[Constraint],
) {
    devices.iter_mut().filter(|device| device.active).for_each(|device| device.last_touch = None);
    for (contact, constraint) in contacts.iter().zip(constraints).filter(|(contact, _)| !contact.is_held()) {
        let OtherSide::Device(number) = contact.other else { continue };
        let DeviceState { last_touch, may_be_inside, .. } = &mut devices[number];
        let is_through = contact.gap(constraint.end) < -contact.distance;
        *may_be_inside |= is_through;
        let (object, force) = (contact.object(), contact.force.length());
        if is_through || force > last_touch.map_or(0.0, |touch| touch.force) {
            let point = objects[object].points.of(contact.slot).location.point;
            *last_touch = Some(LastTouch { object, point, force });
        }
    }
}
