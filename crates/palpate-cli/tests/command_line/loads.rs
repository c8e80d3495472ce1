//! Prescribed forces of a scene: output, logs and errors.

use crate::workplace::{Table, Workplace};

const SCENE: &str = r#"
[[object]]
name = "beam"
recording = "beam.palp"
[[device]]
name = "load"
mode = "force"
attach = { object = "beam", point = [0.05, 0.0, 0.0] }
path = { file = "force.csv" }
patch_radius = 0.03
"#;

/// A damped beam of 0.1 m that is fixed at one end, its scene, and a force that grows to 0.02 N and stays.
fn workplace() -> Workplace {
    let workplace = Workplace::new();
    let body = ["record", "box:0.1x0.1x0.1/3x3x3", "--order", "1", "--young", "2000", "--poisson", "0.3"];
    let rest = [
        "--density",
        "110",
        "--rayleigh",
        "20,2e-3",
        "--modes",
        "20",
        "--fix",
        "x<-0.049",
        "-o",
        "beam.palp",
    ];
    workplace.succeed(&[&body[..], &rest].concat());
    workplace.write("scene.toml", SCENE);
    workplace.write("force.csv", "t,fx,fy,fz\n0,0,0,0\n0.1,0.0,-0.02,0.01\n");
    workplace
}

#[test]
fn a_force_moves_its_point_and_its_work_is_input() {
    let workplace = workplace();
    workplace.succeed(&["run", "scene.toml", "--duration", "1", "--csv", "steps.csv"]);
    let table = Table::parse(&workplace.text("steps.csv"));
    let column = |name: &str| table.column(name);
    // The middle of step 50 has the course at 49.5 ms; the hand feels the opposite.
    assert!((column("load.fy")[49] - 0.02 * 0.495).abs() < 1e-15 && column("load.fy")[999] == 0.02);
    assert_eq!(
        table.vectors("load", ["x", "y", "z"]),
        table.vectors("load", ["proxy_x", "proxy_y", "proxy_z"])
    );
    // Second route to the work: the sum of force times travel of the point.
    let places = table.vectors("load", ["proxy_x", "proxy_y", "proxy_z"]);
    let forces = table.vectors("load", ["fx", "fy", "fz"]);
    let steps = places.windows(2).zip(&forces[1..]);
    let work: f64 = steps.map(|(ends, force)| -force.dot(ends[1] - ends[0])).sum();
    let input = column("energy.input");
    assert!((work / (input[999] - input[0]) - 1.0).abs() < 1e-9, "{work} {}", input[999]);
    assert!(places[999].y < -1e-4, "{}", places[999]);
    assert!(column("energy.defect")[999].abs() < 1e-11 * input[999]);
    let summary = workplace.json(&["run", "scene.toml", "--json"]);
    assert_eq!(summary["steps"], 100, "to the end of the course");
    assert_eq!(summary["devices"][0]["force_last_xyz_n"][2], -0.01 * 0.995);
    assert!(
        (summary["devices"][0]["proxy_last_m"][1].as_f64().expect("a number") - places[99].y).abs() < 1e-15
    );
}

#[test]
fn a_probe_reads_the_point_and_changes_nothing() {
    let workplace = workplace();
    workplace.succeed(&["run", "scene.toml", "--csv", "without.csv"]);
    let probe = "[[probe]]\nname = \"tip\"\nobject = \"beam\"\npoint = [0.05, 0.05, 0.0]\n";
    workplace.write("scene.toml", format!("{SCENE}{probe}"));
    let text = workplace.succeed(&["run", "scene.toml", "--csv", "steps.csv", "--vtu", "frames"]);
    let [with, without] = ["steps.csv", "without.csv"].map(|name| Table::parse(&workplace.text(name)));
    for column in ["energy.elastic", "energy.input", "load.proxy_x", "load.proxy_y", "beam.px"] {
        assert_eq!(with.column(column), without.column(column), "{column}");
    }
    // In a body that stays, the displacement is the way from the rest position, which is on the surface.
    let places = with.vectors("tip", ["x", "y", "z"]);
    let displacements = with.vectors("tip", ["ux", "uy", "uz"]);
    let rest = places[0] - displacements[0];
    assert!((rest - glam::DVec3::new(0.05, 0.05, 0.0)).length() < 1e-15, "{rest}");
    for (place, displacement) in places.iter().zip(&displacements) {
        assert!((*place - rest - *displacement).length() < 1e-16);
    }
    assert!(text.contains("\n  tip          displaced by ("), "{text}");
    let summary = workplace.json(&["run", "scene.toml", "--json"]);
    let last = &summary["probes"][0];
    assert_eq!((&last["name"], &last["object"]), (&"tip".into(), &"beam".into()));
    assert_eq!(last["displacement_m"][1], displacements[99].y);
    assert!(displacements[99].y < -1e-5);
    let fail = |from: &str, to: &str| {
        workplace.write("scene.toml", format!("{SCENE}{}", probe.replace(from, to)));
        workplace.fail(&["run", "scene.toml"])
    };
    assert_eq!(fail("beam", "bean"), "scene.toml: line 13: there is no object \"bean\"; the scene has beam");
    assert_eq!(fail("tip", "load"), "scene.toml: line 12: the name \"load\" is taken already");
    assert!(fail("0.05, 0.05", "0.05, 0.5").starts_with("scene.toml: line 14: the point "));
}

