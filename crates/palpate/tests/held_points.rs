//! Held points: constraint, momentum and energy, on the released recordings.

use glam::DVec3;
use palpate::{
    DeviceInput, DeviceMode, DeviceParameters, Grasp, Input, Model, ModelObject, ModelParameters,
    ObjectStart, Output, Recording, RigidCompliance, RigidIntegrator, State, SurfacePoint, Twist, step,
};
use palpate_testkit::{GRAVITY_M_S2, finger, fixed_block, free_block, holding, model_and_state, start_at};
use std::ops::Range;
use std::sync::Arc;

const H: f64 = 1e-3;

/// Distance of a held point to its hand [m]: eight roundings of coordinates below one metre.
const HELD_M: f64 = 2e-15;

/// Distance of a held point to its hand where two hands hold it [m]: round-off of a solve that leaves three dependent rows out.
const HELD_BY_TWO_M: f64 = 1e-12;

/// Round-off of a momentum [1], relative above 1 N·s: four hundred sums of terms below 0.1 N·s.
const MOMENTUM_ROUND_OFF: f64 = 1e-13;

/// Round-off of an energy ledger [1], relative to what moved: two thousand sums with terms of that size.
const LEDGER_ROUND_OFF: f64 = 1e-12;

/// Smallest energy that counts as moved [J], so that a body at rest has a scale.
const LEAST_ENERGY_J: f64 = 1e-6;

/// Round-off of dissipated energy [J]: a sum of terms that are not negative.
const DISSIPATION_ROUND_OFF_J: f64 = 1e-15;

/// Round-off of the ledger of a hand that jumped back [J].
const DEFECT_AFTER_A_JUMP_J: f64 = 1e-12;

/// Remaining vibration after 60 s, and round-off [1], relative to the sag and to the weight.
const SETTLED: f64 = 1e-9;

/// Smallest sag that counts [m].
const LEAST_SAG_M: f64 = 1e-3;

/// Relative error of first order in a displacement of 0.1 mm on a body of decimetres [1].
const SMALL_DISPLACEMENT: f64 = 1e-2;

/// Residual of a constraint that is not round-off [m].
const NOT_ROUND_OFF_M: f64 = 1e-9;

/// Share of the work that semi-implicit Euler leaves as a defect [1]: first order in the step, so neither round-off nor all of it.
const FIRST_ORDER_DEFECT: Range<f64> = 1e-6..0.3;

/// Upper limit of the energy of a block that a finger presses by a centimetre at a fixed end [J]: it was 2·10²⁷ J for a held point.
const MOST_ENERGY_J: f64 = 100.0;

/// A grasp within a triangle.
fn grasp(object: usize, triangle: u32) -> Grasp {
    palpate_testkit::grasp(object, triangle, [0.25, 0.35, 0.4])
}

fn one(recording: Arc<Recording>, parameters: ModelParameters) -> (Model, State) {
    model_and_state(parameters, vec![ModelObject::new(recording, start_at(DVec3::ZERO))])
}

fn parameters(devices: usize) -> ModelParameters {
    ModelParameters {
        devices: vec![DeviceParameters::default(); devices],
        ..ModelParameters::for_reference()
    }
}

/// Run with one hand on a path; `observe` takes every output.
fn follow(
    model: &Model,
    state: &mut State,
    grasp: Grasp,
    steps: usize,
    path: impl Fn(f64) -> DVec3,
    mut observe: impl FnMut(&Output),
) {
    for number in 1..=steps {
        let position = path(number as f64 * H);
        observe(step(model, state, &holding(position, grasp)));
    }
}

#[test]
fn held_point_is_at_the_hand_at_the_end_of_every_step() {
    let (model, mut state) = one(free_block(), parameters(1));
    let rest = free_block().surface.rest_position(&grasp(0, 3).point);
    let path = |t: f64| rest + DVec3::new(0.02 * (9.0 * t).sin(), 0.01 * (25.0 * t).sin(), -0.1 * t * t);
    let mut number = 0;
    follow(&model, &mut state, grasp(0, 3), 1500, path, |output| {
        number += 1;
        let error = (output.devices[0].proxy - path(f64::from(number) * H)).length();
        assert!(error < HELD_M, "step {number}: {error}");
        assert_eq!(output.status.unsolved_islands, 0);
    });
}

