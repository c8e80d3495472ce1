//! Clamps: as hands that hold the same nodes, with exact work, wherever their frames go.

use glam::{DQuat, DVec3};
use palpate::{
    Clamp, DeviceInput, DeviceParameters, Grasp, Input, Model, ModelObject, ModelParameters, Pose, Recording,
    State, SurfacePoint, step,
};
use palpate_testkit::{GRAVITY_M_S2, free_block, model_and_state, start_at, subdivided};
use std::sync::Arc;

/// Difference between rows in single precision, of clamps, and in double precision, of hands [1].
const SINGLE: f64 = 2e-6;

/// Round-off of an energy ledger [1], relative to what moved: thousands of sums with terms of that size.
const LEDGER_ROUND_OFF: f64 = 1e-11;

/// Distance of a held place from its frame [m]: round-off of a solve with dozens of rows.
const HELD_M: f64 = 1e-12;

/// Triangles of the end of the block at x = ±0.1 m.
fn end(recording: &Recording, side: f64) -> Vec<u32> {
    let surface = &recording.surface;
    let is_end = |t: &u32| {
        surface.triangles[*t as usize].iter().all(|n| side * surface.positions[*n as usize].x > 0.0999)
    };
    (0..surface.triangles.len() as u32).filter(is_end).collect()
}

/// The nodes of some triangles, as grasps.
fn nodes(recording: &Recording, triangles: &[u32]) -> Vec<Grasp> {
    let mut nodes: Vec<u32> =
        triangles.iter().flat_map(|t| recording.surface.triangles[*t as usize]).collect();
    nodes.sort_unstable();
    nodes.dedup();
    let point = |node: u32| {
        let triangle = recording.surface.triangles.iter().position(|corners| corners.contains(&node));
        let triangle = triangle.expect("a node of a triangle");
        let weights = recording.surface.triangles[triangle].map(|n| f64::from(u8::from(n == node)));
        Grasp { object: 0, point: SurfacePoint { triangle: triangle as u32, weights } }
    };
    nodes.into_iter().map(point).collect()
}

fn clamped(recording: &Arc<Recording>, clamps: Vec<Clamp>, devices: usize) -> (Model, State) {
    let parameters = ModelParameters {
        gravity: DVec3::Y * -GRAVITY_M_S2,
        devices: vec![DeviceParameters::default(); devices],
        clamps,
        ..ModelParameters::for_reference()
    };
    model_and_state(parameters, vec![ModelObject::new(recording.clone(), start_at(DVec3::ZERO))])
}

/// A frame that sways and turns, from a position.
fn frame(from: DVec3, t: f64, turn: f64) -> Pose {
    let position = from + DVec3::new(0.004 * (7.0 * t).sin(), 0.02 * (3.0 * t).sin(), 0.01 * t * t);
    Pose { position, orientation: DQuat::from_rotation_x(turn * t) * DQuat::from_rotation_z(0.3 * turn * t) }
}

#[test]
fn clamp_of_few_nodes_gives_the_forces_of_hands_that_hold_them() {
    let recording = free_block();
    let triangles = end(&recording, 1.0);
    let grasps = nodes(&recording, &triangles);
    let origin = DVec3::X * 0.1;
    let start = Pose { position: origin, ..Pose::IDENTITY };
    let (model, mut state) = clamped(&recording, vec![Clamp::new(0, triangles, start)], 0);
    assert_eq!(model.clamp_cells(0), grasps.len());
    let (by_hands, mut held) = clamped(&recording, Vec::new(), grasps.len());
    for number in 1..=300 {
        let pose = frame(origin, f64::from(number) * 1e-3, 2.0);
        let hold = |grasp: &Grasp| {
            let rest = recording.surface.rest_position(&grasp.point);
            DeviceInput::held(pose.world_from_body(start.body_from_world(rest)), *grasp)
        };
        let hands = Input { devices: grasps.iter().map(hold).collect(), ..Input::default() };
        let expected = step(&by_hands, &mut held, &hands).clone();
        let force: DVec3 = expected.devices.iter().map(|device| device.force_on_hand).sum();
        let moment = expected.devices.iter().map(|d| (d.proxy - pose.position).cross(d.force_on_hand));
        let torque: DVec3 = moment.sum();
        let scale: f64 = expected.devices.iter().map(|device| device.force_on_hand.length()).sum();
        let output = step(&model, &mut state, &Input { clamps: vec![pose], ..Input::default() });
        assert_eq!(output.status.unsolved_islands + output.status.dependent_rows, 0);
        let clamp = output.clamps[0];
        assert!((clamp.force - force).length() < SINGLE * scale, "{number}: {} {force}", clamp.force);
        assert!(
            (clamp.torque - torque).length() < 0.1 * SINGLE * scale,
            "{number}: {} {torque}",
            clamp.torque
        );
        let moved = output.objects[0].pose.position - expected.objects[0].pose.position;
        assert!(moved.length() < 1e-8, "{moved}");
    }
}

