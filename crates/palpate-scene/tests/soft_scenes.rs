//! Built-in scenes of soft bodies: the lump in the liver is felt, the jelly wobbles at its frequency, the gripper carries the weight, the duck stands and is squeezed.

use glam::DVec3;
use palpate::{DeviceInput, DeviceMode, State, step};
use palpate_fem::RecordedBody;
use palpate_scene::{BodySource, MaterialChoice, OpenedScene, RecordOptions, SceneLibrary, SilentProgress};
use std::f64::consts::TAU;
use tempfile::TempDir;

/// Largest recording of a built-in scene.
const BYTES: u64 = 3_000_000;

/// Force error that the certificates of these scenes keep.
const FORCE_ERROR: f64 = 0.03;

/// Opened scene, whose recordings are small and certified, and of which nothing is warned.
fn opened(id: &str) -> OpenedScene {
    let folder = TempDir::new().expect("a folder");
    let library = SceneLibrary::new(Some(folder.path())).expect("a library");
    let opened = library.open_built_in(id, &mut SilentProgress).expect("a scene");
    for file in std::fs::read_dir(folder.path()).expect("a folder").flatten() {
        let bytes = file.metadata().expect("a file").len();
        println!("{id}: {} has {} kB", file.file_name().display(), bytes / 1000);
        assert!(bytes < BYTES, "{id}: {bytes} bytes");
    }
    for recording in opened.scene.model.recordings() {
        let certificate = recording.metadata.certificate.as_ref().expect("a certificate");
        let error = certificate.force_error_max;
        println!("{id}: force error {:.2} %", 100.0 * error);
        assert!(error < FORCE_ERROR, "{id}: {error}");
    }
    assert!(opened.scene.warnings.is_empty(), "{id}: {:?}", opened.scene.warnings);
    opened
}

/// Steps a scene to a time [s], and looks at each step; pointers go where they are told, or rest.
fn run(
    opened: &OpenedScene,
    seconds: f64,
    hand: impl Fn(f64) -> Option<DVec3>,
    mut look: impl FnMut(f64, &State) -> bool,
) {
    let scene = &opened.scene;
    let h = scene.model.parameters().step_s;
    let mut state = State::new(&scene.model);
    let first = scene.devices.iter().position(|device| device.pointer);
    for number in 1..=(seconds / h).round() as u32 {
        let time = f64::from(number) * h;
        let mut input = scene.input_at(time);
        for (slot, _) in scene.devices.iter().enumerate().filter(|(_, device)| device.pointer) {
            let position = hand(time).filter(|_| first == Some(slot));
            input.devices[slot] = position.map_or(DeviceInput::inactive(), |position| DeviceInput {
                position,
                mode: DeviceMode::Touch,
            });
        }
        step(&scene.model, &mut state, &input);
        if look(time, &state) {
            return;
        }
    }
}

/// Force [N] of a finger that comes from above at x and z [m], 4 mm below the place where it has met the body.
fn force_at_depth(opened: &OpenedScene, x: f64, z: f64) -> f64 {
    const DEPTH: f64 = 0.004;
    let hand = |time: f64| Some(DVec3::new(x, 0.058 - 0.012 * time, z));
    let (mut met, mut force) = (None, None);
    run(opened, 4.0, hand, |_, state| {
        let finger = &state.output().devices[0];
        if finger.force_on_hand.y > 1e-4 && met.is_none() {
            met = Some(finger.proxy.y);
        }
        force = met.filter(|met| met - finger.proxy.y >= DEPTH).map(|_| finger.force_on_hand.y);
        force.is_some()
    });
    force.unwrap_or_else(|| panic!("a finger that goes 4 mm deep, met at {met:?}"))
}

/// Scene of the liver with cells of a size [m], and a lump of a stiffness [Pa].
fn liver(cell_size: f64, lump_pa: f64, folder: &TempDir) -> OpenedScene {
    let material = |region: &str, young: f64| {
        format!("[[material]]\nregion = \"{region}\"\nyoung = {young}\npoisson = 0.45\ndensity = 1060.0\n")
    };
    let text = material("liver", 4000.0) + &material("lump", lump_pa);
    let options = RecordOptions {
        materials: MaterialChoice::Text(text, "materials".into()),
        damping: Some(palpate::Damping::Rayleigh { alpha: 4.0, beta: 2e-3 }),
        modes: 100,
        order: palpate_fem::ElementOrder::Linear,
        fix: vec!["underside".into()],
        ..RecordOptions::default()
    };
    let source = format!("body:liver/{cell_size}");
    let recording = options.record(BodySource::Text(&source), &mut SilentProgress).expect("a recording");
    let bytes = recording.to_bytes().expect("a file");
    std::fs::write(folder.path().join("liver.palp"), bytes).expect("a file");
    let library = SceneLibrary::new(Some(folder.path())).expect("a library");
    let written = folder.path().join("written");
    library.write_built_in("liver", 10, &written, &mut SilentProgress).expect("a scene");
    std::fs::copy(folder.path().join("liver.palp"), written.join("liver.palp")).expect("a copy");
    library.open_file(&written.join("scene.toml")).expect("a scene")
}

