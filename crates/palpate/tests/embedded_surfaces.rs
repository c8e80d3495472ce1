//! Embedded surfaces: a body whose surface moves with the nodes below it steps as one that has its own compliance between all surface nodes.

use glam::DVec3;
use palpate::{
    DeviceInput, EMBEDDED_FORMAT_VERSIONS, Error, Input, ModelObject, ModelParameters, Output, Recording,
    RecordingError, ResidualFieldCache, State, SurfacePoint, step,
};
use palpate_testkit::{
    GRAVITY_M_S2, embedded, energy_imbalance, finger, fixed_block, floor, free_block, grasp, half_extent,
    model_and_state, object_at, start_at, subdivided,
};
use std::sync::Arc;

/// Difference by the rounding of the residual compliance to single precision on one side [1]: it grows from 10⁻⁸ in the first contact step.
const SINGLE: f64 = 1e-5;

/// The body on an embedded surface, and on the same surface with its own compliances.
fn both(recording: &Recording) -> [Arc<Recording>; 2] {
    let mut pair = [embedded(recording), subdivided(recording, 1)];
    pair.iter_mut().for_each(|body| body.metadata.mesh.order = 1);
    pair.map(Arc::new)
}

/// Outputs of a number of steps with each of two bodies.
fn outputs(
    bodies: &[Arc<Recording>; 2],
    parameters: &ModelParameters,
    objects: impl Fn(&Arc<Recording>) -> Vec<ModelObject>,
    input: impl Fn(u32) -> Input,
    steps: u32,
) -> [Vec<Output>; 2] {
    [0, 1].map(|side| {
        let (model, mut state) = model_and_state(parameters.clone(), objects(&bodies[side]));
        (0..steps)
            .map(|number| {
                step(&model, &mut state, &input(number));
                state.output().clone()
            })
            .collect()
    })
}

/// Check that forces and poses agree; gives the largest force.
fn check_equal([own, other]: &[Vec<Output>; 2]) -> f64 {
    let forces = |output: &Output| -> Vec<DVec3> {
        let of_devices = output.devices.iter().map(|device| device.force_on_hand);
        of_devices.chain(output.objects.iter().map(|object| object.force)).collect()
    };
    let largest = other.iter().flat_map(&forces).map(DVec3::length).fold(0.0, f64::max);
    for (number, (a, b)) in own.iter().zip(other).enumerate() {
        for (at, (force, expected)) in forces(a).into_iter().zip(forces(b)).enumerate() {
            let apart = (force - expected).length();
            assert!(apart <= SINGLE * largest, "step {number}, force {at}: {force} {expected}");
        }
        for (a, b) in a.objects.iter().zip(&b.objects) {
            let apart = (a.pose.position - b.pose.position).length();
            assert!(apart < SINGLE * 1e-2, "step {number}: {apart}");
        }
    }
    largest
}

#[test]
fn held_points_and_fingers_feel_the_same_body() {
    for patch_radius in [0.0, 0.03] {
        let bodies = both(&free_block());
        let device = finger(0.01, patch_radius, 0.6);
        let parameters = ModelParameters { devices: vec![device; 3], ..ModelParameters::for_reference() };
        let side = half_extent(&bodies[0], 0);
        let objects = |body: &Arc<Recording>| vec![object_at(body, DVec3::ZERO, DVec3::new(0.0, 0.02, 0.0))];
        // A finger presses and slides against a hand that holds the other side; another strokes.
        let input = |number: u32| {
            let t = f64::from(number) * 1e-3;
            let held = bodies[0].surface.rest_position(&grasp(0, 9, [0.2, 0.3, 0.5]).point);
            let press = DVec3::new(side + 0.0115 - 0.03 * t.min(0.2), 0.03 * t, 0.011);
            let stroke = DVec3::new(-side - 0.0115 + 0.02 * t.min(0.2), 0.02 - 0.04 * t, -0.012);
            Input {
                devices: vec![
                    DeviceInput::held(held + DVec3::Y * (0.01 * t), grasp(0, 9, [0.2, 0.3, 0.5])),
                    DeviceInput::touching(press),
                    DeviceInput::touching(stroke),
                ],
                ..Input::default()
            }
        };
        let largest = check_equal(&outputs(&bodies, &parameters, objects, input, 300));
        assert!(largest > 0.5, "{largest}");
    }
}

#[test]
fn all_nodes_fall_and_stack_the_same() {
    let bodies = both(&free_block());
    let parameters = ModelParameters {
        gravity: DVec3::Y * -GRAVITY_M_S2,
        obstacles: vec![floor(0.5)],
        ..ModelParameters::for_reference()
    };
    let height = half_extent(&bodies[0], 1);
    let objects = |body: &Arc<Recording>| {
        vec![
            object_at(body, DVec3::Y * (height + 1e-3), DVec3::X * 0.05),
            object_at(body, DVec3::new(0.01, 3.0 * height + 3e-3, 0.0), DVec3::ZERO),
        ]
    };
    let largest = check_equal(&outputs(&bodies, &parameters, objects, |_| Input::default(), 35));
    assert!(largest > 1.0, "{largest}");
}

