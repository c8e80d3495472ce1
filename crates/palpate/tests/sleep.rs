//! Sleep: what rests falls asleep as it is, costs no step, and wakes with what comes near.

use glam::{DQuat, DVec3};
use palpate::{
    Collider, ContactOutput, Input, Model, ModelObject, ModelParameters, Obstacle, Output, Pose, Recording,
    Shape, State, StepStatus, step,
};
use palpate_testkit::{
    GRAVITY_M_S2, Random, energy_imbalance, finger, fixed_block, floor, free_block, grasp, half_extent,
    holding, model_and_state, object_at, start_at, touching, with_stiffness_damping,
};
use std::sync::Arc;

/// Small share of an energy [1]: round-off of some thousand steps.
const ROUND_OFF: f64 = 1e-9;

/// Time for which objects are still before they sleep [s].
const SLEEP_AFTER_S: f64 = 0.2;

/// Steps in which all scenes of this file come to rest and fall asleep.
const SETTLING: u32 = 3000;

/// Block whose vibrations decay within some tenths of a second.
fn damped_block() -> Arc<Recording> {
    with_stiffness_damping(&free_block(), 1e-2)
}

fn parameters() -> ModelParameters {
    let half = half_extent(&free_block(), 1);
    ModelParameters {
        gravity: DVec3::Y * -GRAVITY_M_S2,
        obstacles: vec![floor(0.5)],
        devices: vec![finger(0.1 * half, 0.1 * half, 0.5)],
        max_contact_samples: 12,
        sleep_after_s: SLEEP_AFTER_S,
        ..ModelParameters::for_reference()
    }
}

/// A stack of two blocks, and one that lies apart from it.
fn blocks() -> Vec<ModelObject> {
    let block = damped_block();
    let half = half_extent(&block, 1);
    let at = |x: f64, y: f64| object_at(&block, DVec3::new(x * half, y * half, 0.0), DVec3::ZERO);
    vec![at(0.0, 1.01), at(0.1, 3.05), at(8.0, 1.01)]
}

fn asleep(output: &Output) -> Vec<bool> {
    output.objects.iter().map(|object| object.is_asleep).collect()
}

/// Stored energy at the start by the ledger of an output [J].
fn stored_at_start(state: &State) -> f64 {
    state.output().energy.stored()
}

/// Steps without device until all objects sleep.
fn settle(model: &Model, state: &mut State) {
    (0..SETTLING).for_each(|_| _ = step(model, state, &Input::default()));
    assert!(asleep(state.output()).iter().all(|&asleep| asleep), "{:?}", state.output());
}

#[test]
fn what_rests_falls_asleep_and_stays_as_it_is() {
    let (model, mut state) = model_and_state(parameters(), blocks());
    let start = stored_at_start(&state);
    let mut seen = false;
    for _ in 0..SETTLING {
        let before = state.output().clone();
        let output = step(&model, &mut state, &Input::default());
        let energy = &output.energy;
        assert!(energy_imbalance(output, start).abs() < ROUND_OFF * energy.lost().max(1e-3), "{energy:?}");
        if asleep(&before).iter().all(|&asleep| asleep) {
            seen = true;
            let status = StepStatus::default();
            let expected = Output { time_s: output.time_s, status, ..before };
            assert_eq!(*output, expected);
        }
    }
    assert!(seen, "nothing fell asleep");
    // The floor carries all three; the upper block is carried by the lower one.
    let output = state.output();
    let weight = free_block().mass() * GRAVITY_M_S2;
    let carried = |object: usize, against: Collider| -> f64 {
        let of = |c: &&ContactOutput| c.object == object && c.against == against;
        output.contacts.iter().filter(of).map(|contact| contact.force.y).sum()
    };
    let on_floor: Vec<f64> = (0..3).map(|object| carried(object, Collider::Obstacle(0))).collect();
    assert!((on_floor[0] / weight - 2.0).abs() < 1e-3, "{on_floor:?} of {weight}");
    assert!(on_floor[1].abs() < 1e-12 && (on_floor[2] / weight - 1.0).abs() < 1e-3, "{on_floor:?}");
}

