//! Scene files: keys of earlier versions, and errors as values.

use palpate::{DeviceMode, RigidIntegrator};
use palpate_scene::{RunMode, Scene, SceneError, SceneErrorKind, read_scene};
use palpate_testkit::FREE_BLOCK_FILE;
use std::path::Path;
use tempfile::TempDir;

/// A scene in a folder with a recording `cube.palp` and a path `path.csv`.
fn read(text: &str) -> Result<Scene, SceneError> {
    let folder = TempDir::new().expect("a temporary folder");
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).expect("a file");
    write("cube.palp", FREE_BLOCK_FILE);
    write("path.csv", b"t,x,y,z\n0,0,0,3\n1,0,0,2\n");
    write("scene.toml", text.as_bytes());
    read_scene(&folder.path().join("scene.toml"), RunMode::Offline)
}

const OBJECT: &str = "[[object]]\nname = \"cube\"\nrecording = \"cube.palp\"\n";

/// Every key that a scene file ever had, in its oldest spelling.
const OLD_SCENE: &str = r#"
step = 0.002
gravity = [0.0, -9.81, 0.0]
motion = "paper"
rigid_compliance = false
most_contact_points = 100
most_places = 16

[[object]]
name = "cube"
recording = "cube.palp"
response = "modal"
position = [0.0, 1.0, 0.0]
orientation = [1.0, 0.0, 0.0, 0.0]
velocity = [0.1, 0.0, 0.0]
angular_velocity = [0.0, 0.1, 0.0]
friction = 0.4

[[plane]]
name = "floor"
point = [0.0, -4.0, 0.0]
normal = [0.0, 1.0, 0.0]
friction = 0.5

[[obstacle]]
name = "ball"
sphere = { radius = 0.02 }
position = [9.0, 0.0, 0.0]
orientation = [1.0, 0.0, 0.0, 0.0]
friction = 0.5

[[obstacle]]
box = { half_extents = [0.1, 0.1, 0.1] }
path = { file = "path.csv", repeat = true }

[[obstacle]]
capsule = { radius = 0.1, half_length = 0.2 }

[[device]]
name = "finger"
mode = "touch"
path = { file = "path.csv" }
simulated = { device = "touch", grip = "light" }
tip_radius = 0.005
patch_radius = 0.01
friction = 0.6
coupling = { stiffness = 500.0, damping = 1.0 }

[[device]]
name = "robot"
mode = "touch"
driver = { kind = "dhd", which = 2, force = 1.5, armed = true }
mount = { position = [0.0, 0.0, 0.1], orientation = [1.0, 0.0, 0.0, 0.0], scale = 2.0 }

[[device]]
name = "far"
mode = "touch"
linked = true

[[device]]
name = "mouse"
mode = "touch"
pointer = true
coupling = "auto"
"#;

/// Old spellings and those of today.
const SPELLINGS: [(&str, &str); 5] = [
    ("motion =", "integrator ="),
    ("most_contact_points", "max_contact_points"),
    ("most_places", "max_contact_samples"),
    ("which =", "id ="),
    ("force =", "max_force ="),
];

#[test]
fn a_scene_with_every_old_key_opens_as_one_with_the_keys_of_today() {
    let new_scene = SPELLINGS.iter().fold(OLD_SCENE.to_string(), |text, (old, new)| text.replace(old, new));
    for text in [OLD_SCENE, new_scene.as_str()] {
        let scene = read(text).expect("a scene");
        let parameters = scene.model.parameters();
        assert_eq!((parameters.step_s, parameters.motion), (0.002, RigidIntegrator::Paper));
        assert_eq!((parameters.max_contact_points, parameters.max_contact_samples), (100, 16));
        assert_eq!((scene.obstacles.len(), scene.devices.len()), (4, 4));
        assert!(scene.devices.iter().all(|device| device.mode == DeviceMode::Touch));
        let real = scene.devices[1].real.as_ref().expect("a real device");
        assert_eq!((real.id.as_str(), real.max_force_n, real.armed), ("2", Some(1.5), true));
    }
}

#[test]
fn old_and_new_spelling_of_a_key_exclude_each_other() {
    // The line is that where the table begins.
    for (old, new, key) in [
        ("motion = \"exact\"", "integrator = \"exact\"", "integrator"),
        ("most_places = 48", "max_contact_samples = 48", "max_contact_samples"),
        ("most_contact_points = 9", "max_contact_points = 9", "max_contact_points"),
    ] {
        let error = read(&format!("{old}\n{new}\n{OBJECT}")).err().expect("a refusal");
        assert_eq!(
            (error.kind, error.line, error.key.as_deref()),
            (SceneErrorKind::Syntax, Some(1), Some(key))
        );
        assert!(error.message.contains(&format!("duplicate field `{key}`")), "{error}");
    }
}

