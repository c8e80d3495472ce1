//! Resumed states under other parameters, and deformation snapshots.

use glam::DVec3;
use palpate::{
    DeviceInput, DeviceParameters, Input, Model, ModelObject, ModelParameters, ObjectStart,
    ResidualFieldCache, State, Twist, step,
};
use palpate_testkit::{
    GRAVITY_M_S2, finger, floor, free_block, grasp, half_extent, holding, model_and_state, start_at, touching,
};

/// Round-off of an energy ledger [1], relative above 1 J: four hundred sums.
const LEDGER_ROUND_OFF: f64 = 1e-12;

/// Round-off of a displacement of millimetres that is a sum over a dozen modes [m].
const SUMMED_M: f64 = 1e-15;

/// Relative difference of cached residual fields [1]: they are stored as f32.
const F32_ROUNDING: f64 = 1e-6;

/// Energies [J] and displacements [m] that a hand or finger of a test causes at least, so that there is something to keep.
const LEAST_ELASTIC_J: f64 = 1e-7;
const LEAST_KINETIC_J: f64 = 1e-6;
const LEAST_RESIDUAL_M: f64 = 1e-5;
const LEAST_DEPTH_M: f64 = 1e-4;

fn model(step_s: f64, gravity: DVec3) -> Model {
    let start = ObjectStart {
        twist: Twist { linear: DVec3::new(0.1, 0.0, 0.2), angular: DVec3::new(0.5, -1.0, 2.0) },
        ..start_at(DVec3::ZERO)
    };
    let parameters = ModelParameters {
        step_s,
        gravity,
        devices: vec![DeviceParameters::default()],
        ..ModelParameters::for_reference()
    };
    Model::new(parameters, vec![ModelObject::new(free_block(), start)]).expect("a model")
}

/// State after a point was pulled for 40 steps.
fn pulled(model: &Model) -> State {
    let grasp = grasp(0, 3, [0.2, 0.3, 0.5]);
    let recording = model.recordings().next().expect("an object");
    let rest = recording.surface.rest_position(&grasp.point);
    let mut state = State::new(model);
    for number in 1..=40 {
        let hand = rest + DVec3::new(2e-4, 1e-4, -1e-4) * f64::from(number);
        step(model, &mut state, &holding(hand, grasp));
    }
    state
}

fn inactive() -> Input {
    Input { devices: vec![DeviceInput::inactive()], ..Input::default() }
}

#[test]
fn state_resumed_under_equal_parameters_continues_as_after_release() {
    let model = model(1e-3, DVec3::Y * -GRAVITY_M_S2);
    let mut state = pulled(&model);
    let mut other = State::resume(&model, &state.snapshots());
    assert_eq!(other.output().objects[0].pose, state.output().objects[0].pose);
    assert_eq!(other.modal_state(0), state.modal_state(0));
    for _ in 0..200 {
        let (a, b) = (step(&model, &mut state, &inactive()).clone(), step(&model, &mut other, &inactive()));
        assert_eq!((a.objects[0].pose, a.objects[0].twist), (b.objects[0].pose, b.objects[0].twist));
        assert_eq!(a.objects[0].energy.elastic, b.objects[0].energy.elastic);
    }
    assert_eq!(state.modal_state(0), other.modal_state(0));
}

#[test]
fn initial_state_resumes_to_itself() {
    let model = model(1e-3, DVec3::Y * -GRAVITY_M_S2);
    let start = State::new(&model);
    let mut other = State::resume(&model, &start.snapshots());
    assert_eq!((other.output(), other.snapshots()), (start.output(), start.snapshots()));
    let mut state = start;
    for _ in 0..100 {
        assert_eq!(step(&model, &mut state, &inactive()), step(&model, &mut other, &inactive()));
    }
}

#[test]
fn state_resumed_under_other_parameters_keeps_motion_and_energy_except_potential() {
    let before = model(1e-3, DVec3::ZERO);
    let state = pulled(&before);
    let after = model(5e-4, DVec3::X * 3.0);
    let mut other = State::resume(&after, &state.snapshots());
    let (old, new) = (state.output(), other.output().clone());
    assert_eq!((old.objects[0].pose, old.objects[0].twist), (new.objects[0].pose, new.objects[0].twist));
    assert_eq!(old.energy.kinetic, new.energy.kinetic);
    assert_eq!((old.energy.elastic, new.time_s, new.energy.input), (new.energy.elastic, 0.0, 0.0));
    let begun = new.energy.stored();
    assert!(old.energy.elastic > LEAST_ELASTIC_J && old.energy.kinetic > LEAST_KINETIC_J, "{:?}", old.energy);
    for _ in 0..400 {
        let energy = step(&after, &mut other, &inactive()).energy;
        let missing = energy.stored() + energy.lost() - begun - energy.defect;
        assert!(missing.abs() < LEDGER_ROUND_OFF * begun.abs().max(1.0), "{missing} J of {begun} J");
    }
}

