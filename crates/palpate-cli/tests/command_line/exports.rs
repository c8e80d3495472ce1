//! Runs and recordings as files for other programs.

use crate::glb::Glb;
use crate::realtime;
use crate::workplace::{Table, Workplace};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::{DQuat, DVec3};
use palpate::{
    Coupling, DeviceInput, DeviceMode, DeviceParameters, Input, Model, ModelParameters, Obstacle, Pose,
    Recording, Shape, State, step,
};
use palpate_haptics::SceneNames;
use palpate_haptics::log::{LogReader, LogWriter};
use palpate_testkit::{GRAVITY_M_S2, finger, floor, object_at, wait_until};
use std::collections::BTreeMap;
use std::io::Cursor;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Rest, displacement, translation and turn are rounded to single precision [m]: numbers below 0.25.
const SINGLE: f64 = 8.0 * 0.25 * f32::EPSILON as f64;

/// Two fingers on a cube on a floor, logged for 0.6 s: 300 steps.
fn logged() -> Workplace {
    let workplace = realtime::workplace();
    workplace.succeed(&["run", "fingers.toml", "--realtime", "--duration", "0.6", "--log", "run.mcap"]);
    workplace
}

/// The scene of `realtime::workplace`, made without the command.
fn model(workplace: &Workplace) -> Model {
    let recording = Recording::from_bytes(&workplace.read("cube.palp")).expect("a recording");
    let coupling = Some(Coupling { stiffness: 200.0, damping: 0.5 });
    let finger = DeviceParameters { coupling, ..finger(0.005, 0.005, 0.6) };
    let floor = Obstacle { shape: Shape::Plane { normal: DVec3::Z }, ..floor(0.5) };
    let parameters = ModelParameters {
        step_s: STEP_S,
        gravity: DVec3::Z * -GRAVITY_M_S2,
        max_contact_samples: 8,
        devices: vec![finger; 2],
        obstacles: vec![floor],
        ..ModelParameters::for_real_time()
    };
    let cube = object_at(&Arc::new(recording), DVec3::Z * 0.0501, DVec3::ZERO);
    Model::new(parameters, vec![cube]).expect("a model")
}

/// Where the cube's surface nodes are at the end of each step [m, world], from 0; computed from the log's inputs.
fn surfaces(workplace: &Workplace) -> Vec<Vec<DVec3>> {
    let model = model(workplace);
    let names = SceneNames {
        objects: vec!["cube".into()],
        devices: vec!["left".into(), "right".into()],
        obstacles: vec!["floor".into()],
        ..SceneNames::default()
    };
    let bytes = workplace.read("run.mcap");
    let mut state = State::new(&model);
    let placed = |state: &State| {
        let rest = &model.recordings().next().expect("one").surface.positions;
        let mut displacement = vec![DVec3::ZERO; rest.len()];
        state.deformation(0).surface_displacement(&model, &mut displacement);
        let pose = state.output().objects[0].pose;
        rest.iter().zip(&displacement).map(|(rest, u)| pose.world_from_body(*rest + *u)).collect()
    };
    let mut surfaces = vec![placed(&state)];
    for logged in LogReader::new(&bytes).expect("a log").logged_steps() {
        let logged = logged.expect("a step");
        step(&model, &mut state, &logged.input(&names, &[DeviceMode::Touch; 2]).expect("an input"));
        assert_eq!(logged.first_difference(&names, state.output()), None, "the test has the same scene");
        surfaces.push(placed(&state));
    }
    surfaces
}

/// Step of the scene [s].
const STEP_S: f64 = 0.002;

/// Rounding of times below a second to single precision [s].
const TIME_S: f64 = 1e-6;

/// Round-off of a time that is a sum of steps and was written as text [s].
const TEXT_S: f64 = 1e-9;

/// Rounding of normals and forces to single precision [1], relative above 1.
const SINGLE_SHARE: f64 = 1e-6;

/// Rounding of the largest of many displacements, differences of coordinates in single precision [1].
const LARGEST_SHARE: f64 = 1e-5;

/// Displacement of a cube that deforms [m], at least.
const DEFORMED_M: f64 = 1e-5;

/// Round-off of a turned unit vector [1].
const TURNED: f64 = 1e-12;