#[test]
fn impulse_of_the_hand_is_the_momentum_of_the_object() {
    let recording = free_block();
    let (model, mut state) = one(recording.clone(), parameters(1));
    let rest = recording.surface.rest_position(&grasp(0, 7).point);
    let path = |t: f64| rest + DVec3::new(0.03 * (8.0 * t).sin(), 0.2 * t * t, 0.01 * (30.0 * t).sin());
    let (mut given, mut turning, mut before) = (DVec3::ZERO, DVec3::ZERO, rest);
    let mut number = 0;
    follow(&model, &mut state, grasp(0, 7), 400, path, |output| {
        number += 1;
        let force = -output.devices[0].force_on_hand;
        let hand = path(f64::from(number) * H);
        given += force * H;
        // Moment about the world's origin: the force acts at the hand's position in the middle of the step.
        turning += (0.5 * (before + hand)).cross(force) * H;
        before = hand;
    });
    let object = state.output().objects[0];
    let momentum = object.twist.linear * recording.mass();
    assert!((momentum - given).length() < MOMENTUM_ROUND_OFF * given.length().max(1.0), "{momentum} {given}");
    let spin =
        palpate::inertia_in_world(recording.inertia(), glam::DMat3::from_quat(object.pose.orientation));
    let angular = spin * object.twist.angular + object.pose.position.cross(momentum);
    assert!(
        (angular - turning).length() < MOMENTUM_ROUND_OFF * turning.length().max(1.0),
        "{angular} {turning}"
    );
}

#[test]
fn the_energy_balance_closes_in_every_step_while_the_body_turns() {
    let (model, mut state) =
        one(free_block(), ModelParameters { gravity: DVec3::Y * -GRAVITY_M_S2, ..parameters(1) });
    let rest = free_block().surface.rest_position(&grasp(0, 2).point);
    let path = |t: f64| rest + DVec3::new(0.05 * (11.0 * t).sin(), 0.04 * (17.0 * t).sin(), 0.0);
    let mut lost = 0.0;
    follow(&model, &mut state, grasp(0, 2), 2000, path, |output| {
        let energy = output.energy;
        let moved = energy.input.abs() + energy.dissipated + energy.stored().abs() + LEAST_ENERGY_J;
        assert!(energy.defect.abs() < LEDGER_ROUND_OFF * moved, "{energy:?}");
        assert!(
            energy.dissipated >= lost - DISSIPATION_ROUND_OFF_J,
            "dissipation gave back {}",
            lost - energy.dissipated
        );
        lost = energy.dissipated;
    });
    assert!(lost > 0.0 && state.output().objects[0].pose.orientation.w.abs() < 0.99, "it did not turn");
}

#[test]
fn fixed_body_sags_to_its_static_shape_which_needs_no_force_at_the_hand() {
    let recording = fixed_block();
    let gravity = DVec3::new(0.0, -GRAVITY_M_S2, 2.0);
    let (model, mut state) = one(recording.clone(), ModelParameters { gravity, ..parameters(1) });
    let none = Input { devices: Vec::new(), ..Input::default() };
    (0..60_000).for_each(|_| {
        step(&model, &mut state, &none);
    });
    let mut sag = vec![DVec3::ZERO; recording.surface.positions.len()];
    state.surface_displacement(&model, 0, &mut sag);
    // Second route: Φ·Λ⁻¹·p + residual, without time integration.
    let response = recording.gravity.as_ref().expect("a fixed body");
    let m = recording.modes.len();
    for (node, moved) in sag.iter().enumerate() {
        let mut expected = response.residual_displacement(node, gravity);
        for mode in 0..m {
            let load: f64 = (0..3).map(|axis| gravity[axis] * response.modal_forces[axis * m + mode]).sum();
            let q = load / recording.modes.angular_frequencies[mode].powi(2);
            expected +=
                DVec3::new(0.0, 1.0, 2.0).map(|axis| recording.modes.row(node, axis as usize)[mode]) * q;
        }
        assert!(
            (*moved - expected).length() < SETTLED * sag[0].length().max(LEAST_SAG_M),
            "{node}: {moved} {expected}"
        );
    }
    let output = state.output().clone();
    assert!(output.energy.defect.abs() < LEDGER_ROUND_OFF * output.energy.dissipated, "{:?}", output.energy);
    let held = grasp(0, 11);
    let corners = recording.surface.corners(&held.point);
    let at: DVec3 =
        corners.iter().map(|&(node, w)| (recording.surface.positions[node] + sag[node]) * w).sum();
    let force = step(&model, &mut state, &holding(at, held)).devices[0].force_on_hand.length();
    assert!(force < SETTLED * recording.mass() * GRAVITY_M_S2, "{force}");
}

