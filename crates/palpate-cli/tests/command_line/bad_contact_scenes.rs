//! Errors and warnings of scenes with contacts.

use crate::workplace::{CUBE, Workplace};

/// A cube on a floor, a finger that touches it, and a ball that moves.
const SCENE: &str = r#"max_contact_points = 100

[[object]]
name = "cube"
recording = "cube.palp"
friction = 0.4

[[plane]]
name = "floor"
point = [0.0, -0.06, 0.0]
normal = [0.0, 1.0, 0.0]
friction = 0.5

[[obstacle]]
name = "ball"
sphere = { radius = 0.02 }
path = { file = "ball.csv" }
friction = 0.5

[[device]]
name = "finger"
mode = "touch"
path = { file = "finger.csv" }
tip_radius = 0.005
patch_radius = 0.23
friction = 0.6
coupling = { stiffness = 500.0, damping = 1.0 }
"#;

fn workplace() -> Workplace {
    let workplace = Workplace::new();
    workplace.succeed(&[&CUBE[..], &["cube.palp"]].concat());
    workplace.write("ball.csv", "0,0.2,0,0,1,0,0,0\n0.01,0.2,0.1,0,1,0,0,0\n");
    workplace.write("finger.csv", "0,0,0.07,0\n0.02,0,0.06,0\n");
    workplace
}

fn run(workplace: &Workplace, old: &str, new: &str) -> String {
    assert!(SCENE.contains(old), "{old:?} is not in the scene");
    workplace.write("scene.toml", SCENE.replacen(old, new, 1));
    workplace.fail(&["run", "scene.toml"])
}

#[test]
fn unknown_keys_of_contacts_are_errors_with_their_line() {
    let workplace = workplace();
    for (old, new, line, known) in [
        (
            "normal = [0.0, 1.0, 0.0]",
            "normal = [0.0, 1.0, 0.0]\ncolour = 1",
            12,
            "unknown field `colour`, expected one of `name`, `point`, `normal`, `path`, `friction`",
        ),
        (
            "sphere = {",
            "ball = {",
            16,
            "unknown field `ball`, expected one of `name`, `sphere`, `box`, `capsule`, `mesh`, `position`, `orientation`, \
             `path`, `friction`",
        ),
        ("{ radius", "{ diameter", 16, "unknown field `diameter`, expected `radius`"),
        ("damping = 1.0", "damper = 1.0", 27, "unknown field `damper`, expected `stiffness` or `damping`"),
        ("stiffness = 500.0, ", "", 27, "missing field `stiffness`"),
        ("normal = [0.0, 1.0, 0.0]\n", "", 8, "missing field `normal`"),
        ("normal = [0.0, 1.0, 0.0]", "normal = [0.0, 1.0]", 11, "2 numbers, expected 3"),
        (
            "max_contact_points = 100",
            "max_contact_points = 1.5",
            1,
            "invalid type: floating point `1.5`, expected a whole number",
        ),
    ] {
        let error = run(&workplace, old, new);
        let place = format!("scene.toml: TOML parse error at line {line}, column ");
        assert!(error.starts_with(&place) && error.ends_with(known), "{error}");
    }
}

#[test]
fn numbers_out_of_range_are_named_with_their_line() {
    let workplace = workplace();
    let friction = "friction = 0.5\n\n[[device]]";
    for (old, new, error) in [
        (
            "max_contact_points = 100",
            "max_contact_points = 0",
            "line 1: max_contact_points is 0, expected 1 to 4096",
        ),
        (
            "max_contact_points = 100",
            "max_contact_samples = 3",
            "line 1: max_contact_samples is 3, expected 8 to 1000000",
        ),
        ("friction = 0.4", "friction = -0.4", "line 6: friction is -0.4, expected at least 0 and below 1e6"),
        (
            "normal = [0.0, 1.0, 0.0]",
            "normal = [0.0, 0.0, 0.0]",
            "line 11: normal is [0.0, 0.0, 0.0], expected a vector that is not zero",
        ),
        (
            "friction = 0.5\n\n[[obstacle]]",
            "friction = inf\n\n[[obstacle]]",
            "line 12: friction is inf, expected at least 0 and below 1e6",
        ),
        ("radius = 0.02", "radius = 0", "line 16: radius is 0 m, expected above 0 and below 1e6"),
        (
            "sphere = { radius = 0.02 }",
            "box = { half_extents = [0.1, -0.1, 0.1] }",
            "line 16: half_extents are [0.1, -0.1, 0.1] m, expected three numbers above 0",
        ),
        (
            "sphere = { radius = 0.02 }",
            "capsule = { radius = 0.1, half_length = nan }",
            "line 16: half_length is NaN m, expected above 0 and below 1e6",
        ),
        (
            "sphere = { radius = 0.02 }",
            "mesh = { file = \"a.obj\", scale = 0 }",
            "line 16: scale is 0, expected above 0 and below 1e6",
        ),
        (
            friction,
            "friction = nan\n\n[[device]]",
            "line 18: friction is NaN, expected at least 0 and below 1e6",
        ),
        (
            "tip_radius = 0.005",
            "tip_radius = -0.005",
            "line 24: tip_radius is -0.005 m, expected at least 0 and below 1e6",
        ),
        (
            "patch_radius = 0.23",
            "patch_radius = inf",
            "line 25: patch_radius is inf m, expected at least 0 and below 1e6",
        ),
        ("friction = 0.6", "friction = -1", "line 26: friction is -1, expected at least 0 and below 1e6"),
        (
            "stiffness = 500.0",
            "stiffness = 0",
            "line 27: stiffness is 0 N/m, expected above 0 and below 1e18",
        ),
        ("damping = 1.0", "damping = -1", "line 27: damping is -1 N·s/m, expected at least 0 and below 1e18"),
    ] {
        assert_eq!(run(&workplace, old, new), format!("scene.toml: {error}"));
    }
}