#[test]
fn a_finger_wakes_the_group_that_it_comes_near_and_feels_the_same_as_awake() {
    let half = half_extent(&free_block(), 1);
    let run = |sleep_after_s: f64| -> Vec<(f64, Vec<bool>)> {
        let (model, mut state) = model_and_state(ModelParameters { sleep_after_s, ..parameters() }, blocks());
        (0..SETTLING).for_each(|_| _ = step(&model, &mut state, &Input::default()));
        let start = stored_at_start(&state) - state.output().energy.input + state.output().energy.lost();
        let at = |number: u32| DVec3::new(0.1 * half, (7.0 - 0.0032 * f64::from(number)) * half, 0.0);
        let outputs = (0..1000).map(|number| {
            let output = step(&model, &mut state, &touching(&[at(number)]));
            let energy = &output.energy;
            assert!(energy_imbalance(output, start).abs() < ROUND_OFF * energy.lost(), "{energy:?}");
            (output.devices[0].force_on_hand.y, asleep(output))
        });
        outputs.collect()
    };
    let (with, without) = (run(SLEEP_AFTER_S), run(f64::INFINITY));
    assert_eq!(with[0].1, [true; 3]);
    assert_eq!(with[999].1, [false, false, true]);
    let largest = without.iter().map(|(force, _)| *force).fold(0.0, f64::max);
    assert!(largest > 0.0);
    for (number, ((a, _), (b, _))) in with.iter().zip(&without).enumerate() {
        assert!((a - b).abs() < 0.01 * largest, "step {number}: {a} N asleep before, {b} N awake");
    }
}

#[test]
fn a_block_that_falls_wakes_what_it_hits_and_all_sleep_again() {
    let block = damped_block();
    let half = half_extent(&block, 1);
    let place = DVec3::new(0.5 * half, 16.0 * half, 0.0);
    let mut objects = blocks();
    objects.push(object_at(&block, place, DVec3::ZERO));
    // A device holds the block until the others sleep.
    let grasp = grasp(3, 0, [1.0, 0.0, 0.0]);
    let held = holding(place + block.surface.rest_position(&grasp.point), grasp);
    let run = |sleep_after_s: f64| {
        let (model, mut state) =
            model_and_state(ModelParameters { sleep_after_s, ..parameters() }, objects.clone());
        let start = stored_at_start(&state);
        (0..SETTLING).for_each(|_| _ = step(&model, &mut state, &held));
        let before = asleep(state.output());
        let (mut deepest, mut woken) = (0.0_f64, false);
        for _ in 0..2 * SETTLING {
            let output = step(&model, &mut state, &Input::default());
            let scale = output.energy.lost().max(1e-3);
            assert!(energy_imbalance(output, start).abs() < ROUND_OFF * scale, "{:?}", output.energy);
            deepest =
                output.objects.iter().fold(deepest, |deepest, object| deepest.max(object.penetration_m));
            // First the stack that it hits.
            if !woken && output.objects[..2].iter().all(|object| !object.is_asleep) {
                woken = true;
                assert_eq!(output.objects[2].is_asleep, before[2]);
            }
        }
        (before, deepest, woken, asleep(state.output()))
    };
    let (before, deepest, woken, after) = run(SLEEP_AFTER_S);
    assert_eq!((&before[..], woken, &after[..]), (&[true, true, true, false][..], true, &[true; 4][..]));
    let (.., deepest_awake, _, after) = run(f64::INFINITY);
    assert_eq!(after, [false; 4]);
    assert!(deepest < 1.1 * deepest_awake, "{deepest} m inside, {deepest_awake} m without sleep");
}

#[test]
fn obstacles_that_move_and_gravity_that_changes_wake() {
    let half = half_extent(&free_block(), 1);
    let shape = Shape::Box { half_extents: DVec3::splat(half) };
    let place =
        |x: f64| Pose { position: DVec3::new(x * half, 1.5 * half, 0.0), orientation: DQuat::IDENTITY };
    let mut with_box = parameters();
    with_box.obstacles.push(Obstacle { pose: place(-8.0), shape, friction: 0.5 });
    let (model, mut state) = model_and_state(with_box, blocks());
    settle(&model, &mut state);
    let floor_pose = model.parameters().obstacles[0].pose;
    let input = |x: f64| Input { obstacles: vec![floor_pose, place(x)], ..Input::default() };
    // The box moves far from all, then stays, then pushes the stack.
    (0..100).for_each(|number| _ = step(&model, &mut state, &input(-8.0 - 0.01 * f64::from(number))));
    assert_eq!(asleep(state.output()), [true; 3]);
    (0..1000).for_each(|number| _ = step(&model, &mut state, &input(-9.0 + 0.008 * f64::from(number))));
    assert_eq!(asleep(state.output()), [false, false, true]);
    assert!(state.output().objects[0].pose.position.x > 0.1 * half);

    settle(&model, &mut state);
    let gravity = Some(DVec3::new(1.0, -GRAVITY_M_S2, 0.0));
    step(&model, &mut state, &Input { gravity, ..Input::default() });
    assert_eq!(asleep(state.output()), [false; 3]);
}

#[test]
fn a_body_with_fixed_nodes_sleeps_on_a_floor_and_wakes_with_its_base() {
    let body = fixed_block();
    let low = body.surface.positions.iter().map(|p| p.y).fold(0.0, f64::min);
    let in_the_floor = DVec3::Y * (-low - 1e-4);
    let (model, mut state) =
        model_and_state(parameters(), vec![ModelObject::new(body, start_at(in_the_floor))]);
    (0..20 * SETTLING).for_each(|_| _ = step(&model, &mut state, &Input::default()));
    assert!(state.output().objects[0].is_asleep, "{:?}", state.output());
    let base = |x: f64| Input { bases: vec![Some(in_the_floor + DVec3::X * x)], ..Input::default() };
    step(&model, &mut state, &base(0.0));
    assert!(state.output().objects[0].is_asleep);
    step(&model, &mut state, &base(1e-4));
    assert!(!state.output().objects[0].is_asleep);
}

