//! Touch: contact laws, momentum and energy, on the released recordings (a block of 0.2 × 0.1 × 0.1 m).

use glam::DVec3;
use palpate::{
    Collider, Coupling, DeviceMode, DeviceParameters, Grasp, Input, Model, ModelObject, ModelParameters,
    Obstacle, Output, Pose, Recording, ResidualCompliance, Shape, SurfacePoint, step,
};
use palpate_testkit::{
    GRAVITY_M_S2, Random, energy_imbalance, finger, fixed_block, floor, free_block, half_extent, holding,
    model_and_state, start_at, touching, with_stiffness_damping,
};
use std::sync::Arc;

const H: f64 = 1e-3;
const GRAVITY: DVec3 = DVec3::new(0.0, -GRAVITY_M_S2, 0.0);

/// Round-off of an energy ledger [J]: thousands of sums of terms below 1 J.
const LEDGER_ROUND_OFF_J: f64 = 1e-12;

/// Round-off of a momentum [kg·m/s]: thousands of sums of terms below 1 kg·m/s.
const MOMENTUM_ROUND_OFF: f64 = 1e-12;

/// Round-off of a momentum that a few hundred contact forces change [kg·m/s].
const PAIR_MOMENTUM_ROUND_OFF: f64 = 1e-13;

/// Relative round-off of contact forces and of what follows from them [1]: the solver keeps nine digits.
const SOLVED: f64 = 1e-9;

/// Relative difference of touch and hold [1]: the tip touches the surface a few micrometres beside the node, on cells of centimetres.
const BESIDE_THE_NODE: f64 = 1e-5;

/// Slip speed of a contact that sticks [m/s]: round-off of a displacement over a step.
const STICKS_M_S: f64 = 1e-9;

/// Force of a tip that presses and does not merely graze [N]: half the block's weight.
const PRESSES_N: f64 = 1.0;

/// Depth of a tip in contact that presses with a few newtons [m]; one that lost its contact is millimetres inside.
const PRESSED_GAP_M: f64 = 1e-5;

/// Gap that the solver leaves at a contact [m].
const SOLVER_GAP_M: f64 = 1e-6;

/// Distance of nodes to the plane of their face [m]: round-off of coordinates below 1 m.
const ON_THE_FACE_M: f64 = 1e-9;

/// Stretch of a coupling that presses [m], at least.
const PRESSED_M: f64 = 1e-4;

/// Imbalance of the energy ledger since the start beyond its stated defect [J].
fn open(output: &Output, start: f64) -> f64 {
    energy_imbalance(output, start) - output.energy.defect
}

#[test]
fn sticking_tip_at_a_node_has_the_force_of_a_held_point() {
    let body = free_block();
    // Node nearest to the middle of a side face, where a tip presses along x.
    let side = half_extent(&body, 0);
    let middle = |n: &usize| (body.surface.positions[*n] - DVec3::X * side).length_squared();
    let node =
        (0..body.surface.positions.len()).min_by(|a, b| middle(a).total_cmp(&middle(b))).expect("nodes");
    let rest = body.surface.positions[node];
    let triangle =
        body.surface.triangles.iter().position(|t| t.contains(&(node as u32))).expect("a triangle");
    let weights = body.surface.triangles[triangle].map(|n| if n as usize == node { 1.0 } else { 0.0 });
    let grasp = Grasp { object: 0, point: SurfacePoint { triangle: triangle as u32, weights } };
    let parameters =
        ModelParameters { devices: vec![finger(0.0, 0.0, 5.0)], ..ModelParameters::for_reference() };
    let (model, mut touched) =
        model_and_state(parameters.clone(), vec![ModelObject::new(body.clone(), start_at(DVec3::ZERO))]);
    let (other, mut held) =
        model_and_state(parameters, vec![ModelObject::new(body.clone(), start_at(DVec3::ZERO))]);
    // The tip has a radius of a thousandth of an edge.
    let tip = 1e-3 * body.surface.mean_edge();
    let path = |t: f64| -DVec3::X * (0.01 * t - 0.2 * t * t * t) + DVec3::Y * (0.002 * t);
    let mut compared = 0;
    // While the tip presses.
    for number in 1..=105 {
        let displacement = path(f64::from(number - 1) * H);
        let a = step(&model, &mut touched, &touching(&[rest + displacement + DVec3::X * tip])).clone();
        let b = step(&other, &mut held, &holding(rest + displacement, grasp));
        let (touch, hold) = (a.devices[0].force_on_hand, b.devices[0].force_on_hand);
        // Both begin at the node.
        if number > 2 {
            let share = (touch - hold).length() / hold.length();
            assert!(share < BESIDE_THE_NODE, "step {number}: {touch} {hold}");
            compared += 1;
        }
        assert!(a.contacts.iter().all(|c| c.slip_speed < STICKS_M_S), "it sticks");
    }
    assert!(compared > 90);
}

