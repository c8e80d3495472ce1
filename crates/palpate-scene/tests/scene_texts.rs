//! Scenes of texts, for programs that move the devices: parts in memory, and devices without a path.

use glam::DVec3;
use palpate::{AppliedForce, DeviceMode, Pose, Recording, State, step};
use palpate_scene::{
    PartsInMemory, RunCheck, RunMode, Scene, SceneError, SceneErrorKind, Warning, WarningKind, read_scene,
    read_scene_text,
};
use palpate_testkit::FREE_BLOCK_FILE;
use std::path::{Path, PathBuf};
use std::sync::Arc;

const TEXT: &str = r#"
[[object]]
name = "cube"
recording = "<cube>"
[[device]]
name = "finger"
mode = "touch"
[[device]]
name = "load"
mode = "force"
attach = { object = "cube", point = [0.1, 0.05, 0.05] }
[[device]]
name = "guided"
mode = "touch"
path = { file = "<path>" }
"#;

fn read(text: &str, path: &str) -> Result<Scene, SceneError> {
    let recording = Arc::new(Recording::from_bytes(FREE_BLOCK_FILE).expect("a recording"));
    let parts = PartsInMemory {
        recordings: [(PathBuf::from("<cube>"), recording)].into(),
        paths: [(PathBuf::from("<path>"), path.to_string())].into(),
    };
    read_scene_text(Path::new("nowhere/scene.toml"), text, &parts, RunMode::Offline)
}

#[test]
fn parts_in_memory_take_the_place_of_files() {
    let scene = read(TEXT, "0,0,0,3\n2,0,0,1\n").expect("a scene");
    assert_eq!(scene.end_s(), 2.0);
    let input = scene.input_at(1.0);
    assert_eq!(input.devices[2].position, DVec3::new(0.0, 0.0, 2.0));
    // Without a path: at the origin, and without force, until the program says otherwise.
    assert_eq!((input.devices[0].position, input.devices[0].mode), (DVec3::ZERO, DeviceMode::Touch));
    assert!(matches!(input.devices[1].mode, DeviceMode::Force(AppliedForce { force: DVec3::ZERO, .. })));
}

#[test]
fn parts_without_a_path_stay_where_the_program_has_put_them() {
    let scene = read(TEXT, "0,0,0,3\n2,0,0,1\n").expect("a scene");
    let mut input = scene.input_at(0.0);
    input.devices[0].position = DVec3::X;
    input.gravity = Some(DVec3::Y);
    for time_s in [0.5, 3.0] {
        scene.follow_paths(time_s, &mut input);
        assert_eq!((input.devices[0].position, input.gravity), (DVec3::X, Some(DVec3::Y)));
        assert_eq!(input.devices[1..], scene.input_at(time_s).devices[1..]);
    }
}

#[test]
fn mistakes_have_their_line() {
    let error = read(TEXT, "0,0,0\n").err().expect("a path of three columns");
    assert_eq!(
        (error.kind, error.line, error.key.as_deref()),
        (SceneErrorKind::Path, Some(15), Some("path"))
    );
    assert!(error.message.starts_with("path: line 1"), "{}", error.message);
    let error = read(&TEXT.replace("<cube>", "cube.palp"), "0,0,0,3\n").err().expect("no file");
    assert_eq!((error.kind, error.line), (SceneErrorKind::Recording, Some(4)));
}

#[test]
fn a_scene_file_needs_a_mover_for_every_device() {
    let folder = tempfile::TempDir::new().expect("a folder");
    std::fs::write(folder.path().join("cube.palp"), FREE_BLOCK_FILE).expect("a file");
    let file = folder.path().join("scene.toml");
    let whole = TEXT.replace("<cube>", "cube.palp");
    for (device, needs) in [("finger", "the device needs path"), ("load", "mode = \"force\" needs path")] {
        let (objects, devices) = whole.split_once("[[device]]").expect("devices");
        let own = devices.split("[[device]]").find(|text| text.contains(device)).expect("the device");
        std::fs::write(&file, format!("{objects}[[device]]{own}")).expect("a file");
        let error = read_scene(&file, RunMode::Offline).err().expect("nobody moves it");
        assert_eq!((error.kind, error.key.as_deref()), (SceneErrorKind::Missing, Some("path")));
        assert!(error.message.starts_with(needs), "{}", error.message);
    }
}