#[test]
fn keys_that_exclude_each_other_are_refused() {
    let workplace = workplace();
    let held = "mode = \"held\"\nattach = { object = \"cube\", point = [0.0, 0.05, 0.0] }";
    let without = "the obstacle \"ball\" needs one shape: sphere, box, capsule or mesh";
    for (old, new, error) in [
        (
            "mode = \"touch\"",
            "mode = \"poke\"",
            "line 22: mode is \"poke\", expected \"held\", \"touch\" or \"force\"",
        ),
        (
            "mode = \"touch\"",
            "mode = \"held\"",
            "line 22: mode = \"held\" needs attach = { object = \"…\", point = [x, y, z] }, the point that the device holds",
        ),
        (
            "mode = \"touch\"",
            "mode = \"touch\"\nattach = { object = \"cube\", point = [0.0, 0.05, 0.0] }",
            "line 23: attach is of a device that holds a point; with mode = \"touch\" leave it out",
        ),
        (
            "mode = \"touch\"",
            held,
            "line 25: tip_radius is of a device that touches; with mode = \"held\" leave it out",
        ),
        (
            "mode = \"touch\"\npath = { file = \"finger.csv\" }\ntip_radius = 0.005\n",
            &format!("{held}\npath = {{ file = \"finger.csv\" }}\n"),
            "line 25: patch_radius is of a device that touches; with mode = \"held\" leave it out",
        ),
        (
            "mode = \"touch\"\npath = { file = \"finger.csv\" }\ntip_radius = 0.005\npatch_radius = 0.23\n",
            &format!("{held}\npath = {{ file = \"finger.csv\" }}\n"),
            "line 25: friction is of a device that touches; with mode = \"held\" leave it out",
        ),
        ("sphere = { radius = 0.02 }\n", "", &format!("line 14: {without}")),
        (
            "sphere = { radius = 0.02 }",
            "sphere = { radius = 0.02 }\nbox = { half_extents = [1, 1, 1] }",
            &format!("line 14: {without}"),
        ),
        (
            "path = { file = \"ball.csv\" }",
            "path = { file = \"ball.csv\" }\nposition = [0, 0, 0]",
            "line 18: the position is in the path: leave one of the two out",
        ),
        (
            "path = { file = \"ball.csv\" }",
            "path = { file = \"ball.csv\" }\norientation = [1, 0, 0, 0]",
            "line 18: the orientation is in the path: leave one of the two out",
        ),
        (
            "path = { file = \"ball.csv\" }",
            "orientation = [1, 1, 0, 0]",
            "line 17: orientation has length 1.4142135623730951, expected a unit quaternion w, x, y, z",
        ),
        ("name = \"floor\"", "name = \"cube\"", "line 9: the name \"cube\" is taken already"),
        ("name = \"ball\"", "name = \"floor\"", "line 15: the name \"floor\" is taken already"),
        (
            "name = \"ball\"",
            "name = \"a ball\"",
            "line 15: name is \"a ball\", expected letters, digits, - and _",
        ),
        ("name = \"finger\"", "name = \"ball\"", "line 15: the name \"ball\" is taken already"),
        // A plane without a name is called plane.
        (
            "[[plane]]\nname = \"floor\"",
            "[[plane]]\nname = \"plane2\"\npoint = [0, 0, 0]\nnormal = [1, 0, 0]\n[[plane]]",
            "line 12: the name \"plane2\" is taken already",
        ),
    ] {
        assert_eq!(run(&workplace, old, new), format!("scene.toml: {error}"));
    }
}