#[test]
fn coupling_force_obeys_its_law() {
    let coupling = Coupling { stiffness: 300.0, damping: 0.4 };
    let device = DeviceParameters { coupling: Some(coupling), ..finger(0.005, 0.0, 0.8) };
    let body = free_block();
    let side = half_extent(&body, 0);
    let parameters = ModelParameters { devices: vec![device; 2], ..ModelParameters::for_reference() };
    let (model, mut state) = model_and_state(parameters, vec![ModelObject::new(body, start_at(DVec3::ZERO))]);
    let mut before = [DVec3::ZERO; 2];
    for number in 1..=600 {
        let t = f64::from(number) * H;
        let reach = side + 0.005 + 0.001 - 0.02 * t.min(0.2);
        let hands = [DVec3::X * reach, DVec3::new(-reach, 0.003 * (30.0 * t).sin(), 0.0)];
        let output = step(&model, &mut state, &touching(&hands));
        for (device, hand) in hands.into_iter().enumerate() {
            let stretch = hand - output.devices[device].proxy;
            let force = -output.devices[device].force_on_hand;
            let law = stretch * coupling.stiffness + (stretch - before[device]) * (coupling.damping / H);
            assert!(
                force == DVec3::ZERO || (force - law).length() < SOLVED * (1.0 + law.length()),
                "{number}"
            );
            before[device] = stretch;
        }
        assert!(open(output, 0.0).abs() < LEDGER_ROUND_OFF_J);
        assert!(output.energy.stored() <= output.energy.input + LEDGER_ROUND_OFF_J);
    }
    assert!(before[0].length() > PRESSED_M, "it was pressed");
}

#[test]
fn contact_forces_on_a_floor_are_the_change_of_momentum() {
    let body = free_block();
    let mass = body.mass();
    let parameters =
        ModelParameters { gravity: GRAVITY, obstacles: vec![floor(0.4)], ..ModelParameters::for_reference() };
    let mut start = start_at(DVec3::Y * (half_extent(&body, 1) + 0.004));
    start.twist.linear = DVec3::X * 0.3;
    let low = -half_extent(&body, 1);
    let face = body.surface.positions.iter().filter(|p| (p.y - low).abs() < ON_THE_FACE_M).count();
    let (model, mut state) = model_and_state(parameters, vec![ModelObject::new(body, start)]);
    let stored = state.output().energy.stored();
    let mut momentum = start.twist.linear * mass;
    let mut most = 0;
    for number in 0..1500 {
        let output = step(&model, &mut state, &Input::default());
        let force: DVec3 = output.contacts.iter().map(|c| c.force).sum();
        momentum += (force + GRAVITY * mass) * H;
        let error = (output.objects[0].twist.linear * mass - momentum).length();
        assert!(error < MOMENTUM_ROUND_OFF, "step {number}: {error}");
        most = most.max(output.contacts.len());
        for contact in &output.contacts {
            assert_eq!(contact.against, Collider::Obstacle(0));
            let normal = contact.force.dot(-contact.normal);
            let across = (contact.force + contact.normal * normal).length();
            assert!(normal > 0.0 && across <= 0.4 * normal * (1.0 + SOLVED), "in the cone");
            assert!(contact.gap > -SOLVER_GAP_M, "no deeper than the solver leaves: {}", contact.gap);
        }
        // The energy never exceeds that at the start, and the ledger closes.
        assert!(
            output.energy.stored() <= stored + LEDGER_ROUND_OFF_J
                && open(output, stored).abs() < LEDGER_ROUND_OFF_J
        );
    }
    let output = state.output();
    assert_eq!(most, face, "the whole face touches");
    assert!(output.objects[0].twist.linear.length() < 0.05, "friction has stopped it");
    assert!(
        output.energy.friction > 0.5 * 0.5 * mass * 0.09,
        "by taking its energy: {}",
        output.energy.friction
    );
}