#[test]
fn a_finger_finds_the_lump_in_the_liver() {
    let shape = palpate_mesh::Liver::default();
    // Sections are symmetric about the ridge, where the world has the mesh's x and z.
    let mirrored = 2.0 * shape.ridge_z(shape.lump.x) - shape.lump.z;
    let measure =
        |scene: &OpenedScene| [shape.lump.z, mirrored].map(|z| force_at_depth(scene, shape.lump.x, z));
    let built_in = measure(&opened("liver"));
    let folder = TempDir::new().expect("a folder");
    for cell_size in [shape.cell_size, 0.012] {
        let [above, beside] = measure(&liver(cell_size, 40_000.0, &folder));
        let [healthy, healthy_beside] = measure(&liver(cell_size, 4_000.0, &folder));
        println!(
            "cells of {cell_size} m: {above:.3} N above the lump, {beside:.3} N at the mirrored place; without it {healthy:.3} N and \
             {healthy_beside:.3} N"
        );
        assert!(above / beside > 1.35 && above / healthy > 1.45, "{above} {beside} {healthy}");
        // Without a lump the two places are alike, and far from it the lump is not felt.
        assert!((healthy / healthy_beside - 1.0).abs() < 0.1, "{healthy} {healthy_beside}");
        assert!((beside / healthy_beside - 1.0).abs() < 0.02, "{beside} {healthy_beside}");
        if cell_size == shape.cell_size {
            let difference = (built_in[0] / above - 1.0).abs().max((built_in[1] / beside - 1.0).abs());
            assert!(difference < 1e-3, "{built_in:?} {above} {beside}");
        }
    }
}

#[test]
fn a_tapped_jelly_wobbles_at_the_frequency_of_a_finer_mesh_and_stays_on_its_plate() {
    let opened = opened("jelly");
    let scene = &opened.scene;
    let recording = scene.model.recordings().next().expect("a jelly");
    let lowest = recording.modes.angular_frequencies[0] / TAU;
    let material = &recording.metadata.materials[0];
    let finer = RecordOptions {
        materials: MaterialChoice::Uniform(material.clone()),
        modes: 4,
        fix: vec!["underside".into()],
        ..RecordOptions::default()
    };
    let prepared = finer.prepare(BodySource::Text("body:jelly/7"), &mut SilentProgress).expect("a body");
    let body: RecordedBody = prepared.record(&mut SilentProgress).expect("a recording");
    let expected = body.recording.modes.angular_frequencies[0] / TAU;

    // A tap on the flank at the top, and zero crossings of the surface's sway while the plate rests: from 1.5 s on.
    let (top, _) = recording.surface.nearest(DVec3::new(0.0, 0.03, 0.0)).expect("a surface");
    let hand =
        |time: f64| (1.2..1.3).contains(&time).then(|| DVec3::new(0.055 - 0.2 * (time - 1.2), 0.05, 0.0));
    let mut sway: Vec<(f64, f64)> = Vec::new();
    let mut farthest = 0.0_f64;
    let mut nodes = vec![DVec3::ZERO; recording.surface.positions.len()];
    run(&opened, 5.0, hand, |time, state| {
        state.surface_displacement(&scene.model, 0, &mut nodes);
        let triangle = recording.surface.triangles[top.triangle as usize];
        sway.push((time, nodes[triangle[0] as usize].x));
        let along = state.output().objects[0].pose.position;
        farthest = farthest.max(along.x.abs()).max(along.z.abs());
        false
    });
    let free: Vec<(f64, f64)> = sway.into_iter().filter(|(time, _)| *time > 1.6).collect();
    let largest = free.iter().map(|(_, x)| x.abs()).fold(0.0, f64::max);
    let crossing = |pair: &[(f64, f64)]| {
        let [(t, a), (u, b)] = [pair[0], pair[1]];
        (a < 0.0 && b >= 0.0).then(|| t + (u - t) * a / (a - b))
    };
    let crossings: Vec<f64> = free.windows(2).filter_map(crossing).take(8).collect();
    let wobble = 7.0 / (crossings[7] - crossings[0]);
    println!(
        "lowest mode {lowest:.3} Hz, of a finer mesh {expected:.3} Hz, wobbles at {wobble:.3} Hz by {:.1} mm",
        1e3 * largest
    );
    assert!((3.0..8.0).contains(&lowest));
    assert!((lowest / expected - 1.0).abs() < 0.02, "{lowest} {expected}");
    assert!((wobble / expected - 1.0).abs() < 0.03, "{wobble} {expected}");
    assert!(largest > 1e-3, "visible: {largest} m");
    assert!(farthest < 0.013, "it goes with its plate, by 12 mm: {farthest}");
}