#[test]
fn hand_at_nan_is_rejected_and_the_others_act() {
    let (model, mut state) = one(free_block(), parameters(2));
    let rest = |triangle| free_block().surface.rest_position(&grasp(0, triangle).point);
    let hold = |triangle, position| DeviceInput::held(position, grasp(0, triangle));
    let bad = DVec3::new(f64::NAN, 0.0, 0.0);
    let input = Input { devices: vec![hold(1, bad), hold(5, rest(5) + DVec3::X * 1e-3)], ..Input::default() };
    let output = step(&model, &mut state, &input);
    assert_eq!(output.status.rejected_inputs, 1);
    assert_eq!(output.devices[0].force_on_hand, DVec3::ZERO);
    assert!(output.devices[1].force_on_hand.x < 0.0 && output.devices[1].force_on_hand.is_finite());
}

/// A triangle of the fixed block whose nodes are all fixed.
fn fixed_triangle() -> u32 {
    let block = fixed_block();
    let is_fixed = |triangle: &u32| !block.is_movable(&grasp(0, *triangle).point);
    (0..block.surface.triangles.len() as u32).find(is_fixed).expect("a fixed end")
}

#[test]
fn a_hand_on_fixed_nodes_is_rejected_and_a_finger_there_gets_finite_forces() {
    let devices = vec![DeviceParameters::default(), finger(0.005, 0.02, 0.5)];
    let (model, mut state) = one(fixed_block(), ModelParameters { devices, ..parameters(0) });
    let grasp = grasp(0, fixed_triangle());
    let rest = fixed_block().surface.rest_position(&grasp.point);
    let outward = DVec3::X * rest.x.signum();
    for number in 0..200 {
        // The hand a centimetre away, the finger pressed a centimetre deep.
        let depth = 0.01 * f64::from(number.min(100)) / 100.0;
        let input = Input {
            devices: vec![
                DeviceInput::held(rest + DVec3::new(0.0, 0.01, 0.0), grasp),
                DeviceInput::touching(rest + outward * (0.0051 - depth)),
            ],
            ..Input::default()
        };
        let output = step(&model, &mut state, &input);
        assert_eq!(output.status.rejected_inputs, 1);
        assert_eq!(output.devices[0].force_on_hand, DVec3::ZERO);
        assert!(output.devices[1].force_on_hand.is_finite(), "{:?}", output.devices);
        assert!(output.energy.stored().abs() < MOST_ENERGY_J, "{:?}", output.energy);
    }
    assert_eq!(
        model.check_grasp(&grasp).map_err(|error| error.to_string()),
        Err("object 0: the point lies on fixed nodes: no hand can move it; hold one that is farther from them".into())
    );
    let beyond = Grasp { point: SurfacePoint { triangle: 99, ..grasp.point }, ..grasp };
    assert_eq!(
        model.check_grasp(&beyond).map_err(|error| error.to_string()),
        Err("object 0: there is no point in triangle 99 with such weights where a force may enter".into())
    );
}

#[test]
fn hand_that_jumps_too_far_gets_no_force_and_the_state_stays_finite() {
    let (model, mut state) = one(free_block(), parameters(1));
    let rest = free_block().surface.rest_position(&grasp(0, 3).point);
    let hold = |position| holding(position, grasp(0, 3));
    step(&model, &mut state, &hold(rest));
    let output = step(&model, &mut state, &hold(rest + DVec3::new(3e6, 4e6, 5e5)));
    assert_eq!(output.status.unsolved_islands, 1);
    assert_eq!(output.devices[0].force_on_hand, DVec3::ZERO);
    let output = step(&model, &mut state, &hold(rest + DVec3::X * 1e-4));
    assert_eq!(output.status.unsolved_islands, 0);
    assert!(
        output.devices[0].force_on_hand.is_finite() && output.energy.defect.abs() < DEFECT_AFTER_A_JUMP_J
    );
}