/// Rounding of a coordinate that is 0 [m].
const ON_THE_FLOOR_M: f64 = 1e-9;

/// Rounding of the radius of a tip of 5 mm to single precision [m].
const TIP_M: f64 = 1e-8;

/// The largest distance [m] of a point from the nearest of others.
fn apart(points: &[DVec3], others: &[DVec3]) -> f64 {
    let nearest = |p: &DVec3| others.iter().map(|other| (*p - *other).length()).fold(f64::INFINITY, f64::min);
    points.iter().map(nearest).fold(0.0, f64::max)
}

#[test]
fn an_animation_has_the_surface_at_every_frame_where_the_run_had_it() {
    let workplace = logged();
    let report = workplace.json(&["export", "run.mcap", "--gltf", "run.glb", "--json"]);
    assert_eq!((&report["steps"], &report["frames"]), (&300.into(), &19.into()));
    assert_eq!(report["repeated"], serde_json::json!({ "steps": 300, "identical": true }));
    assert_eq!(
        (&report["files"][0]["kind"], &report["files"][0]["path"]),
        (&"gltf".into(), &"run.glb".into())
    );
    assert_eq!(report["files"][0]["bytes"], workplace.read("run.glb").len());
    let glb = Glb::parse(&workplace.read("run.glb"));
    let surfaces = surfaces(&workplace);
    let (times, weights) = glb.channel("cube", "weights", 1).expect("it deforms");
    assert_eq!((times.len(), weights.len()), (19, 19 * 19));
    for (frame, time) in times.iter().enumerate() {
        let number = (time / 0.002).round() as usize;
        assert!(
            (time - frame as f64 / 30.0) < STEP_S && (time - STEP_S * number as f64).abs() < TIME_S,
            "{time}"
        );
        let (position, turn) = glb.place("cube", frame);
        let drawn = glb.vertices("cube", "POSITION", &weights[19 * frame..19 * (frame + 1)]);
        let drawn: Vec<DVec3> = drawn.into_iter().map(|p| position + turn * p).collect();
        let off = apart(&drawn, &surfaces[number]).max(apart(&surfaces[number], &drawn));
        assert!(off < SINGLE, "frame {frame}: {off:e} m");
        // Normals are unit vectors, also of a deformed surface.
        let normals = glb.vertices("cube", "NORMAL", &weights[19 * frame..19 * (frame + 1)]);
        assert!(normals.iter().all(|n| (n.length() - 1.0).abs() < SINGLE_SHARE));
    }
    // It does deform: the last shape is not the first.
    let (first, last) = (&weights[..19], &weights[18 * 19..]);
    let moved = apart(&glb.vertices("cube", "POSITION", last), &glb.vertices("cube", "POSITION", first));
    assert!(moved > DEFORMED_M, "{moved:e}");

    // Gravity points down: the scene's z is up, and glTF's y.
    let up = DQuat::from_array(glb.property("world", "rotation")) * DVec3::Z;
    assert!((up - DVec3::Y).length() < TURNED, "{up}");
    // The floor lies where it is, does not move, and is not smaller than the cube.
    let floor = glb.vertices("floor", "POSITION", &[]);
    assert!(
        floor.iter().all(|p| p.z.abs() < ON_THE_FLOOR_M && p.x.abs() > 0.1 && p.y.abs() > 0.1),
        "{floor:?}"
    );
    assert!(glb.channel("floor", "translation", 3).is_none() && glb.channel("floor", "weights", 1).is_none());
    // Tips are where the proxies are.
    workplace.succeed(&["export", "run.mcap", "--csv", "steps.csv"]);
    let table = Table::parse(&workplace.text("steps.csv"));
    let proxies = table.vectors("left", ["proxy_x", "proxy_y", "proxy_z"]);
    for (frame, time) in times.iter().enumerate().skip(1) {
        let number = (time / 0.002).round() as usize;
        assert!((glb.place("left", frame).0 - proxies[number - 1]).length() < SINGLE);
    }
    let tip = glb.vertices("left", "POSITION", &[]);
    assert!(tip.iter().all(|p| (p.length() - 0.005).abs() < TIP_M));
}