#[test]
fn the_gripper_lifts_the_cube_and_sets_it_down_again_and_carries_its_weight() {
    let opened = opened("gripper");
    let scene = &opened.scene;
    let weight = 9.81 * scene.model.recordings().next().expect("a cube").mass();
    let (mut start, mut deviation, mut count) = (DVec3::ZERO, 0.0_f64, [0, 0]);
    let mut height = [f64::INFINITY, 0.0];
    run(
        &opened,
        32.0,
        |_| None,
        |time, state| {
            let cube = &state.output().objects[0];
            let phase = time % 8.0;
            if (4.2..4.8).contains(&phase) {
                // Held, still, off the floor: the fingers alone carry it.
                let net: DVec3 = cube.force - DVec3::new(0.0, weight, 0.0);
                deviation = deviation.max(net.length() / weight);
                height[0] = f64::min(height[0], cube.pose.position.y);
                count[0] += 1;
            }
            if (7.4..7.6).contains(&phase) {
                start = cube.pose.position;
                height[1] = f64::max(height[1], start.y);
                assert!(start.x.abs() < 1e-3 && start.z.abs() < 1e-3, "{time} s: {start}");
                count[1] += 1;
            }
            false
        },
    );
    println!(
        "held: {:.2} % off the weight at most, {height:?} m above and on the floor, at the end {start}",
        100.0 * deviation
    );
    assert!(count[0] >= 4 * 599 && count[1] >= 4 * 199, "{count:?}");
    assert!(deviation < 0.01, "{deviation}");
    assert!(height[0] > 0.075 && height[1] < 0.026, "{height:?}");
}

/// Width of the duck's neck where the fingers are [m], and how far they go in on each side [m].
const NECK: f64 = 0.056;
const SQUEEZE: f64 = 0.006;

#[test]
fn the_duck_stands_and_takes_the_squeeze_of_two_fingers() {
    let opened = opened("duck");
    let scene = &opened.scene;
    let h = scene.model.parameters().step_s;
    let mut state = State::new(&scene.model);
    let pointers: Vec<usize> = (0..scene.devices.len()).filter(|&slot| scene.devices[slot].pointer).collect();
    let tip = scene.devices[pointers[0]].parameters.tip_radius;
    let run = |state: &mut State, seconds: f64, apart: &dyn Fn(f64) -> Option<f64>| {
        let frame = state.output().objects[0].pose;
        for number in 1..=(seconds / h).round() as u32 {
            let mut input = scene.input_at(0.0);
            pointers.iter().for_each(|&slot| input.devices[slot] = DeviceInput::inactive());
            if let Some(apart) = apart(f64::from(number) * h) {
                for (slot, side) in pointers.iter().zip([1.0, -1.0]) {
                    // At the neck, beside the centre of mass.
                    let position = frame.position
                        + frame.orientation * DVec3::new(0.016, 0.012, side * (0.5 * NECK + tip + apart));
                    input.devices[*slot] = DeviceInput { position, mode: DeviceMode::Touch };
                }
            }
            step(&scene.model, state, &input);
        }
    };
    run(&mut state, 3.0, &|_| None);
    let standing = state.output().objects[0].pose;
    let up = standing.orientation * DVec3::Y;
    assert!(up.y > 0.999 && (standing.position.y - 0.046).abs() < 1e-3, "{standing:?}");
    run(&mut state, 1.0, &|time| Some(0.004 - (0.004 + SQUEEZE) * (time / 0.8).min(1.0)));
    let forces = [0, 1].map(|at| state.output().devices[pointers[at]].force_on_hand);
    println!(
        "squeezed: {:?} N, {:.2} mm",
        forces.map(|force| force.z),
        1e3 * state.output().objects[0].pose.position.y
    );
    // Each hand is pushed outwards, by as much as the other.
    assert!(forces[0].z > 0.3 && forces[1].z < -0.3, "{forces:?}");
    assert!((forces[0].z + forces[1].z).abs() < 0.1 * forces[0].z, "{forces:?}");
    run(&mut state, 2.0, &|_| None);
    let rest = state.output().objects[0].pose;
    assert!(
        (rest.orientation * DVec3::Y).y > 0.999 && (rest.position - standing.position).length() < 0.01,
        "{rest:?}"
    );
}
