//! Library of scenes: pointers are added, settings change the text, and the last scene stays when a change is refused.

use palpate::Material;
use palpate_scene::{
    MeshUpload, MeshingParameters, Progress, SceneErrorKind, SceneLibrary, SettingsChange, SilentProgress,
};
use palpate_testkit::FREE_BLOCK_FILE;
use tempfile::TempDir;

#[test]
fn a_scene_file_gets_pointers_and_its_settings_can_be_changed() {
    let folder = TempDir::new().expect("a folder");
    let path = folder.path().join("scene.toml");
    std::fs::write(folder.path().join("cube.palp"), FREE_BLOCK_FILE).expect("a file");
    let text = "[[object]]\nname = \"cube\"\nrecording = \"cube.palp\"\nfriction = 0.3\n";
    std::fs::write(&path, text).expect("a file");
    let library = SceneLibrary::new(Some(&folder.path().join("cache"))).expect("a library");

    let opened = library.open_file(&path).expect("a scene");
    assert_eq!((opened.title.as_str(), opened.id.as_deref()), ("scene.toml", None));
    assert!(opened.text.starts_with(text.trim_end()), "lines keep their numbers");
    let pointers: Vec<&str> = opened.scene.devices.iter().map(|device| device.name.as_str()).collect();
    assert_eq!(pointers, ["finger1", "finger2", "finger3", "finger4"]);
    assert_eq!(opened.recordable.len(), 1);
    assert!(
        opened.scene.warnings.iter().all(|warning| warning.part != "finger1"),
        "{:?}",
        opened.scene.warnings
    );

    let change =
        SettingsChange { gravity: Some([0.0, -1.6, 0.0]), friction: Some(0.9), ..Default::default() };
    let changed = library.change_settings(&change).expect("a changed scene");
    let parameters = changed.scene.model.parameters();
    assert_eq!(parameters.gravity.to_array(), [0.0, -1.6, 0.0]);
    assert!(parameters.devices.iter().all(|device| device.friction == 0.9));

    let change = SettingsChange { step_s: Some(0.1), ..Default::default() };
    let error = library.change_settings(&change).err().expect("a refusal");
    assert_eq!(error.kind, SceneErrorKind::OutOfRange);
    assert_eq!(error.to_string(), "the step is 0.1 s, expected 0.0002 s to 0.01 s");
    let again = library.change_settings(&SettingsChange::default()).expect("the last scene");
    assert_eq!(again.scene.model.parameters().gravity.y, -1.6);

    let error = library.open_built_in("nothing", &mut SilentProgress).err().expect("a refusal");
    assert_eq!(error.kind, SceneErrorKind::UnknownValue);
    assert_eq!(
        error.to_string(),
        "there is no scene \"nothing\"; there are bounce, shake, pinch, stack, ball, slab, liver, jelly, gripper, duck, bar, fork, bell"
    );
}

#[test]
fn an_error_below_a_tip_that_becomes_a_pointer_has_the_line_of_the_file() {
    let folder = TempDir::new().expect("a folder");
    let path = folder.path().join("scene.toml");
    std::fs::write(folder.path().join("cube.palp"), FREE_BLOCK_FILE).expect("a file");
    let text = |friction: f64| {
        format!(
            "# A cube.\n[[object]]\nname = \"cube\"\nrecording = \"cube.palp\"\n\n[[device]]\nname = \"tip\"\nmode = \"touch\"\n\n\
             [[plane]]\nname = \"floor\"\npoint = [0, 0, -1]\nnormal = [0, 0, 1]\nfriction = {friction}\n"
        )
    };
    let library = SceneLibrary::new(Some(&folder.path().join("cache"))).expect("a library");
    std::fs::write(&path, text(-1.0)).expect("a file");
    let error = library.open_file(&path).err().expect("a refusal");
    assert_eq!((error.line, error.key.as_deref()), (Some(14), Some("friction")));
    std::fs::write(&path, text(0.5)).expect("a file");
    let opened = library.open_file(&path).expect("a scene");
    assert!(opened.scene.devices[0].pointer);
    assert_eq!(opened.text, text(0.5).replace("\"touch\"\n", "\"touch\"\npointer = true\n"));
}

/// Listener that wants no recording any more.
struct Cancelled;

impl Progress for Cancelled {
    fn begin(&mut self, _: &str, _: u64) {}
    fn advance(&mut self, _: u64) {}
    fn warn(&mut self, _: &str) {}
    fn is_interrupted(&self) -> bool {
        true
    }
}

