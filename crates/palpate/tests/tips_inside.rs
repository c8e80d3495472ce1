//! Tips that begin, or end up, inside objects, on the released recordings (a block of 0.2 × 0.1 × 0.1 m).

use glam::DVec3;
use palpate::{
    Coupling, DeviceInput, DeviceMode, DeviceParameters, Input, Model, ModelObject, ModelParameters, Output,
    Recording, State, step,
};
use palpate_testkit::{
    Random, energy_imbalance, finger, fixed_block, free_block, half_extent, model_and_state, object_at,
    start_at, touching, with_stiffness_damping,
};
use std::f64::consts::PI;
use std::sync::Arc;

const H: f64 = 1e-3;

/// Time constant of the offset [s].
const LET_OUT_S: f64 = 0.02;

/// Round-off of an energy ledger [J]: thousands of sums of terms below 1 J.
const LEDGER_ROUND_OFF_J: f64 = 1e-12;

/// Relative round-off of what follows from contact forces [1]: the solver keeps nine digits.
const SOLVED: f64 = 1e-9;

/// Relative difference of a force at rest after two histories [1]: a contact stays at a location that is off by a thousandth of the
/// patch.
const AT_REST: f64 = 1e-3;

/// Share of the largest force that a tip at rest inside a body at rest has in its first step: (h/T)²/2 is 1.3e-3 of the offset, of
/// which a body that resists speed feels more.
const FIRST_STEP: f64 = 0.15;

const COUPLING: Option<Coupling> = Some(Coupling { stiffness: 300.0, damping: 0.5 });

fn scene(body: &Arc<Recording>, device: DeviceParameters) -> (Model, State) {
    let parameters = ModelParameters { devices: vec![device], ..ModelParameters::for_reference() };
    model_and_state(parameters, vec![ModelObject::new(body.clone(), start_at(DVec3::ZERO))])
}

/// Work of a device from its force, its motion [m] and its offset over a step [J].
fn work(output: &Output, device: usize, motion: DVec3) -> f64 {
    let out = &output.devices[device];
    -out.force_on_hand.dot(motion + out.offset[1] - out.offset[0])
}

/// Winding number of the deformed surface of an object around a point [m, world]: 1 inside, 0 outside, by the solid angles of its triangles
/// (van Oosterom & Strackee 1983).
fn winding_number(model: &Model, state: &State, point: DVec3) -> f64 {
    let surface = &model.recordings().next().expect("an object").surface;
    let mut moved = vec![DVec3::ZERO; surface.positions.len()];
    state.surface_displacement(model, 0, &mut moved);
    let place = state.output().objects[0].pose.body_from_world(point);
    let solid_angle = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(|node| surface.positions[node as usize] + moved[node as usize] - place);
        let (x, y, z) = (a.length(), b.length(), c.length());
        2.0 * a.dot(b.cross(c)).atan2(x * y * z + a.dot(b) * z + b.dot(c) * x + c.dot(a) * y)
    };
    surface.triangles.iter().map(solid_angle).sum::<f64>() / (4.0 * PI)
}