#[test]
fn cells_follow_the_frame_and_the_energy_balance_closes() {
    // More nodes on an end than cells, and no more cells than the block that was subdivided has nodes there.
    let recording = Arc::new(subdivided(&free_block(), 2));
    let ends = [-1.0, 1.0];
    let clamp = |side: f64| Clamp {
        max_cells: 3,
        ..Clamp::new(0, end(&recording, side), Pose { position: DVec3::X * 0.1 * side, ..Pose::IDENTITY })
    };
    let (model, mut state) = clamped(&recording, ends.map(clamp).to_vec(), 0);
    assert!(model.clamp_cells(0) == 3 && model.clamp_cells(1) == 3);
    let stored = state.output().energy.stored();
    let momentum = |state: &State| state.output().objects[0].twist.linear * recording.mass();
    let (mut given, mut weight) = (DVec3::ZERO, DVec3::ZERO);
    for number in 1..=1000 {
        let t = f64::from(number) * 1e-3;
        let clamps =
            vec![frame(DVec3::X * -0.1, t, 1.5), frame(DVec3::X * 0.1, t, 1.5 + 0.2 * (5.0 * t).sin())];
        let output = step(&model, &mut state, &Input { clamps, ..Input::default() });
        assert_eq!((output.status.unsolved_islands, output.status.dependent_rows), (0, 0), "{number}");
        let energy = output.energy;
        let moved = energy.input.abs() + energy.dissipated + (energy.stored() - stored).abs() + 1e-3;
        assert!(energy.defect.abs() < LEDGER_ROUND_OFF * moved, "{number}: {energy:?}");
        assert!(output.status.solver_residual_m < HELD_M, "{}", output.status.solver_residual_m);
        given -= (output.clamps[0].force + output.clamps[1].force) * 1e-3;
        weight += DVec3::Y * (-GRAVITY_M_S2 * recording.mass() * 1e-3);
    }
    let found = momentum(&state);
    assert!((found - given - weight).length() < 1e-11 * given.length(), "{found} {given}");
    assert!(state.output().objects[0].pose.orientation.w.abs() < 0.9, "it turned");
}

#[test]
fn clamps_out_of_range_are_refused_and_a_frame_that_is_no_number_stays() {
    let recording = free_block();
    let refuse = |clamp: Clamp| {
        let parameters = ModelParameters { clamps: vec![clamp], ..ModelParameters::for_reference() };
        let object = ModelObject::new(recording.clone(), start_at(DVec3::ZERO));
        Model::new(parameters, vec![object]).expect_err("a bad clamp").to_string()
    };
    let good = Clamp::new(0, end(&recording, 1.0), Pose::IDENTITY);
    assert_eq!(refuse(Clamp { object: 1, ..good.clone() }), "clamp 0: object is 1, expected below 1");
    let none = Clamp { triangles: Vec::new(), ..good.clone() };
    assert_eq!(refuse(none), "clamp 0: triangles must be one or more, with numbers below 20");
    assert_eq!(refuse(Clamp { max_cells: 0, ..good.clone() }), "clamp 0: max_cells is 0, expected 1 to 256");
    let (model, mut state) = clamped(&recording, vec![good], 0);
    let bad = Pose { position: DVec3::splat(f64::NAN), ..Pose::IDENTITY };
    let output = step(&model, &mut state, &Input { clamps: vec![bad], ..Input::default() });
    assert_eq!(output.status.rejected_inputs, 1);
    assert!(output.clamps[0].force.y < 0.0, "it still carries the weight: {}", output.clamps[0].force);
}
