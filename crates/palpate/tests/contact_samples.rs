//! Contact samples: faces against obstacles at fewer contacts than nodes, on a released recording with a refined surface
//! (a block of 0.2 × 0.1 × 0.1 m whose lower face has 45 nodes).

use glam::{DQuat, DVec3};
use palpate::{
    Collider, ContactOutput, DeviceInput, Input, Model, ModelObject, ModelParameters, ObjectStart, Obstacle,
    Pose, Recording, Shape, State, Twist, step,
};
use palpate_testkit::{
    GRAVITY_M_S2, energy_imbalance, finger, floor, free_block, model_and_state, object_at, subdivided,
    with_stiffness_damping,
};
use std::sync::Arc;

const H: f64 = 1e-3;
const GRAVITY: DVec3 = DVec3::new(0.0, -GRAVITY_M_S2, 0.0);

/// Mean force on a block at rest over its weight, minus one [1]: what it still rocks after 5 s.
const STILL_ROCKS: f64 = 1e-3;

/// Round-off of an energy ledger [J]: thousands of sums of terms below 1 J.
const LEDGER_ROUND_OFF_J: f64 = 1e-12;

/// Round-off of a momentum [kg·m/s]: thousands of sums of terms below 1 kg·m/s.
const MOMENTUM_ROUND_OFF: f64 = 1e-12;

/// Relative round-off of contact forces and of what follows from them [1]: the solver keeps nine digits.
const SOLVED: f64 = 1e-9;

/// Half the block's length less a hundredth [m]: its corners are beyond.
const AT_THE_CORNERS_M: f64 = 0.099;

/// Relative difference of the forces of a grip with room for few contact points and for all [1]; where the first ones take it all, the
/// block slips out.
const GRIP: f64 = 0.02;

fn block() -> Arc<Recording> {
    Arc::new(subdivided(&free_block(), 2))
}

fn on_a_floor(recording: &Arc<Recording>, max_contact_samples: usize, pose: Pose) -> (Model, State) {
    let parameters = ModelParameters {
        gravity: GRAVITY,
        obstacles: vec![floor(0.4)],
        max_contact_samples,
        ..ModelParameters::for_reference()
    };
    let start = ObjectStart { pose, twist: Twist::ZERO };
    model_and_state(parameters, vec![ModelObject::new(recording.clone(), start)])
}

fn at(position: DVec3) -> Pose {
    Pose { position, ..Pose::IDENTITY }
}

#[test]
fn block_rests_on_contact_samples_as_on_all_nodes() {
    let recording = block();
    let weight = recording.mass() * GRAVITY_M_S2;
    for most in [usize::MAX, 24, 12] {
        let (model, mut state) = on_a_floor(&recording, most, at(DVec3::Y * 0.0502));
        let mut force = DVec3::ZERO;
        for number in 0..6000 {
            let output = step(&model, &mut state, &Input::default());
            // Samples, and at most twice as many nodes between them.
            assert!(output.contacts.len() <= most.saturating_mul(3).min(45));
            if number >= 5000 {
                force += output.contacts.iter().map(|c| c.force).sum::<DVec3>() * 1e-3;
            }
        }
        let output = state.output();
        assert!((force - DVec3::Y * weight).length() < STILL_ROCKS * weight, "{most}: {force}");
        // Its corners are among the contacts.
        let pose = output.objects[0].pose;
        let outmost = |side: f64| {
            output.contacts.iter().map(|c| side * (c.point.x - pose.position.x)).fold(0.0, f64::max)
        };
        assert!(outmost(1.0) > AT_THE_CORNERS_M && outmost(-1.0) > AT_THE_CORNERS_M, "{most}");
        assert!((most == usize::MAX) == (output.contacts.len() > 24), "{}", output.contacts.len());
    }
}

#[test]
fn contact_samples_carry_the_change_of_momentum_and_dissipate_the_lost_energy() {
    let recording = block();
    let mass = recording.mass();
    let turn = DQuat::from_euler(glam::EulerRot::XYZ, 0.4, 0.3, 0.8);
    for pose in [at(DVec3::Y * 0.054), Pose { position: DVec3::Y * 0.14, orientation: turn }] {
        let (model, mut state) = on_a_floor(&recording, 24, pose);
        let stored = state.output().energy.stored();
        let (mut momentum, mut most) = (DVec3::ZERO, 0);
        for number in 0..2500 {
            let output = step(&model, &mut state, &Input::default());
            let force: DVec3 = output.contacts.iter().map(|c| c.force).sum();
            momentum += (force + GRAVITY * mass) * H;
            let error = (output.objects[0].twist.linear * mass - momentum).length();
            assert!(error < MOMENTUM_ROUND_OFF, "step {number}: {error}");
            for contact in &output.contacts {
                let normal = contact.force.dot(-contact.normal);
                let across = (contact.force + contact.normal * normal).length();
                assert!(
                    normal > 0.0 && across <= 0.4 * normal * (1.0 + SOLVED),
                    "in the cone: {number} {normal} {across} {:?}",
                    output.status
                );
            }
            assert!(output.energy.stored() <= stored + LEDGER_ROUND_OFF_J, "step {number}");
            let imbalance = energy_imbalance(output, stored);
            assert!(imbalance.abs() < LEDGER_ROUND_OFF_J, "step {number}: {imbalance}");
            most = most.max(output.contacts.len());
        }
        assert!((8..=24).contains(&most), "{most}");
    }
}

