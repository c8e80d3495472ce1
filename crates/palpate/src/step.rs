//! One step of a scene, a function per stage.
//!
//! Predict every object without contact force; find what comes into contact; find the forces f that obey the
//! contacts' laws at the end of the step; advance deformation and rigid motion with f held; account for the energy.
//!
//! With R, R⁺ the orientation before and after, v = h·ω̄ the step's turn (see `motion`), a the
//! deformed arm in body axes, and A = R·a, A⁺ = R⁺·a⁺ in world axes, the Cayley map gives
//!
//! ```text
//! A⁺ − A = v × (A + A⁺)/2 + (1 + v̂/2)·R·(a⁺ − a)
//! ```
//!
//! So with torque ½(A + A⁺) × f and force in the body g = Rᵀ·(1 − v̂/2)·f = R⁺ᵀ·(1 + v̂/2)·f, the work
//! f·(Δx + ΔA) at a contact is, exactly, the work on the rigid motion, f·Δx + τ·v, plus that on
//! the deformation, g·Δa: the energy balance holds in every step, also while the body turns.
//!
//! What the two sides of a contact do to each other over a step is f·Δapart, in the normal direction −λ·(gap⁺ − gap).
//! With gap⁺ ≥ min(0, gap) and Coulomb's law for the slip of the whole step it is never negative: contacts take
//! energy and give none, whatever the shape, the normal and the place that were chosen for the step.

use crate::contact::{
    Collider, Contact, DeviceState, Finding, HELD, Key, Law, Other, Parts, Wanted, WantedOther, against,
    look_ahead, renew, touch,
};
use crate::energy::EnergyLedger;
use crate::response::{Place, Reading, Responding};
use crate::scene::Model;
use crate::spatial::Pose;
use crate::state::{
    ContactOutput, DeviceInput, DeviceMode, Input, ObjectState, Output, State, StepStatus, Workspace,
};
use glam::DVec3;

/// A turn [rad], times the size of the body, that is off by more than this share of the reach was not found.
const UNSOLVED: f64 = 1e-9;

/// A contact that penetrates is pushed out by this share a step, as far as losses pay for it.
const RECOVERY: f64 = 0.1;

/// Sums that are carried from step to step are made anew over so many, a share in each, and all in every step while there
/// are few points.
const RENEWED: u64 = 64;
const FEW: usize = 16;

/// Advance a scene by one step.
///
/// # Real time
/// No allocation, lock or system call. The cost grows with modes × contacts, not with the mesh.
pub fn step<'s>(model: &Model, state: &'s mut State, input: &Input) -> &'s Output {
    state.output.status = StepStatus::default();
    predict(model, state);
    move_obstacles(state, input);
    find_contacts(model, state, input);
    prepare_contacts(model, state);
    solve(model, state);
    advance(model, state);
    state.steps += 1;
    write_output(model, state, input);
    &state.output
}

/// Stage 1: every object at the end of the step without contact force.
fn predict(model: &Model, state: &mut State) {
    for (at, own) in state.objects.iter_mut().enumerate() {
        let object = &model.objects[at];
        let mut responding = Responding::new(model, at, &own.rigid, &mut own.response);
        // A step predicts the next one, if gravity and step size stay.
        if !responding.predict() {
            own.points.predict(&mut responding);
        }
        own.free = object.advance_rigid(&model.parameters, &own.rigid, (DVec3::ZERO, DVec3::ZERO), None);
        own.surface_motion = object.body.way(own.response.coordinates(), own.response.free_coordinates());
    }
}

fn move_obstacles(state: &mut State, input: &Input) {
    let State { obstacles, workspace, output, .. } = state;
    for (number, next) in workspace.next_obstacles.iter_mut().enumerate() {
        *next = obstacles[number];
        let Some(wanted) = input.obstacles.get(number) else { continue };
        let length = wanted.orientation.length();
        if wanted.position.is_finite() && (0.99..=1.01).contains(&length) {
            *next = Pose { orientation: wanted.orientation.normalize(), ..*wanted };
        } else {
            output.status.rejected_inputs += 1;
        }
    }
}

/// The device's input if it can be used.
fn usable<'i>(model: &Model, input: &'i Input, device: usize) -> Option<&'i DeviceInput> {
    let device_input = input.devices.get(device)?;
    let allowed = match &device_input.mode {
        DeviceMode::Inactive => false,
        DeviceMode::Held(grasp) => model.accepts(grasp),
        DeviceMode::Touch => true,
    };
    (allowed && device_input.position.is_finite()).then_some(device_input)
}