#[test]
fn surface_displacement_is_modal_plus_residual_displacement() {
    let model = model(1e-3, DVec3::Y * -GRAVITY_M_S2);
    let state = pulled(&model);
    let deformation = state.deformation(0);
    let recording = model.recordings().next().expect("an object");
    let mut whole = vec![DVec3::ZERO; recording.surface.positions.len()];
    let mut residuals = whole.clone();
    deformation.surface_displacement(&model, &mut whole);
    deformation.residual_displacements(&model, &mut ResidualFieldCache::default(), &mut residuals);
    let (q, mut largest) = (deformation.modal_coordinates(), 0.0_f64);
    assert_eq!(q.len(), recording.modes.len());
    for (node, (u, residual)) in whole.iter().zip(&residuals).enumerate() {
        let row = |axis: usize| recording.modes.row(node, axis).iter().zip(q).map(|(a, b)| a * b).sum();
        let modal = DVec3::new(row(0), row(1), row(2));
        assert!((modal + *residual - *u).length() < SUMMED_M, "{node}: {modal} {residual} {u}");
        largest = largest.max(residual.length());
    }
    assert!(largest > LEAST_RESIDUAL_M, "the hand causes residual displacement: {largest} m");
}

#[test]
fn cached_residual_fields_give_equal_displacements() {
    let recording = free_block();
    let (surface, edge) = (&recording.surface, half_extent(&recording, 0));
    let fingers = vec![finger(0.01, 0.04, 0.0); 2];
    let parameters = ModelParameters { devices: fingers, ..ModelParameters::for_reference() };
    let (model, mut state) =
        model_and_state(parameters, vec![ModelObject::new(recording.clone(), start_at(DVec3::ZERO))]);
    let mut cache = ResidualFieldCache::default();
    let mut deepest = 0.0_f64;
    for number in 0..300 {
        // Fingers press and move over new and cached patches.
        let (press, along) =
            (0.004 * (f64::from(number) / 100.0).min(1.0), 0.02 * (f64::from(number) / 40.0).sin());
        let tip = |side: f64| DVec3::new(side * (edge + 0.0105 - press), along, 0.01);
        step(&model, &mut state, &touching(&[tip(-1.0), tip(1.0)]));
        let mut with = vec![DVec3::ZERO; surface.positions.len()];
        let mut without = with.clone();
        let deformation = state.deformation(0);
        deformation.surface_displacement_cached(&model, &mut cache, &mut with);
        deformation.surface_displacement(&model, &mut without);
        let size = without.iter().map(|u| u.length()).fold(0.0, f64::max);
        let difference = with.iter().zip(&without).map(|(a, b)| (*a - *b).length()).fold(0.0, f64::max);
        assert!(difference <= F32_ROUNDING * size, "{number}: {difference} of {size}");
        deepest = deepest.max(size);
    }
    assert!(deepest > LEAST_DEPTH_M, "they press: {deepest} m");
}

#[test]
fn a_clone_goes_on_as_its_original() {
    // Cloned before anything touches, when its buffers are empty, and in a press between a floor and a finger.
    let body = free_block();
    let parameters = ModelParameters {
        gravity: DVec3::Y * -9.81,
        obstacles: vec![floor(0.4)],
        devices: vec![finger(0.01, 0.03, 0.5)],
        max_contact_samples: 12,
        ..ModelParameters::for_reference()
    };
    let start = start_at(DVec3::Y * 0.0505);
    let (model, mut state) = model_and_state(parameters, vec![ModelObject::new(body, start)]);
    let input = |number: u32| touching(&[DVec3::Y * (0.112 - 1e-5 * f64::from(number.min(600)))]);
    let mut clones = vec![state.clone()];
    let mut forces = 0;
    for number in 0..800 {
        if number == 400 {
            clones.push(state.clone());
        }
        let output = step(&model, &mut state, &input(number)).clone();
        forces += output.contacts.len();
        for clone in &mut clones {
            assert_eq!(&output, step(&model, clone, &input(number)), "step {number}");
        }
    }
    assert!(forces > 5000, "{forces} contacts");
}