#[test]
fn bodies_that_nothing_touches_vibrate_and_drift_on_however_little() {
    let (free, fixed) = (free_block(), fixed_block());
    let drifting = object_at(&free, DVec3::ZERO, DVec3::X * 1e-6);
    let objects = vec![drifting, ModelObject::new(fixed, start_at(DVec3::Y))];
    let parameters = ModelParameters { gravity: DVec3::Y * 1e-6, obstacles: Vec::new(), ..parameters() };
    let (model, mut state) = model_and_state(parameters, objects);
    (0..SETTLING).for_each(|_| _ = step(&model, &mut state, &Input::default()));
    let time = f64::from(SETTLING) * model.parameters().step_s;
    assert_eq!(asleep(state.output()), [false; 2]);
    assert!((state.output().objects[0].pose.position.x / (1e-6 * time) - 1.0).abs() < ROUND_OFF);
}

#[test]
fn random_fingers_among_sleeping_and_waking_blocks_get_no_energy() {
    let (block, mut random) = (damped_block(), Random::new(7));
    let half = half_extent(&block, 1);
    let objects: Vec<_> = (0..9)
        .map(|k| {
            let at = DVec3::new((k % 3) as f64 * 2.6, 1.01, (k / 3) as f64 * 2.6) * half;
            object_at(&block, at, DVec3::ZERO)
        })
        .collect();
    let parameters =
        ModelParameters { devices: vec![finger(0.2 * half, 0.1 * half, 0.5); 2], ..parameters() };
    let (model, mut state) = model_and_state(parameters, objects);
    let start = stored_at_start(&state);
    let (mut position, mut velocity) = ([DVec3::Y * 3.0 * half; 2], [DVec3::ZERO; 2]);
    let (mut fell_asleep, mut woke, mut before) = (0, 0, asleep(state.output()));
    for number in 0..20_000 {
        for (p, v) in position.iter_mut().zip(&mut velocity) {
            *v = (*v * 0.995 + random.vector() * (0.05 * half)).clamp_length_max(3.0 * half);
            *p = (*p + *v * 1e-3).clamp(DVec3::splat(-half), DVec3::splat(6.0 * half));
        }
        // Pauses, in which blocks fall asleep.
        let input = if number % 5000 < 2500 { touching(&position) } else { Input::default() };
        let output = step(&model, &mut state, &input);
        let energy = &output.energy;
        let scale = energy.lost() + energy.input.abs() + 1e-3;
        assert!(energy_imbalance(output, start).abs() < ROUND_OFF * scale, "step {number}: {energy:?}");
        assert!(energy.lost() > -ROUND_OFF * scale, "step {number}: {energy:?}");
        let now = asleep(output);
        fell_asleep += now.iter().zip(&before).filter(|(now, before)| **now && !**before).count();
        woke += now.iter().zip(&before).filter(|(now, before)| !**now && **before).count();
        before = now;
    }
    assert!(fell_asleep > 9 && woke > 3, "{fell_asleep} fell asleep, {woke} woke");
}

#[test]
fn an_object_that_was_held_falls_when_it_is_let_go_however_soon_objects_sleep() {
    let block = damped_block();
    let half = half_extent(&block, 1);
    let place = DVec3::Y * 8.0 * half;
    let grasp = grasp(0, 0, [1.0, 0.0, 0.0]);
    let held = holding(place + block.surface.rest_position(&grasp.point), grasp);
    let parameters = ModelParameters { sleep_after_s: 1e-4, ..parameters() };
    let (model, mut state) = model_and_state(parameters, vec![object_at(&block, place, DVec3::ZERO)]);
    (0..2 * SETTLING).for_each(|_| _ = step(&model, &mut state, &held));
    let height = state.output().objects[0].pose.position.y;
    (0..300).for_each(|_| _ = step(&model, &mut state, &Input::default()));
    assert!(state.output().objects[0].pose.position.y < height - 2.0 * half);
}

#[test]
fn inputs_that_are_refused_wake_nothing() {
    let (model, mut state) = model_and_state(parameters(), blocks());
    settle(&model, &mut state);
    let bases = vec![Some(DVec3::X); 3];
    step(&model, &mut state, &Input { bases, gravity: Some(DVec3::NAN), ..Input::default() });
    assert_eq!(asleep(state.output()), [true; 3]);
    assert_eq!(state.output().status.rejected_inputs, 4, "three bases of free objects, and gravity");
}