#[test]
fn a_part_of_a_run_is_that_part_of_the_whole() {
    let workplace = logged();
    workplace.succeed(&["replay", "run.mcap", "--csv", "all.csv", "--contacts", "touches.csv"]);
    workplace.succeed(&["export", "run.mcap", "--csv", "same.csv", "--contacts", "same_touches.csv"]);
    assert!(workplace.read("all.csv") == workplace.read("same.csv"));
    assert!(workplace.read("touches.csv") == workplace.read("same_touches.csv"));
    let part = ["export", "run.mcap", "--csv", "part.csv", "--gltf", "part.glb", "--fps", "50"];
    let report = workplace.json(&[&part[..], &["--from", "0.2", "--to", "0.3", "--json"]].concat());
    // Nothing after the part needs to be computed.
    assert_eq!((&report["repeated"]["steps"], &report["frames"]), (&150.into(), &6.into()));
    let all = workplace.text("all.csv");
    let lines: Vec<&str> = all.lines().collect();
    let expected = [&lines[..1], &lines[100..151]].concat().join("\n") + "\n";
    assert_eq!(workplace.text("part.csv"), expected);
    let glb = Glb::parse(&workplace.read("part.glb"));
    let (times, _) = glb.channel("cube", "weights", 1).expect("it deforms");
    for (frame, time) in times.iter().enumerate() {
        assert!((time - 0.02 * frame as f64).abs() < TIME_S, "an animation begins at 0: {times:?}");
    }
    let start = glb.json["asset"]["extras"]["start_s"].as_f64().expect("a number");
    assert!((start - 0.2).abs() < TEXT_S, "{start}");
    let text = workplace.succeed(&["export", "run.mcap", "--contacts", "c.csv", "--to", "0.1"]);
    assert_eq!(text, "50 of 300 steps repeated, bit for bit\n  contacts     c.csv\n");
}

/// An array of a VTU file.
fn array(text: &str, name: &str) -> Vec<u8> {
    let (_, rest) = text.split_once(&format!("Name=\"{name}\"")).unwrap_or_else(|| panic!("no {name}"));
    let (_, rest) = rest.split_once('>').expect("a tag");
    let bytes = STANDARD.decode(rest.split_once('<').expect("a tag").0).expect("base64");
    let length = u64::from_le_bytes(bytes[..8].try_into().expect("8 bytes")) as usize;
    assert_eq!(bytes.len(), 8 + length);
    bytes[8..].to_vec()
}

fn vectors(text: &str, name: &str) -> Vec<DVec3> {
    let bytes = array(text, name);
    let number = |four: &[u8]| f64::from(f32::from_le_bytes(four.try_into().expect("4 bytes")));
    bytes.chunks_exact(12).map(|v| DVec3::new(number(&v[..4]), number(&v[4..8]), number(&v[8..]))).collect()
}

#[test]
fn frames_for_paraview_show_obstacles_contacts_and_devices() {
    let workplace = logged();
    workplace.succeed(&[
        "export",
        "run.mcap",
        "--vtu",
        "frames",
        "--contacts",
        "contacts.csv",
        "--fps",
        "50",
    ]);
    let index = workplace.text("frames/scene.pvd");
    // The floor does not move: one file, shown at every time.
    assert_eq!(index.matches("file=\"floor_00000.vtu\"").count(), 31, "{index}");
    assert_eq!(std::fs::read_dir(workplace.path("frames")).expect("a folder").count(), 3 * 31 + 2);
    let surfaces = surfaces(&workplace);
    let contacts = workplace.text("contacts.csv");
    for frame in 0..31 {
        let time = 0.02 * frame as f64;
        let file = |part: &str| workplace.text(&format!("frames/{part}_{frame:05}.vtu"));
        let drawn = vectors(&file("cube"), "Points");
        let off: f64 =
            drawn.iter().zip(&surfaces[10 * frame]).map(|(a, b)| (*a - *b).length()).fold(0.0, f64::max);
        assert!(off < SINGLE, "frame {frame}: {off:e}");
        let rows = contacts.lines().skip(1).filter_map(|line| {
            let numbers: Vec<f64> = line.split(',').filter_map(|cell| cell.parse().ok()).collect();
            ((numbers[0] - time).abs() < TEXT_S).then(|| DVec3::from_slice(&numbers[7..]))
        });
        let forces = vectors(&file("scene.contacts"), "force");
        let rows: Vec<DVec3> = rows.collect();
        assert_eq!(rows.len(), forces.len(), "frame {frame}");
        assert!(
            rows.iter().zip(&forces).all(|(a, b)| (*a - *b).length() < SINGLE_SHARE * (1.0 + a.length()))
        );
        assert_eq!(vectors(&file("scene.devices"), "Points").len(), 2);
    }
    assert!(vectors(&workplace.text("frames/scene.contacts_00030.vtu"), "force").len() > 2, "it stands");
    let floor = vectors(&workplace.text("frames/floor_00000.vtu"), "Points");
    assert!(floor.iter().all(|p| p.z == 0.0 && p.x.abs() > 0.1));
}

