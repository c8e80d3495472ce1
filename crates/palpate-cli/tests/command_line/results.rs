//! Results of good input: recordings, runs, files.

use crate::workplace::{CUBE, SCENE, Table, Workplace, gmsh_bar};
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
    let mut names: Vec<&str> = object.as_object().expect("an object").keys().map(String::as_str).collect();
    names.sort_unstable();
    names
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
    for errors in ["held", "touched"].map(|hands| &certificate["peak_force_error_max"][hands]) {
        let errors = errors.as_array().expect("errors at one, two and three places");
        let in_range = |error| (1e-4..1.0).contains(&number(error));
        assert!(errors.len() == 3 && errors.iter().all(in_range), "{certificate}");
    }
    assert_eq!(certificate["samples"], 16);
    assert_eq!(certificate["modes_of"], serde_json::json!([20, 64 * 3 - 6]));
    // Levels of contact samples: ever fewer, wider apart, and none off by more than the cube's half diagonal.
    let levels = certificate["sample_levels"].as_array().expect("levels");
    assert!(levels.last().is_some_and(|level| number(&level["samples"]) <= 8.0), "{certificate}");
    assert!(levels.is_sorted_by_key(|level| number(&level["spacing_m"])), "{certificate}");
    assert!(levels.iter().all(|level| number(&level["hausdorff_distance_m"]) < 0.0867), "{certificate}");
    let line = format!("    level 1              {} contact samples, spacing ", levels[0]["samples"]);
    assert!(printed.contains(&line), "{printed}");
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
    let mesh = palpate_mesh::ball_mesh(0.05, 3).expect("a good ball");
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
        "t,left.x,left.y,left.z,left.fx,left.fy,left.fz,left.proxy_x,left.proxy_y,left.proxy_z,right.x,right.y,right.z,\
         right.fx,right.fy,right.fz,right.proxy_x,right.proxy_y,right.proxy_z,cube.px,cube.py,cube.pz,cube.qw,cube.qx,\
         cube.qy,cube.qz,cube.vx,cube.vy,cube.vz,cube.wx,cube.wy,cube.wz,cube.fx,cube.fy,cube.fz,cube.tx,cube.ty,cube.tz,energy.kinetic,energy.elastic,energy.residual,\
         energy.potential,energy.coupling,energy.input,energy.dissipated,energy.friction,energy.impact,energy.defect"
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
    // And so are the points that they hold.
    let held = table.vectors("left", ["proxy_x", "proxy_y", "proxy_z"]);
    assert!(held.iter().zip(&left).all(|(held, hand)| (held - hand).length() < SUMMED), "{held:?}");

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
        // The net force is that of the hands.
        let net = table.vectors("cube", ["fx", "fy", "fz"])[row];
        assert!((net + forces[0][row] + forces[1][row]).length() < SUMMED * net.length(), "row {row}: {net}");
        // m·v = Σ f·h + m·g·t.
        let weight = DVec3::Z * (-9.81 * 0.11 * 1e-3 * (row + 1) as f64);
        let momentum = velocities[row] * 0.11;
        assert!((momentum - given - weight).length() < SUMMED, "row {row}: {momentum} {}", given + weight);
    }
    assert!(lost > 0.0 && work > 0.0);

    // The summary says the same.
    assert_eq!(
        names(&summary),
        [
            "clamps",
            "contacts",
            "devices",
            "energy_j",
            "objects",
            "obstacles",
            "probes",
            "solver",
            "step_s",
            "steps",
            "timing_us",
            "warnings"
        ]
    );
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
    for name in [
        "kinetic",
        "elastic",
        "residual",
        "potential",
        "coupling",
        "input",
        "dissipated",
        "friction",
        "impact",
        "defect",
    ] {
        assert_eq!(number(&summary["energy_j"][name]), energy(name)[49], "{name}");
    }
    // Held points are not contacts.
    assert_eq!(summary["contacts"], serde_json::json!({ "count_max": 0, "force_max_n": 0.0 }));
    assert_eq!(
        (&summary["solver"]["dropped_contacts"], &summary["solver"]["unsolved_steps"]),
        (&Value::from(0), &Value::from(0))
    );
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
    // Every 10 ms from 0 to 50 ms the cube, and the devices.
    assert_eq!(listed.len(), 12, "{index}");
    for (entry, (time, file)) in listed.iter().enumerate() {
        let time: f64 = time.parse().expect("a number");
        assert!((time - 0.01 * (entry / 2) as f64).abs() < SUMMED, "{time}");
        let text = workplace.text(&format!("out/frames/{file}"));
        let (name, size) = [
            ("cube", "NumberOfPoints=\"56\" NumberOfCells=\"108\""),
            ("scene.devices", "NumberOfPoints=\"2\" NumberOfCells=\"2\""),
        ][entry % 2];
        assert_eq!(*file, format!("{name}_{:05}.vtu", entry / 2));
        assert!(text.contains(size), "{file}");
    }
    // Nothing else lies there.
    assert_eq!(std::fs::read_dir(workplace.path("out/frames")).expect("a folder").count(), 13);
}

#[test]
fn the_papers_rules_can_be_chosen_and_change_the_outcome() {
    let workplace = Workplace::with_scene();
    let mut runs = Vec::new();
    for (at, rules) in [
        "",
        "integrator = \"exact\"\nrigid_compliance = true\n",
        "integrator = \"paper\"\n",
        "rigid_compliance = false\n",
    ]
    .into_iter()
    .enumerate()
    {
        workplace.write("scene.toml", format!("{rules}{}", *SCENE));
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
