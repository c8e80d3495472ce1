//! Gravity that changes in time: motion, sag, contact and energy, against sums and superposition.

use glam::DVec3;
use palpate::{
    DeviceInput, DeviceParameters, InitialDeformation, Input, Model, ModelObject, ModelParameters, Recording,
    State, step,
};
use palpate_testkit::{
    GRAVITY_M_S2, energy_imbalance, fixed_block, floor, free_block, grasp, half_extent, holding,
    model_and_state, start_at, with_stiffness_damping,
};
use std::sync::Arc;

const H: f64 = 1e-3;

/// Round-off of a position or a velocity [1]: a thousand sums.
const ROUND_OFF: f64 = 1e-13;

/// Round-off of superposed forces and displacements [1], relative to the largest: a thousand steps of modes with S in single precision.
const SUPERPOSITION: f64 = 1e-7;

/// Relative round-off of an energy ledger with contacts [1]: the solver keeps nine digits.
const LEDGER: f64 = 1e-9;

/// Change of momentum by swaying over a second, relative to that by the weight [1].
const SWAY: f64 = 5e-3;

/// Slip of half a second while friction holds [m].
const SLIP_M: f64 = 1e-6;

fn one(recording: &Arc<Recording>, gravity: DVec3) -> (Model, State) {
    let devices = vec![DeviceParameters::default()];
    let parameters = ModelParameters { gravity, devices, ..ModelParameters::for_reference() };
    model_and_state(parameters, vec![ModelObject::new(recording.clone(), start_at(DVec3::ZERO))])
}

fn under(gravity: DVec3) -> Input {
    Input { gravity: Some(gravity), ..Input::default() }
}

#[test]
fn a_free_body_falls_as_the_sum_of_what_was_held_and_the_change_of_potential_is_input() {
    let recording = free_block();
    let (model, mut state) = one(&recording, DVec3::ZERO);
    let (mut v, mut x, mut input) = (DVec3::ZERO, DVec3::ZERO, 0.0);
    let mut last = DVec3::ZERO;
    for number in 0..1000 {
        let t = H * f64::from(number);
        let gravity = DVec3::new(3.0 * (7.0 * t).sin(), -GRAVITY_M_S2 * (2.0 * t).cos(), 1.0);
        input -= recording.mass() * (gravity - last).dot(x);
        (x, v, last) = (x + v * H + gravity * (0.5 * H * H), v + gravity * H, gravity);
        step(&model, &mut state, &under(gravity));
    }
    let output = state.output();
    assert!((output.objects[0].pose.position - x).length() < ROUND_OFF * x.length(), "{x}");
    assert!((output.objects[0].twist.linear - v).length() < ROUND_OFF * v.length(), "{v}");
    assert!(input.abs() > 1.0, "{input}");
    assert!((output.energy.input - input).abs() < 1e-12 * input.abs(), "{} {input}", output.energy.input);
    assert!(output.energy.defect.abs() < 1e-12 * input.abs(), "{:?}", output.energy);
    // Without a word gravity stays as it was.
    let before = output.objects[0].twist.linear;
    let after = step(&model, &mut state, &Input::default()).objects[0].twist.linear;
    assert!((after - before - last * H).length() < ROUND_OFF * v.length());
}

#[test]
fn the_sag_and_the_held_force_of_a_fixed_body_superpose() {
    let recording = fixed_block();
    let (first, second) = (DVec3::new(0.0, -GRAVITY_M_S2, 2.0), DVec3::new(5.0, 3.0, -1.0));
    let (changed_at, steps) = (300, 900);
    let point = grasp(0, 11, [0.25, 0.35, 0.4]);
    let corners = recording.surface.corners(&point.point);
    let rest: DVec3 = corners.iter().map(|&(node, w)| recording.surface.positions[node] * w).sum();
    // Displacements and held forces of every step, with the point held where it rests from a step on.
    let run = |start: DVec3, change: Option<DVec3>, steps: usize, held_from: usize| {
        let (model, mut state) = one(&recording, start);
        let mut sag = vec![DVec3::ZERO; recording.surface.positions.len()];
        let mut course = Vec::new();
        for number in 0..steps {
            let hand = if number >= held_from { holding(rest, point) } else { Input::default() };
            let gravity = change.filter(|_| number >= changed_at);
            let force =
                step(&model, &mut state, &Input { gravity, ..hand }).devices.first().map(|d| d.force_on_hand);
            state.surface_displacement(&model, 0, &mut sag);
            course.push((sag[40], force.unwrap_or_default()));
        }
        assert!(state.output().energy.defect.abs() < LEDGER * state.output().energy.stored().abs().max(1e-3));
        course
    };
    for held_from in [usize::MAX, 0] {
        let changed = run(first, Some(second), steps, held_from);
        let constant = run(first, None, steps, held_from);
        let difference = run(second - first, None, steps - changed_at, held_from);
        let largest = constant
            .iter()
            .fold((0.0_f64, 0.0_f64), |(u, f), now| (u.max(now.0.length()), f.max(now.1.length())));
        for number in 0..steps {
            let after =
                number.checked_sub(changed_at).map_or((DVec3::ZERO, DVec3::ZERO), |at| difference[at]);
            let off = changed[number].0 - constant[number].0 - after.0;
            assert!(off.length() < SUPERPOSITION * largest.0, "{held_from} {number}: {off} of {}", largest.0);
            let off = changed[number].1 - constant[number].1 - after.1;
            assert!(
                off.length() <= SUPERPOSITION * largest.1,
                "{held_from} {number}: {off} of {}",
                largest.1
            );
        }
    }
}