#[test]
fn bad_paths_of_obstacles_are_named_with_both_lines() {
    let workplace = workplace();
    workplace.write("scene.toml", SCENE);
    for (rows, error) in [
        ("0,0,0,0,1\n", "line 1: 5 numbers, expected the four t,x,y,z or the eight t,x,y,z,qw,qx,qy,qz"),
        ("0,0,0,0\n1,0,0,0,1,0,0,0\n", "line 2: 8 numbers, expected the four t,x,y,z"),
        (
            "t,x,y,z,qx,qy,qz,qw\n",
            "line 1: the columns are t,x,y,z,qx,qy,qz,qw, expected t,x,y,z or t,x,y,z,qw,qx,qy,qz",
        ),
        ("0,0,0,0,0,0,0,0\n", "line 1: orientation has length 0, expected a unit quaternion w, x, y, z"),
        ("0,0,0,0\n0,0,0,0\n", "line 2: time 0 s does not come after 0 s"),
    ] {
        workplace.write("ball.csv", rows);
        assert_eq!(
            workplace.fail(&["run", "scene.toml"]),
            format!("scene.toml: line 17: path ball.csv: {error}")
        );
    }
    // A device has no orientation.
    workplace.write("ball.csv", "0,0,0,0\n");
    workplace.write("finger.csv", "0,0,0,0,1,0,0,0\n");
    assert_eq!(
        workplace.fail(&["run", "scene.toml"]),
        "scene.toml: line 23: path finger.csv: line 1: 8 numbers, expected the four t,x,y,z"
    );
}

#[test]
fn bad_meshes_of_obstacles_are_named() {
    let workplace = workplace();
    let corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n";
    workplace.write("open.obj", format!("{corners}f 1 3 2\nf 1 2 4\nf 2 3 4\n"));
    workplace.write("flat.obj", format!("{corners}v 2 0 0\nf 1 2 5\nf 1 5 2\n"));
    workplace.write("bad.obj", format!("{corners}f 1 2\n"));
    workplace.write("short.stl", [b'x'; 100]);
    workplace.write("empty.stl", "solid\nendsolid\n");
    workplace.write("bad.off", "OFF\n1 1 0\n");
    workplace.write(
        "surface.msh",
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n3\n1 0 0 0\n2 1 0 0\n3 0 1 0\n$EndNodes\n$Elements\n1\n\
         1 2 2 1 1 1 2 3\n$EndElements\n",
    );
    for (file, error) in [
        ("no.obj", "cannot read mesh no.obj: No such file or directory (os error 2)"),
        ("cow.ply", "cannot read mesh cow.ply: No such file or directory (os error 2)"),
        ("bad.off", "bad.off: line 2: expected a vertex, found the end of the file"),
        (
            "open.obj",
            "open.obj: an obstacle's mesh is open at the edge between nodes 0 and 1: it needs an inside and an outside",
        ),
        ("flat.obj", "flat.obj: triangle 0 of an obstacle's mesh has no area"),
        ("bad.obj", "bad.obj: line 5: the face has 2 corners, expected three or more"),
        (
            "short.stl",
            "short.stl: line 1: this is no STL file: a text begins with 'solid', and a binary file with 2021161080 \
             triangles has 101058054084 bytes, not 100",
        ),
        ("empty.stl", "empty.stl: line 2: the file has no triangles"),
        (
            "surface.msh",
            "surface.msh: the mesh has no solid elements; give a surface as .obj, .stl, .ply or .off",
        ),
    ] {
        let error_found =
            run(&workplace, "sphere = { radius = 0.02 }", &format!("mesh = {{ file = \"{file}\" }}"));
        assert_eq!(error_found, format!("scene.toml: line 16: {error}"));
    }
}

