//! The command `palpate` from outside: what it prints and writes, what it refuses and how it says so.

mod common;

use common::{CUBE, SCENE, Table, Workplace, gmsh_bar};
use glam::DVec3;
use serde_json::Value;

/// Sums of a few hundred terms keep all but three digits of f64.
const SUMMED: f64 = 1e-12;

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

fn vector(value: &Value) -> DVec3 {
    let numbers: Vec<f64> = value.as_array().expect("an array").iter().map(number).collect();
    DVec3::from_array(numbers.try_into().expect("three numbers"))
}

fn near(value: &Value, expected: f64) {
    let value = number(value);
    assert!((value - expected).abs() <= SUMMED * expected.abs().max(1.0), "{value}, expected {expected}");
}

fn names(object: &Value) -> Vec<&str> {
    object.as_object().expect("an object").keys().map(String::as_str).collect()
}

#[test]
fn a_recorded_box_has_the_counts_mass_and_frequencies_of_a_box() {
    let workplace = Workplace::new();
    let printed = workplace.succeed(&[&CUBE[..], &["cube.palp"]].concat());
    assert!(printed.starts_with("cube.palp ("), "{printed}");
    let recording = workplace.json(&["inspect", "cube.palp", "--json"]);
    // 4³ nodes of which 2³ lie within; 5 tetrahedra a cell; 2 triangles a face.
    for (key, count) in
        [("nodes", 64), ("elements", 135), ("surface_nodes", 56), ("surface_triangles", 108), ("modes", 20)]
    {
        assert_eq!(recording[key], count, "{key}");
    }
    near(&recording["mass_kg"], 0.11);
    assert!(vector(&recording["center_of_mass_m"]).length() < SUMMED);
    for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
        let expected = if i == j { 0.11 * 0.01 / 6.0 } else { 0.0 };
        near(&recording["inertia_kg_m2"][i][j], expected);
    }
    let frequencies: Vec<f64> =
        recording["frequencies_hz"].as_array().expect("an array").iter().map(number).collect();
    assert!(frequencies.len() == 20 && frequencies.is_sorted() && frequencies[0] > 1.0, "{frequencies:?}");
    let certificate = &recording["certificate"];
    for key in [
        "force_error_max",
        "static_compliance_error_max",
        "instantaneous_compliance_error_max",
        "bandwidth_hz",
    ] {
        assert!(number(&certificate[key]) > 0.0, "{key}: {certificate}");
    }
    assert!(number(&certificate["force_error_max"]) < 0.1, "{certificate}");
    assert_eq!(certificate["samples"], 12);
    assert_eq!(certificate["modes_of"], serde_json::json!([20, 64 * 3 - 6]));
    assert_eq!(recording["support"], "free");
    assert_eq!(recording["provenance"]["source"], "box:0.1x0.1x0.1/3x3x3");

    // The same as --json prints at once, and what a person sees.
    assert_eq!(workplace.json(&[&CUBE[..], &["again.palp", "--json"]].concat()), recording);
    assert!(workplace.read("cube.palp") == workplace.read("again.palp"));
    assert_eq!(workplace.succeed(&["inspect", "cube.palp"]), printed);
    assert_eq!(workplace.files(), ["again.palp", "cube.palp"]);
}

#[test]
fn a_recorded_sphere_has_the_counts_and_mass_of_its_mesh() {
    let workplace = Workplace::new();
    let recording = workplace.json(&[
        "record",
        "sphere:0.05/3",
        "--order",
        "1",
        "--young",
        "5e4",
        "--poisson",
        "0.3",
        "--density",
        "1000",
        "--modes",
        "10",
        "--damping-ratio",
        "0.02",
        "--residual",
        "0.04",
        "-o",
        "ball.palp",
        "--json",
    ]);
    // 20·n³ tetrahedra; shells of 10·a² + 2 nodes about the centre; 20·n² triangles.
    for (key, count) in [("nodes", 147), ("elements", 540), ("surface_nodes", 92), ("surface_triangles", 180)]
    {
        assert_eq!(recording[key], count, "{key}");
    }
    let mesh = palpate_fem::mesh::ball_mesh(0.05, 3).expect("a good ball");
    let volume = |tet: &[u32; 4]| {
        let [a, b, c, d] = tet.map(|node| mesh.nodes[node as usize]);
        (b - a).cross(c - a).dot(d - a) / 6.0
    };
    near(&recording["mass_kg"], 1000.0 * mesh.tets.iter().map(volume).sum::<f64>());
    assert_eq!(recording["damping"]["ratio"], 0.02);
    let ratios = recording["damping_ratios"].as_array().expect("an array");
    assert!(ratios.len() == 10 && ratios.iter().all(|ratio| ratio == 0.02), "{ratios:?}");
    assert_eq!(
        recording["residual_compliance"],
        serde_json::json!({ "kind": "near_field", "radius_m": 0.04 })
    );
}

