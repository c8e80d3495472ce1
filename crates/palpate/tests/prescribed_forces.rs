//! Prescribed forces: momentum, work and static displacement, and agreement with hands that give the same forces.

use glam::{DMat3, DVec3};
use palpate::{
    AppliedForce, DeviceInput, DeviceMode, DeviceParameters, Grasp, Input, Model, ModelObject,
    ModelParameters, ObjectStart, RigidIntegrator, State, Twist, inertia_in_world, step,
};
use palpate_testkit::{
    GRAVITY_M_S2, fixed_block, floor, free_block, model_and_state, object_at, start_at,
    with_stiffness_damping,
};

const H: f64 = 1e-3;

/// Round-off of momentum [1], relative above 1 N·s: a thousand sums of terms below 0.1 N·s.
const MOMENTUM_ROUND_OFF: f64 = 1e-12;

/// Round-off of an energy ledger [1], relative to what moved: three thousand sums with terms of that size.
const LEDGER_ROUND_OFF: f64 = 1e-12;

/// Difference of two runs under the same forces [m]: round-off of the solver, which grows with the time while the body turns.
const SAME_RUN_M: f64 = 1e-11;

/// Remaining vibration after 60 s, and round-off [1], relative to the displacement.
const SETTLED: f64 = 1e-9;

fn grasp(triangle: u32) -> Grasp {
    palpate_testkit::grasp(0, triangle, [0.25, 0.35, 0.4])
}

fn exerting(triangle: u32, force: DVec3) -> DeviceInput {
    DeviceInput::exerting(AppliedForce { grasp: grasp(triangle), force })
}

/// A force of half a newton that changes in all directions.
fn force_at(t: f64) -> DVec3 {
    DVec3::new(0.4 * (13.0 * t).sin(), 0.3 * (5.0 * t).cos(), 0.5 * (29.0 * t).sin())
}

fn devices(count: usize, patch_radius: f64) -> ModelParameters {
    let device = DeviceParameters { patch_radius, ..DeviceParameters::default() };
    ModelParameters { devices: vec![device; count], ..ModelParameters::for_reference() }
}

/// The free block, which turns by several radians a second.
fn turning_block(parameters: ModelParameters) -> (Model, State) {
    let twist = Twist { linear: DVec3::new(0.1, 0.0, -0.2), angular: DVec3::new(4.0, -7.0, 3.0) };
    let start = ObjectStart { twist, ..start_at(DVec3::ZERO) };
    model_and_state(parameters, vec![ModelObject::new(free_block(), start)])
}

#[test]
fn force_on_a_point_or_a_patch_gives_its_momentum_and_its_work_in_every_step() {
    for patch_radius in [0.0, 0.04] {
        let (model, mut state) = turning_block(devices(2, patch_radius));
        let recording = free_block();
        let momenta = |state: &State| {
            let object = state.output().objects[0];
            let linear = object.twist.linear * recording.mass();
            let inertia = inertia_in_world(recording.inertia(), DMat3::from_quat(object.pose.orientation));
            (linear, inertia * object.twist.angular + object.pose.position.cross(linear))
        };
        let start = momenta(&state);
        let (mut given, mut turning) = (DVec3::ZERO, DVec3::ZERO);
        let mut before: Option<[DVec3; 2]> = None;
        for number in 1..=1000 {
            let t = f64::from(number) * H;
            let forces = [force_at(t), force_at(-2.0 * t)];
            let given_devices = vec![exerting(3, forces[0]), exerting(11, forces[1])];
            let input = Input { devices: given_devices, ..Input::default() };
            let output = step(&model, &mut state, &input);
            assert_eq!(output.devices[0].force_on_hand, -forces[0]);
            assert_eq!((output.status.unsolved_islands, output.status.rejected_inputs), (0, 0));
            let energy = output.energy;
            let moved = energy.input.abs() + energy.dissipated + energy.stored().abs();
            assert!(energy.defect.abs() < LEDGER_ROUND_OFF * moved, "{number}: {energy:?}");
            // Moment about the world's origin: a force acts at its point in the middle of the step.
            let at = [output.devices[0].proxy, output.devices[1].proxy];
            if let Some(before) = before {
                for ((force, at), before) in forces.into_iter().zip(at).zip(before) {
                    given += force * H;
                    turning += (0.5 * (at + before)).cross(force) * H;
                }
            } else {
                let (linear, angular) = momenta(&state);
                (given, turning) = (linear - start.0, angular - start.1);
            }
            before = Some(at);
        }
        let (linear, angular) = momenta(&state);
        let scale = given.length().max(1.0);
        assert!((linear - start.0 - given).length() < MOMENTUM_ROUND_OFF * scale, "{linear} {given}");
        let scale = turning.length().max(1.0);
        assert!((angular - start.1 - turning).length() < MOMENTUM_ROUND_OFF * scale, "{angular} {turning}");
        assert!(state.output().energy.input > 1e-3, "the forces work");
    }
}