#[test]
fn a_recording_is_exported_as_the_shapes_of_its_modes() {
    let workplace = Workplace::with_scene();
    let recording = Recording::from_bytes(&workplace.read("cube.palp")).expect("a recording");
    let export = ["export", "cube.palp", "--gltf", "m.glb", "--csv", "m.csv", "--vtu", "m"];
    let text = workplace.succeed(&[&export[..], &["--modes", "3"]].concat());
    assert!(text.starts_with("3 of 20 modes, "), "{text}");
    let glb = Glb::parse(&workplace.read("m.glb"));
    let names = &glb.json["meshes"][0]["extras"]["targetNames"];
    let hz = |mode: usize| recording.modes.angular_frequencies[mode] / std::f64::consts::TAU;
    assert_eq!(names[2], format!("mode 3: {:.2} Hz", hz(2)));
    assert_eq!(glb.json["animations"][2]["name"], names[2]);
    assert_eq!(glb.json["animations"].as_array().map(Vec::len), Some(3));
    // Rest, and each mode alone: its shape, a tenth of the diagonal at most.
    let rest = glb.vertices("box:0.1x0.1x0.1/3x3x3", "POSITION", &[0.0; 3]);
    assert!(apart(&recording.surface.positions, &rest) < SINGLE);
    let corners = glb.indices(&glb.primitive("box:0.1x0.1x0.1/3x3x3")["indices"]);
    for (drawn, known) in corners.chunks_exact(3).zip(&recording.surface.triangles) {
        for (vertex, node) in drawn.iter().zip(known) {
            let off = rest[*vertex as usize] - recording.surface.positions[*node as usize];
            assert!(off.length() < SINGLE);
        }
    }
    let drawn = glb.vertices("box:0.1x0.1x0.1/3x3x3", "POSITION", &[0.0, 0.0, 1.0]);
    let largest = rest.iter().zip(&drawn).map(|(a, b)| (*a - *b).length()).fold(0.0, f64::max);
    assert!((largest / (0.1 * recording.surface.diagonal()) - 1.0).abs() < LARGEST_SHARE, "{largest}");
    let shape: Vec<DVec3> = (0..recording.surface.positions.len())
        .map(|node| DVec3::from_array([0, 1, 2].map(|axis| recording.modes.row(node, axis)[2])))
        .collect();
    let scale = largest / shape.iter().map(|u| u.length()).fold(0.0, f64::max);
    let expected: Vec<DVec3> =
        recording.surface.positions.iter().zip(&shape).map(|(p, u)| *p + scale * *u).collect();
    assert!(apart(&expected, &drawn).max(apart(&drawn, &expected)) < SINGLE);

    let table = Table::parse(&workplace.text("m.csv"));
    assert_eq!((table.header.as_str(), table.len()), ("mode,frequency_hz,damping_ratio", 3));
    assert_eq!(table.column("damping_ratio"), recording.modes.damping_ratios[..3]);
    assert_eq!(table.column("frequency_hz"), [hz(0), hz(1), hz(2)]);
    assert_eq!(workplace.text("m/modes.pvd").matches("<DataSet").count(), 4);
    let third = workplace.text("m/mode_00003.vtu");
    let moved = vectors(&third, "displacement");
    assert!(moved.iter().zip(&shape).all(|(a, b)| (*a - scale * *b).length() < SINGLE));
    assert_eq!(array(&third, "frequency_hz"), hz(2).to_le_bytes());

    // Ten are drawn and all have a row, unless it is said.
    let report = workplace.json(&["export", "cube.palp", "--gltf", "m.glb", "--csv", "m.csv", "--json"]);
    assert_eq!((&report["modes"], &report["modes_drawn"]), (&20.into(), &10.into()));
    // Files that were there already are named as they were asked for, too.
    assert_eq!(
        (&report["files"][0]["path"], &report["files"][1]["path"]),
        (&"m.csv".into(), &"m.glb".into())
    );
    assert_eq!(Table::parse(&workplace.text("m.csv")).len(), 20);
}