#[test]
fn a_pressing_tip_keeps_its_contact_on_a_coarse_mesh() {
    // Edges of 0.1 m under a patch of some millimetres: nodes and patch are displaced differently.
    let plane = Obstacle { shape: Shape::Plane { normal: DVec3::Z }, ..floor(0.5) };
    for (x, y) in [(0.0, 0.0), (0.03, 0.01), (-0.05, 0.0), (0.07, -0.03), (0.0, 0.03)] {
        for patch_radius in [0.0, 0.002, 0.005, 0.02] {
            let parameters = ModelParameters {
                gravity: -DVec3::Z * GRAVITY_M_S2,
                devices: vec![finger(0.005, patch_radius, 0.5)],
                obstacles: vec![plane.clone()],
                ..ModelParameters::default()
            };
            let body = free_block();
            let top = 2.0 * half_extent(&body, 2);
            let start = start_at(DVec3::Z * 0.5 * top);
            let (model, mut state) = model_and_state(parameters, vec![ModelObject::new(body, start)]);
            let mut strongest = 0.0_f64;
            let mut deepest = 0.0_f64;
            for number in 0..400 {
                let depth = 0.01 * (f64::from(number) / 200.0).min(1.0);
                let output = step(&model, &mut state, &touching(&[DVec3::new(x, y, top + 0.005 - depth)]));
                strongest = strongest.max(output.devices[0].force_on_hand.z);
                deepest = deepest.max(output.objects[0].penetration_m);
            }
            let case = format!("({x}, {y}), patch of {patch_radius} m");
            assert!(strongest > PRESSES_N, "{case}: {strongest} N");
            assert!(deepest < PRESSED_GAP_M, "{case}: {deepest} m inside");
        }
    }
}

#[test]
fn fast_tip_does_not_pass_through() {
    // A motion of ten times the block's size in a step, through it: contact on the near side.
    let body = free_block();
    let side = half_extent(&body, 1);
    let device = DeviceParameters {
        coupling: Some(Coupling { stiffness: 50.0, damping: 0.0 }),
        ..finger(0.002, 0.0, 0.0)
    };
    let parameters = ModelParameters { devices: vec![device], ..ModelParameters::for_reference() };
    let (model, mut state) = model_and_state(parameters, vec![ModelObject::new(body, start_at(DVec3::ZERO))]);
    step(&model, &mut state, &touching(&[DVec3::Y * 10.0 * side]));
    let output = step(&model, &mut state, &touching(&[-DVec3::Y * 10.0 * side]));
    assert_eq!(output.contacts.len(), 1);
    assert!(output.contacts[0].normal.y > 0.99, "{:?}", output.contacts[0]);
    assert!(output.devices[0].force_on_hand.y > 0.0);
    assert!(output.devices[0].proxy.y > output.objects[0].pose.position.y, "on the side that it came from");
}

#[test]
fn a_tip_that_falls_silent_comes_back_to_where_it_touched() {
    // Damped, so that it is at rest again after the stall.
    let body = with_stiffness_damping(&fixed_block(), 50.0 * H);
    let radius = 0.004;
    let coupling = Some(Coupling { stiffness: 300.0, damping: 0.5 });
    let top = half_extent(&body, 1);
    for mode in [DeviceMode::Suspended, DeviceMode::Inactive] {
        let devices = vec![DeviceParameters { coupling, ..finger(radius, 0.03, 0.0) }];
        let parameters = ModelParameters { devices, ..ModelParameters::for_reference() };
        let (model, mut state) =
            model_and_state(parameters, vec![ModelObject::new(body.clone(), start_at(DVec3::ZERO))]);
        let start = state.output().energy.stored();
        let mut felt = [DVec3::ZERO; 2];
        for number in 0..8000 {
            // The hand goes 5 mm into the surface, and its centre with it.
            let depth = (f64::from(number) * 2e-5).min(radius + 0.005);
            let mut input = touching(&[DVec3::Y * (top + radius - depth) + DVec3::X * 0.02]);
            if (4000..4100).contains(&number) {
                input.devices[0].mode = mode;
            }
            let output = step(&model, &mut state, &input);
            let force = output.devices[0].force_on_hand;
            match number {
                3999 => felt[0] = force,
                4000..4100 => assert_eq!(force, DVec3::ZERO),
                7999 => felt[1] = force,
                _ => {}
            }
            // A tip that comes back is not thrown out.
            assert!(force.length() < 1.5 * felt[0].length().max(1.0), "step {number}: {force}");
            assert!(open(output, start).abs() < LEDGER_ROUND_OFF_J, "step {number}");
        }
        assert!(felt[0].y > 0.1, "{felt:?}");
        assert!((felt[1] - felt[0]).length() < 0.02 * felt[0].length(), "{felt:?}");
    }
}