#[test]
fn positions_of_a_program_are_checked_as_those_of_a_path() {
    let scene = read(TEXT, "0,0,0,3000\n1,0,0,1000\n").expect("a scene");
    let about = |what: &str, name: &str| {
        format!(
            "{what} of {name:?} goes 2999.9 m away from the objects, which span 0.245 m: positions are in metres; if these are in \
             millimetres, divide them by 1000"
        )
    };
    let of_path = scene.warnings.last().expect("a warning");
    assert_eq!((of_path.kind, &*of_path.message), (WarningKind::Units, &*about("the path", "guided")));
    let hand = [DVec3::ZERO, DVec3::Z * 3000.0, DVec3::Z * 1000.0];
    let state = State::new(&scene.model);
    let mut check = RunCheck::new(&scene);
    let told = check.add_positions(&scene, "finger", hand.into_iter(), &state).cloned().expect("a warning");
    assert_eq!(
        (told.kind, &*told.part, told.message),
        (WarningKind::Units, "finger", about("the motion", "finger"))
    );
    assert_eq!(check.add_positions(&scene, "finger", hand.into_iter(), &state), None, "it is told once");
    // One that follows an object is near it, however far this has gone.
    let object = Pose { position: DVec3::Z * 3000.0, ..Pose::IDENTITY };
    let following = scene.far_positions("finger", hand[..2].iter().copied(), || std::iter::once(object));
    assert!(
        following.is_some_and(|warning| warning.message == about("the motion", "finger")),
        "it left the start"
    );
    assert_eq!(scene.far_positions("finger", hand[1..2].iter().copied(), || std::iter::once(object)), None);
    assert_eq!(scene.far_positions("finger", [DVec3::Z * 7.0].into_iter(), std::iter::empty), None);
}

#[test]
fn a_tip_that_a_program_puts_into_an_object_is_told_of() {
    let scene = read(TEXT, "0,0,0,3\n1,0,0,3\n").expect("a scene");
    let inside = |at: DVec3| {
        let (mut state, mut check) = (State::new(&scene.model), RunCheck::new(&scene));
        let mut input = scene.input_at(0.0);
        input.devices[0].position = at;
        for _ in 0..3 {
            step(&scene.model, &mut state, &input);
            check.add(&input, &state);
        }
        let warnings = check.warnings(&scene).into_iter();
        warnings.filter(|warning| warning.kind == WarningKind::BeginsInside).collect::<Vec<_>>()
    };
    let surface = &scene.model.recordings().next().expect("a recording").surface;
    let top = surface.positions.iter().map(|x| x.z).fold(0.0, f64::max);
    let [warning] = &inside(DVec3::Z * (top - 0.01))[..] else { panic!("one warning") };
    // A tip without a radius starts a little above the surface.
    let begin = "the tip of \"finger\" begins 10.1";
    let end = "mm inside an object: it starts on the surface, from where it presses its way to the hand within a tenth of a second; begin \
               outside";
    let message = &warning.message;
    assert!(message.starts_with(begin) && message.ends_with(end), "{message}");
    assert_eq!(warning.part, "finger");
    assert_eq!(inside(DVec3::Z * (top + 0.001)), []);
}

#[test]
fn a_tip_that_moves_and_touches_nothing_is_told_of() {
    let scene = read(TEXT, "0,0,0,3\n1,0,0,3\n").expect("a scene");
    let mut state = State::new(&scene.model);
    let mut check = RunCheck::new(&scene);
    let mut input = scene.input_at(0.0);
    input.devices[0].position = DVec3::X;
    let parts = |check: &RunCheck| {
        check.warnings(&scene).into_iter().map(|own| (own.kind, own.part)).collect::<Vec<_>>()
    };
    let guided = (WarningKind::NoContact, "guided".to_string());
    step(&scene.model, &mut state, &input);
    check.add(&input, &state);
    assert_eq!(
        parts(&check),
        std::slice::from_ref(&guided),
        "a path was meant to touch; a tip that rests was not"
    );
    input.devices[0].position = 2.0 * DVec3::X;
    step(&scene.model, &mut state, &input);
    check.add(&input, &state);
    assert_eq!(parts(&check), [(WarningKind::NoContact, "finger".to_string()), guided]);
    assert_eq!(check.warnings(&scene)[0].message, "finger touched nothing");
    (0..10).for_each(|_| check.sample_surfaces(&scene, &input, &state, &mut Vec::new()));
    let messages: Vec<String> = check.warnings(&scene).into_iter().map(|own| own.message).collect();
    assert_eq!(
        messages[0],
        "finger touched nothing; its centre stayed about 1.9000 m or more from all objects"
    );
}