#[test]
fn two_hands_on_one_point_give_dependent_rows_and_finite_forces() {
    let (model, mut state) = one(free_block(), parameters(2));
    let hand = DeviceInput {
        position: free_block().surface.rest_position(&grasp(0, 3).point) + DVec3::X * 1e-3,
        mode: DeviceMode::Held(grasp(0, 3)),
    };
    let output = step(&model, &mut state, &Input { devices: vec![hand; 2], ..Input::default() });
    assert_eq!(output.status.dependent_rows, 3);
    assert_eq!(output.devices[1].force_on_hand, DVec3::ZERO);
    assert!((output.devices[0].proxy - hand.position).length() < HELD_BY_TWO_M);
}

#[test]
fn equal_inputs_give_equal_bits() {
    let run = || {
        let (model, mut state) = one(free_block(), parameters(1));
        let rest = free_block().surface.rest_position(&grasp(0, 3).point);
        let mut forces = Vec::new();
        let path = |t: f64| rest + DVec3::Y * (0.01 * (40.0 * t).sin());
        follow(&model, &mut state, grasp(0, 3), 300, path, |output| {
            forces.push(output.devices[0].force_on_hand)
        });
        forces
    };
    assert_eq!(run(), run());
}

#[test]
fn without_rigid_compliance_the_residual_is_half_h_squared_times_the_mobility() {
    let recording = free_block();
    let dropped = ModelParameters { rigid_compliance: RigidCompliance::Dropped, ..parameters(1) };
    let (model, mut state) = one(recording.clone(), dropped);
    let rest = recording.surface.rest_position(&grasp(0, 3).point);
    let hand = rest + DVec3::X * 1e-4;
    let output = step(&model, &mut state, &holding(hand, grasp(0, 3)));
    let force = -output.devices[0].force_on_hand;
    let residual = output.devices[0].proxy - hand;
    let linear = force * (0.5 * H * H / recording.mass());
    let spin = recording.inertia().inverse() * rest.cross(force) * (0.5 * H * H);
    assert!(
        (residual - linear - spin.cross(rest)).length() < SMALL_DISPLACEMENT * residual.length(),
        "{residual} {linear}"
    );
    assert!(residual.length() > NOT_ROUND_OFF_M, "{residual}");
}

#[test]
fn the_papers_update_gives_momentum_but_not_the_exact_energy() {
    let recording = free_block();
    let paper = ModelParameters { motion: RigidIntegrator::Paper, ..parameters(1) };
    let (model, mut state) = one(recording.clone(), paper);
    let rest = recording.surface.rest_position(&grasp(0, 3).point);
    let mut given = DVec3::ZERO;
    let path = |t: f64| rest + DVec3::Y * (0.02 * (20.0 * t).sin());
    follow(&model, &mut state, grasp(0, 3), 300, path, |output| given -= output.devices[0].force_on_hand * H);
    let output = state.output();
    let momentum = output.objects[0].twist.linear * recording.mass();
    assert!((momentum - given).length() < MOMENTUM_ROUND_OFF, "{momentum} {given}");
    // Semi-implicit Euler: the ledger reports a defect of first order in the step.
    let share = output.energy.defect.abs() / output.energy.input.abs();
    assert!(FIRST_ORDER_DEFECT.contains(&share), "{share}");
}

#[test]
fn parameters_out_of_range_are_refused() {
    let start = start_at(DVec3::ZERO);
    let refused = |parameters: ModelParameters, recording, start| {
        Model::new(parameters, vec![ModelObject::new(recording, start)])
            .err()
            .map(|e| e.to_string())
            .unwrap_or_default()
    };
    let step_s = |step_s| ModelParameters { step_s, ..ModelParameters::for_reference() };
    assert_eq!(refused(step_s(0.0), free_block(), start), "step is 0 s, expected above 0 and at most 1");
    assert_eq!(
        refused(step_s(f64::NAN), free_block(), start),
        "step is NaN s, expected above 0 and at most 1"
    );
    let moving = ObjectStart { twist: Twist { linear: DVec3::X, angular: DVec3::ZERO }, ..start };
    assert_eq!(
        refused(step_s(H), fixed_block(), moving),
        "object 0: has fixed nodes, so its velocities must be zero"
    );
}
