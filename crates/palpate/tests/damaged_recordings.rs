//! Damaged content behind a right hash: every field of every kind of recording, damaged in many ways, is refused or makes a model that
//! steps with finite numbers; nothing panics, and nothing is allocated beyond the size of the file.

use glam::DVec3;
use palpate::{Error, ModelObject, ModelParameters, Recording, State, step};
use palpate_testkit::{
    CountingAllocator, EditableRecording, FIXED_BLOCK_FILE, FREE_BLOCK_FILE, finger, fixed_block, floor,
    free_block, grasp, largest_allocation, subdivided, subdivided_near_field, touching,
};
use safetensors::Dtype;
use serde_json::{Value, json};
use std::sync::Arc;

#[global_allocator]
static COUNTING: CountingAllocator = CountingAllocator;

const BALL: &[u8] = include_bytes!("../../../data/recordings/v1_levels/ball.palp");

/// Upper limit of an allocation for a file of 100 kB [bytes]: the reader's, and those of the model, which holds patches.
const LARGEST_ALLOCATION: usize = 64 << 20;

/// Recordings of every kind: free, fixed, with levels, with a near field.
fn files() -> Vec<(&'static str, Vec<u8>)> {
    let near = subdivided_near_field(&free_block()).to_bytes().expect("a good recording");
    vec![
        ("free", FREE_BLOCK_FILE.to_vec()),
        ("fixed", FIXED_BLOCK_FILE.to_vec()),
        ("levels", BALL.to_vec()),
        ("near field", near),
    ]
}

/// Reading, a model of two such objects with a floor, a finger and a held point, and three steps. Gives the refusal; panics if a number
/// is not finite.
fn use_file(file: &[u8]) -> Result<(), Error> {
    let recording = Arc::new(Recording::from_bytes(file)?);
    let radius = recording.surface.radius();
    // Devices have a largest size.
    let tip = (0.1 * radius).min(1.0);
    let is_fixed = recording.gravity.is_some();
    let object =
        |height: f64| palpate_testkit::object_at(&recording, DVec3::Y * (height * radius), DVec3::ZERO);
    let objects: Vec<ModelObject> = if is_fixed { vec![object(0.0)] } else { vec![object(0.9), object(2.5)] };
    let parameters = ModelParameters {
        gravity: DVec3::Y * -9.81,
        obstacles: vec![floor(0.5)],
        devices: vec![finger(tip, tip, 0.5), finger(tip, 0.0, 0.5)],
        max_contact_samples: 12,
        ..ModelParameters::default()
    };
    let model = palpate::Model::new(parameters, objects)?;
    let mut state = State::new(&model);
    let mut input = touching(&[DVec3::Y * (2.0 * radius), DVec3::ZERO]);
    input.devices[1] = palpate::DeviceInput::held(DVec3::ZERO, grasp(0, 0, [0.2, 0.3, 0.5]));
    for _ in 0..3 {
        let output = step(&model, &mut state, &input);
        let forces: Vec<f64> =
            output.devices.iter().flat_map(|device| device.force_on_hand.to_array()).collect();
        assert!(forces.iter().all(|force| force.is_finite()), "forces {forces:?}");
        assert!(output.energy.stored().is_finite(), "{:?}", output.energy);
        let poses = output.objects.iter().all(|object| object.pose.position.is_finite());
        assert!(poses, "{:?}", output.objects);
        input.devices[0].position.y -= 0.05 * radius;
    }
    Ok(())
}

/// Outcome of a file, with the rest of the process safe from a panic in it.
fn outcome(name: &str, file: &[u8]) -> Result<(), Error> {
    largest_allocation();
    let used = std::panic::catch_unwind(|| use_file(file));
    let largest = largest_allocation();
    assert!(largest < LARGEST_ALLOCATION, "{name}: an allocation of {largest} bytes");
    used.unwrap_or_else(|_| panic!("{name}: a panic"))
}