#[test]
fn a_log_of_a_force_repeats_bit_for_bit() {
    let workplace = workplace();
    workplace.succeed(&["run", "scene.toml", "--realtime", "--log", "run.mcap", "--pictures", "0"]);
    workplace.succeed(&["replay", "run.mcap", "--csv", "replayed.csv"]);
    // As offline: the course follows simulated time.
    workplace.succeed(&["run", "scene.toml", "--csv", "steps.csv"]);
    assert_eq!(workplace.text("replayed.csv"), workplace.text("steps.csv"));
}

#[test]
fn keys_that_do_not_fit_a_force_are_refused() {
    let workplace = workplace();
    let fail = |from: &str, to: &str| {
        assert!(SCENE.contains(from));
        workplace.write("scene.toml", SCENE.replace(from, to));
        workplace.fail(&["run", "scene.toml"])
    };
    assert_eq!(
        fail("patch_radius = 0.03", "tip_radius = 0.03"),
        "scene.toml: line 10: tip_radius is of a hand; with mode = \"force\" the path is the force: leave it out"
    );
    assert_eq!(
        fail("patch_radius = 0.03", "coupling = { stiffness = 10.0 }"),
        "scene.toml: line 10: coupling is of a hand; with mode = \"force\" the path is the force: leave it out"
    );
    assert_eq!(
        fail("attach = { object = \"beam\", point = [0.05, 0.0, 0.0] }\n", ""),
        "scene.toml: line 7: mode = \"force\" needs attach = { object = \"…\", point = [x, y, z] }, the point that the force acts on"
    );
    assert_eq!(
        fail("path = { file = \"force.csv\" }\n", ""),
        "scene.toml: line 6: mode = \"force\" needs path = { file = \"…\" } with the columns t,fx,fy,fz: the force on the object in \
         world axes [N]"
    );
    assert_eq!(
        fail("0.05, 0.0, 0.0", "-0.05, 0.0, 0.0"),
        "scene.toml: line 8: the point of \"load\" lies on fixed nodes of \"beam\": no hand can move it; hold one that is farther from them"
    );
    assert_eq!(
        fail("\"force\"", "\"pull\""),
        "scene.toml: line 7: mode is \"pull\", expected \"held\", \"touch\" or \"force\""
    );
    workplace.write("force.csv", "t,x,y,z\n0,0,0,0\n");
    assert_eq!(
        fail("0.03", "0.04"),
        "scene.toml: line 9: path force.csv: line 1: the columns are t,x,y,z, expected t,fx,fy,fz"
    );
}