#[test]
fn forces_of_hands_prescribed_give_the_same_motion_in_flight_and_on_a_floor() {
    for obstacles in [Vec::new(), vec![floor(0.5)]] {
        let parameters = ModelParameters {
            gravity: DVec3::Y * -GRAVITY_M_S2,
            obstacles: obstacles.clone(),
            ..devices(2, 0.0)
        };
        let objects = || vec![object_at(&free_block(), DVec3::Y * 0.051, DVec3::ZERO)];
        let (model, mut held) = model_and_state(parameters.clone(), objects());
        let (_, mut pushed) = model_and_state(parameters, objects());
        let surface = &free_block().surface;
        let rest = [3, 11].map(|triangle| surface.rest_position(&grasp(triangle).point) + DVec3::Y * 0.051);
        let mut worst = 0.0_f64;
        for number in 1..=300 {
            let t = f64::from(number) * H;
            let sway = DVec3::new(0.004 * (9.0 * t).sin(), 0.05 * t * t, 0.002 * (25.0 * t).sin());
            let hold =
                |at: usize, triangle| DeviceInput::held(rest[at] + sway * (1.0 + at as f64), grasp(triangle));
            let input = Input { devices: vec![hold(0, 3), hold(1, 11)], ..Input::default() };
            let output = step(&model, &mut held, &input);
            let push = |at: usize, triangle| exerting(triangle, -output.devices[at].force_on_hand);
            let input = Input { devices: vec![push(0, 3), push(1, 11)], ..Input::default() };
            let (expected, contacts) = (output.devices.clone(), output.contacts.len());
            let output = step(&model, &mut pushed, &input);
            for (device, expected) in output.devices.iter().zip(&expected) {
                worst = worst.max((device.proxy - expected.proxy).length());
            }
            assert_eq!(output.contacts.len(), contacts, "{number}");
        }
        let tolerance = if obstacles.is_empty() { SAME_RUN_M } else { ON_A_FLOOR_M };
        assert!(worst < tolerance, "{worst}");
        let [a, b] = [&held, &pushed].map(|state| state.output().energy);
        let weight = free_block().mass() * GRAVITY_M_S2;
        assert!((a.input - b.input).abs() < tolerance * weight, "{a:?} {b:?}");
    }
}

/// Difference of two runs on a floor [m]: the contacts' tolerance, 10⁻⁸ of the block's radius, in three hundred steps.
const ON_A_FLOOR_M: f64 = 300.0 * 1e-8 * 0.12 * 4.0;

