//! Objects that begin inside obstacles and each other, on a released recording (a block of 0.2 × 0.1 × 0.1 m).

use glam::{DQuat, DVec3};
use palpate::{
    Input, ModelObject, ModelParameters, ObjectStart, Obstacle, Output, Pose, Shape, State, Twist, step,
};
use palpate_testkit::{GRAVITY_M_S2, floor, free_block, model_and_state, object_at, start_at};

const GRAVITY: DVec3 = DVec3::new(0.0, -GRAVITY_M_S2, 0.0);

/// Time constant of depenetration [s].
const TIME_CONSTANT_S: f64 = 0.02;

/// Relative difference of forces that two runs agree within [1]: the solver's tolerance of 1e-8 of the size, over its penetration.
const SOLVED: f64 = 1e-6;

/// Round-off of an energy ledger [J]: thousands of sums of terms below 1 J.
const LEDGER_ROUND_OFF_J: f64 = 1e-12;

/// Penetration that stays [m]: the solver's loose tolerance, 1e-5 of the block's radius, and what its tolerance lets in.
const SLOP_M: f64 = 2e-6;

/// Penetration of the block beside [m]: contact acts from the first step, and it stays deeper than the slop for 130 steps.
const SHALLOW_M: f64 = 1e-3;

/// Steps in which both blocks are deeper than the slop, within which contacts push as well.
const DEEP_STEPS: usize = 120;

fn penetration(output: &Output) -> f64 {
    output.objects.iter().map(|object| object.penetration_m).fold(0.0, f64::max)
}

/// Lowest point of the block in an orientation, from its centre of mass [m].
fn lowest(turn: DQuat) -> f64 {
    free_block().surface.positions.iter().map(|p| (turn * *p).y).fold(f64::INFINITY, f64::min)
}

fn block_in_floor(depth: f64) -> (palpate::Model, State) {
    let parameters =
        ModelParameters { gravity: GRAVITY, obstacles: vec![floor(0.4)], ..ModelParameters::for_reference() };
    let start = start_at(DVec3::Y * (-lowest(DQuat::IDENTITY) - depth));
    model_and_state(parameters, vec![ModelObject::new(free_block(), start)])
}

#[test]
fn block_in_a_floor_comes_out_and_feels_as_one_on_it() {
    // Its forces, deformation and velocity are those of a block that begins 1 mm inside; its height approaches that one's.
    let weight = free_block().mass() * GRAVITY_M_S2;
    let (on_model, mut on) = block_in_floor(SHALLOW_M);
    for depth in [0.002, 0.01, 0.03] {
        let (model, mut state) = block_in_floor(depth);
        on.clone_from(&State::new(&on_model));
        let mut left = depth - SHALLOW_M;
        for number in 1..=DEEP_STEPS {
            let (out, beside) = (
                step(&model, &mut state, &Input::default()).clone(),
                step(&on_model, &mut on, &Input::default()).clone(),
            );
            let force = |output: &Output| output.contacts.iter().map(|c| c.force).sum::<DVec3>();
            assert!(
                (force(&out) - force(&beside)).length() < SOLVED * weight,
                "{depth} m, step {number}: {} for {}",
                force(&out),
                force(&beside)
            );
            let speed = (out.objects[0].twist.linear - beside.objects[0].twist.linear).length();
            assert!(speed < SOLVED, "step {number}: {speed} m/s from nowhere");
            left *= 1.0 - 1e-3 / TIME_CONSTANT_S;
            let below = beside.objects[0].pose.position.y - out.objects[0].pose.position.y;
            assert!((below - left).abs() < SLOP_M, "{depth} m, step {number}: {below} m for {left} m");
            let lifted = weight * (depth - SHALLOW_M - below) + beside.energy.input;
            let energy = &out.energy;
            assert!((energy.input - lifted).abs() < LEDGER_ROUND_OFF_J, "{} J for {lifted} J", energy.input);
            assert!(energy.defect.abs() < LEDGER_ROUND_OFF_J, "{energy:?}");
        }
        for _ in DEEP_STEPS..1000 {
            let energy = step(&model, &mut state, &Input::default()).energy;
            assert!(energy.defect.abs() < LEDGER_ROUND_OFF_J, "{energy:?}");
        }
        assert!(penetration(state.output()) < SLOP_M, "{}", penetration(state.output()));
    }
}

#[test]
fn what_overlaps_in_weightlessness_parts_without_velocity_or_energy() {
    // Two blocks, the second 3 mm inside the first, and a block 5 mm inside a box, turned so that it goes out by a corner.
    let body = free_block();
    let pair = || {
        vec![
            object_at(&body, DVec3::ZERO, DVec3::ZERO),
            object_at(&body, DVec3::new(0.197, 0.01, 0.02), DVec3::ZERO),
        ]
    };
    let parted = part(ModelParameters::for_reference(), pair());
    let centre = 0.5 * (parted.objects[0].pose.position + parted.objects[1].pose.position);
    assert!(
        (centre - DVec3::new(0.0985, 0.005, 0.01)).length() < SLOP_M,
        "the centre of mass stays: {centre}"
    );

    let turn = DQuat::from_rotation_z(0.7) * DQuat::from_rotation_x(0.5);
    let position = DVec3::Y * (0.02 - lowest(turn) - 0.005);
    let start = ObjectStart { pose: Pose { position, orientation: turn }, twist: Twist::ZERO };
    let table = Obstacle {
        shape: Shape::Box { half_extents: DVec3::new(0.5, 0.02, 0.5) },
        pose: Pose::IDENTITY,
        friction: 0.5,
    };
    let parameters = ModelParameters { obstacles: vec![table], ..ModelParameters::for_reference() };
    let out = part(parameters, vec![ModelObject::new(body.clone(), start)]);
    let moved = out.objects[0].pose.position - position;
    assert!((moved - DVec3::Y * 0.005).length() < SLOP_M, "straight up by its depth: {moved}");
}

/// Output after half a second of a weightless scene in which nothing may begin to move.
fn part(parameters: ModelParameters, objects: Vec<ModelObject>) -> Output {
    let (model, mut state) = model_and_state(parameters, objects);
    let begins = penetration(step(&model, &mut state, &Input::default()));
    assert!(begins > 0.001, "they overlap by {begins} m");
    for _ in 0..500 {
        let output = step(&model, &mut state, &Input::default());
        for object in &output.objects {
            assert!(object.twist.linear.length() < SOLVED && object.twist.angular.length() < SOLVED);
        }
        let energy = &output.energy;
        assert!(energy.stored().abs().max(energy.input.abs()) < LEDGER_ROUND_OFF_J, "{energy:?}");
    }
    let output = state.output().clone();
    assert!(penetration(&output) < SLOP_M, "{}", penetration(&output));
    output
}