/// A damped bar of 0.1 × 0.03 × 0.03 m, and a scene that clamps its two ends.
fn clamped() -> (Workplace, String) {
    let workplace = Workplace::new();
    let body = ["record", "box:0.1x0.03x0.03/6x2x2", "--young", "1e5", "--poisson", "0", "--density", "1000"];
    workplace.succeed(&[&body[..], &["--rayleigh", "0,1e-2", "--modes", "40", "-o", "bar.palp"]].concat());
    // The right end goes 0.1 mm outwards, then turns by 1 mrad about the bar.
    workplace.write(
        "jaw.csv",
        "0,0.05,0,0,1,0,0,0\n0.2,0.0501,0,0,1,0,0,0\n0.5,0.0501,0,0,1,0,0,0\n0.6,0.0501,0,0,1,0.0005,0,0\n",
    );
    let scene = "[[object]]\nname = \"bar\"\nrecording = \"bar.palp\"\n[[clamp]]\nname = \"wall\"\nobject = \"bar\"\nbox = { min = \
                 [-1, -1, -1], max = [-0.049, 1, 1] }\n[[clamp]]\nname = \"jaw\"\nobject = \"bar\"\nface = { point = [0.05, 0.0, 0.0] }\npath \
                 = { file = \"jaw.csv\" }\n";
    workplace.write("scene.toml", scene);
    (workplace, scene.to_string())
}

#[test]
fn clamps_stretch_and_twist_a_bar() {
    let (workplace, _) = clamped();
    let text = workplace.succeed(&["run", "scene.toml", "--duration", "1", "--csv", "steps.csv"]);
    assert!(text.contains("\n  jaw          force on the clamp "), "{text}");
    let table = Table::parse(&workplace.text("steps.csv"));
    let at = |name: &str, row: usize| table.column(name)[row];
    // EA/L·u, at rest after 0.5 s; and GJ/L·θ, within what short ends stiffen.
    let stretch = 1e5 * 9e-4 / 0.1 * 1e-4;
    assert!((at("jaw.fx", 499) / -stretch - 1.0).abs() < 1e-4, "{}", at("jaw.fx", 499));
    assert!((at("wall.fx", 499) / stretch - 1.0).abs() < 1e-4, "{}", at("wall.fx", 499));
    let twist = 0.5e5 * 0.1406 * 0.03_f64.powi(4) / 0.1 * 1e-3;
    let ratio = at("jaw.tx", 999) / -twist;
    assert!(ratio > 1.0 && ratio < 1.15, "{ratio}");
    assert!((at("wall.tx", 999) + at("jaw.tx", 999)).abs() < 1e-4 * twist, "{}", at("wall.tx", 999));
    // Without a path the frame is in the middle of the face.
    assert_eq!(at("jaw.x", 999), 0.0501);
    assert!((at("wall.x", 999) + 0.05).abs() < 1e-12, "{}", at("wall.x", 999));
    assert!(at("energy.defect", 999).abs() < 1e-11 * at("energy.input", 999));
    let summary = workplace.json(&["run", "scene.toml", "--json"]);
    let jaw = &summary["clamps"][1];
    assert_eq!((&summary["steps"], &jaw["name"], &jaw["cells"]), (&600.into(), &"jaw".into(), &12.into()));
    assert!(jaw["torque_max_nm"].as_f64().expect("a number") > 0.9 * twist);
}

#[test]
fn a_log_of_clamps_repeats_bit_for_bit() {
    let (workplace, _) = clamped();
    workplace.succeed(&["run", "scene.toml", "--realtime", "--log", "run.mcap", "--pictures", "0"]);
    workplace.succeed(&["replay", "run.mcap", "--csv", "replayed.csv"]);
    workplace.succeed(&["run", "scene.toml", "--csv", "steps.csv"]);
    assert_eq!(workplace.text("replayed.csv"), workplace.text("steps.csv"));
}

#[test]
fn clamps_that_hold_nothing_or_fixed_nodes_are_refused() {
    let (workplace, scene) = clamped();
    let fail = |from: &str, to: &str| {
        assert!(scene.contains(from));
        workplace.write("scene.toml", scene.replace(from, to));
        workplace.fail(&["run", "scene.toml"])
    };
    assert_eq!(
        fail("face = { point = [0.05, 0.0, 0.0] }\n", ""),
        "scene.toml: line 9: a clamp needs one of face = { point = [x, y, z] }, the face around a point, and box = { min = [x, y, z], max = \
         [x, y, z] }, all triangles in a box"
    );
    assert_eq!(
        fail("-0.049, 1", "-0.06, 1"),
        "scene.toml: line 7: there is no whole triangle of \"bar\" in it; it is given in the body frame [m]"
    );
    assert_eq!(
        fail("face = {", "max_cells = 500\nface = {"),
        "scene.toml: line 11: max_cells is 500, expected 1 to 256"
    );
    assert_eq!(
        fail("object = \"bar\"\nface", "object = \"bat\"\nface"),
        "scene.toml: line 10: there is no object \"bat\"; the scene has bar"
    );
    let body = ["record", "box:0.1x0.03x0.03/6x2x2", "--young", "1e5", "--poisson", "0", "--density", "1000"];
    let fixed = ["--modes", "40", "--fix", "x<-0.049", "-o", "bar.palp"];
    workplace.succeed(&[&body[..], &fixed].concat());
    assert_eq!(
        fail("name", "name"),
        "scene.toml: line 7: the clamp \"wall\" holds fixed nodes of \"bar\": leave them out"
    );
}

