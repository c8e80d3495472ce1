//! Bases of bodies with fixed nodes that move: as gravity less acceleration, with exact work.

use glam::{DQuat, DVec3};
use palpate::{
    AppliedForce, DeviceInput, DeviceParameters, Input, Model, ModelObject, ModelParameters, ObjectStart,
    State, step,
};
use palpate_testkit::{GRAVITY_M_S2, fixed_block, floor, free_block, grasp, model_and_state, start_at};

const H: f64 = 1e-3;
const GRAVITY: DVec3 = DVec3::new(0.0, -GRAVITY_M_S2, 0.0);

/// Round-off of an energy ledger [1], relative to what moved: thousands of sums with terms of that size.
const LEDGER_ROUND_OFF: f64 = 1e-11;

/// Round-off of displacements of a millimetre after a thousand steps [m].
const SAME_M: f64 = 1e-14;

/// The block with fixed nodes, turned so that they are above its free end, at a place.
fn block(parameters: ModelParameters, place: DVec3) -> (Model, State) {
    let mut start = start_at(place);
    start.pose.orientation = DQuat::from_rotation_z(-0.7) * DQuat::from_rotation_x(-0.4);
    model_and_state(parameters, vec![ModelObject::new(fixed_block(), ObjectStart { ..start })])
}

/// Way of a base from rest.
fn way(t: f64) -> DVec3 {
    DVec3::new(0.01 * (1.0 - (30.0 * t).cos()), 0.02 * (1.0 - (17.0 * t).cos()), -0.1 * t * t)
}

#[test]
fn base_that_accelerates_is_gravity_less_acceleration() {
    let parameters = ModelParameters { gravity: GRAVITY, ..ModelParameters::for_reference() };
    let place = DVec3::new(0.3, -0.2, 0.5);
    let (model, mut moving) = block(parameters.clone(), place);
    let (_, mut still) = block(parameters, place);
    let point = grasp(0, 11, [0.25, 0.35, 0.4]).point;
    let (mut before, mut velocity, mut largest) = (DVec3::ZERO, DVec3::ZERO, 0.0_f64);
    for number in 1..=1000 {
        let given = way(f64::from(number) * H);
        step(&model, &mut moving, &Input { bases: vec![Some(place + given)], ..Input::default() });
        let next = (given - before) / H;
        let gravity = Some(GRAVITY - (next - velocity) / H);
        step(&model, &mut still, &Input { gravity, ..Input::default() });
        let [a, b] = [&moving, &still].map(|state| state.point_displacement(&model, 0, &point));
        assert!((a - b).length() < 1e-9 * a.length().max(1e-3), "{number}: {a} {b}");
        largest = largest.max(a.length());
        // Midway between the last two positions, with their difference over the step.
        let object = moving.output().objects[0];
        assert!((object.pose.position - place - 0.5 * (before + given)).length() < SAME_M, "{number}");
        assert!((object.twist.linear - next).length() < 1e-11, "{number}");
        (before, velocity) = (given, next);
    }
    assert!(largest > 1e-3, "{largest}");
}

#[test]
fn work_of_base_hands_forces_and_contacts_is_stored_or_lost_in_every_step() {
    let device = DeviceParameters::default();
    let parameters = ModelParameters {
        gravity: GRAVITY,
        devices: vec![device; 2],
        obstacles: vec![floor(0.5)],
        ..ModelParameters::for_reference()
    };
    let place = DVec3::Y * 0.13;
    let (model, mut state) = block(parameters, place);
    let stored = state.output().energy.stored();
    let held = grasp(0, 11, [0.25, 0.35, 0.4]);
    let rest = model.recordings().next().expect("a block").surface.rest_position(&held.point);
    let start = state.output().objects[0].pose.world_from_body(rest);
    let (mut contacts, mut work) = (0, 0.0);
    for number in 1..=1500 {
        let t = f64::from(number) * H;
        // From a second on it moves at constant speed.
        // Down to the floor and up again.
        let way = |t: f64| way(t) * DVec3::new(1.0, -0.4, 1.0);
        let given = if t < 1.0 { way(t) } else { way(1.0) - DVec3::Z * 0.2 * (t - 1.0) };
        let hand = match number {
            ..300 => DeviceInput::held(start + way(t) * 0.9, held),
            _ => DeviceInput::inactive(),
        };
        let force = DVec3::new(0.05 * (40.0 * t).sin(), 0.02, 0.0);
        let push = DeviceInput::exerting(AppliedForce { grasp: grasp(0, 17, [0.2, 0.3, 0.5]), force });
        let input = Input { devices: vec![hand, push], bases: vec![Some(place + given)], ..Input::default() };
        let output = step(&model, &mut state, &input);
        let energy = output.energy;
        let moved = energy.input.abs() + energy.lost() + (energy.stored() - stored).abs();
        assert!(energy.defect.abs() < LEDGER_ROUND_OFF * moved, "{number}: {energy:?}");
        assert_eq!(output.status.unsolved_islands, 0, "{number}");
        contacts += output.contacts.len();
        work = energy.input;
    }
    assert!(contacts > 100 && work.abs() > 1e-3, "{contacts} contacts, {work} J");
}

#[test]
fn base_that_stops_leaves_the_kinetic_energy_of_the_modes_alone() {
    let (model, mut state) = block(ModelParameters::for_reference(), DVec3::ZERO);
    // A jerk to constant speed, and a stop: the impulses of the base.
    for number in 1..=200 {
        let given = DVec3::X * 0.1 * H * f64::from(number);
        step(&model, &mut state, &Input { bases: vec![Some(given)], ..Input::default() });
    }
    let moving = state.output().objects[0];
    assert!((moving.twist.linear - DVec3::X * 0.1).length() < 1e-12);
    let object = 0.5 * fixed_block().mass() * 0.01;
    assert!(moving.energy.kinetic > 0.1 * object, "{:?}", moving.energy);
    let output = step(&model, &mut state, &Input::default());
    assert_eq!(output.objects[0].twist.linear, DVec3::ZERO);
    let modal: f64 = state.modal_state(0).iter().map(|mode| 0.5 * mode.v * mode.v).sum();
    let kinetic = state.output().objects[0].energy.kinetic;
    assert!((kinetic - modal).abs() < 1e-12 * modal, "{kinetic} {modal}");
}

#[test]
fn bases_of_free_bodies_and_positions_that_are_no_numbers_are_rejected() {
    let (model, mut state) = model_and_state(
        ModelParameters::for_reference(),
        vec![ModelObject::new(free_block(), start_at(DVec3::ZERO))],
    );
    let input = |position| Input { bases: vec![Some(position)], ..Input::default() };
    assert_eq!(step(&model, &mut state, &input(DVec3::X)).status.rejected_inputs, 1);
    assert_eq!(state.output().objects[0].pose.position, DVec3::ZERO);
    let (model, mut state) = block(ModelParameters::for_reference(), DVec3::ZERO);
    assert_eq!(step(&model, &mut state, &input(DVec3::NAN)).status.rejected_inputs, 1);
    assert_eq!(state.output().objects[0].pose.position, DVec3::ZERO);
}
