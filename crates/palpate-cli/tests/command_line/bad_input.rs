//! Bad input: one clear error, a status, and nothing half-written.

use crate::workplace::{SCENE, Workplace, gmsh_bar};

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
            "`step`, `gravity`, `integrator`, `rigid_compliance`, `max_contact_points`, `max_contact_samples`, `solver_budget`, `sleep_after`, `object`, `plane`, `obstacle`, `device`, `probe`, `clamp`",
        ),
        (
            "recording = \"cube.palp\"",
            "recording = \"cube.palp\"\nspeed = 1",
            7,
            "`name`, `recording`, `response`, `table`, `position`, `path`, `orientation`, `velocity`, `angular_velocity`, `start`, `friction`",
        ),
        (
            "mode = \"held\"",
            "mode = \"held\"\nforce = 1",
            11,
            "`name`, `mode`, `attach`, `path`, `linked`, `pointer`, `tip_radius`, `patch_radius`, `friction`, `coupling`, \
             `simulated`, `driver`, `mount`, `limits`",
        ),
        ("{ file = \"left.csv\" }", "{ files = \"left.csv\" }", 12, "expected `file` or `repeat`"),
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
            "\nintegrator = \"rough\"\n[[object]]",
            "scene.toml: line 3: integrator is \"rough\", expected \"exact\" or \"paper\"",
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
        (
            "mode = \"held\"",
            "mode = \"push\"",
            "scene.toml: line 10: mode is \"push\", expected \"held\", \"touch\" or \"force\"",
        ),
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
    let free = workplace.text("scene.toml");
    // A body that could touch something is let go of as little.
    let above_a_floor =
        format!("{free}\n[[plane]]\nname = \"floor\"\npoint = [0, -1, 0]\nnormal = [0, 1, 0]\n");
    for scene in [above_a_floor, free] {
        workplace.write("scene.toml", &scene);
        let error = workplace.fail(&["run", "scene.toml", "--csv", "out.csv"]);
        assert!(
        error.starts_with(
            "at 0.001000 s the held points can't be met: a hand moves, or a body turns, too far in one step of 0.001 s; \
             the hand of \"left\" is "
        ) && error.ends_with(". Use a shorter step, and check that paths are in metres"),
        "{error}"
    );
    }
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
    assert_eq!(workplace.fail(&["inspect", "."]), ".: there is no store of impulse responses");
}

#[test]
fn a_failed_recording_says_why_and_leaves_what_was_there() {
    let workplace = Workplace::new();
    workplace.write("out.palp", "an older recording");
    let facet =
        "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
    workplace.write("surface.stl", format!("solid\n{facet}endsolid\n"));
    workplace.write("notes.txt", "Dear diary\n");
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
        "--fix \"foot\" is neither a group of the mesh nor a condition such as 'x<0.001' or 'y>=0.1 & z<0', nor all, surface, \
         region:NAME or nodes:1,5-9; the mesh \
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
        "surface.stl: the surface is open: 3 edges belong to one triangle only, about holes of 100 % of its area, and at most 5 % can be \
         closed: close it, or give a sheet a thickness, in the program that made it"
    );
    assert_eq!(
        with(&["--cell-size", "0.01"]),
        "box:0.1x0.1x0.1/2x2x2: a cell size is for surfaces, and this has its tetrahedra already: leave --cell-size out"
    );
    assert_eq!(
        record("notes.txt", &material),
        "notes.txt: the file begins with 'Dear diary', and is of no mesh format that palpate knows: expected Gmsh (.msh), VTK (.vtk, \
         .vtu), TetGen (.node with .ele), MEDIT (.mesh, .meshb), Vega (.veg) or Abaqus (.inp), or a surface as STL, OBJ, PLY, OFF or \
         glTF"
    );
    assert_eq!(
        record(cube, &[]),
        "region '0' has no material in the mesh file: give --young, --poisson and --density, --material, or --materials"
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