#[test]
fn every_tensor_damaged_in_many_ways_is_refused_or_makes_a_model() {
    let (mut refused, mut accepted) = (0, 0);
    for (kind, file) in files() {
        let good = EditableRecording::new(&file).expect("a recording");
        assert_eq!(outcome(kind, &good.to_bytes().expect("a file")), Ok(()));
        for tensor in &good.tensors {
            let name = format!("{kind}: {}", tensor.name);
            let damage = |what: &str, change: &dyn Fn(&mut EditableRecording)| {
                let mut damaged = good.clone();
                change(&mut damaged);
                let file = damaged.to_bytes().expect("a container");
                outcome(&format!("{name} {what}"), &file)
            };
            let must_fail = |what: &str, change: &dyn Fn(&mut EditableRecording)| {
                let refusal = damage(what, change).expect_err(&format!("{name} {what} is accepted"));
                assert!(matches!(refusal, Error::Recording(_)), "{name} {what}: {refusal}");
            };
            let own = tensor.name.as_str();
            let last = tensor.len() - 1;
            for at in [0, last / 3, last] {
                let set =
                    |value: f64| move |damaged: &mut EditableRecording| damaged.tensor(own).set(at, value);
                let impossible: &[f64] = match tensor.dtype {
                    Dtype::U32 => &[f64::from(u32::MAX), 1e9],
                    _ => &[f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e300, 3e38],
                };
                for &value in impossible {
                    // A node number of the mesh file may be any.
                    if own == "surface.source_nodes" {
                        assert_eq!(damage("any number", &set(value)), Ok(()));
                    } else {
                        must_fail(&format!("{value:e} at {at}"), &set(value));
                    }
                    refused += 1;
                }
                for value in [0.0, -0.0, 1.0, 2.0, -1.0, 1e-300, -1e-300, 1e-30, 1e9, -1e9, 1e17] {
                    match damage(&format!("{value:e} at {at}"), &set(value)) {
                        Ok(()) => accepted += 1,
                        Err(refusal) => {
                            assert!(matches!(refusal, Error::Recording(_)), "{name} {value}: {refusal}");
                            refused += 1;
                        }
                    }
                }
            }
            let entries = tensor.shape[0];
            for length in [0, 1, entries / 2, entries - 1, entries + 1, 2 * entries, 100 * entries] {
                if length != entries {
                    must_fail(&format!("{length} entries"), &|damaged| damaged.tensor(own).resize(length));
                    refused += 1;
                }
            }
            must_fail("cut in its last extent", &|damaged| {
                let tensor = damaged.tensor(own);
                let width = tensor.width();
                let length = tensor.bytes.len() - width;
                tensor.bytes.truncate(length);
                tensor.shape = vec![length / width];
            });
            must_fail("of another type", &|damaged| {
                let tensor = damaged.tensor(own);
                tensor.dtype = if tensor.dtype == Dtype::U32 { Dtype::F32 } else { Dtype::U32 };
                tensor.shape = vec![tensor.bytes.len() / 4];
            });
            // Without its levels, its residual compliance or its gravity a file is whole; without a part of them it is not.
            let _ = damage("missing", &|damaged| damaged.tensors.retain(|tensor| tensor.name != own));
        }
    }
    println!("{refused} damaged files refused, {accepted} are recordings all the same");
    assert!(refused > 1000);
}

#[test]
fn every_number_of_the_metadata_damaged_is_refused_or_makes_a_model() {
    fn paths(value: &Value, path: &str, into: &mut Vec<String>) {
        match value {
            Value::Object(entries) => {
                entries.iter().for_each(|(key, value)| paths(value, &format!("{path}/{key}"), into));
            }
            Value::Array(entries) => {
                (0..)
                    .zip(entries)
                    .for_each(|(at, value): (usize, _)| paths(value, &format!("{path}/{at}"), into));
            }
            _ => into.push(path.into()),
        }
    }
    for (kind, file) in files().into_iter().take(3) {
        let good = EditableRecording::new(&file).expect("a recording");
        let mut all = Vec::new();
        paths(&good.metadata, "", &mut all);
        for path in &all {
            let others = [
                json!(0),
                json!(-1),
                json!(3),
                json!(1e300),
                json!(-1e300),
                json!(1e-300),
                json!(u64::MAX),
                json!(null),
                json!("x"),
                json!([]),
                json!({}),
                json!(true),
            ];
            for other in others {
                let mut damaged = good.clone();
                *damaged.metadata.pointer_mut(path).expect("a place") = other.clone();
                let file = damaged.to_bytes().expect("a file");
                let _ = outcome(&format!("{kind}: {path} {other}"), &file);
            }
        }
    }
}