#[test]
fn constant_force_displaces_a_fixed_body_by_its_static_compliance() {
    let recording = with_stiffness_damping(&fixed_block(), 1e-2);
    let (model, mut state) =
        model_and_state(devices(1, 0.0), vec![ModelObject::new(recording.clone(), start_at(DVec3::ZERO))]);
    let (point, force) = (grasp(11).point, DVec3::new(0.02, -0.05, 0.03));
    let input = Input { devices: vec![exerting(11, force)], ..Input::default() };
    (0..60_000).for_each(|_| {
        step(&model, &mut state, &input);
    });
    // Second route: J·(Φ·Λ⁻¹·Φᵀ + S)·Jᵀ·f, without time integration.
    let corners = recording.surface.corners(&point);
    let mut expected = DVec3::ZERO;
    for (i, wi) in corners {
        for (j, wj) in corners {
            let mut block = recording.residual.block(i, j);
            for (mode, omega) in recording.modes.angular_frequencies.iter().enumerate() {
                let shape = |node: usize| {
                    DVec3::from_array([0, 1, 2].map(|axis| recording.modes.row(node, axis)[mode]))
                };
                let (a, b) = (shape(i), shape(j) / (omega * omega));
                block += DMat3::from_cols(a * b.x, a * b.y, a * b.z);
            }
            expected += block * force * (wi * wj);
        }
    }
    let moved = state.output().devices[0].proxy - recording.surface.rest_position(&point);
    assert!((moved - expected).length() < SETTLED * expected.length(), "{moved} {expected}");
    let energy = state.output().energy;
    assert!(energy.defect.abs() < LEDGER_ROUND_OFF * energy.dissipated, "{energy:?}");
    let stored = energy.elastic + energy.residual;
    assert!((stored / (0.5 * force.dot(moved)) - 1.0).abs() < SETTLED, "{energy:?}");
}

#[test]
fn force_is_not_scaled_where_a_hand_cannot_be_met() {
    let (model, mut state) = turning_block(devices(2, 0.0));
    let rest = free_block().surface.rest_position(&grasp(3).point);
    let hold = |position| DeviceInput::held(position, grasp(3));
    let push = exerting(11, DVec3::X);
    step(&model, &mut state, &Input { devices: vec![hold(rest), push], ..Input::default() });
    let before = state.output().objects[0].twist.linear;
    let far = rest + DVec3::new(3e6, 4e6, 5e5);
    let output = step(&model, &mut state, &Input { devices: vec![hold(far), push], ..Input::default() });
    assert_eq!((output.status.unsolved_islands, output.devices[0].force_on_hand), (1, DVec3::ZERO));
    let gained = (output.objects[0].twist.linear - before) * free_block().mass();
    assert!((gained - DVec3::X * H).length() < MOMENTUM_ROUND_OFF, "{gained}");
}

#[test]
fn force_comes_and_goes_and_one_that_is_no_number_is_rejected() {
    let (model, mut state) = turning_block(devices(1, 0.04));
    let (_, mut free) = turning_block(devices(1, 0.04));
    let none = DeviceInput::inactive();
    let one = |device| Input { devices: vec![device], ..Input::default() };
    for number in 0..60 {
        let device = match number / 10 % 3 {
            0 => exerting(3, DVec3::ZERO),
            1 => none,
            _ => DeviceInput {
                mode: DeviceMode::Force(AppliedForce { grasp: grasp(5), force: DVec3::NAN }),
                ..none
            },
        };
        let output = step(&model, &mut state, &one(device));
        assert_eq!(output.status.rejected_inputs, u32::from(number / 10 % 3 == 2), "{number}");
        assert_eq!(output.devices[0].force_on_hand, DVec3::ZERO);
    }
    (0..60).for_each(|_| {
        step(&model, &mut free, &one(none));
    });
    let [a, b] = [&state, &free].map(|state| state.output().objects[0].pose);
    assert!((a.position - b.position).length() < SAME_RUN_M, "{a:?} {b:?}");
    assert!(a.orientation.angle_between(b.orientation) < 1e-7, "{a:?} {b:?}");
}

#[test]
fn semi_implicit_euler_takes_the_whole_force_too() {
    let parameters = ModelParameters { motion: RigidIntegrator::Paper, ..devices(1, 0.0) };
    let (model, mut state) = turning_block(parameters);
    let before = state.output().objects[0].twist.linear;
    let force = DVec3::new(0.1, 0.2, 0.3);
    let output = step(&model, &mut state, &Input { devices: vec![exerting(3, force)], ..Input::default() });
    let gained = (output.objects[0].twist.linear - before) * free_block().mass();
    assert!((gained - force * H).length() < MOMENTUM_ROUND_OFF, "{gained}");
}