#[test]
fn a_gmsh_bar_of_two_materials_stands_on_a_group_or_on_a_condition() {
    let workplace = Workplace::new();
    workplace.write("bar.msh", gmsh_bar());
    workplace.write(
        "bar.toml",
        "[[material]]\nregion = \"soft\"\nyoung = 2e4\npoisson = 0.45\ndensity = 1000.0\n\n\
         [[material]]\nregion = 2\nyoung = 2e5\npoisson = 0.3\ndensity = 3000.0\n",
    );
    let record = |more: &[&str]| {
        let common = ["record", "bar.msh", "--materials", "bar.toml", "--modes", "10", "--json"];
        workplace.json(&[&common[..], more].concat())
    };
    let free = record(&["-o", "free.palp"]);
    // Two halves of a litre.
    near(&free["mass_kg"], 4.0);
    let centre = vector(&free["center_of_mass_m"]);
    assert!((centre - DVec3::X * 0.025).length() < SUMMED, "{centre}");
    assert_eq!((&free["support"], &free["fixed_nodes"]), (&Value::from("free"), &Value::from(0)));
    assert_eq!(free["materials"][0]["region"], "soft");
    assert_eq!(free["materials"][1]["young_pa"], 2e5);

    let by_group = record(&["--fix", "foot", "-o", "group.palp"]);
    let by_condition = record(&["--fix", "x<-0.0999", "-o", "condition.palp"]);
    // 3×3 corners and the middles of their edges.
    assert_eq!(by_group["fixed_nodes"], 25);
    assert_eq!(by_group["support"], "fixed");
    assert_eq!(by_group, by_condition);
    assert!(workplace.read("group.palp") == workplace.read("condition.palp"));
    // Half of it by two conditions.
    let half = record(&["--fix", "x<-0.0999 & z<=0", "--fix", "x<-0.0999 & z>0", "-o", "half.palp"]);
    assert_eq!(half["fixed_nodes"], 25);
    // In millimetres and back.
    let scaled = record(&["--scale", "10", "-o", "scaled.palp"]);
    near(&scaled["mass_kg"], 4000.0);
}