#[test]
fn contact_samples_give_no_energy_to_obstacles_of_any_size() {
    let recording = block();
    let shapes = [
        Shape::Sphere { radius: 0.3 },
        Shape::Sphere { radius: 0.01 },
        Shape::Box { half_extents: DVec3::new(0.2, 0.02, 0.2) },
        Shape::Capsule { radius: 0.03, half_length: 0.2 },
    ];
    let obstacles: Vec<Obstacle> =
        shapes.into_iter().map(|shape| Obstacle { shape, pose: Pose::IDENTITY, friction: 0.7 }).collect();
    let parameters = ModelParameters {
        obstacles,
        devices: vec![finger(0.01, 0.03, 0.5)],
        max_contact_samples: 8,
        ..ModelParameters::for_reference()
    };
    let (model, mut state) =
        model_and_state(parameters, vec![object_at(&recording, DVec3::ZERO, DVec3::ZERO)]);
    let mut most = [0; 4];
    for number in 0..12_000_u32 {
        let t = f64::from(number) * H;
        let centre = state.output().objects[0].pose.position;
        // Obstacles approach from all sides, press and retreat, one or two at a time.
        let obstacles = (0..4).map(|k| {
            let phase = t * (1.1 + 0.37 * f64::from(k)) + f64::from(k);
            let direction = DVec3::new((3.1 * phase).sin(), (2.3 * phase).cos(), (1.7 * phase).sin());
            let distance = [0.36, 0.09, 0.12, 0.1][k as usize] + 0.06 * (5.0 * phase).sin().max(-0.4);
            let orientation = DQuat::from_rotation_arc(DVec3::Y, direction.normalize());
            Pose { position: centre + direction.normalize() * distance, orientation }
        });
        let device = DeviceInput::touching(centre + DVec3::new(0.1 * (7.0 * t).sin(), 0.11, 0.0));
        let input = Input { obstacles: obstacles.collect(), devices: vec![device], ..Input::default() };
        let output = step(&model, &mut state, &input);
        let energy = &output.energy;
        assert!(
            energy.stored() <= energy.input + SOLVED * (1.0 + energy.input.abs()),
            "{number}: {energy:?}"
        );
        assert!(energy.stored().is_finite() && output.objects[0].pose.position.is_finite());
        for (k, most) in most.iter_mut().enumerate() {
            let is_its = |c: &&ContactOutput| c.against == Collider::Obstacle(k);
            *most = (*most).max(output.contacts.iter().filter(is_its).count());
        }
    }
    assert!(most.iter().all(|most| *most > 0), "{most:?}");
}

/// Forces [N] of two boxes that grip the block, which stands on a smooth floor, and the number of steps in which contacts found no room.
fn grip(max_contact_samples: usize, max_contact_points: usize) -> ([f64; 2], usize) {
    const HALF_LENGTH_M: f64 = 0.1;
    const HALF_BOX_M: f64 = 0.05;
    const DAMPING_S: f64 = 2e-3;
    const PRESSED_M: f64 = 16e-3;
    let recording = Arc::new(subdivided(&with_stiffness_damping(&free_block(), DAMPING_S), 3));
    let shape = Shape::Box { half_extents: DVec3::splat(HALF_BOX_M) };
    let beside = |side: f64| at(DVec3::new(side * (HALF_LENGTH_M + HALF_BOX_M), HALF_BOX_M, 0.0));
    let jaws = [-1.0, 1.0].map(|side| Obstacle { shape: shape.clone(), pose: beside(side), friction: 0.5 });
    let parameters = ModelParameters {
        gravity: GRAVITY,
        obstacles: [vec![floor(0.0)], jaws.to_vec()].concat(),
        max_contact_samples,
        max_contact_points,
        ..ModelParameters::for_reference()
    };
    let object = object_at(&recording, DVec3::Y * HALF_BOX_M, DVec3::ZERO);
    let (model, mut state) = model_and_state(parameters, vec![object]);
    let mut poses = vec![Pose::IDENTITY, beside(-1.0), beside(1.0)];
    let mut dropping_steps = 0;
    for number in 1..=400 {
        let pressed = PRESSED_M * (f64::from(number) / 200.0).min(1.0);
        for (pose, side) in poses[1..].iter_mut().zip([-1.0, 1.0]) {
            pose.position.x = side * (HALF_LENGTH_M + HALF_BOX_M - pressed);
        }
        let output = step(&model, &mut state, &Input { obstacles: poses.clone(), ..Input::default() });
        dropping_steps += usize::from(output.status.dropped_contacts > 0);
    }
    let jaw = |number: usize| {
        let contacts =
            state.output().contacts.iter().filter(move |c| c.against == Collider::Obstacle(number));
        contacts.map(|c| c.force.x.abs()).sum::<f64>()
    };
    ([jaw(1), jaw(2)], dropping_steps)
}

#[test]
fn planes_and_boxes_share_the_contact_points_of_an_object() {
    // By all nodes, and by samples with all nodes between them that are too deep, there are more contacts than room.
    let (expected, dropping_steps) = grip(48, 1024);
    assert_eq!(dropping_steps, 0);
    for (samples, points) in [(48, 120), (48, 88), (48, 56), (usize::MAX, 300)] {
        let (got, dropping_steps) = grip(samples, points);
        // Room is shared from the step on in which all have asked for it.
        assert!(dropping_steps <= 1, "{samples}, {points}: contacts without room in {dropping_steps} steps");
        for (got, expected) in got.into_iter().zip(expected) {
            assert!(
                (got - expected).abs() < GRIP * expected,
                "{samples}, {points}: {got} N for {expected} N"
            );
        }
    }
}
