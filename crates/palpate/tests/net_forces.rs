//! Net forces and torques on objects, planes and obstacles: sums over contacts, action and reaction, change of momentum.

use glam::{DQuat, DVec3};
use palpate::{
    AppliedForce, Clamp, Collider, DeviceInput, Input, Model, ModelParameters, Obstacle, ObstacleOutput,
    Output, Pose, Shape, State, step,
};
use palpate_testkit::{
    GRAVITY_M_S2, finger, floor, free_block, grasp, half_extent, model_and_state, object_at,
    with_stiffness_damping,
};

const H: f64 = 1e-3;
const GRAVITY: DVec3 = DVec3::new(0.0, -GRAVITY_M_S2, 0.0);

/// Round-off of sums over some dozen contacts [1], relative to the sum of their sizes.
const ROUND_OFF: f64 = 1e-13;

/// Round-off of a momentum that a few hundred steps change [1].
const MOMENTUM_ROUND_OFF: f64 = 1e-11;

/// Force of a block at rest against its weight [1]: it falls asleep while it still rocks a little.
const AT_REST: f64 = 1e-2;

/// Net forces on objects and obstacles by summing the contacts of an output: (force, torque) about the poses given.
fn summed(output: &Output, of: Collider, origin: DVec3) -> (DVec3, DVec3, f64) {
    let (mut force, mut torque, mut size) = (DVec3::ZERO, DVec3::ZERO, 1e-9);
    for contact in &output.contacts {
        let sign = if of == Collider::Object(contact.object) { 1.0 } else { -1.0 };
        if sign > 0.0 || contact.against == of {
            force += sign * contact.force;
            torque += (contact.point - origin).cross(sign * contact.force);
            size += contact.force.length();
        }
    }
    (force, torque, size)
}

/// Check that nets are the sums over contacts, and that forces and moments of all parts balance.
fn check_sums(output: &Output, obstacles: &[Pose]) {
    for (number, object) in output.objects.iter().enumerate() {
        let (force, torque, size) = summed(output, Collider::Object(number), object.pose.position);
        assert!((object.force - force).length() < ROUND_OFF * size, "{object:?} {force}");
        assert!((object.torque - torque).length() < ROUND_OFF * size, "{object:?} {torque}");
    }
    for (number, (obstacle, pose)) in output.obstacles.iter().zip(obstacles).enumerate() {
        let (force, torque, size) = summed(output, Collider::Obstacle(number), pose.position);
        assert!((obstacle.force - force).length() < ROUND_OFF * size, "{obstacle:?} {force}");
        assert!((obstacle.torque - torque).length() < ROUND_OFF * size, "{obstacle:?} {torque}");
    }
}

#[test]
fn a_plane_carries_the_weight_of_a_block_awake_and_asleep() {
    let block = with_stiffness_damping(&free_block(), 1e-3);
    let half = half_extent(&block, 1);
    // The plane's frame is beside the block.
    let plane = Pose { position: DVec3::new(0.3, 0.0, -0.1), ..Pose::IDENTITY };
    let parameters = ModelParameters {
        gravity: GRAVITY,
        obstacles: vec![Obstacle { pose: plane, ..floor(0.5) }],
        ..ModelParameters::default()
    };
    let at = DVec3::new(0.02, 1.001 * half, 0.01);
    let (model, mut state) = model_and_state(parameters, vec![object_at(&block, at, DVec3::ZERO)]);
    let weight = block.mass() * GRAVITY;
    let mut asleep = None;
    for _ in 0..3000 {
        let output = step(&model, &mut state, &Input::default());
        check_sums(output, &[plane]);
        if output.objects[0].is_asleep {
            let before = asleep.get_or_insert_with(|| output.clone());
            assert_eq!((&before.objects, &before.obstacles), (&output.objects, &output.obstacles));
        }
    }
    assert!(asleep.is_some(), "it stays awake");
    let output = state.output();
    let (object, carried) = (output.objects[0], output.obstacles[0]);
    assert!((object.force + weight).length() < AT_REST * weight.length(), "{object:?}");
    assert!((carried.force - weight).length() < AT_REST * weight.length(), "{carried:?}");
    // No torque about the centre of mass; on the plane that of the weight there.
    let size = weight.length() * half;
    assert!(object.torque.length() < AT_REST * size, "{object:?}");
    let lever = object.pose.position - plane.position;
    assert!(
        (carried.torque - lever.cross(weight)).length() < AT_REST * weight.length() * lever.length(),
        "{carried:?}"
    );
    // Gravity that changes wakes it, and the sums go on.
    let ObstacleOutput { force, .. } = carried;
    let _ = step(&model, &mut state, &Input { gravity: Some(1.01 * GRAVITY), ..Input::default() });
    let output = state.output();
    check_sums(output, &[plane]);
    assert!(!output.objects[0].is_asleep && output.obstacles[0].force != force);
}

/// Two stacked blocks on a floor, a moving box and a finger.
fn pile() -> (Model, State) {
    let block = free_block();
    let half = half_extent(&block, 1);
    let side = half_extent(&block, 0);
    let parameters = ModelParameters {
        gravity: GRAVITY,
        obstacles: vec![
            floor(0.4),
            Obstacle {
                shape: Shape::Box { half_extents: DVec3::splat(0.03) },
                pose: Pose { position: DVec3::new(side + 0.032, half, 0.01), ..Pose::IDENTITY },
                friction: 0.3,
            },
        ],
        devices: vec![finger(0.01, 0.02, 0.6)],
        ..ModelParameters::for_reference()
    };
    let at = |x: f64, y: f64| object_at(&block, DVec3::new(x, y * half, 0.0), DVec3::ZERO);
    model_and_state(parameters, vec![at(0.0, 1.001), at(0.02, 3.003)])
}