#[test]
fn a_block_on_a_floor_carries_the_weight_of_the_moment_and_slides_beyond_the_angle_of_friction() {
    // Damped, so that it does not sway and hop.
    let recording = with_stiffness_damping(&free_block(), 0.01);
    let height = half_extent(&recording, 1);
    for (slope, slides) in [(0.3, false), (0.5, true)] {
        let friction = 0.4;
        let parameters = ModelParameters {
            gravity: DVec3::Y * -GRAVITY_M_S2,
            obstacles: vec![floor(friction)],
            ..ModelParameters::for_reference()
        };
        let object = ModelObject::new(recording.clone(), start_at(DVec3::Y * height));
        let (model, mut state) = model_and_state(parameters, vec![object]);
        let (mut friction_until, mut impulse, mut leaned_at) = (0.0, DVec3::ZERO, 0.0);
        let stored = state.output().energy.stored();
        // Settles for 2 s, leans until 4 s, goes on to 5 s.
        for number in 0..5000 {
            let lean = slope * ((f64::from(number) - 2000.0) / 2000.0).clamp(0.0, 1.0);
            let gravity = DVec3::new(lean, -1.0, 0.0) * GRAVITY_M_S2;
            let output = step(&model, &mut state, &under(gravity));
            if number >= 4000 {
                impulse += output.contacts.iter().map(|contact| contact.force * H).sum::<DVec3>();
            }
            if number < 4000 {
                leaned_at = output.objects[0].twist.linear.x;
            }
            if number < 4500 {
                friction_until = state.output().energy.friction;
            }
        }
        let output = state.output();
        let weight = recording.mass() * GRAVITY_M_S2;
        // The mean of the last second: the soft block sways.
        let (share, along) = (impulse / weight, if slides { friction } else { slope });
        assert!((share.y - 1.0).abs() < SWAY && (share.x + along).abs() < SWAY, "{share} {along}");
        if slides {
            // Gain of speed in the last second; before, the soft sole slips part by part.
            let gained = output.objects[0].twist.linear.x - leaned_at;
            assert!((gained / (GRAVITY_M_S2 * (slope - friction)) - 1.0).abs() < SWAY, "{gained}");
        } else {
            let slipped = (output.energy.friction - friction_until) / (friction * weight);
            assert!(slipped < SLIP_M, "{slipped}");
        }
        let moved = output.energy.friction.max(weight * height);
        assert!(energy_imbalance(output, stored).abs() < LEDGER * moved, "{:?}", output.energy);
    }
}

#[test]
fn gravity_that_is_not_finite_is_refused_and_the_old_one_stays() {
    let (model, mut state) = one(&free_block(), DVec3::Y * -GRAVITY_M_S2);
    let output = step(&model, &mut state, &under(DVec3::new(f64::NAN, 0.0, 0.0)));
    assert_eq!(output.status.rejected_inputs, 1);
    let fallen = output.objects[0].twist.linear + DVec3::Y * (GRAVITY_M_S2 * H);
    assert!(fallen.length() < ROUND_OFF * H, "{fallen}");
    // The hands of the step are used all the same.
    let bad = Input { devices: vec![DeviceInput::inactive()], ..under(DVec3::splat(f64::INFINITY)) };
    assert_eq!(step(&model, &mut state, &bad).status.rejected_inputs, 1);
}

#[test]
fn a_fixed_body_that_starts_at_equilibrium_stays_there_and_a_free_one_has_none() {
    let gravity = DVec3::new(0.0, -GRAVITY_M_S2, 2.0);
    let parameters = ModelParameters { gravity, ..ModelParameters::for_reference() };
    let start = start_at(DVec3::ZERO);
    let object = |recording| ModelObject {
        deformation: InitialDeformation::Equilibrium,
        ..ModelObject::new(recording, start)
    };
    let recording = fixed_block();
    let nodes = recording.surface.positions.len();
    let (model, mut state) = model_and_state(parameters.clone(), vec![object(recording.clone())]);
    let (mut sag, mut now) = (vec![DVec3::ZERO; nodes], vec![DVec3::ZERO; nodes]);
    state.surface_displacement(&model, 0, &mut sag);
    let most = sag.iter().fold(0.0_f64, |most, u| most.max(u.length()));
    for _ in 0..2000 {
        step(&model, &mut state, &Input::default());
    }
    state.surface_displacement(&model, 0, &mut now);
    assert!(sag.iter().zip(&now).all(|(a, b)| (*a - *b).length() < 1e-9 * most), "{most}");
    assert!(
        state.output().energy.kinetic < 1e-15 * state.output().energy.elastic,
        "{:?}",
        state.output().energy
    );
    // Second route: an undeformed body with much damping comes to rest at it.
    let damped = with_stiffness_damping(&recording, 0.05);
    let (model, mut state) = model_and_state(parameters.clone(), vec![ModelObject::new(damped, start)]);
    for _ in 0..20_000 {
        step(&model, &mut state, &Input::default());
    }
    state.surface_displacement(&model, 0, &mut now);
    assert!(sag.iter().zip(&now).all(|(a, b)| (*a - *b).length() < 1e-9 * most), "{most}");

    let refused = Model::new(parameters, vec![object(free_block())]).expect_err("it would fall").to_string();
    assert_eq!(
        refused,
        "object 0: has no fixed nodes: without contact it has no static equilibrium to start from"
    );
}
