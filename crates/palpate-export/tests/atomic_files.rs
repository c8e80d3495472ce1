//! Atomic files: complete or not there, and never an input.

use palpate_export::{AtomicFile, ExportError, OutputFolder, check_distinct, write_atomically};
use std::path::Path;
use tempfile::TempDir;

fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).expect("a folder").flatten();
    let mut names: Vec<String> =
        entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[test]
fn a_file_is_there_when_it_is_finished_and_nothing_remains_of_one_that_is_dropped() {
    let folder = TempDir::new().expect("a folder");
    let path = folder.path().join("steps.csv");
    let mut file = AtomicFile::create(&path, &[]).expect("a file");
    file.write(b"1\n").expect("written");
    assert!(!path.exists());
    drop(file);
    assert!(names(folder.path()).is_empty());

    let mut file = AtomicFile::create(&path, &[]).expect("a file");
    file.write(b"1\n").expect("written");
    assert_eq!(file.finish().expect("finished"), path);
    assert_eq!(names(folder.path()), ["steps.csv"]);
    write_atomically(&path, b"2\n").expect("replaced");
    assert_eq!(std::fs::read(&path).expect("a file"), b"2\n");
}

#[test]
fn inputs_folders_and_missing_folders_are_refused_as_targets() {
    let folder = TempDir::new().expect("a folder");
    let input = folder.path().join("scene.toml");
    std::fs::write(&input, "").expect("a file");
    let missing = folder.path().join("no/out.csv");
    for (target, reason) in [
        (input.as_path(), "it is one of the inputs".to_string()),
        (folder.path(), "it is not a file".to_string()),
        (missing.as_path(), format!("there is no folder {}", folder.path().join("no").display())),
    ] {
        let error = AtomicFile::create(target, &[&input]).err().expect("a refusal");
        assert_eq!(error.to_string(), format!("cannot write {}: {reason}", target.display()));
        assert!(matches!(error, ExportError::Target { .. }));
    }
}

#[test]
fn two_outputs_may_not_be_one_file() {
    let folder = TempDir::new().expect("a folder");
    let (a, b) = (folder.path().join("a.csv"), folder.path().join("b.csv"));
    let same = folder.path().join("./a.csv");
    check_distinct(&[("csv", Some(&a)), ("contacts", Some(&b)), ("gltf", None)]).expect("different files");
    let error = check_distinct(&[("csv", Some(&a)), ("contacts", Some(&same))]).expect_err("the same file");
    assert_eq!(
        error.to_string(),
        format!("cannot write {}: csv and contacts name the same file", same.display())
    );
}

#[test]
fn a_new_folder_that_stays_empty_is_removed() {
    let parent = TempDir::new().expect("a folder");
    let path = parent.path().join("frames");
    drop(OutputFolder::create(&path).expect("a folder"));
    assert!(!path.exists());
    let folder = OutputFolder::create(&path).expect("a folder");
    std::fs::write(path.join("one.vtu"), "").expect("a file");
    drop(folder);
    assert!(path.exists());
}