#[test]
fn action_is_reaction_between_objects_obstacles_and_a_finger() {
    let (model, mut state) = pile();
    let start = model.parameters().obstacles[1].pose;
    let (masses, half): (Vec<f64>, f64) =
        (model.recordings().map(|recording| recording.mass()).collect(), half_extent(&free_block(), 1));
    let (mut pressed, mut pushed, mut turned) = (0.0_f64, 0.0_f64, 0.0_f64);
    for number in 1..=400 {
        let t = f64::from(number) * H;
        let moved = Pose {
            position: start.position - DVec3::X * 0.1 * t,
            orientation: DQuat::from_rotation_z(0.4 * t),
        };
        let hand = DVec3::new(0.05, 4.004 * half + 0.012 - 0.04 * t.min(0.2), 0.02 * t);
        let input = Input {
            devices: vec![DeviceInput::touching(hand)],
            obstacles: vec![Pose::IDENTITY, moved],
            ..Input::default()
        };
        let before: Vec<DVec3> = state.output().objects.iter().map(|object| object.twist.linear).collect();
        let output = step(&model, &mut state, &input);
        check_sums(output, &[Pose::IDENTITY, moved]);
        // Forces of all parts, and their moments about one point, are zero in sum.
        let hand_force = output.devices[0].force_on_hand;
        let tip = output.contacts.iter().filter(|contact| contact.against == Collider::Device(0));
        let mut sums = (hand_force, DVec3::ZERO, hand_force.length() + 1e-9);
        sums.1 -= tip.map(|contact| contact.point.cross(contact.force)).sum::<DVec3>();
        let objects = output.objects.iter().map(|own| (own.force, own.torque, own.pose.position));
        let poses = [DVec3::ZERO, moved.position];
        let obstacles = output.obstacles.iter().zip(poses).map(|(own, at)| (own.force, own.torque, at));
        for (force, torque, at) in objects.chain(obstacles) {
            sums = (sums.0 + force, sums.1 + torque + at.cross(force), sums.2 + force.length());
        }
        assert!(sums.0.length() + sums.1.length() < ROUND_OFF * sums.2, "step {number}: {sums:?}");
        // The net force is the change of momentum less the weight.
        for ((object, before), mass) in output.objects.iter().zip(before).zip(&masses) {
            let change = (object.twist.linear - before) * *mass / H;
            let size = change.length() + object.force.length() + mass * GRAVITY_M_S2;
            assert!(
                (change - object.force - *mass * GRAVITY).length() < MOMENTUM_ROUND_OFF * size,
                "step {number}"
            );
        }
        pressed = pressed.max(hand_force.length());
        pushed = pushed.max(output.obstacles[1].force.length());
        turned = turned.max(output.objects[1].torque.length());
    }
    assert!(pressed > 1.0 && pushed > 1.0 && turned > 1e-2, "{pressed} {pushed} {turned}");
}

#[test]
fn hands_clamps_and_prescribed_forces_are_in_the_net_force() {
    let block = free_block();
    let surface = &block.surface;
    let is_end =
        |t: &u32| surface.triangles[*t as usize].iter().all(|n| surface.positions[*n as usize].x > 0.0999);
    let end: Vec<u32> = (0..surface.triangles.len() as u32).filter(is_end).collect();
    let frame = Pose { position: DVec3::X * 0.1, ..Pose::IDENTITY };
    let (held, _) = surface.nearest(DVec3::new(-0.1, 0.02, 0.0)).expect("a surface");
    let (loaded, _) = surface.nearest(DVec3::new(0.0, 0.05, 0.01)).expect("a surface");
    let parameters = ModelParameters {
        gravity: GRAVITY,
        clamps: vec![Clamp::new(0, end, frame)],
        devices: vec![finger(0.0, 0.0, 0.0); 2],
        ..ModelParameters::default()
    };
    let (model, mut state) = model_and_state(parameters, vec![object_at(&block, DVec3::ZERO, DVec3::ZERO)]);
    let rest = surface.rest_position(&held);
    let mut least = f64::INFINITY;
    for number in 1..=200 {
        let t = f64::from(number) * H;
        let force = DVec3::new(0.5, 2.0 * t, -0.3);
        let input = Input {
            devices: vec![
                DeviceInput::held(rest + DVec3::Y * 0.01 * t, grasp(0, held.triangle, held.weights)),
                DeviceInput::exerting(AppliedForce {
                    grasp: grasp(0, loaded.triangle, loaded.weights),
                    force,
                }),
            ],
            clamps: vec![Pose { position: frame.position - DVec3::X * 0.002 * t, ..frame }],
            ..Input::default()
        };
        let output = step(&model, &mut state, &input);
        let (object, centre) = (&output.objects[0], output.objects[0].pose.position);
        let (clamp, [hand, load]) = (output.clamps[0], [output.devices[0], output.devices[1]]);
        assert_eq!(load.force_on_hand, -force);
        let expected = force - hand.force_on_hand - clamp.force;
        let size = force.length() + hand.force_on_hand.length() + clamp.force.length();
        assert!((object.force - expected).length() < 1e3 * ROUND_OFF * size, "step {number}");
        // The clamp's torque is about the origin of its frame.
        let of_clamp = clamp.torque + (input.clamps[0].position - centre).cross(clamp.force);
        let torque = (load.proxy - centre).cross(force) - (hand.proxy - centre).cross(hand.force_on_hand);
        assert!((object.torque - (torque - of_clamp)).length() < 1e3 * ROUND_OFF * size, "step {number}");
        least = least.min(hand.force_on_hand.length()).min(clamp.force.length());
    }
    assert!(least > 1e-3, "{least}");
}
