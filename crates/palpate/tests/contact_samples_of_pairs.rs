//! Contact samples: two objects in contact at fewer points than nodes, on a released recording with a refined surface
//! (a block of 0.2 × 0.1 × 0.1 m whose lower face has 45 nodes).

use glam::{DQuat, DVec3};
use palpate::{
    Collider, Input, Model, ModelObject, ModelParameters, ObjectStart, Output, Recording, State, Twist, step,
};
use palpate_testkit::{
    GRAVITY_M_S2, energy_imbalance, floor, free_block, model_and_state, start_at, subdivided,
};
use std::sync::Arc;

const H: f64 = 1e-3;
const GRAVITY: DVec3 = DVec3::new(0.0, -GRAVITY_M_S2, 0.0);
const HALF: DVec3 = DVec3::new(0.1, 0.05, 0.05);
const ALL: usize = usize::MAX;

/// Round-off of the momentum of two objects [kg·m/s]: hundreds of sums of terms below 0.1 kg·m/s.
const MOMENTUM_ROUND_OFF: f64 = 1e-13;

/// Round-off of an energy ledger [J], and of contact forces [N]: hundreds of sums of terms below 1.
const ROUND_OFF: f64 = 1e-12;

/// Mean force between blocks of a stack over a block's weight, minus one [1]: what they still rock after 1.5 s.
const STILL_ROCKS: f64 = 5e-3;

/// Difference of forces [N] that are both solved to round-off.
const SOLVED_N: f64 = 1e-9;

/// Half the block's length less a hundredth [m]: its corners are beyond.
const AT_THE_CORNERS_M: f64 = 0.099;

fn block() -> Arc<Recording> {
    Arc::new(subdivided(&free_block(), 2))
}

fn scene(parameters: ModelParameters, body: &Arc<Recording>, starts: [ObjectStart; 2]) -> (Model, State) {
    let objects = starts.map(|start| ModelObject::new(body.clone(), start));
    model_and_state(parameters, objects.to_vec())
}

fn on_a_floor(max_contact_samples: usize) -> ModelParameters {
    let obstacles = vec![floor(0.5)];
    ModelParameters { gravity: GRAVITY, obstacles, max_contact_samples, ..ModelParameters::for_reference() }
}

fn between_objects(output: &Output) -> impl Iterator<Item = &palpate::ContactOutput> {
    output.contacts.iter().filter(|c| matches!(c.against, Collider::Object(_)))
}

#[test]
fn pairs_have_opposite_forces_and_dissipate_the_lost_energy() {
    let body = block();
    let mass = body.mass();
    let tilted = DQuat::from_euler(glam::EulerRot::XYZ, 0.3, 0.2, 0.1);
    // Face on face, half beside one another, and a corner into a face.
    let cases = [(0.0, DQuat::IDENTITY), (0.07, DQuat::from_rotation_y(0.3)), (0.02, tilted)];
    for (max_contact_samples, (beside, orientation)) in
        [ALL, 24, 12].into_iter().flat_map(|m| cases.map(|c| (m, c)))
    {
        let mut upper = start_at(DVec3::new(beside, 2.4 * HALF.y, 0.3 * beside));
        upper.pose.orientation = orientation;
        upper.pose.position.y += if orientation == tilted { 0.06 } else { 0.0 };
        upper.twist = Twist { linear: DVec3::new(0.05, -0.6, 0.02), angular: DVec3::new(0.0, 0.4, 0.1) };
        let parameters = ModelParameters { max_contact_samples, ..ModelParameters::for_reference() };
        let (model, mut state) = scene(parameters, &body, [start_at(DVec3::ZERO), upper]);
        let start = state.output().energy.stored();
        let momentum = upper.twist.linear * mass;
        let (mut most, mut unsolved) = (0, 0);
        for number in 0..800 {
            let output = step(&model, &mut state, &Input::default());
            let now: DVec3 = output.objects.iter().map(|o| o.twist.linear * mass).sum();
            assert!((now - momentum).length() < MOMENTUM_ROUND_OFF, "step {number}: {}", now - momentum);
            assert!(output.energy.stored() <= start + ROUND_OFF, "step {number}");
            let imbalance = energy_imbalance(output, start);
            assert!(imbalance.abs() < ROUND_OFF, "step {number}: {imbalance}");
            assert!(output.energy.input.abs() < ROUND_OFF, "no work from outside");
            for contact in &output.contacts {
                let normal = contact.force.dot(-contact.normal);
                let across = (contact.force + contact.normal * normal).length();
                // Scaled fallback solutions, of two whole faces that collide, may leave the cone.
                let in_the_cone = normal > -ROUND_OFF && across <= 0.5 * normal + ROUND_OFF;
                assert!(in_the_cone || output.status.unsolved_islands > 0, "{number}: {normal} {across}");
            }
            unsolved += output.status.unsolved_islands;
            most = most.max(output.contacts.len());
        }
        assert!(most > 0 && most <= max_contact_samples, "{most} of {max_contact_samples}");
        assert!(
            max_contact_samples == ALL || unsolved <= 2,
            "{max_contact_samples}, {beside}: {unsolved} unsolved"
        );
        let apart = state.output().objects[1].twist.linear.y - state.output().objects[0].twist.linear.y;
        assert!(apart > 0.0, "they fly apart: {apart}");
    }
}

