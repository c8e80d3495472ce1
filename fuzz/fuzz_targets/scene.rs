//! Scene files: keys, numbers and files of any text, and two steps of what was read.
#![no_main]

use libfuzzer_sys::fuzz_target;
use palpate::{Input, State, step};
use palpate_scene::{RunMode, read_scene};
use std::path::PathBuf;
use std::sync::LazyLock;

/// Folder with the files that the seeds name.
static FOLDER: LazyLock<PathBuf> = LazyLock::new(|| {
    let folder = std::env::temp_dir().join(format!("palpate-fuzz-scene-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a writable folder");
    let block = palpate_testkit::free_block().to_bytes().expect("a recording");
    std::fs::write(folder.join("a.palp"), block).expect("a writable folder");
    std::fs::write(folder.join("a.csv"), "0,0,0.5,0\n1,0,0.4,0\n").expect("a writable folder");
    folder
});

fuzz_target!(|text: &str| {
    let path = FOLDER.join("scene.toml");
    std::fs::write(&path, text).expect("a writable folder");
    let Ok(scene) = read_scene(&path, RunMode::Offline) else { return };
    let mut state = State::new(&scene.model);
    for _ in 0..2 {
        let output = step(&scene.model, &mut state, &Input::default());
        assert!(output.objects.iter().all(|object| object.pose.position.is_finite()));
    }
});
