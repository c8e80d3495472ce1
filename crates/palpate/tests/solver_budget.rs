//! Budget of the contact solver: what it leaves out gives no energy and is reported, and what rests is carried.

use glam::{DQuat, DVec3};
use palpate::{Input, Model, ModelParameters, Output, State, step};
use palpate_testkit::{
    GRAVITY_M_S2, energy_imbalance, finger, floor, free_block, half_extent, model_and_state, object_at,
    touching,
};

/// Small share of an energy [1]: round-off of some thousand steps.
const ROUND_OFF: f64 = 1e-9;

/// Two blocks that fall on a floor, the upper one askew, with a finger, under a budget of the solver.
fn tower(solver_budget: u64) -> (Model, State) {
    let block = free_block();
    let half = half_extent(&block, 1);
    let mut upper = object_at(&block, DVec3::Y * (3.2 * half), DVec3::X * 0.2);
    upper.start.pose.orientation = DQuat::from_rotation_z(0.3);
    let parameters = ModelParameters {
        gravity: DVec3::Y * -GRAVITY_M_S2,
        obstacles: vec![floor(0.5)],
        devices: vec![finger(0.1 * half, 0.1 * half, 0.5)],
        max_contact_samples: 12,
        solver_budget,
        ..ModelParameters::for_reference()
    };
    model_and_state(parameters, vec![object_at(&block, DVec3::Y * (1.01 * half), DVec3::ZERO), upper])
}

/// Run with a finger that strikes the upper block time and again. Gives the outputs of all steps.
fn run(solver_budget: u64, steps: u32) -> Vec<Output> {
    let (model, mut state) = tower(solver_budget);
    let half = half_extent(&free_block(), 1);
    let at = |number: u32| {
        let share = 0.5 - 0.5 * (f64::from(number) * 0.05).cos();
        DVec3::new(-3.0 * half + 2.0 * half * share, 3.0 * half, 0.0)
    };
    (0..steps).map(|number| step(&model, &mut state, &touching(&[at(number)])).clone()).collect()
}

#[test]
fn a_large_budget_changes_nothing() {
    for (with, without) in run(1_000_000, 300).iter().zip(run(u64::MAX, 300)) {
        assert_eq!(with.status.islands_out_of_budget, 0);
        assert_eq!(*with, without);
    }
}

#[test]
fn a_small_budget_is_reported_and_gives_no_energy() {
    let mut out_of_budget = 0;
    let outputs = run(300, 2000);
    let stored = outputs[0].energy.stored() - (outputs[0].energy.input - outputs[0].energy.lost());
    for output in &outputs {
        let energy = &output.energy;
        let scale = energy.kinetic + energy.elastic + energy.input.abs() + energy.lost();
        out_of_budget += output.status.islands_out_of_budget;
        assert!(energy_imbalance(output, stored).abs() < ROUND_OFF * scale, "{energy:?}");
        assert!(energy.friction >= -ROUND_OFF * scale, "{energy:?}");
        assert!(energy.lost() >= -ROUND_OFF * scale, "{energy:?}");
    }
    assert!(out_of_budget > 100, "{out_of_budget} islands");
}

#[test]
fn a_block_at_rest_is_carried_on_a_small_budget() {
    let block = free_block();
    let half = half_extent(&block, 1);
    let parameters = ModelParameters {
        gravity: DVec3::Y * -GRAVITY_M_S2,
        obstacles: vec![floor(0.5)],
        solver_budget: 1,
        ..ModelParameters::for_reference()
    };
    let (model, mut state) =
        model_and_state(parameters, vec![object_at(&block, DVec3::Y * half, DVec3::ZERO)]);
    let weight = block.mass() * GRAVITY_M_S2;
    let (mut sum, mut lowest) = (0.0, f64::INFINITY);
    let (settling, steps) = (1000, 500);
    for number in 0..settling + steps {
        let output = step(&model, &mut state, &Input::default());
        let force: f64 = output.contacts.iter().map(|contact| contact.force.y).sum();
        sum += if number >= settling { force / f64::from(steps) } else { 0.0 };
        lowest = lowest.min(output.objects[0].pose.position.y);
    }
    assert!((sum / weight - 1.0).abs() < 0.01, "{sum} N for {weight} N");
    assert!(lowest > 0.9 * half, "it sank to {lowest} m of {half} m");
}