#[test]
fn outputs_of_one_run_are_two_files_and_none_of_its_inputs() {
    let workplace = workplace();
    workplace
        .write("scene.toml", SCENE.replacen("sphere = { radius = 0.02 }", "mesh = { file = \"a.obj\" }", 1));
    workplace.write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n");
    let before = workplace.files();
    for contacts in ["out.csv", "./out.csv"] {
        assert_eq!(
            workplace.fail(&["run", "scene.toml", "--csv", "out.csv", "--contacts", contacts]),
            format!("cannot write {contacts}: --csv and --contacts name the same file")
        );
    }
    for name in ["scene.toml", "ball.csv", "finger.csv", "cube.palp", "a.obj"] {
        for option in ["--csv", "--contacts"] {
            assert_eq!(
                workplace.fail(&["run", "scene.toml", option, name]),
                format!("cannot write {name}: it is one of the inputs")
            );
        }
    }
    assert_eq!(workplace.files(), before);
    workplace.succeed(&["run", "scene.toml", "--csv", "steps.csv", "--contacts", "contacts.csv"]);
}

#[test]
fn a_patch_that_shows_the_mesh_and_a_table_that_leaves_something_out_get_a_warning() {
    let workplace = workplace();
    let warnings = |scene: String| {
        workplace.write("scene.toml", scene);
        let output = workplace.palpate(&["run", "scene.toml"]);
        assert_eq!(output.status.code(), Some(0));
        String::from_utf8(output.stderr).expect("text on standard error")
    };
    // Linear elements in cells of a third of 0.1 m, with their diagonals.
    assert_eq!(warnings(SCENE.to_string()), "");
    let edge = 0.1 / 3.0 * (2.0 + 2_f64.sqrt()) / 3.0;
    let smooth = format!("{:.2e}", 6.0 * edge);
    for (patch, shown) in [("patch_radius = 0.2", "2.00e-1"), ("", "5.00e-3")] {
        assert_eq!(
            warnings(SCENE.replacen("patch_radius = 0.23", patch, 1)),
            format!(
                "warning: device \"finger\" touches with a patch of {shown} m, less than 6 edges of the mesh on 100 % of \
                 \"cube\": its finite elements are too stiff for that by more than 2 %, and the feel shows the mesh; with patch_radius = \
                 {smooth} it does not\n"
            )
        );
    }
    assert_eq!(warnings(SCENE.replacen("patch_radius = 0.23", "patch_radius = 0", 1)), "");

    let mut arguments = [&["record", "box:0.1x0.1x0.1/2x2x2"], &CUBE[2..12]].concat();
    arguments.extend(["--duration", "0.05", "--dense", "cube.zarr", "--output", "same.palp"]);
    workplace.succeed(&arguments);
    let points = SCENE.replacen("patch_radius = 0.23", "patch_radius = 0", 1);
    let table = points.replacen("cube.palp", "cube.zarr", 1);
    let warning = "warning: the table of \"cube\" stands alone: contacts are searched for on its undeformed surface, and forces may be off \
                   by some per cent where it deforms much; name its recording too: recording = \"….palp\", table = \"….zarr\"\n";
    assert_eq!(warnings(table.clone()), warning);
    let (alone, _) = table.split_once("[[plane]]").expect("a plane");
    assert_eq!(warnings(alone.to_string()), "");
    let both =
        points.replacen("\"cube.palp\"", "\"same.palp\"\nresponse = \"fir\"\ntable = \"cube.zarr\"", 1);
    assert_eq!(
        warnings(both),
        "warning: the table of \"cube\" ends after 0.05 s, when the slowest mode still has 89 % of its amplitude: what a force does \
         later is lost, and energy with it; record it with --duration 1.6, or damp the body more\n"
    );
}

/// Kinds and parts of the warnings of a run, as JSON has them.
fn kinds(workplace: &Workplace, scene: &str) -> Vec<(String, String)> {
    workplace.write("scene.toml", scene);
    let summary = workplace.json(&["run", "scene.toml", "--duration", "0.02", "--json"]);
    let text = |value: &serde_json::Value| value.as_str().expect("a text").to_string();
    let warnings = summary["warnings"].as_array().expect("a list");
    warnings.iter().map(|warning| (text(&warning["kind"]), text(&warning["part"]))).collect()
}