#[test]
fn refusals_name_the_field_the_finding_and_what_is_expected() {
    let refused = |change: &dyn Fn(&mut Recording), of: &Arc<Recording>| {
        let mut recording = Recording::clone(of);
        change(&mut recording);
        recording.validate().expect_err("damaged").to_string()
    };
    type Case<'a> = (&'a dyn Fn(&mut Recording), &'a Arc<Recording>, &'a str);
    let cases: [Case; 22] = [
        (
            &|r| r.surface.positions[2].y = f64::NAN,
            &free_block(),
            "surface.positions[7] is NaN m, expected -1e18 to 1e18",
        ),
        (
            &|r| r.surface.triangles[4][1] = 12,
            &free_block(),
            "surface.triangles name node 12 in triangle 4, beyond the surface's 12 nodes",
        ),
        (
            &|r| r.surface.triangles[4][1] = r.surface.triangles[4][0],
            &free_block(),
            "surface.triangles name a node twice in triangle 4, expected three different ones",
        ),
        (
            &|r| r.surface.triangles.truncate(19),
            &free_block(),
            "surface.triangles leave the edge between the nodes 9 and 10 open, expected a closed surface",
        ),
        (&|r| r.surface.triangles.clear(), &free_block(), "surface.triangles is empty"),
        (
            &|r| r.surface.source_nodes[1] = r.surface.source_nodes[0],
            &free_block(),
            "surface.source_nodes hold node 0 twice, expected different nodes",
        ),
        (
            &|r| r.surface.source_nodes.truncate(11),
            &free_block(),
            "surface.source_nodes holds 11 numbers, expected 12",
        ),
        (
            &|r| r.surface.positions.iter_mut().for_each(|p| *p = DVec3::ZERO),
            &free_block(),
            "surface.triangles have a mean edge of 0e0 m, expected a surface with an extent",
        ),
        (
            &|r| r.modes.damping_ratios[1] = -0.1,
            &free_block(),
            "modes.damping_ratios[1] is -1e-1, expected 0e0 to 1e18",
        ),
        (
            &|r| r.modes.angular_frequencies[0] = 0.0,
            &free_block(),
            "modes.angular_frequencies[0] is 0e0 rad/s, expected 1e-6 to 1e13",
        ),
        (
            &|r| r.modes.mode_shapes.truncate(431),
            &free_block(),
            "modes.mode_shapes holds 431 numbers, expected 432",
        ),
        (
            &|r| r.metadata.mass.mass_kg = -1.0,
            &free_block(),
            "mass.mass_kg[0] is -1e0 kg, expected 1e-18 to 1e18",
        ),
        (
            &|r| r.metadata.mass.inertia_kg_m2[0][1] = 1.0,
            &free_block(),
            "mass.inertia_kg_m2 is not one of a body: symmetric, positive definite, and no principal value above the sum of the others",
        ),
        (&|r| r.metadata.mass.mass_kg *= 1e-3, &free_block(), "mass.inertia_kg_m2 has the trace"),
        (&|r| r.metadata.mesh.order = 3, &free_block(), "mesh.order is 3, expected 1 or 2"),
        (
            &|r| r.metadata.mesh.fixed_nodes = 4,
            &free_block(),
            "mesh.fixed_nodes is 4 with the support Free, which contradict",
        ),
        (
            &|r| r.metadata.materials[0].poisson = 0.5,
            &free_block(),
            "materials.poisson of the region \"\" is 5e-1, expected a number from -1e0 to below 5e-1",
        ),
        (
            &|r| r.metadata.damping = palpate::Damping::Ratio(-1.0),
            &free_block(),
            "damping.ratio is -1e0, expected a number from 0e0 to below 1e18",
        ),
        (&|r| r.gravity = None, &fixed_block(), "gravity.modal_forces is missing: the body has fixed nodes"),
        (
            &|r| r.gravity = fixed_block().gravity.clone(),
            &free_block(),
            "gravity.modal_forces is given, but the body has no fixed nodes",
        ),
        (
            &|r| r.gravity.as_mut().expect("fixed").modal_forces[0] = 1e3,
            &fixed_block(),
            "gravity.modal_forces of axis 0 have the squared sum",
        ),
        (
            &|r| r.residual = subdivided(&free_block(), 1).residual,
            &free_block(),
            "residual compliance holds 8127 numbers, 12 nodes need 702",
        ),
    ];
    for (change, of, expected) in cases {
        let found = refused(change, of);
        assert!(found.starts_with(&format!("not a usable recording: {expected}")), "{found}\nfor {expected}");
    }
}