#[test]
fn what_can_not_be_exported_is_refused_in_words_and_leaves_nothing() {
    let workplace = logged();
    workplace.write("notes.txt", "no recording\n");
    let before = workplace.files();
    let cases: &[(&[&str], &str)] = &[
        (&["run.mcap", "--gltf", "run.mcap"], "cannot write run.mcap: it is one of the inputs"),
        (&["cube.palp", "--gltf", "./cube.palp"], "cannot write ./cube.palp: it is one of the inputs"),
        (&["cube.palp", "--csv", "cube.palp"], "cannot write cube.palp: it is one of the inputs"),
        (&["run.mcap", "--csv", "a", "--gltf", "a"], "cannot write a: --csv and --gltf name the same file"),
        (&["run.mcap", "--gltf", "no/a.glb"], "cannot write no/a.glb: there is no folder no"),
        (&["run.mcap", "--vtu", "left.csv"], "cannot make the folder left.csv: File exists (os error 17)"),
        (&["run.mcap", "--gltf", "a", "--fps", "0"], "--fps is 0, expected a positive number"),
        (&["run.mcap", "--gltf", "a", "--from", "-1"], "--from is -1 s, expected a time from 0 on"),
        (&["run.mcap", "--gltf", "a", "--from", "7"], "--from is 7 s, but run.mcap ends at 0.600 s"),
        (
            &["run.mcap", "--gltf", "a", "--from", "0.2", "--to", "0.1"],
            "--to is 0.1 s, expected a time after --from, 0.2 s",
        ),
        (
            &["run.mcap", "--vtu", "a", "--from", "0.2002", "--to", "0.2008"],
            "no step of 0.002 s ends between --from 0.2002 s and --to 0.2008 s",
        ),
        (
            &["run.mcap", "--csv", "a", "--modes", "3"],
            "--modes is of a recording, run.mcap is a log: leave it out",
        ),
        (
            &["cube.palp", "--csv", "a", "--fps", "3"],
            "--fps is of a log, cube.palp is a recording: leave it out",
        ),
        (&["cube.palp", "--csv", "a", "--modes", "0"], "--modes is 0, expected at least 1"),
        (&["scene.toml", "--csv", "a"], "scene.toml is a scene: palpate run scene.toml takes --csv"),
        (&["notes.txt", "--csv", "a"], "notes.txt: "),
        (&["none.mcap", "--csv", "a"], "cannot read the log none.mcap"),
        (&["none.palp", "--csv", "a"], "cannot read the recording none.palp"),
    ];
    for (arguments, expected) in cases {
        let error = workplace.fail(&[&["export"], *arguments].concat());
        assert!(error.starts_with(expected), "{arguments:?}: {error}");
    }
    assert_eq!(workplace.files(), before);
    // Nothing is asked for: a command line that is wrong.
    assert_eq!(workplace.palpate(&["export", "run.mcap"]).status.code(), Some(2));

    // Whatever byte of the log is wrong: all files, or none.
    let bytes = workplace.read("run.mcap");
    for at in [40, bytes.len() / 3, bytes.len() / 2, bytes.len() - 30] {
        let mut wrong = bytes.clone();
        wrong[at] ^= 0x55;
        workplace.write("wrong.mcap", wrong);
        let done = workplace.palpate(&["export", "wrong.mcap", "--gltf", "a.glb", "--vtu", "frames"]);
        let there = (workplace.path("a.glb").exists(), workplace.path("frames").exists());
        match done.status.code() {
            Some(0) => assert_eq!(there, (true, true)),
            code => assert_eq!((code, there), (Some(1), (false, false)), "byte {at}"),
        }
        let _ = std::fs::remove_file(workplace.path("a.glb"));
        let _ = std::fs::remove_dir_all(workplace.path("frames"));
    }
}