#[test]
fn a_tip_that_begins_inside_feels_in_the_end_what_one_that_pressed_there_feels() {
    // Damped, so that it comes to rest.
    let body = with_stiffness_damping(&fixed_block(), 50.0 * H);
    let top = half_extent(&body, 1);
    for (radius, coupling) in [(0.004_f64, COUPLING), (0.0, COUPLING), (0.004, None), (0.0, None)] {
        // The whole tip is inside, by 1 mm; or half of it.
        for depth in [2.0 * radius + 0.001, radius.max(0.0005)] {
            let hand = DVec3::new(0.02, top + radius - depth, 0.0);
            let device = DeviceParameters { coupling, ..finger(radius, 0.03, 0.0) };
            let (model, mut pressed) = scene(&body, device);
            for number in 1..=4000 {
                let above = DVec3::Y * (depth * (1.0 - f64::from(number) * 5e-3).max(0.0));
                step(&model, &mut pressed, &touching(&[hand + above]));
            }
            let felt = pressed.output().devices[0].force_on_hand;
            let (model, mut state) = scene(&body, device);
            let (mut forces, mut worked) = (Vec::new(), 0.0);
            for number in 0..4000 {
                let output = step(&model, &mut state, &touching(&[hand]));
                worked += work(output, 0, DVec3::ZERO);
                forces.push(output.devices[0].force_on_hand);
                assert!(energy_imbalance(output, 0.0).abs() < LEDGER_ROUND_OFF_J, "step {number}");
                assert!((worked - output.energy.input).abs() < LEDGER_ROUND_OFF_J, "step {number}");
                // The offset decays, critically damped.
                let t = f64::from(number) * H / LET_OUT_S;
                let offset = depth * (1.0 + t) * (-t).exp();
                let is = output.devices[0].offset[1].y;
                // A point has a radius of a thousandth of an edge.
                let own = 1e-3 * body.surface.mean_edge();
                assert!((is - offset).abs() < own + 0.02 * offset, "step {number}: {is} {offset}");
            }
            let largest = forces.iter().map(|f| f.length()).fold(0.0, f64::max);
            let case = format!("radius {radius}, depth {depth}, {coupling:?}");
            assert!(felt.y > 1e-3, "{case}: {felt}");
            assert!(
                (forces[3999] - felt).length() < AT_REST * felt.length(),
                "{case}: {} {felt}",
                forces[3999]
            );
            assert!(forces[0].length() < FIRST_STEP * largest, "{case}: {} of {largest}", forces[0].length());
        }
    }
}

#[test]
fn a_free_body_is_pushed_off_a_tip_inside_it() {
    let body = free_block();
    for (radius, coupling) in [(0.004, COUPLING), (0.0, None), (0.01, None)] {
        let (model, mut state) = scene(&body, DeviceParameters { coupling, ..finger(radius, 0.0, 0.4) });
        // Nearest to the upper face.
        let hand = DVec3::new(0.03, 0.6 * half_extent(&body, 1), 0.01);
        for number in 0..3000 {
            let output = step(&model, &mut state, &touching(&[hand]));
            assert!(energy_imbalance(output, 0.0).abs() < LEDGER_ROUND_OFF_J, "step {number}");
            assert!(output.energy.stored() <= output.energy.input + LEDGER_ROUND_OFF_J, "step {number}");
        }
        let output = state.output();
        assert_eq!(output.devices[0].force_on_hand, DVec3::ZERO);
        assert!((output.devices[0].proxy - hand).length() < 1e-9, "the proxy is at the hand");
        let place = output.objects[0].pose.body_from_world(hand).abs();
        assert!((0..3).any(|axis| place[axis] > half_extent(&body, axis)), "{place}");
    }
}

#[test]
fn a_tip_at_the_interface_of_two_objects_finds_a_place_outside_both() {
    // 1 mm deep in the right block, which touches the left one: its place is out of the left one as well.
    let body = free_block();
    let side = half_extent(&body, 0);
    let objects = [-1.0, 1.0].map(|at| object_at(&body, DVec3::X * (at * side), DVec3::ZERO));
    let parameters =
        ModelParameters { devices: vec![finger(0.002, 0.0, 0.0)], ..ModelParameters::for_reference() };
    let (model, mut state) = model_and_state(parameters, objects.to_vec());
    let output = step(&model, &mut state, &touching(&[DVec3::X * 0.001]));
    let proxy = output.devices[0].proxy;
    let half = [0, 1, 2].map(|axis| half_extent(&body, axis));
    for object in &output.objects {
        let place = object.pose.body_from_world(proxy).abs();
        assert!((0..3).any(|axis| place[axis] > half[axis]), "{place}");
    }
}

