//! Library of scenes: pointers are added, settings change the text, and the last scene stays when a change is refused.

use palpate_scene::{Progress, SceneErrorKind, SceneLibrary, SettingsChange, SilentProgress};
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
        "there is no scene \"nothing\"; there are bounce, shake, pinch, stack, ball, slab"
    );
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