#[test]
fn a_run_writes_every_step_and_its_energy_and_momentum_close() {
    let workplace = Workplace::with_scene();
    let summary = workplace.json(&["run", "scene.toml", "--csv", "out.csv", "--json"]);
    let table = Table::parse(&workplace.text("out.csv"));
    assert_eq!(
        table.header,
        "t,left.x,left.y,left.z,left.fx,left.fy,left.fz,right.x,right.y,right.z,right.fx,right.fy,right.fz,cube.px,\
         cube.py,cube.pz,cube.qw,cube.qx,cube.qy,cube.qz,cube.vx,cube.vy,cube.vz,cube.wx,cube.wy,cube.wz,\
         energy.kinetic,energy.elastic,energy.residual,energy.potential,energy.input,energy.dissipated,energy.defect"
    );
    // To the end of the longest path.
    assert_eq!(table.len(), 50);
    assert!(table.numbers().all(f64::is_finite));
    for (row, t) in table.column("t").into_iter().enumerate() {
        assert!((t - 1e-3 * (row + 1) as f64).abs() < SUMMED);
    }

    // Hands are where their paths are, linear in time.
    let left = table.vectors("left", ["x", "y", "z"]);
    assert!((left[14] - DVec3::new(-0.0475, 0.001, 0.0)).length() < SUMMED, "{}", left[14]);
    assert!((left[49] - DVec3::new(-0.04, 0.01, 0.002)).length() < SUMMED, "{}", left[49]);
    let right = table.vectors("right", ["x", "y", "z"]);
    assert_eq!(right[49], right[39]);

    // Stored = at the start + input − dissipated + defect, and the input is Σ f·Δx of the hands.
    let energy = |name: &str| table.column(&format!("energy.{name}"));
    let forces = ["left", "right"].map(|name| table.vectors(name, ["fx", "fy", "fz"]));
    let (mut work, mut given) = (0.0, DVec3::ZERO);
    let mut before = [DVec3::X * -0.05, DVec3::X * 0.05];
    let (mut moved, mut lost) = (0.0_f64, 0.0);
    let velocities = table.vectors("cube", ["vx", "vy", "vz"]);
    for row in 0..table.len() {
        for (device, hands) in [&left, &right].into_iter().enumerate() {
            let share = -forces[device][row].dot(hands[row] - before[device]);
            moved += share.abs();
            work += share;
            before[device] = hands[row];
            given -= forces[device][row] * 1e-3;
        }
        let stored: f64 =
            ["kinetic", "elastic", "residual", "potential"].into_iter().map(|name| energy(name)[row]).sum();
        let (input, dissipated, defect) =
            (energy("input")[row], energy("dissipated")[row], energy("defect")[row]);
        assert!((input - work).abs() < SUMMED * moved, "row {row}: {input} {work}");
        assert!((stored - (input - dissipated + defect)).abs() < SUMMED * moved, "row {row}");
        assert!(defect.abs() < SUMMED * moved, "row {row}: {defect}");
        assert!(dissipated >= lost - SUMMED * moved, "row {row}: {dissipated} after {lost}");
        lost = dissipated;
        // m·v = Σ f·h + m·g·t.
        let weight = DVec3::Z * (-9.81 * 0.11 * 1e-3 * (row + 1) as f64);
        let momentum = velocities[row] * 0.11;
        assert!((momentum - given - weight).length() < SUMMED, "row {row}: {momentum} {}", given + weight);
    }
    assert!(lost > 0.0 && work > 0.0);

    // The summary says the same.
    assert_eq!(names(&summary), ["devices", "energy_j", "objects", "solver", "step_s", "steps", "timing_us"]);
    assert_eq!((&summary["steps"], &summary["step_s"]), (&Value::from(50), &Value::from(1e-3)));
    for (at, name) in ["left", "right"].into_iter().enumerate() {
        let device = &summary["devices"][at];
        assert_eq!(device["name"], name);
        let lengths: Vec<f64> = forces[at].iter().map(|force| force.length()).collect();
        near(&device["force_last_n"], lengths[49]);
        near(&device["force_max_n"], lengths.into_iter().fold(0.0, f64::max));
    }
    let object = &summary["objects"][0];
    assert_eq!(object["name"], "cube");
    assert_eq!(vector(&object["position_m"]), table.vectors("cube", ["px", "py", "pz"])[49]);
    assert_eq!(vector(&object["velocity_m_s"]), velocities[49]);
    assert_eq!(vector(&object["angular_velocity_rad_s"]), table.vectors("cube", ["wx", "wy", "wz"])[49]);
    let orientation = ["qw", "qx", "qy", "qz"].map(|part| table.column(&format!("cube.{part}"))[49]);
    assert_eq!(object["orientation"], serde_json::json!(orientation));
    for name in ["kinetic", "elastic", "residual", "potential", "input", "dissipated", "defect"] {
        assert_eq!(number(&summary["energy_j"][name]), energy(name)[49], "{name}");
    }
    let times = ["p50", "p99", "p999", "max"].map(|name| number(&summary["timing_us"][name]));
    assert!(times[0] >= 0.0 && times.is_sorted(), "{times:?}");
}