#[test]
fn random_tips_extract_no_energy_and_the_state_stays_finite() {
    let soft = Some(Coupling { stiffness: 100.0, damping: 0.2 });
    // The last two have a residual compliance that relaxes in ten steps.
    let relaxing = with_stiffness_damping(&free_block(), 10.0 * H);
    for (seed, body, coupling) in
        [(1, free_block(), None), (2, free_block(), soft), (3, relaxing.clone(), None), (4, relaxing, soft)]
    {
        let mut random = Random::new(88_172_645 + 7919 * seed);
        let device = |tip, patch, friction| DeviceParameters { coupling, ..finger(tip, patch, friction) };
        let devices = vec![device(0.01, 0.03, 0.6), device(0.0, 0.0, 0.0), device(0.003, 0.0, 1.2)];
        let parameters = ModelParameters { devices, ..ModelParameters::for_reference() };
        let (model, mut state) =
            model_and_state(parameters, vec![ModelObject::new(body, start_at(DVec3::ZERO))]);
        let mut hands = [DVec3::ONE; 3];
        let (mut kinds, mut goals) = ([0; 3], [DVec3::ZERO; 3]);
        let mut touches = 0;
        for number in 0..8000 {
            let centre = state.output().objects[0].pose.position;
            for device in 0..3 {
                if random.within(-1.0, 1.0) > 0.98 {
                    kinds[device] = (3.5 * (1.0 + random.within(-1.0, 1.0))) as i32;
                    goals[device] = random.vector() * 0.15;
                }
                hands[device] = match kinds[device] {
                    0 => centre + goals[device],
                    1 => centre + random.vector() * 0.2,
                    2 => hands[device] + (centre - hands[device]) * 0.03,
                    3 => centre + goals[device] * if number % 2 == 0 { 1.0 } else { 0.85 },
                    4 => DVec3::splat(f64::NAN),
                    5 => hands[device] + random.vector() * 0.003,
                    _ => centre + goals[device] * 2.0,
                };
            }
            let mut input = touching(&hands);
            // The first device stalls now and then.
            if number % 400 > 350 {
                input.devices[0].mode = DeviceMode::Suspended;
            }
            let output = step(&model, &mut state, &input);
            for hand in hands.iter_mut().filter(|hand| !hand.is_finite()) {
                *hand = centre + DVec3::X;
            }
            touches += output.contacts.len();
            let energy = &output.energy;
            let size = 1.0 + energy.input.abs();
            assert!(energy.stored() <= energy.input + SOLVED * size, "step {number}: {energy:?}");
            assert!(energy.stored().is_finite() && output.objects[0].pose.position.is_finite());
            let sound = |d: &palpate::DeviceOutput| d.force_on_hand.is_finite() && d.proxy.is_finite();
            assert!(output.devices.iter().all(sound), "step {number}");
        }
        assert!(touches > 1000, "{touches} touches");
    }
}

#[test]
fn colliding_objects_have_opposite_forces() {
    // Two blocks collide without gravity: momentum is conserved, energy does not grow.
    let body = free_block();
    let mass = body.mass();
    let gap = 2.0 * half_extent(&body, 0) + 0.002;
    let mut left = start_at(DVec3::ZERO);
    let mut right = start_at(DVec3::new(gap, 0.01, 0.0));
    (left.twist.linear, right.twist.linear) = (DVec3::X * 0.2, -DVec3::X * 0.3);
    let objects = vec![ModelObject::new(body.clone(), left), ModelObject::new(body, right)];
    let (model, mut state) = model_and_state(ModelParameters::for_reference(), objects);
    let start = state.output().energy.stored();
    let mut met = false;
    for _ in 0..400 {
        let output = step(&model, &mut state, &Input::default());
        met |= !output.contacts.is_empty();
        let momentum: DVec3 = output.objects.iter().map(|o| o.twist.linear * mass).sum();
        assert!((momentum - DVec3::X * (-0.1 * mass)).length() < PAIR_MOMENTUM_ROUND_OFF, "{momentum}");
        assert!(
            output.energy.stored() <= start + LEDGER_ROUND_OFF_J
                && open(output, start).abs() < LEDGER_ROUND_OFF_J
        );
        assert!(output.energy.input.abs() < LEDGER_ROUND_OFF_J, "no work from outside");
    }
    let output = state.output();
    let apart = output.objects[1].twist.linear.x - output.objects[0].twist.linear.x;
    assert!(met && apart > 0.0, "they fly apart: {apart}");
}