#[test]
fn a_log_of_this_version_that_differs_is_refused_and_one_of_another_version_is_computed() {
    let workplace = realtime::workplace();
    write_differing_log(&workplace, env!("CARGO_PKG_VERSION"));
    let before = workplace.files();
    let export = ["export", "differs.mcap", "--gltf", "a.glb", "--vtu", "a", "--csv", "a.csv"];
    let error = workplace.fail(&export);
    let expected = ["differs.mcap: step 1 differs: cube.", "and so is this; only the same build"];
    assert!(error.starts_with(expected[0]) && error.contains(expected[1]), "{error}");
    assert_eq!(workplace.files(), before);

    write_differing_log(&workplace, "0.0.1");
    let text = workplace.succeed(&["replay", "differs.mcap"]);
    let expected = "5 steps replayed: computed with the inputs of the log, which is of palpate 0.0.1; the first number that differs is cube.";
    assert!(text.starts_with(expected), "{text}");
}

/// Log of five steps whose scene has other gravity than its steps had, written by a version.
fn write_differing_log(workplace: &Workplace, version: &str) {
    let model = model(workplace);
    let mut state = State::new(&model);
    let mut input = Input {
        devices: vec![DeviceInput::inactive(); 2],
        obstacles: vec![Pose::IDENTITY],
        ..Input::default()
    };
    input.devices[0].position = DVec3::new(-0.058, 0.0, 0.05);
    let names = SceneNames {
        objects: vec!["cube".into()],
        devices: vec!["left".into(), "right".into()],
        obstacles: vec!["floor".into()],
        ..SceneNames::default()
    };
    let scene = workplace.text("fingers.toml").replace("{ file = \"gravity.csv\" }", "[0.0, 0.0, -9.8]");
    workplace.write("fingers.toml", scene);
    let carried = ["fingers.toml", "cube.palp", "left_finger.csv", "right_finger.csv"];
    let files = carried.map(|name| (name.to_string(), workplace.read(name)));
    let facts = BTreeMap::from([("scene".into(), "fingers.toml".into()), ("version".into(), version.into())]);
    let out = Cursor::new(Vec::new());
    let (mut hand, writer) =
        LogWriter::new(out, names, facts, &files, (&model, &state, &input)).expect("a log in memory");
    for number in 1..=5 {
        step(&model, &mut state, &input);
        hand.record_step(|record| {
            record.step = number;
            record.capture(&input, &state);
        });
    }
    let written = writer.run(&AtomicBool::new(true));
    assert_eq!((written.steps, written.failure), (5, None));
    workplace.write("differs.mcap", written.sink.into_inner());
}

#[test]
fn an_interrupt_leaves_no_frames_behind_and_older_ones_as_they_were() {
    let workplace = Workplace::with_scene();
    workplace.succeed(&["run", "scene.toml", "--vtu", "older", "--fps", "100"]);
    let older = workplace.read("older/cube_00003.vtu");
    for folder in ["older", "newer"] {
        let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_palpate"))
            .args(["run", "scene.toml", "--duration", "10000", "--vtu", folder])
            .current_dir(workplace.path("."))
            .stderr(std::process::Stdio::null())
            .spawn()
            .expect("the command starts");
        let hidden = || {
            let entries = std::fs::read_dir(workplace.path(folder)).into_iter().flatten().flatten();
            entries.filter(|entry| entry.file_name().to_string_lossy().starts_with('.')).count()
        };
        wait_until("five frames", || hidden() >= 5);
        let interrupt = std::process::Command::new("kill").args(["-INT", &child.id().to_string()]).status();
        assert!(interrupt.is_ok_and(|status| status.success()));
        assert_eq!(child.wait().expect("a child").code(), Some(130));
        assert_eq!(hidden(), 0, "{folder}");
    }
    assert!(!workplace.path("newer").exists());
    assert!(workplace.read("older/cube_00003.vtu") == older);
    assert_eq!(std::fs::read_dir(workplace.path("older")).expect("a folder").count(), 13);
}