const SHAKEN: &str = r#"
[[object]]
name = "beam"
recording = "beam.palp"
path = { file = "base.csv" }
[[probe]]
name = "tip"
object = "beam"
point = [0.05, 0.0, 0.0]
"#;

#[test]
fn a_base_moves_its_body_and_a_log_repeats_it() {
    let workplace = workplace();
    let rows = (0..=400).map(|k| {
        let t = f64::from(k) * 1e-3;
        format!("{t:?},0.0,{:?},0.2\n", 0.002 * (1.0 - (40.0 * t).cos()))
    });
    workplace.write("base.csv", rows.collect::<String>());
    workplace.write("scene.toml", SHAKEN);
    let text = workplace.succeed(&["run", "scene.toml", "--csv", "steps.csv"]);
    assert!(text.starts_with("400 steps") && text.contains("from hands, obstacles and bases"), "{text}");
    let table = Table::parse(&workplace.text("steps.csv"));
    let (t, base, speed) = (table.column("t"), table.column("beam.py"), table.column("beam.vy"));
    // From rest; in the first step it catches up on half a step.
    for (row, t) in t.iter().enumerate().take(399).skip(1) {
        // The mean of the path half a step before and after, linear between rows: off by h²/4 of its acceleration.
        assert!((base[row] - 0.002 * (1.0 - (40.0 * t).cos())).abs() < 1e-6, "{row}");
        assert!((speed[row] - 0.08 * (40.0 * t).sin()).abs() < 2e-4, "{row}");
    }
    let (place, moved) = (table.column("tip.y"), table.column("tip.uy"));
    assert!(moved.iter().any(|u| u.abs() > 1e-4) && table.column("tip.z")[0] > 0.19);
    assert!(place.iter().zip(&base).zip(&moved).all(|((y, base), u)| (y - base - u).abs() < 1e-12));
    let input = table.column("energy.input");
    let most = input.iter().fold(0.0_f64, |most, input| most.max(input.abs()));
    assert!(table.column("energy.defect").iter().all(|defect| defect.abs() < 1e-11 * most));
    workplace.succeed(&["run", "scene.toml", "--realtime", "--log", "run.mcap", "--pictures", "0"]);
    workplace.succeed(&["replay", "run.mcap", "--csv", "replayed.csv"]);
    assert_eq!(workplace.text("replayed.csv"), workplace.text("steps.csv"));
}

#[test]
fn a_base_that_turns_and_one_of_a_free_body_are_refused() {
    let workplace = workplace();
    workplace.write("base.csv", "0,0,0,0,1,0,0,0\n1,0,0,0,1,0,0,0\n");
    workplace.write("scene.toml", SHAKEN);
    assert_eq!(
        workplace.fail(&["run", "scene.toml"]),
        "scene.toml: line 5: object \"beam\": a base follows a path without rotation: give the columns t,x,y,z, or drive a free body by a \
         clamp, which may turn"
    );
    workplace.write("scene.toml", SHAKEN.replace("path =", "position = [0.0, 0.0, 0.0]\npath ="));
    assert_eq!(
        workplace.fail(&["run", "scene.toml"]),
        "scene.toml: line 5: the position is in the path: leave one of the two out"
    );
    let body = ["record", "box:0.1x0.1x0.1/2x2x2", "--order", "1", "--young", "2000", "--poisson", "0.3"];
    workplace.succeed(&[&body[..], &["--density", "110", "--modes", "10", "-o", "beam.palp"]].concat());
    workplace.write("scene.toml", SHAKEN);
    assert_eq!(
        workplace.fail(&["run", "scene.toml"]),
        "scene.toml: line 5: object \"beam\": only a body with fixed nodes has a base that follows a path: record it with --fix, or drive a \
         free one by a clamp"
    );
}