#[test]
fn a_recording_that_is_not_wanted_any_more_ends_and_leaves_nothing() {
    let folder = TempDir::new().expect("a folder");
    let cache = folder.path().join("cache");
    let library = SceneLibrary::new(Some(&cache)).expect("a library");
    let error = library.open_built_in("slab", &mut Cancelled).err().expect("an interruption");
    assert_eq!(error.to_string(), "box:0.24x0.02x0.12/24x2x12: interrupted");
    assert_eq!(std::fs::read_dir(&cache).expect("a folder").count(), 0);
}

#[test]
fn an_uploaded_mesh_is_read_by_its_content_and_its_repairs_are_told() {
    let library = SceneLibrary::new(None).expect("a library");
    let upload = |name: &str, text: &str| MeshUpload {
        name: name.into(),
        bytes: text.into(),
        scale: 0.1,
        meshing: MeshingParameters::default(),
        material: Material::isotropic(1e4, 0.3, 1000.0),
        modes: 6,
    };
    // A hexahedron in MEDIT's format, and a node of no use.
    let cube = "MeshVersionFormatted 2\nDimension 3\nVertices 9\n0 0 0 0\n1 0 0 0\n1 1 0 0\n0 1 0 0\n0 0 1 0\n1 0 1 0\n1 1 1 0\n\
                0 1 1 0\n9 9 9 0\nHexahedra 1\n1 2 3 4 5 6 7 8 0\nEnd\n";
    let opened = library.record_upload(upload("cube.vtk", cube), &mut SilentProgress).expect("a scene");
    assert_eq!(opened.title, "cube.vtk");
    assert_eq!(
        opened.about,
        "Your own mesh. Press and drag it. Note: hexahedra (1) were split into 6 tetrahedra Note: 1 nodes belong to no tetrahedron \
         and are left out"
    );
    assert!(
        (opened.scene.model.recordings().map(|recording| recording.mass()).sum::<f64>() - 1.0).abs() < 1e-9
    );
    let refused = |name: &str, text: &str| {
        let opened = library.record_upload(upload(name, text), &mut SilentProgress);
        opened.err().map(|error| error.message).expect("an error")
    };
    assert_eq!(
        refused("tip.msh", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"),
        "tip.msh: the surface is open: 3 edges belong to one triangle only, about holes of 100 % of its area, and at most 5 % can be \
         closed: close it, or give a sheet a thickness, in the program that made it"
    );
    // A cube of 10 cm, one face of two triangles turned.
    let surface = "OFF\n8 7 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n4 0 3 2 1\n4 4 5 6 7\n4 0 1 5 4\n\
                   4 1 2 6 5\n4 2 3 7 6\n3 3 0 4\n3 3 7 4\n";
    let upload = MeshUpload {
        meshing: MeshingParameters { cell_size: Some(0.03), nodes: None, curved: false },
        ..upload("cube.stl", surface)
    };
    let (in_memory, repairs) = upload.record(&mut SilentProgress).expect("a recording");
    let opened = library.record_upload(upload, &mut SilentProgress).expect("a scene");
    let told = "Your own mesh. Press and drag it. Note: 1 triangles faced the other way than their neighbours and were turned Note: the \
                surface was filled with ";
    assert!(opened.about.starts_with(told), "{}", opened.about);
    let mass: f64 = opened.scene.model.recordings().map(|recording| recording.mass()).sum();
    assert!((mass - 1.0).abs() < 0.01, "{mass}");
    // Recorded in memory, as a page without a server does, it is the same body with the same repairs.
    assert!((in_memory.mass() / mass - 1.0).abs() < 1e-12);
    assert_eq!(
        ["Your own mesh. Press and drag it."]
            .into_iter()
            .chain(repairs.iter().map(String::as_str))
            .collect::<Vec<_>>()
            .join(" Note: "),
        opened.about
    );
    // Another material is recorded of the same cells.
    let soft = Material::isotropic(5e3, 0.3, 500.0);
    let softer = library.change_material(0, soft, &mut SilentProgress).expect("a scene");
    let halved: f64 = softer.scene.model.recordings().map(|recording| recording.mass()).sum();
    assert!((halved / mass - 0.5).abs() < 1e-12, "{halved}");
    assert_eq!(
        refused("a.veg", "*VERTICES\n*INCLUDE /etc/passwd\n"),
        "a.veg: line 2: the file includes '/etc/passwd', expected a file beside it or below"
    );
}