/// Stage 2: what is, or may come, in contact within the step.
fn find_contacts(model: &Model, state: &mut State, input: &Input) {
    let State { steps, objects, devices, obstacles, contacts, inside, levels, workspace, output, .. } = state;
    let Workspace { search, caches, vicinities, near, wanted, spare, modes, next_obstacles, .. } = workspace;
    wanted.clear();
    search.begin();
    let step = *steps;
    let mut scene =
        Finding { model, objects, contacts, caches, search, vicinities, levels, near, modes, wanted, step };
    let searched = || (0..model.objects.len()).filter(|&at| model.objects[at].is_searched());
    for (number, device) in devices.iter_mut().enumerate() {
        let asked = input.devices.get(number).is_some_and(|d| d.mode != DeviceMode::Inactive);
        let Some(device_input) = usable(model, input, number) else {
            output.status.rejected_inputs += u32::from(asked);
            device.present = false;
            continue;
        };
        // A device that was away, or held a point, comes from where it is.
        let held = scene.contacts.iter().any(|c| c.law == Law::Held && c.other == Other::Device(number));
        let touches = device_input.mode == DeviceMode::Touch;
        let fresh = touches && (!device.present || held);
        device.present &= touches != held;
        let (target, parameters) = (device_input.position, &model.parameters.devices[number]);
        device.begin(parameters, model.parameters.step_s, target, target);
        if let DeviceMode::Held(grasp) = device_input.mode {
            scene.wanted.push(Wanted {
                key: Key { other: Collider::Device(number), object: grasp.object, feature: HELD },
                place: Place { point: grasp.point, reading: Reading::Point },
                other: WantedOther::Device(number),
                law: Law::Held,
                normal: DVec3::ZERO,
                distance: 0.0,
            });
            continue;
        }
        for at in searched() {
            touch(&mut scene, number, device, fresh, at, &mut inside[number * model.objects.len() + at]);
        }
    }
    for at in searched() {
        for (number, (before, after)) in obstacles.iter().zip(&*next_obstacles).enumerate() {
            against(&mut scene, at, number, *before, *after);
        }
    }
    scene.pairs();
    // After all that looks at the surface as it is now.
    for (number, at) in (0..devices.len()).flat_map(|number| searched().map(move |at| (number, at))) {
        look_ahead(&mut scene, number, at);
    }
    renew(model, objects, contacts, spare, wanted, &mut output.status);
}

/// Where the sides of each contact are at the start, and where they would be without force.
fn prepare_contacts(model: &Model, state: &mut State) {
    let State { steps, objects, devices, contacts, output, .. } = state;
    for (at, own) in objects.iter_mut().enumerate() {
        let orientation = own.rigid.pose.orientation;
        let mut responding = Responding::new(model, at, &own.rigid, &mut own.response);
        own.points.predict_fresh(&mut responding);
        match own.points.points.len() {
            0..=FEW => own.points.renew(0, 1),
            _ => own.points.renew(*steps % RENEWED, RENEWED),
        }
        for point in &mut own.points.points {
            point.start_arm = orientation * (point.rest + point.placed.displacement);
        }
    }
    // What losses can pay for pushing out what penetrates, shared among the contacts.
    let mut budget = 0.5 * output.energy.lost().max(0.0);
    for contact in contacts.iter_mut() {
        let at = |object: usize, slot: usize| {
            objects[object].rigid.pose.position + objects[object].points.of(slot).start_arm
        };
        let other = match contact.other {
            Other::Device(device) => devices[device].proxy,
            Other::Obstacle { start, .. } => start,
            Other::Object { number, slot } => at(number, slot),
        };
        if let (Law::Held, Other::Device(number)) = (contact.law, contact.other) {
            if contact.fresh {
                // The hand takes the point where it is.
                let (parameters, h) = (&model.parameters.devices[number], model.parameters.step_s);
                let device = &mut devices[number];
                device.present = false;
                device.begin(parameters, h, device.target, at(contact.object, contact.slot));
            }
            continue;
        }
        contact.start = other - at(contact.object, contact.slot);
        let gap = contact.gap(contact.start);
        contact.least_gap = 0.0;
        if gap < 0.0 {
            let push = RECOVERY * -gap;
            let cost = 2.0 * contact.force.length() * push;
            let paid = if cost > budget { 0.0 } else { push };
            budget -= if paid > 0.0 { cost } else { 0.0 };
            contact.least_gap = gap + paid;
        }
    }
}

/// Stage 3: the forces. What contacts push out must be paid for by what was lost before: if it is not, they stay where
/// they are, and in the last resort they give no force.
fn solve(model: &Model, state: &mut State) {
    let State { objects, devices, contacts, workspace, output, .. } = state;
    let paid = output.energy.lost().max(0.0);
    let mut parts = Parts { model, objects, devices, contacts };
    for attempt in 0..3 {
        let mut status = output.status;
        workspace.solver.solve(&mut parts, &mut status);
        let taken: f64 = parts.contacts.iter().map(Contact::taken).sum();
        if taken + paid >= -parts.rounding() || attempt == 2 {
            output.status = status;
            return;
        }
        for contact in parts.contacts.iter_mut().filter(|contact| contact.law != Law::Held) {
            if attempt == 0 {
                contact.least_gap = contact.gap(contact.start).min(0.0);
            } else {
                // None at all, also not what a sweep leaves as too little.
                (contact.least_gap, contact.force) = (f64::NEG_INFINITY, DVec3::ZERO);
            }
        }
    }
}