#[test]
fn a_fixed_body_sags_the_same_everywhere() {
    let bodies = both(&fixed_block());
    let parameters = ModelParameters {
        gravity: DVec3::new(0.1, -0.3, 0.2),
        devices: vec![finger(0.01, 0.02, 0.5)],
        ..ModelParameters::for_reference()
    };
    let end = half_extent(&bodies[0], 0);
    let surfaces = [0, 1].map(|side| {
        let body = &bodies[side];
        let object = ModelObject::new(body.clone(), start_at(DVec3::ZERO));
        let (model, mut state) = model_and_state(parameters.clone(), vec![object]);
        let point = SurfacePoint { triangle: 5, weights: [0.1, 0.6, 0.3] };
        for number in 0..200 {
            let depth = 0.03 * f64::from(number) * 1e-3;
            let tip = DeviceInput::touching(DVec3::new(end + 0.011 - depth, 0.01, 0.01));
            step(&model, &mut state, &Input { devices: vec![tip], ..Input::default() });
        }
        let mut displacements = vec![DVec3::ZERO; body.surface.positions.len()];
        let deformed = state.deformation(0);
        deformed.surface_displacement(&model, &mut displacements);
        let mut cached = displacements.clone();
        let cache = &mut ResidualFieldCache::default();
        deformed.surface_displacement_cached(&model, cache, &mut cached);
        let apart = cached.iter().zip(&displacements).map(|(a, b)| (*a - *b).length());
        assert!(apart.fold(0.0, f64::max) < 1e-7, "a cached field is of single precision");
        let probed = state.point_displacement(&model, 0, &point);
        let force = state.output().devices[0].force_on_hand;
        (displacements, probed, force)
    });
    let [(own, own_point, force), (expected, point, _)] = &surfaces;
    assert!(force.length() > 0.1, "{force}");
    let largest = expected.iter().map(|u| u.length()).fold(0.0, f64::max);
    for (node, (a, b)) in own.iter().zip(expected).enumerate() {
        assert!((*a - *b).length() < SINGLE * largest, "node {node}: {a} {b}");
    }
    assert!((*own_point - *point).length() < SINGLE * largest, "{own_point} {point}");
}

#[test]
fn contacts_of_an_embedded_surface_are_no_closer_than_the_nodes_that_carry_it() {
    let coarse = free_block();
    let mut body = embedded(&coarse);
    let spacing = coarse.surface.mean_edge();
    let embedding = body.embedding.as_mut().expect("an embedding");
    embedding.mean_edge = spacing;
    let body = Arc::new(body);
    let parameters = ModelParameters {
        gravity: DVec3::Y * -GRAVITY_M_S2,
        obstacles: vec![floor(0.5)],
        max_contact_samples: 24,
        ..ModelParameters::default()
    };
    let height = half_extent(&body, 1);
    let object = object_at(&body, DVec3::Y * (height + 2e-3), DVec3::ZERO);
    let (model, mut state) = model_and_state(parameters, vec![object]);
    let stored = stored_energy(&state);
    let mut most = 0;
    for _ in 0..1000 {
        step(&model, &mut state, &Input::default());
        let output = state.output();
        let positions: Vec<DVec3> = output.contacts.iter().map(|contact| contact.point).collect();
        most = most.max(positions.len());
        assert!(energy_imbalance(output, stored).abs() < 1e-9, "{}", energy_imbalance(output, stored));
    }
    // The face of the coarse body has 9 nodes, that of the embedded one 25.
    assert!((3..=12).contains(&most), "{most} contacts");
    let weight = body.mass() * GRAVITY_M_S2;
    let carried = state.output().obstacles[0].force.y;
    assert!((carried + weight).abs() < 1e-2 * weight, "{carried} {weight}");
}

fn stored_energy(state: &State) -> f64 {
    state.output().energy.stored()
}

#[test]
fn files_hold_the_model_and_the_weights() {
    for coarse in [free_block(), fixed_block()] {
        let body = embedded(&coarse);
        let bytes = body.to_bytes().expect("a file");
        let read = Recording::from_bytes(&bytes).expect("a recording");
        assert!(read == body);
        assert_eq!(read.to_bytes().expect("a file"), bytes);
        assert_eq!(read.metadata.format_version, EMBEDDED_FORMAT_VERSIONS[0]);
        // Of a file with all compliances most is S, which grows with the square of the surface.
        let whole = subdivided(&coarse, 1).to_bytes().expect("a file");
        assert!(2 * bytes.len() < whole.len(), "{} {}", bytes.len(), whole.len());
    }
}

#[test]
fn damaged_embeddings_are_refused() {
    let good = embedded(&free_block());
    let message = |change: fn(&mut Recording)| {
        let mut body = good.clone();
        change(&mut body);
        match body.validate() {
            Err(Error::Recording(RecordingError::Inconsistent { what, .. })) => what,
            other => panic!("{other:?}"),
        }
    };
    fn embedding(body: &mut Recording) -> &mut palpate::Embedding {
        body.embedding.as_mut().expect("an embedding")
    }
    for (change, expected) in [
        (
            (|body| embedding(body).weights[3] = f32::NAN) as fn(&mut Recording),
            "embedding.weights[3] is NaN, expected -100 to 100",
        ),
        (
            |body| embedding(body).weights[3] = 0.75,
            "embedding.weights of surface node 1 sum to 1.25, expected 1",
        ),
        (|body| embedding(body).nodes[0] = 1000, "embedding.nodes name node 1000, beyond the model's"),
        (|body| embedding(body).offsets[2] = 1, "embedding.offsets do not divide"),
        (|body| embedding(body).mean_edge = 0.0, "embedding.mean_edge is 0e0 m"),
        (
            |body| {
                embedding(body).weights.pop();
            },
            "embedding.weights holds",
        ),
        (|body| embedding(body).mode_shapes[0] = f64::INFINITY, "modes.mode_shapes[0] is inf"),
        (
            |body| {
                embedding(body).mode_shapes.pop();
            },
            "modes.mode_shapes holds",
        ),
        (|body| body.metadata.format_version = 1, "an embedding is given with format version 1"),
        (|body| body.embedding = None, "no embedding is given with format version 3"),
    ] {
        let found = message(change);
        assert!(found.contains(expected), "{found:?} lacks {expected:?}");
    }
}