#[test]
fn stack_stands_on_contact_samples() {
    // The sag against all nodes is measured on a finer body: `palpate verify places`.
    let body = block();
    let weight = body.mass() * GRAVITY_M_S2;
    // The last two by fewer contact points than nodes, or than samples on the floor and on the other block.
    let limits = [(ALL, 512), (24, 512), (12, 512), (ALL, 60), (24, 30)];
    for (most, max_contact_points) in limits {
        let starts = [1.0, 3.0].map(|k| start_at(DVec3::Y * (k * HALF.y + 1e-4)));
        let (model, mut state) =
            scene(ModelParameters { max_contact_points, ..on_a_floor(most) }, &body, starts);
        let mut carried = DVec3::ZERO;
        for number in 0..2500 {
            let output = step(&model, &mut state, &Input::default());
            // Room is shared from the step in which all have asked for it.
            assert!(
                number < 2 || output.status.dropped_contacts == 0,
                "{most}, {max_contact_points}: {number}"
            );
            if number >= 1500 {
                for contact in between_objects(output) {
                    let on_the_upper = if contact.object == 1 { contact.force } else { -contact.force };
                    carried += on_the_upper * 1e-3;
                }
            }
        }
        let output = state.output();
        let error = (carried - DVec3::Y * weight).length();
        assert!(error < STILL_ROCKS * weight, "{most}, {max_contact_points}: {carried}");
        let count = between_objects(output).count();
        assert!((most.min(max_contact_points) > 60) == (count > 24) && count <= most, "{most}: {count}");
        // Corners of the upper block are among the contacts.
        let outmost = between_objects(output).map(|c| c.point.x).fold(0.0, f64::max);
        assert!(outmost > AT_THE_CORNERS_M, "{most}: {outmost}");
    }
}

#[test]
fn overhanging_block_tips_over_as_with_all_nodes() {
    let body = block();
    for most in [ALL, 24, 12] {
        // Its centre of mass is above the other block up to half of its length.
        for (overhang, falls) in [(0.6, false), (1.1, true)] {
            let lower = start_at(DVec3::Y * HALF.y);
            let upper = start_at(DVec3::new(2.0 * HALF.x * 0.5 * overhang, 3.0 * HALF.y, 0.0));
            let (model, mut state) = scene(on_a_floor(most), &body, [lower, upper]);
            for _ in 0..1500 {
                step(&model, &mut state, &Input::default());
            }
            let height = state.output().objects[1].pose.position.y;
            assert_eq!(height < 2.4 * HALF.y, falls, "{most}, {overhang}: {height}");
        }
    }
}

#[test]
fn few_nodes_in_contact_are_not_subsampled() {
    // A corner on a face: few nodes are near, and all of them are contacts.
    let body = block();
    let corner = DQuat::from_rotation_arc(HALF.normalize(), -DVec3::Y);
    let run = |max_contact_samples: usize| {
        let mut upper = start_at(DVec3::Y * (HALF.y + HALF.length() + 1e-3));
        upper.pose.orientation = corner;
        upper.twist.linear = -DVec3::Y * 0.05;
        let parameters = ModelParameters { max_contact_samples, ..ModelParameters::for_reference() };
        let (model, mut state) = scene(parameters, &body, [start_at(DVec3::ZERO), upper]);
        (0..60)
            .map(|_| step(&model, &mut state, &Input::default()).contacts.iter().map(|c| c.force.y).sum())
            .collect::<Vec<f64>>()
    };
    let (ours, theirs) = (run(24), run(ALL));
    assert!(theirs.iter().any(|force| *force != 0.0), "they are in contact");
    // Fewer than 24 contacts.
    for (number, (a, b)) in ours.iter().zip(&theirs).enumerate() {
        assert!((a - b).abs() < SOLVED_N, "step {number}: {a} {b}");
    }
    assert!((H * ours.iter().sum::<f64>()).abs() > 0.0);
}
