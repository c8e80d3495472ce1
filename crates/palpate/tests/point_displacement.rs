//! Displacement of one surface point: as that of the whole surface, and as the solver has it.

use glam::DVec3;
use palpate::{
    DeviceInput, DeviceParameters, Input, ModelObject, ModelParameters, Recording, State, SurfacePoint, step,
};
use palpate_testkit::{
    GRAVITY_M_S2, finger, fixed_block, floor, free_block, grasp, model_and_state, object_at, start_at,
    with_stiffness_damping,
};
use std::sync::Arc;

/// Round-off of two sums of some hundred terms, relative to the largest displacement [1].
const ROUND_OFF: f64 = 1e-12;

/// Difference of a patch's residual displacement from the sum over its nodes, in single precision [1].
const SINGLE: f64 = 1e-6;

const POINTS: [(u32, [f64; 3]); 3] = [(3, [0.25, 0.35, 0.4]), (11, [1.0, 0.0, 0.0]), (17, [0.0, 0.5, 0.5])];

/// Displacements at [`POINTS`] by the whole surface agree, relative to the largest displacement.
fn check(model: &palpate::Model, state: &State, recording: &Recording, tolerance: f64) {
    let mut whole = vec![DVec3::ZERO; recording.surface.positions.len()];
    state.surface_displacement(model, 0, &mut whole);
    let largest = whole.iter().map(|u| u.length()).fold(0.0, f64::max);
    for (triangle, weights) in POINTS {
        let point = SurfacePoint { triangle, weights };
        let expected: DVec3 =
            recording.surface.corners(&point).iter().map(|&(node, w)| whole[node] * w).sum();
        let found = state.point_displacement(model, 0, &point);
        assert!((found - expected).length() <= tolerance * largest, "{triangle}: {found} {expected}");
    }
}

#[test]
fn point_moves_with_the_surface_and_a_held_point_with_its_hand() {
    let damped = with_stiffness_damping(&fixed_block(), 5e-3);
    for recording in [free_block(), fixed_block(), damped] {
        let parameters = ModelParameters {
            gravity: DVec3::Y * -GRAVITY_M_S2,
            devices: vec![DeviceParameters::default()],
            ..ModelParameters::for_reference()
        };
        let object = ModelObject::new(recording.clone(), start_at(DVec3::ZERO));
        let (model, mut state) = model_and_state(parameters, vec![object]);
        let held = grasp(0, 11, [0.25, 0.35, 0.4]);
        let rest = recording.surface.rest_position(&held.point);
        for number in 1..=200 {
            let t = f64::from(number) * 1e-3;
            let hand = rest + DVec3::new(0.003 * (20.0 * t).sin(), 0.002 * (31.0 * t).sin(), 0.0);
            step(
                &model,
                &mut state,
                &Input { devices: vec![DeviceInput::held(hand, held)], ..Input::default() },
            );
            check(&model, &state, &recording, ROUND_OFF);
            let pose = state.output().objects[0].pose;
            let moved = state.point_displacement(&model, 0, &held.point);
            let found = pose.world_from_body(recording.surface.rest_position(&held.point) + moved);
            assert!((found - hand).length() < 1e-14, "{found} {hand}");
        }
    }
}

#[test]
fn point_moves_with_a_surface_that_lies_on_a_floor_and_is_touched() {
    let recording: Arc<Recording> = free_block();
    let parameters = ModelParameters {
        gravity: DVec3::Y * -GRAVITY_M_S2,
        obstacles: vec![floor(0.5)],
        devices: vec![finger(0.01, 0.04, 0.5)],
        ..ModelParameters::for_reference()
    };
    let objects = vec![object_at(&recording, DVec3::Y * 0.051, DVec3::ZERO)];
    let (model, mut state) = model_and_state(parameters, objects);
    let mut touched = 0;
    for number in 1..=400 {
        let height = 0.12 - 0.1e-3 * f64::from(number);
        let tip = DeviceInput::touching(DVec3::new(0.01, height, 0.01));
        let output = step(&model, &mut state, &Input { devices: vec![tip], ..Input::default() });
        touched += u32::from(output.contacts.len() > 1);
        check(&model, &state, &recording, SINGLE);
    }
    assert!(touched > 100, "{touched}");
}