#[test]
fn the_same_scene_gives_the_same_bytes_from_wherever_it_is_run() {
    let workplace = Workplace::with_scene();
    workplace.succeed(&["run", "scene.toml", "--csv", "first.csv"]);
    workplace.succeed(&["run", "scene.toml", "--csv", "second.csv", "--vtu", "frames"]);
    assert!(workplace.read("first.csv") == workplace.read("second.csv"));
    // Files of a scene are looked for beside it.
    std::fs::create_dir(workplace.path("elsewhere")).expect("a folder");
    let output = std::process::Command::new(env!("CARGO_BIN_EXE_palpate"))
        .arg("run")
        .arg(workplace.path("scene.toml"))
        .args(["--csv", "third.csv"])
        .current_dir(workplace.path("elsewhere"))
        .output()
        .expect("the command starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(workplace.read("first.csv") == workplace.read("elsewhere/third.csv"));
}

#[test]
fn surfaces_for_paraview_are_all_there_and_listed() {
    let workplace = Workplace::with_scene();
    let printed = workplace.succeed(&["run", "scene.toml", "--vtu", "out/frames", "--fps", "100"]);
    assert!(printed.contains("out/frames/scene.pvd (open it in ParaView)"), "{printed}");
    let index = workplace.text("out/frames/scene.pvd");
    let listed: Vec<(&str, &str)> = index
        .lines()
        .filter_map(|line| {
            let (_, rest) = line.split_once("timestep=\"")?;
            let (time, rest) = rest.split_once('"')?;
            let (_, rest) = rest.split_once("file=\"")?;
            Some((time, rest.split_once('"')?.0))
        })
        .collect();
    // Every 10 ms from 0 to 50 ms.
    assert_eq!(listed.len(), 6, "{index}");
    for (frame, (time, file)) in listed.iter().enumerate() {
        let time: f64 = time.parse().expect("a number");
        assert!((time - 0.01 * frame as f64).abs() < SUMMED, "{time}");
        let text = workplace.text(&format!("out/frames/{file}"));
        assert!(text.contains("NumberOfPoints=\"56\" NumberOfCells=\"108\""), "{file}");
    }
    // Nothing else lies there.
    assert_eq!(std::fs::read_dir(workplace.path("out/frames")).expect("a folder").count(), 7);
}

#[test]
fn the_papers_rules_can_be_chosen_and_change_the_outcome() {
    let workplace = Workplace::with_scene();
    let mut runs = Vec::new();
    for (at, rules) in [
        "",
        "motion = \"exact\"\nrigid_compliance = true\n",
        "motion = \"paper\"\n",
        "rigid_compliance = false\n",
    ]
    .into_iter()
    .enumerate()
    {
        workplace.write("scene.toml", format!("{rules}{SCENE}"));
        let name = format!("{at}.csv");
        workplace.succeed(&["run", "scene.toml", "--csv", &name]);
        let table = Table::parse(&workplace.text(&name));
        assert!(table.len() == 50 && table.numbers().all(f64::is_finite), "{rules}");
        runs.push(workplace.read(&name));
    }
    assert!(runs[0] == runs[1], "these are the defaults");
    assert!(runs[0] != runs[2] && runs[0] != runs[3] && runs[2] != runs[3]);
}

#[test]
fn an_object_without_hands_falls_by_half_g_t_squared() {
    let workplace = Workplace::with_scene();
    workplace.write(
        "fall.toml",
        "gravity = [0.0, 0.0, -9.81]\n[[object]]\nname = \"stone\"\nrecording = \"cube.palp\"\nposition = [1.0, 2.0, \
         3.0]\norientation = [0.0, 0.0, 1.0, 0.0]\nvelocity = [0.5, 0.0, 2.0]\nangular_velocity = [0.0, 0.0, 3.0]\n",
    );
    let summary = workplace.json(&["run", "fall.toml", "--csv", "fall.csv", "--json"]);
    assert_eq!(summary["steps"], 1000, "one second without a path to tell");
    assert_eq!(summary["devices"], serde_json::json!([]));
    let table = Table::parse(&workplace.text("fall.csv"));
    for (row, position) in table.vectors("stone", ["px", "py", "pz"]).into_iter().enumerate() {
        let t = 1e-3 * (row + 1) as f64;
        let exact = DVec3::new(1.0 + 0.5 * t, 2.0, 3.0 + 2.0 * t - 9.81 * t * t / 2.0);
        assert!((position - exact).length() < SUMMED * 10.0, "{t} s: {position} {exact}");
    }
    // A cube spins evenly, and its velocity does not touch its spin.
    for spin in table.vectors("stone", ["wx", "wy", "wz"]) {
        assert!((spin - DVec3::Z * 3.0).length() < SUMMED * 10.0, "{spin}");
    }
    assert_eq!(workplace.json(&["run", "fall.toml", "--duration", "0.25", "--json"])["steps"], 250);
}

/// The scene with one part of its text changed, and what `run` says about it.
fn broken(workplace: &Workplace, old: &str, new: &str) -> String {
    assert!(SCENE.contains(old), "{old:?} is not in the scene");
    workplace.write("scene.toml", SCENE.replacen(old, new, 1));
    let error = workplace.fail(&["run", "scene.toml", "--csv", "out.csv"]);
    assert!(!workplace.path("out.csv").exists(), "a failed run left its output");
    error
}

#[test]
fn unknown_keys_are_errors_with_their_line() {
    let workplace = Workplace::with_scene();
    for (old, new, line, known) in [
        (
            "step = 0.001",
            "stepp = 0.001",
            1,
            "`step`, `gravity`, `motion`, `rigid_compliance`, `object`, `device`",
        ),
        (
            "recording = \"cube.palp\"",
            "recording = \"cube.palp\"\nspeed = 1",
            7,
            "`name`, `recording`, `position`, `orientation`, `velocity`, `angular_velocity`",
        ),
        ("mode = \"held\"", "mode = \"held\"\nforce = 1", 11, "`name`, `mode`, `attach`, `path`"),
        ("{ file = \"left.csv\" }", "{ files = \"left.csv\" }", 12, "`file`"),
    ] {
        let error = broken(&workplace, old, new);
        assert!(
            error.starts_with(&format!("scene.toml: TOML parse error at line {line}, column ")),
            "{error}"
        );
        assert!(error.contains("unknown field `") && error.ends_with(known), "{error}");
    }
}

#[test]
fn what_a_scene_file_gets_wrong_is_named_with_its_line() {
    let workplace = Workplace::with_scene();
    for (old, new, error) in [
        ("step = 0.001", "step = 0", "scene.toml: line 1: step is 0 s, expected above 0 and at most 1"),
        ("step = 0.001", "step = nan", "scene.toml: line 1: step is NaN s, expected above 0 and at most 1"),
        (
            "\n\n[[object]]",
            "\nmotion = \"rough\"\n[[object]]",
            "scene.toml: line 3: motion is \"rough\", expected \"exact\" or \"paper\"",
        ),
        (
            "recording = \"cube.palp\"",
            "recording = \"no.palp\"",
            "scene.toml: line 6: cannot read the recording no.palp: No such file or directory (os error 2)",
        ),
        (
            "recording = \"cube.palp\"",
            "recording = \"left.csv\"",
            "scene.toml: line 6: left.csv: not a usable recording: the file is damaged, truncated or of another kind \
             (header too large)",
        ),
        (
            "recording = \"cube.palp\"",
            "recording = \"cube.palp\"\norientation = [1.0, 1.0, 0.0, 0.0]",
            "scene.toml: line 5: object \"cube\": orientation has length 1.4142135623730951, expected a unit quaternion \
             w, x, y, z",
        ),
        (
            "left.csv",
            "no.csv",
            "scene.toml: line 12: cannot read the path no.csv: No such file or directory (os error 2)",
        ),
        (
            "point = [-0.05, 0.0, 0.0]",
            "point = [-0.25, 0.0, 0.0]",
            "scene.toml: line 11: the point [-0.25, 0, 0] is 0.2000 m from the surface of \"cube\", at most 0.0087 m are \
             allowed; it is given in the body frame, whose origin is the centre of mass",
        ),
        ("name = \"right\"", "name = \"left\"", "scene.toml: line 15: the name \"left\" is taken already"),
        ("name = \"right\"", "name = \"cube\"", "scene.toml: line 15: the name \"cube\" is taken already"),
        (
            "name = \"right\"",
            "name = \"my hand\"",
            "scene.toml: line 15: name is \"my hand\", expected letters, digits, - and _",
        ),
        (
            "object = \"cube\", point = [0.05",
            "object = \"ball\", point = [0.05",
            "scene.toml: line 17: there is no object \"ball\"; the scene has cube",
        ),
        ("mode = \"held\"", "mode = \"touch\"", "scene.toml: line 10: mode is \"touch\", expected \"held\""),
        (
            "point = [0.05, 0.0, 0.0]",
            "point = [-0.05, 0.0, 0.0]",
            "scene.toml: line 17: device \"right\" holds the same point as \"left\"",
        ),
    ] {
        assert_eq!(broken(&workplace, old, new), error);
    }
    for (old, new, line, what) in [
        ("point = [-0.05, 0.0, 0.0]", "point = [-0.05, 0.0]", 11, "2 numbers, expected 3"),
        ("gravity = [0.0, 0.0, -9.81]", "gravity = [0.0, 0.0, inf]", 2, "expected finite numbers below 1e6"),
        ("name = \"cube\"\n", "", 4, "missing field `name`"),
        ("mode = \"held\"\n", "", 8, "missing field `mode`"),
    ] {
        let error = broken(&workplace, old, new);
        assert!(
            error.starts_with(&format!("scene.toml: TOML parse error at line {line}, column "))
                && error.ends_with(what),
            "{error}"
        );
    }
    workplace.write("scene.toml", "step = 0.001\n");
    assert_eq!(workplace.fail(&["run", "scene.toml"]), "scene.toml: line 1: the scene has no [[object]]");
    assert_eq!(
        workplace.fail(&["run", "no.toml"]),
        "cannot read the scene no.toml: No such file or directory (os error 2)"
    );
}

#[test]
fn bad_rows_of_a_path_are_named_with_both_lines() {
    let workplace = Workplace::with_scene();
    let prefix = "scene.toml: line 12: path left.csv: ";
    for (rows, error) in [
        ("t,x,y,z\n0,-0.05,0,0\n1,NaN,0,0\n", "line 3: \"1,NaN,0,0\" must be finite and below 1e6"),
        ("0,-0.05,0,0\n1,0,0\n", "line 2: 3 numbers, expected the four t,x,y,z"),
        ("0,-0.05,0,0\n0,0,0,0\n", "line 2: time 0 s does not come after 0 s"),
        ("time,x,y,z\n0,-0.05,0,0\n", "line 1: the columns are time,x,y,z, expected t,x,y,z"),
        ("# nothing\n", "no rows, expected lines t,x,y,z in s and m"),
    ] {
        workplace.write("left.csv", rows);
        assert_eq!(workplace.fail(&["run", "scene.toml"]), format!("{prefix}{error}"));
    }
}

#[test]
fn a_hand_in_millimetres_ends_the_run_and_leaves_no_output() {
    let workplace = Workplace::with_scene();
    workplace.write("left.csv", "0,-50,0,0\n0.05,-45,3,0\n");
    let before = workplace.files();
    let error = workplace.fail(&["run", "scene.toml", "--csv", "out.csv"]);
    assert!(
        error.starts_with(
            "at 0.001000 s the held points can't be met: a hand moves, or a body turns, too far in one step of 0.001 s; \
             the hand of \"left\" is "
        ) && error.ends_with(". Use a shorter step, and check that paths are in metres"),
        "{error}"
    );
    assert_eq!(workplace.files(), before);
}

#[test]
fn impossible_durations_and_rates_are_refused() {
    let workplace = Workplace::with_scene();
    let error = |option: &str, value: &str| workplace.fail(&["run", "scene.toml", option, value]);
    for (value, shown) in [("0", "0"), ("-1", "-1"), ("nan", "NaN"), ("1e-9", "0.000000001")] {
        let text = format!("the duration is {shown} s, expected at least one step of 0.001 s");
        assert_eq!(error("--duration", value), text);
    }
    assert_eq!(
        error("--duration", "1e9"),
        "1000000000 s are 1000000000000 steps of 0.001 s, at most 100000000 are run at once"
    );
    assert_eq!(error("--fps", "0"), "--fps is 0, expected a positive number");
}

#[test]
fn outputs_never_replace_an_input_and_need_a_folder() {
    let workplace = Workplace::with_scene();
    workplace.write("bar.msh", gmsh_bar());
    let before: Vec<_> = workplace.files().into_iter().map(|name| (workplace.read(&name), name)).collect();
    for name in ["scene.toml", "cube.palp", "left.csv", "./right.csv"] {
        let error = workplace.fail(&["run", "scene.toml", "--csv", name]);
        assert_eq!(error, format!("cannot write {name}: it is one of the inputs"));
    }
    let record = |output: &str| {
        let material = ["--young", "1e4", "--poisson", "0.3", "--density", "1000"];
        workplace.fail(&[&["record", "bar.msh", "-o", output], &material[..]].concat())
    };
    assert_eq!(record("./bar.msh"), "cannot write ./bar.msh: it is one of the inputs");
    assert_eq!(record("no/bar.palp"), "cannot write no/bar.palp: there is no folder no");
    assert_eq!(record("."), "cannot write .: it is not a file");
    assert_eq!(
        workplace.fail(&["run", "scene.toml", "--csv", "no/out.csv"]),
        "cannot write no/out.csv: there is no folder no"
    );
    let error = workplace.fail(&["run", "scene.toml", "--vtu", "left.csv"]);
    assert_eq!(error, "cannot make the folder left.csv: File exists (os error 17)");
    for (content, name) in &before {
        assert!(workplace.read(name) == *content, "{name} was changed");
    }
    assert_eq!(workplace.files().len(), before.len());
}

#[test]
fn damaged_recordings_are_refused_wherever_the_damage_is() {
    let workplace = Workplace::with_scene();
    let whole = workplace.read("cube.palp");
    let inspect = |bytes: &[u8]| {
        workplace.write("broken.palp", bytes);
        let error = workplace.fail(&["inspect", "broken.palp"]);
        error.strip_prefix("broken.palp: ").map(str::to_string).unwrap_or_else(|| panic!("{error}"))
    };
    let other = "not a usable recording: the file is damaged, truncated or of another kind (";
    for length in [1, 7, 8, 9, 200, whole.len() / 2, whole.len() - 1] {
        let error = inspect(&whole[..length]);
        assert!(error.starts_with(other), "{length} bytes: {error}");
    }
    let text = inspect("this is only text, and long enough to hold a header\n".as_bytes());
    assert!(text.starts_with(other), "{text}");
    assert_eq!(inspect(&[]), "the file is empty");
    for at in (0..whole.len()).step_by(whole.len() / 60).chain(0..8) {
        let mut bytes = whole.clone();
        bytes[at] ^= 0x10;
        let error = inspect(&bytes);
        assert!(error.starts_with("not a usable recording: "), "byte {at}: {error}");
    }
    // Among the numbers only the hash can tell.
    let mut bytes = whole.clone();
    bytes[whole.len() - 100] ^= 1;
    assert_eq!(
        inspect(&bytes),
        "not a usable recording: its content does not fit its hash: the file was damaged or changed after it was written"
    );
    assert_eq!(
        workplace.fail(&["inspect", "no.palp"]),
        "cannot read the recording no.palp: No such file or directory (os error 2)"
    );
    assert_eq!(workplace.fail(&["inspect", "."]), "cannot read the recording .: it is not a file");
}

#[test]
fn a_failed_recording_says_why_and_leaves_what_was_there() {
    let workplace = Workplace::new();
    workplace.write("out.palp", "an older recording");
    workplace.write("surface.stl", "solid\nendsolid\n");
    workplace.write("broken.msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n1\n1 0 0\n$EndNodes\n");
    let before = workplace.files();
    let record = |source: &str, more: &[&str]| {
        let options = ["--order", "1", "--modes", "5", "-o", "out.palp"];
        let error = workplace.fail(&[&["record", source], more, &options[..]].concat());
        assert_eq!(workplace.text("out.palp"), "an older recording");
        assert_eq!(workplace.files(), before, "after {error}");
        error
    };
    let material = ["--young", "1e4", "--poisson", "0.3", "--density", "1000"];
    let cube = "box:0.1x0.1x0.1/2x2x2";
    let with = |more: &[&str]| record(cube, &[&material[..], more].concat());
    assert_eq!(
        record(cube, &["--young", "-1", "--poisson", "0.3", "--density", "1000"]),
        "box:0.1x0.1x0.1/2x2x2: Young's modulus is -1e0 Pa, expected 1e-6 to 1e18 Pa"
    );
    assert_eq!(
        record(cube, &["--young", "1e4", "--poisson", "0.5", "--density", "1000"]),
        "box:0.1x0.1x0.1/2x2x2: Poisson's ratio is 0.5, expected below 0.5: at 0.5 the material is incompressible and \
         has no displacement-only stiffness; use 0.49 for rubber or soft tissue"
    );
    assert_eq!(
        with(&["--fix", "x<-1"]),
        "--fix \"x<-1\" selects no node; the mesh spans x -0.050000 … 0.050000, y -0.050000 … 0.050000, z -0.050000 … \
         0.050000 m"
    );
    assert_eq!(
        with(&["--fix", "foot"]),
        "--fix \"foot\" is neither a group of the mesh nor a condition such as 'x<0.001' or 'y>=0.1 & z<0'; the mesh \
         names no groups"
    );
    assert_eq!(
        with(&["--fix", "x<-0.04 & y<-0.04"]),
        "box:0.1x0.1x0.1/2x2x2: the fixed nodes leave the body free to turn: fix at least three nodes that are not on \
         one line"
    );
    assert_eq!(with(&["--scale", "0"]), "scale is 0, expected a positive number");
    assert_eq!(with(&["--rayleigh", "2"]), "--rayleigh is [2.0], expected two numbers ALPHA,BETA");
    assert_eq!(
        with(&["--damping-ratio", "-0.1"]),
        "box:0.1x0.1x0.1/2x2x2: damping ratio is -0.1, expected a number that is not negative"
    );
    assert_eq!(
        with(&["--residual", "-0.1"]),
        "box:0.1x0.1x0.1/2x2x2: residual radius is -0.1 m, expected a positive number"
    );
    assert_eq!(
        record("surface.stl", &material),
        "\"surface.stl\" is no mesh that palpate reads: give a Gmsh file (.msh), a VTK legacy file (.vtk), \
         box:LXxLYxLZ/NXxNYxNZ or sphere:RADIUS/N"
    );
    assert_eq!(
        record("no.msh", &material),
        "cannot read mesh no.msh: No such file or directory (os error 2)"
    );
    let error = record("broken.msh", &material);
    assert!(error.starts_with("broken.msh: line 6: "), "{error}");
    assert_eq!(
        record(cube, &["--materials", "no.toml"]),
        "cannot read the materials no.toml: No such file or directory (os error 2)"
    );
}

#[test]
fn bad_material_files_are_named() {
    let workplace = Workplace::new();
    workplace.write("bar.msh", gmsh_bar());
    let entry = |region: &str| {
        format!("[[material]]\nregion = {region}\nyoung = 1e4\npoisson = 0.3\ndensity = 1000.0\n")
    };
    let with = |text: String| {
        workplace.write("bar.toml", text);
        workplace.fail(&["record", "bar.msh", "--materials", "bar.toml", "-o", "bar.palp"])
    };
    assert_eq!(
        with(entry("1")),
        "bar.toml: region stiff of the mesh has no material; the file has materials for: 1"
    );
    assert_eq!(
        with(entry("\"soft\"") + &entry("\"hard\"")),
        "bar.toml: the material file names region hard, which the mesh does not have; it has: soft, stiff"
    );
    assert_eq!(
        with(entry("\"soft\"") + &entry("1") + &entry("2")),
        "bar.toml: material file: region soft has more than one material"
    );
    assert_eq!(
        with((entry("1") + &entry("2")).replacen("0.3", "0.6", 1)),
        "bar.toml: region soft: Poisson's ratio is 0.6, expected below 0.5: at 0.5 the material is incompressible and \
         has no displacement-only stiffness; use 0.49 for rubber or soft tissue"
    );
    let error = with(entry("1").replace("young", "youngs"));
    assert!(error.starts_with("bar.toml: material file: TOML parse error at line 3, column 1"), "{error}");
    assert_eq!(workplace.files(), ["bar.msh", "bar.toml"]);
}

#[test]
fn wrong_command_lines_exit_with_2_and_do_nothing() {
    let workplace = Workplace::new();
    let cube =
        ["record", "box:0.1x0.1x0.1/2x2x2", "-o", "cube.palp", "--poisson", "0.3", "--density", "1000"];
    for (arguments, said) in [
        (vec![], "Usage: palpate"),
        (vec!["plot"], "unrecognized subcommand 'plot'"),
        (cube.to_vec(), "--young <PA>"),
        (
            [&cube[..], &["--young", "1e4", "--order", "3"]].concat(),
            "'3' for '--order <ORDER>': 3 is not in 1..=2",
        ),
        ([&cube[..], &["--young", "soft"]].concat(), "invalid value 'soft' for '--young <PA>'"),
        (
            [&cube[..], &["--young", "1e4", "--residual", "far"]].concat(),
            "expected auto, whole, none, or a radius",
        ),
        ([&cube[..], &["--young", "1e4", "--materials", "m.toml"]].concat(), "cannot be used with"),
    ] {
        let output = workplace.palpate(&arguments);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {stderr}");
        assert!(output.stdout.is_empty() && stderr.contains(said), "{arguments:?}: {stderr}");
    }
    assert!(workplace.files().is_empty());
    assert!(workplace.succeed(&["--help"]).contains("Usage: palpate"));
    let version = concat!("palpate ", env!("CARGO_PKG_VERSION"), "\n");
    assert_eq!(workplace.succeed(&["--version"]), version);
}