#[test]
fn what_begins_inside_overlaps_or_is_in_millimetres_gets_a_warning_with_its_name() {
    let workplace = workplace();
    let moved = |old: &str, new: &str| {
        assert!(SCENE.contains(old), "{old:?} is not in the scene");
        SCENE.replacen(old, new, 1)
    };
    let other = |at: &str| {
        let other = format!(
            "[[object]]\nname = \"other\"\nrecording = \"cube.palp\"\nposition = [{at}]\n\n[[plane]]"
        );
        moved("[[plane]]", &other)
    };
    let ball = |radius: &str| {
        let path = moved("path = { file = \"ball.csv\" }", "position = [0.0, 0.0, 0.0]");
        path.replacen("radius = 0.02", &format!("radius = {radius}"), 1)
    };
    let path = |text: &str| {
        workplace.write("other.csv", text);
        moved("finger.csv", "other.csv")
    };
    for (scene, expected) in [
        (SCENE.to_string(), vec![]),
        (moved("-0.06, 0.0]", "-0.049, 0.0]"), vec![("begins_inside", "cube")]),
        (moved("-0.06, 0.0]", "0.2, 0.0]"), vec![("begins_inside", "cube")]),
        (ball("0.02"), vec![("begins_inside", "cube")]),
        (ball("0.2"), vec![("begins_inside", "cube")]),
        (other("0.11, 0.0, 0.0"), vec![]),
        (other("0.1, 0.0, 0.0"), vec![]),
        (other("0.09, 0.02, 0.01"), vec![("overlap", "cube")]),
        (other("0.0, 0.0, 0.0"), vec![("overlap", "cube")]),
    ] {
        let expected: Vec<_> =
            expected.iter().map(|(kind, part)| (kind.to_string(), part.to_string())).collect();
        let found = kinds(&workplace, &scene);
        // How a run with such a start goes on is not of interest here.
        let of_run = ["no_contact", "penetration", "large_deformation", "unsolved", "dropped_contacts"];
        let shown: Vec<_> = found.into_iter().filter(|(kind, _)| !of_run.contains(&kind.as_str())).collect();
        assert_eq!(shown, expected, "{scene}");
    }
    for (text, kind) in [
        ("0,0,0.02,0\n1,0,0.02,0\n", "begins_inside"),
        ("0,0,0.053,0\n1,0,0.053,0\n", "begins_inside"),
        ("0,0,70,0\n1,0,60,0\n", "units"),
    ] {
        let found = kinds(&workplace, &path(text));
        assert_eq!(found[0], (kind.to_string(), "finger".to_string()), "{text}");
    }
}

#[test]
fn the_largest_penetration_is_that_of_all_nodes() {
    let workplace = workplace();
    // The floor's surface is 1 cm above the cube's lower face.
    workplace.write("scene.toml", SCENE.replacen("-0.06, 0.0]", "-0.04, 0.0]", 1));
    let summary = workplace.json(&["run", "scene.toml", "--duration", "0.02", "--json"]);
    let depth = summary["objects"][0]["largest_penetration_m"].as_f64().expect("a number");
    assert!((0.005..0.0101).contains(&depth), "{depth}");
    let warnings = summary["warnings"].as_array().expect("a list");
    assert!(warnings.iter().any(|warning| warning["kind"] == "penetration"), "{warnings:?}");
    // One that nothing presses is inside nothing.
    workplace.write("scene.toml", SCENE);
    let summary = workplace.json(&["run", "scene.toml", "--duration", "0.02", "--json"]);
    assert_eq!(summary["objects"][0]["largest_penetration_m"], 0.0);
}

#[test]
fn strict_runs_end_with_the_first_warning() {
    let workplace = workplace();
    workplace.write("scene.toml", SCENE.replacen("-0.06, 0.0]", "-0.04, 0.0]", 1));
    let error = workplace.fail(&["run", "scene.toml", "--strict"]);
    assert!(error.contains("begins 10.00 mm inside \"floor\""), "{error}");
    assert!(error.ends_with("(a warning; --strict makes it an error)"), "{error}");
    // One that is known at the end only: the summary is printed before.
    workplace.write("scene.toml", SCENE);
    let ended = workplace.palpate(&["run", "scene.toml", "--strict"]);
    let error = String::from_utf8_lossy(&ended.stderr);
    assert_eq!(ended.status.code(), Some(1), "{error}");
    assert!(error.contains("finger touched nothing; its centre stayed about 0.0100 m"), "{error}");
    assert!(String::from_utf8_lossy(&ended.stdout).contains("  warning      finger touched nothing"));
    workplace.succeed(&["run", "scene.toml"]);
}

#[test]
fn fixed_nodes_that_begin_inside_an_obstacle_are_not_said_to_be_let_out() {
    let workplace = workplace();
    workplace.succeed(&[&CUBE[..], &["cube.palp", "--fix", "y<-0.049"]].concat());
    workplace.write("scene.toml", SCENE.replacen("-0.06, 0.0]", "-0.04, 0.0]", 1));
    let summary = workplace.json(&["run", "scene.toml", "--duration", "0.02", "--json"]);
    let text = "begins 10.00 mm inside \"floor\": its fixed nodes stay there, without force; move it by as much along";
    assert!(summary["warnings"].to_string().replace('\\', "").contains(text), "{}", summary["warnings"]);
}