#[test]
fn work_of_a_moving_obstacle_is_counted() {
    let body = free_block();
    let ball = Obstacle {
        shape: Shape::Sphere { radius: 0.04 },
        pose: Pose { position: -DVec3::X * (half_extent(&body, 0) + 0.045), ..Pose::IDENTITY },
        friction: 0.3,
    };
    let parameters = ModelParameters { obstacles: vec![ball.clone()], ..ModelParameters::for_reference() };
    let (model, mut state) = model_and_state(parameters, vec![ModelObject::new(body, start_at(DVec3::ZERO))]);
    for number in 1..=400 {
        let position = ball.pose.position + DVec3::X * (0.2 * f64::from(number) * H);
        let input = Input { obstacles: vec![Pose { position, ..ball.pose }], ..Input::default() };
        let output = step(&model, &mut state, &input);
        assert!(open(output, 0.0).abs() < LEDGER_ROUND_OFF_J);
        assert!(output.energy.stored() <= output.energy.input + LEDGER_ROUND_OFF_J);
    }
    let output = state.output();
    assert!(output.objects[0].twist.linear.x > 0.15, "{:?}", output.objects[0].twist);
    assert!(output.energy.input > 0.0);
}

#[test]
fn numbers_out_of_range_are_refused_by_name() {
    let refused = |parameters: ModelParameters| {
        let objects = vec![ModelObject::new(free_block(), start_at(DVec3::ZERO))];
        Model::new(parameters, objects).err().map(|e| e.to_string()).unwrap_or_default()
    };
    let devices = |device| ModelParameters { devices: vec![device], ..ModelParameters::for_reference() };
    assert_eq!(
        refused(devices(finger(-1.0, 0.0, 0.0))),
        "device 0: tip_radius is -1 m, expected a number not below 0"
    );
    assert_eq!(
        refused(devices(finger(0.0, f64::NAN, 0.0))),
        "device 0: patch_radius is NaN m, expected a number not below 0"
    );
    let weak = Coupling { stiffness: 0.0, damping: 0.0 };
    assert_eq!(
        refused(devices(DeviceParameters { coupling: Some(weak), ..finger(0.0, 0.0, 0.0) })),
        "device 0: coupling stiffness is 0 N/m, expected a positive number"
    );
    let obstacles = |shape| ModelParameters {
        obstacles: vec![Obstacle { shape, pose: Pose::IDENTITY, friction: 0.1 }],
        ..ModelParameters::for_reference()
    };
    assert_eq!(
        refused(obstacles(Shape::Plane { normal: DVec3::Y * 2.0 })),
        "obstacle 0: normal has length 2, expected 1"
    );
    assert_eq!(
        refused(obstacles(Shape::Sphere { radius: f64::NAN })),
        "obstacle 0: radius is NaN m, expected a positive number"
    );
}

#[test]
fn body_with_fixed_nodes_has_contact_forces() {
    let body = fixed_block();
    let top = body.surface.positions.iter().copied().max_by(|a, b| a.y.total_cmp(&b.y)).expect("nodes");
    let parameters =
        ModelParameters { devices: vec![finger(0.003, 0.02, 0.5)], ..ModelParameters::for_reference() };
    let (model, mut state) = model_and_state(parameters, vec![ModelObject::new(body, start_at(DVec3::ZERO))]);
    let mut last = 0.0;
    for number in 1..=300 {
        let depth = 2e-5 * f64::from(number).min(100.0);
        let tip = DVec3::new(0.5 * top.x, top.y + 0.003 + 1e-4 - depth, 0.5 * top.z);
        let output = step(&model, &mut state, &touching(&[tip]));
        last = output.devices[0].force_on_hand.y;
        assert!(open(output, 0.0).abs() < LEDGER_ROUND_OFF_J);
    }
    assert!(last > 0.0, "{last}");
}