#[test]
fn errors_have_kind_line_and_key_for_programs() {
    use SceneErrorKind::*;
    let device = |more: &str| format!("{OBJECT}[[device]]\nname = \"a\"\n{more}\n");
    let held = "mode = \"held\"\nattach = { object = \"cube\", point = [0.0, 0.0, 9.0] }\npath = { file = \"path.csv\" }";
    for (text, kind, line, key) in [
        (String::new(), Missing, 1, Some("object")),
        ("step = [".to_string(), Syntax, 1, None),
        (format!("speed = 1\n{OBJECT}"), Syntax, 1, Some("speed")),
        ("[[object]]\nname = \"cube\"\n".to_string(), Syntax, 1, Some("recording")),
        (format!("integrator = \"rough\"\n{OBJECT}"), UnknownValue, 1, Some("integrator")),
        (format!("max_contact_samples = 3\n{OBJECT}"), OutOfRange, 1, Some("max_contact_samples")),
        (format!("sleep_after = 0.0\n{OBJECT}"), OutOfRange, 1, Some("sleep_after")),
        (format!("step = 2.0\n{OBJECT}"), Model, 1, Some("step")),
        (OBJECT.replace("cube.palp", "none.palp"), Recording, 3, Some("recording")),
        (format!("{OBJECT}friction = -1.0"), OutOfRange, 4, Some("friction")),
        (format!("{OBJECT}table = \"t.zarr\""), Conflict, 4, Some("table")),
        (format!("{OBJECT}response = \"fir\""), Table, 3, Some("table")),
        (format!("{OBJECT}{OBJECT}"), Name, 5, Some("name")),
        (format!("{OBJECT}[[obstacle]]\n"), Missing, 4, Some("obstacle")),
        (format!("{OBJECT}[[obstacle]]\nmesh = {{ file = \"a.stl\" }}"), Mesh, 5, Some("mesh")),
        (device("mode = \"touch\"\npath = { file = \"no.csv\" }"), Path, 7, Some("path")),
        (
            device("mode = \"touch\"\npath = { file = \"path.csv\" }\nlinked = true"),
            Conflict,
            8,
            Some("linked"),
        ),
        (device("mode = \"hold\""), UnknownValue, 6, Some("mode")),
        (device(held), Grasp, 7, Some("point")),
    ] {
        let error = read(&text).err().unwrap_or_else(|| panic!("refused: {text}"));
        let found = (error.kind, error.line, error.key.as_deref());
        assert_eq!(found, (kind, Some(line), key), "{error}\n{text}");
        let file = error.file.as_deref().expect("a file");
        assert_eq!(file.file_name(), Some("scene.toml".as_ref()));
        let start = match kind {
            Syntax => format!("{}: TOML parse error at line {line}, ", file.display()),
            _ => format!("{}: line {line}: {}", file.display(), error.message),
        };
        assert!(error.to_string().starts_with(&start), "{error}");
    }
}

#[test]
fn a_missing_file_is_an_io_error_with_its_path() {
    let path = Path::new("no/such/scene.toml");
    let error = read_scene(path, RunMode::Offline).err().expect("a refusal");
    assert_eq!((error.kind, error.file.as_deref(), error.line), (SceneErrorKind::Io, Some(path), None));
    assert!(error.to_string().starts_with("cannot read the scene no/such/scene.toml: "), "{error}");
}

/// Places of the numbers in a scene's text.
fn numbers(text: &str) -> Vec<std::ops::Range<usize>> {
    let bytes = text.as_bytes();
    let (mut found, mut at, mut is_text) = (Vec::new(), 0, false);
    while at < bytes.len() {
        is_text ^= bytes[at] == b'"';
        let begins = bytes[at].is_ascii_digit() || bytes[at] == b'-' && bytes[at + 1].is_ascii_digit();
        let before = at.checked_sub(1).map_or(b' ', |before| bytes[before]);
        if is_text || !begins || !b" [".contains(&before) {
            at += 1;
            continue;
        }
        let length = bytes[at..].iter().take_while(|byte| b"-+.0123456789e".contains(*byte)).count();
        found.push(at..at + length);
        at += length;
    }
    found
}

#[test]
fn a_number_that_is_none_or_beyond_all_sizes_is_refused_in_every_key() {
    let all = numbers(OLD_SCENE);
    assert!(all.len() > 50, "{}", all.len());
    for place in all {
        for other in ["nan", "inf", "-inf", "1e300", "-1e300"] {
            let text = format!("{}{other}{}", &OLD_SCENE[..place.start], &OLD_SCENE[place.end..]);
            let line = 1 + OLD_SCENE[..place.start].matches('\n').count();
            let error = read(&text).err().unwrap_or_else(|| panic!("refused: line {line}: {other}"));
            assert!(error.line.is_some(), "{error}");
        }
    }
}

#[test]
fn a_path_that_is_no_regular_file_or_in_no_order_is_refused_with_its_line() {
    let device = "[[device]]\nname = \"a\"\nmode = \"touch\"\n";
    let of_folder = read(&format!("{OBJECT}{device}path = {{ file = \".\" }}")).err().expect("a refusal");
    let text = of_folder.to_string();
    assert!(
        text.contains("line 7: cannot read the path ") && text.ends_with(": it is a folder, not a file"),
        "{text}"
    );
    for (rows, expected) in [
        ("0,0,0,nan\n", "line 1"),
        ("0,0,inf,0\n", "line 1"),
        ("nan,0,0,0\n", "line 1"),
        ("0,0,0,0\n2,0,0,0\n1,0,0,0\n", "line 3"),
        ("0,0,0,0\n0,0,0,0\n", "line 2"),
        ("0,0,0,2e6\n", "line 1"),
    ] {
        let refused = palpate_haptics::MotionPath::parse(rows, palpate_haptics::Columns::Position);
        let text = refused.expect_err(rows).to_string();
        assert!(text.contains(expected), "{rows:?}: {text}");
    }
}