#[test]
fn a_tip_without_coupling_that_falls_silent_comes_back_too() {
    let body = with_stiffness_damping(&fixed_block(), 50.0 * H);
    let hand = DVec3::new(0.02, half_extent(&body, 1) - 0.001, 0.0);
    let (model, mut state) = scene(&body, finger(0.004, 0.03, 0.0));
    let mut felt = [DVec3::ZERO; 2];
    for number in 0..8000 {
        let above = DVec3::Y * (0.01 - f64::from(number) * 1e-5).max(0.0);
        let mut input = touching(&[hand + above]);
        if (4000..4100).contains(&number) {
            input.devices[0].mode = DeviceMode::Suspended;
        }
        let force = step(&model, &mut state, &input).devices[0].force_on_hand;
        if number == 3999 {
            felt[0] = force;
        }
        felt[1] = force;
    }
    assert!(felt[0].y > 1e-3 && (felt[1] - felt[0]).length() < AT_REST * felt[0].length(), "{felt:?}");
}

#[test]
fn random_starts_inside_extract_no_energy_and_leave_no_tip_inside() {
    let soft = Some(Coupling { stiffness: 100.0, damping: 0.2 });
    for (seed, body, coupling) in [
        (1, free_block(), None),
        (2, free_block(), soft),
        (3, fixed_block(), None),
        (4, fixed_block(), soft),
        (5, with_stiffness_damping(&free_block(), 10.0 * H), soft),
    ] {
        let mut random = Random::new(31_415_926 + 2_718_281 * seed);
        // With one footprint, so that each feels where the others press.
        let device = |tip| DeviceParameters { coupling, ..finger(tip, 0.0, 0.5) };
        let devices = vec![device(0.0), device(0.005), device(0.01)];
        let parameters = ModelParameters { devices, ..ModelParameters::for_reference() };
        let (model, mut state) =
            model_and_state(parameters, vec![ModelObject::new(body.clone(), start_at(DVec3::ZERO))]);
        let start = state.output().energy.stored();
        let half = DVec3::from([0, 1, 2].map(|axis| half_extent(&body, axis)));
        let mut places = [DVec3::ONE; 3];
        let (mut worked, mut felt, mut begun) = (0.0, 0, 0);
        for number in 0..6000 {
            let pose = state.output().objects[0].pose;
            // Every 200 steps each device begins anywhere in the block, but near fixed nodes, and trembles; for 40 it is away.
            let is_away = number % 200 >= 160;
            let mut input = Input { devices: vec![DeviceInput::inactive(); 3], ..Input::default() };
            let mut before = [DVec3::ZERO; 3];
            for device in (0..3).filter(|_| !is_away) {
                if number % 200 == 0 {
                    let place = random.vector() * half;
                    places[device] = pose.world_from_body(DVec3 { x: place.x.abs(), ..place });
                    begun += 1;
                }
                before[device] = places[device];
                if number % 200 > 0 {
                    places[device] += random.vector() * 2e-4;
                }
                input.devices[device] = DeviceInput::touching(places[device]);
            }
            step(&model, &mut state, &input);
            let output = state.output();
            for device in (0..3).filter(|_| !is_away) {
                worked += work(output, device, places[device] - before[device]);
            }
            let size = 1.0 + output.energy.input.abs();
            assert!((worked - output.energy.input).abs() < SOLVED * size, "step {number}");
            assert!(energy_imbalance(output, start).abs() < SOLVED * size, "step {number}");
            assert!(output.energy.stored() - start <= output.energy.input + SOLVED * size, "step {number}");
            // A device that feels nothing is outside the deformed block, also in its first step.
            if [0, 1, 50, 150].contains(&(number % 200)) {
                for (device, out) in output.devices.iter().enumerate() {
                    let feels = out.force_on_hand != DVec3::ZERO;
                    felt += u32::from(feels);
                    let turns = winding_number(&model, &state, out.proxy);
                    assert!(feels || turns < 0.5, "step {number}, device {device}: {turns} at {}", out.proxy);
                }
            }
        }
        assert!(begun == 90 && felt > 50, "{felt} of {begun}");
    }
}