#[test]
fn scaled_fallback_of_an_unsolved_contact_gives_no_energy() {
    let body = free_block();
    let side = half_extent(&body, 0);
    let parameters =
        ModelParameters { devices: vec![finger(0.02, 0.0, 0.5)], ..ModelParameters::for_reference() };
    let (model, mut state) = model_and_state(parameters, vec![ModelObject::new(body, start_at(DVec3::ZERO))]);
    let start = state.output().energy.stored();
    let beside = DVec3::new(side + 0.021, 0.03, 0.02);
    step(&model, &mut state, &touching(&[beside]));
    // A motion of four metres in a step, through the block.
    let beyond = beside - DVec3::X * (40.0 * side);
    let output = step(&model, &mut state, &touching(&[beyond]));
    assert_eq!(output.status.unsolved_islands, 1, "otherwise this shows nothing: {:?}", output.status);
    assert!(output.status.solver_residual_m > side);
    let contact = output.contacts.first().expect("a contact");
    assert!(contact.force.x < 0.0 && output.objects[0].twist.linear.x < 0.0, "pushed on: {contact:?}");
    assert_eq!(output.devices[0].force_on_hand, -contact.force);
    let e = &output.energy;
    assert!(e.input > 0.0 && e.lost() >= 0.0 && open(output, start).abs() < SOLVED * e.input, "{e:?}");
    assert!(e.defect.abs() < SOLVED * e.input, "{e:?}");
    let after = step(&model, &mut state, &touching(&[beyond]));
    assert_eq!((after.status.unsolved_islands, after.contacts.len()), (0, 0));
}

#[test]
fn tip_larger_than_the_body_touches_its_front_only() {
    let body = free_block();
    let (side, thick) = (half_extent(&body, 0), 2.0 * half_extent(&body, 1));
    // The tip's centre is outside; the back of the block is within its radius.
    let tip = 4.0 * thick;
    let parameters =
        ModelParameters { devices: vec![finger(tip, 0.0, 0.0)], ..ModelParameters::for_reference() };
    let (model, mut state) = model_and_state(parameters, vec![ModelObject::new(body, start_at(DVec3::ZERO))]);
    let centre = DVec3::new(0.1 * side, 0.8 * thick, 0.0);
    step(&model, &mut state, &touching(&[centre]));
    let raised = step(&model, &mut state, &touching(&[centre + DVec3::Y * (0.05 * thick)]));
    assert!(raised.contacts.is_empty(), "the back holds nothing: {:?}", raised.contacts);
    let pressed = step(&model, &mut state, &touching(&[centre]));
    assert!(!pressed.contacts.is_empty());
    assert!(pressed.contacts.iter().all(|contact| contact.normal.y > 0.5), "{:?}", pressed.contacts);
}

#[test]
fn a_patch_touches_a_body_whose_residual_compliance_is_round_off() {
    // As in a recording that keeps all modes: entries of both signs, some of them on the diagonal.
    let pressed = |residual: ResidualCompliance| {
        let recording = Recording { residual, ..(*free_block()).clone() };
        let top = half_extent(&recording, 1);
        let parameters =
            ModelParameters { devices: vec![finger(0.0, 0.03, 0.5)], ..ModelParameters::for_reference() };
        let object = ModelObject::new(Arc::new(recording), start_at(DVec3::ZERO));
        let (model, mut state) = model_and_state(parameters, vec![object]);
        let press = touching(&[DVec3::new(0.01, top - 1e-4, 0.02)]);
        let outside = touching(&[DVec3::new(0.01, top + 0.02, 0.02)]);
        step(&model, &mut state, &outside);
        (0..20).map(|_| step(&model, &mut state, &press).devices[0].force_on_hand.y).fold(0.0, f64::max)
    };
    let nodes = free_block().surface.positions.len();
    let entries = 3 * nodes;
    let round_off = (0..entries * (entries + 1) / 2).map(|at| if at % 3 == 0 { 1e-20 } else { -1e-20 });
    let round_off: Vec<f32> = round_off.collect();
    let round_off = ResidualCompliance::from_lower_triangle(nodes, &round_off).expect("so many entries");
    let without = pressed(ResidualCompliance::None);
    let force = pressed(round_off);
    assert!(without > 0.0 && (force / without - 1.0).abs() < SOLVED, "{force} N, without S {without} N");
}