#[test]
fn numbers_in_another_unit_get_a_warning_with_their_part() {
    let object = "[[object]]\nname = \"cube\"\nrecording = \"<cube>\"\n";
    let floor = "[[plane]]\nname = \"floor\"\npoint = [0.0, 0.0, -0.05]\nnormal = [0.0, 0.0, 1.0]\n";
    let other =
        |at: f64| format!("{}position = [0.0, 0.0, {at:?}]\n", object.replace("\"cube\"", "\"other\""));
    let finger = |keys: &str| format!("[[device]]\nname = \"finger\"\nmode = \"touch\"\n{keys}\n");
    let apart = |distance: f64| {
        format!(
            "begins {distance:.1} m away from everything else, and is 0.245 m across: positions are in metres; if these are in \
             millimetres, divide them by 1000"
        )
    };
    let scene = read(object, "").expect("a scene");
    let cube = scene.model.recordings().next().expect("a cube");
    let carrying = cube.mass() * 9.81 / cube.surface.diagonal();
    let lengths =
        "and the objects span 0.245 m: lengths are in metres; if this is in millimetres, divide it by 1000";
    for (text, kind, part, message) in [
        (format!("step = 1.0\n{object}"), WarningKind::Units, "", "the step is 1 s long: it is in seconds, 0.001 for 1 ms".to_string()),
        (
            format!("sleep_after = 500.0\n{object}"),
            WarningKind::Units,
            "",
            "sleep_after is 500 s: it is in seconds, 0.5 for 500 ms; inf for objects that never sleep".to_string(),
        ),
        (
            format!("gravity = [0.0, 0.0, -9.81]\n{object}{}", finger("tip_radius = 0.01\ncoupling = { stiffness = 0.5, damping = 0.001 }")),
            WarningKind::Units,
            "finger",
            format!(
                "the coupling of \"finger\" has a stiffness of 0.5 N/m, and carries no object at less than a stretch of the object's size \
                 ({carrying:.2} N/m): if it is in N/mm, multiply it by 1000, and the damping too"
            ),
        ),
        (
            format!("{object}orientation = [0.0, 0.0, 0.0, 1.0]\n"),
            WarningKind::Units,
            "cube",
            "the orientation of \"cube\" is [0, 0, 0, 1], half a turn about z: the scalar part w stands first, [1, 0, 0, 0] turns nothing; for \
             half a turn write [0, 0, 0, -1]"
                .to_string(),
        ),
        (
            format!("gravity = [0.0, 0.0, -981.0]\n{object}"),
            WarningKind::Units,
            "",
            "gravity is 981 m/s²: it is in m/s², 9.81 on the Earth".to_string(),
        ),
        (
            format!("gravity = [0.0, 0.0, 9.81]\n{object}{floor}"),
            WarningKind::Gravity,
            "",
            "gravity [0.0, 0.0, 9.81] has the direction of every plane's normal, out of the solid side, and lifts the objects off: turn one of them round"
                .to_string(),
        ),
        (
            format!("{object}friction = 60.0\n"),
            WarningKind::Units,
            "cube",
            "the friction of \"cube\" is 60: it is a coefficient, 0.6 for 60 %".to_string(),
        ),
        (
            format!("{object}{}", finger("tip_radius = 5.0")),
            WarningKind::Units,
            "finger",
            format!("the tip of \"finger\" has a radius of 5 m, {lengths}"),
        ),
        (
            format!("{object}{}", finger("tip_radius = 0.01\npatch_radius = 40.0")),
            WarningKind::Units,
            "finger",
            format!("the patch of \"finger\" has a radius of 40 m, {lengths}"),
        ),
        (
            format!("{object}{}", other(120.0)),
            WarningKind::Units,
            "cube",
            format!("the object \"cube\" {}", apart(119.8)),
        ),
        (
            format!("{object}{}", floor.replace("-0.05", "-50.0")),
            WarningKind::Units,
            "cube",
            format!("the object \"cube\" {}", apart(49.9)),
        ),
    ] {
        let warnings = read(&text, "").expect("a scene").warnings;
        let found = warnings.iter().find(|warning| warning.kind == kind).unwrap_or_else(|| panic!("{text}: {warnings:?}"));
        assert_eq!((&*found.part, &*found.message), (part, &*message));
    }
    // Usual numbers get no warning: of ice, rubber, what does not slip, a fall of 5 m, weight towards a floor, and a wall.
    let wall = "[[plane]]\nname = \"wall\"\npoint = [1.0, 0.0, 0.0]\nnormal = [-1.0, 0.0, 0.0]\n";
    for text in [
        format!("gravity = [0.0, 0.0, -9.81]\n{object}friction = 0.0\n{floor}friction = 4.0\n"),
        format!("gravity = [0.0, 0.0, 9.81]\n{object}friction = 1e3\n{wall}"),
        format!("{object}{}", floor.replace("-0.05", "-5.0")),
        format!("{object}{}", finger("tip_radius = 0.01\npatch_radius = 0.2")),
        format!("sleep_after = inf\n{object}orientation = [0.0, 0.0, 0.0, -1.0]\n"),
        format!(
            "gravity = [0.0, 0.0, -9.81]\n{object}{}",
            finger("tip_radius = 0.01\ncoupling = { stiffness = 500.0, damping = 1.0 }")
        ),
        format!(
            "gravity = [0.0, 0.0, 0.0]\n{object}{}",
            finger("tip_radius = 0.01\ncoupling = { stiffness = 0.5, damping = 0.001 }")
        ),
    ] {
        let warnings = read(&text, "").expect("a scene").warnings;
        let asked = |warning: &&Warning| matches!(warning.kind, WarningKind::Units | WarningKind::Gravity);
        assert_eq!(warnings.iter().find(asked), None, "{text}");
    }
}