/// Stages 4 and 5: hold the forces over the step, and account for the energy.
fn advance(model: &Model, state: &mut State) {
    let State { objects, devices, contacts, obstacles, workspace, couplings, output, .. } = state;
    for contact in contacts.iter_mut() {
        account(contact, objects);
        contact.trend = contact.guessed_from.map_or(DVec3::ZERO, |last| contact.force - last);
    }
    let mut unsolved = 0;
    for (at, own) in objects.iter_mut().enumerate() {
        let object = &model.objects[at];
        unsolved += u32::from(own.end.miss * object.radius > UNSOLVED * own.reach(object));
        let pushed = own.points.points.iter().map(|point| (point.displacement - point.free).length());
        own.pushed = pushed.fold(0.0, f64::max);
        own.rigid = own.end.end;
        let mut responding = Responding::new(model, at, &own.rigid, &mut own.response);
        own.ledger.dissipated += responding.advance(&mut own.points.points);
        own.points.points.iter_mut().for_each(|point| point.placed.displacement = point.displacement);
        own.weigh(object, model.parameters.gravity);
        own.ledger.defect =
            own.ledger.stored() - own.stored_at_start - (own.ledger.input - own.ledger.lost());
    }
    output.status.unsolved_islands += unsolved;
    for (number, device) in devices.iter_mut().enumerate() {
        account_coupling(model, number, device, couplings);
    }
    obstacles.copy_from_slice(&workspace.next_obstacles);
}

/// Work of a contact over the step, for its object: what the other side does, and what gets lost between them.
fn account(contact: &Contact, objects: &mut [ObjectState]) {
    let travel = |objects: &[ObjectState], object: usize, slot: usize| {
        let (own, point) = (&objects[object], objects[object].points.of(slot));
        (own.end.end.pose.position - own.rigid.pose.position) + (point.end_arm - point.start_arm)
    };
    let work = contact.force.dot(travel(objects, contact.object, contact.slot));
    let (impact, friction) = if contact.law == Law::Held { (0.0, 0.0) } else { contact.losses() };
    let ledger = &mut objects[contact.object].ledger;
    ledger.input += work + impact + friction;
    ledger.impact += impact;
    ledger.friction += friction;
    if let Other::Object { number, slot } = contact.other {
        let work = contact.force.dot(travel(objects, number, slot));
        objects[number].ledger.input -= work;
    }
}

/// A virtual coupling over the step: the device's work beyond the proxy's, what it stores, what it takes.
fn account_coupling(model: &Model, number: usize, device: &mut DeviceState, couplings: &mut EnergyLedger) {
    let coupling = model.parameters.devices[number].coupling;
    let stored = |stretch: DVec3| 0.5 * coupling.map_or(0.0, |c| c.stiffness) * stretch.length_squared();
    let before = device.last - device.proxy;
    if !device.present {
        // It went away: what was stored is lost.
        couplings.coupling -= stored(before);
        couplings.dissipated += stored(before);
        device.proxy = device.last;
        return;
    }
    // Without force the stretch goes as the damper lets it: a proxy that was pulled off a surface does not fall into the body.
    let after = device.target - device.proxy_under_force();
    if coupling.is_some() {
        let (work, change) = (device.force.dot(after - before), stored(after) - stored(before));
        couplings.input += work;
        couplings.coupling += change;
        couplings.dissipated += work - change;
    }
    device.proxy = device.target - after;
    device.last = device.target;
}

fn write_output(model: &Model, state: &mut State, input: &Input) {
    let State { steps, objects, devices, contacts, couplings, output, .. } = state;
    let h = model.parameters.step_s;
    output.time_s = *steps as f64 * h;
    for ((out, object), own) in output.objects.iter_mut().zip(&model.objects).zip(&*objects) {
        out.pose = own.rigid.pose;
        if let Some(inertia) = &object.inertia {
            out.twist = inertia.twist(&own.rigid);
        }
        out.energy = own.ledger;
    }
    output.energy = objects.iter().fold(*couplings, |sum, own| sum.plus(&own.ledger));
    for (number, out) in output.devices.iter_mut().enumerate() {
        let device = &devices[number];
        out.force_on_hand = if device.present { -device.force } else { DVec3::ZERO };
        if device.present {
            out.proxy = device.proxy;
        } else if let Some(given) = input.devices.get(number).filter(|given| given.position.is_finite()) {
            out.proxy = given.position;
        }
    }
    output.contacts.clear();
    for contact in contacts.iter() {
        let own = &objects[contact.object];
        let point = own.rigid.pose.position + own.points.of(contact.slot).end_arm;
        if let (true, Law::Held, Other::Device(device)) =
            (contact.force != DVec3::ZERO, contact.law, contact.other)
        {
            // A held point is the proxy, to the last digit that the solver gives.
            if model.parameters.devices[device].coupling.is_none() {
                output.devices[device].proxy = point;
            }
        }
        if contact.law != Law::Held
            && contact.force != DVec3::ZERO
            && output.contacts.len() < output.contacts.capacity()
        {
            output.contacts.push(ContactOutput {
                object: contact.object,
                against: contact.against(),
                point,
                normal: contact.normal,
                force: contact.force,
                gap: contact.gap(contact.end),
                slip_speed: contact.slip().length() / h,
            });
        }
    }
}
