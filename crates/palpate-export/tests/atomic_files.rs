//! Output files: complete or not there, never an input, and of one writer at a time; what of a part file was flushed stays.

use palpate_export::{
    AtomicFile, ExportError, OutputFolder, PartFile, TemporaryFolder, check_distinct, part_of,
    remove_unfinished, write_atomically,
};
use std::io::Write;
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

#[test]
fn an_output_that_another_process_writes_is_refused_and_what_it_left_when_killed_is_overwritten() {
    let folder = TempDir::new().expect("a folder");
    let path = folder.path().join("steps.csv");
    let mut first = AtomicFile::create(&path, &[]).expect("a file");
    let error = AtomicFile::create(&path, &[]).err().expect("a refusal").to_string();
    assert_eq!(error, format!("cannot write {}: another process is writing it", path.display()));
    first.write(b"of the first\n").expect("written");
    first.finish().expect("finished");
    assert_eq!(std::fs::read(&path).expect("a file"), b"of the first\n");
    // A killed process leaves the file, and no lock.
    std::fs::write(folder.path().join(".steps.csv.tmp"), "longer than what comes now").expect("a file");
    let mut second = AtomicFile::create(&path, &[]).expect("a file");
    second.write(b"of the second\n").expect("written");
    second.finish().expect("finished");
    assert_eq!(std::fs::read(&path).expect("a file"), b"of the second\n");
    assert_eq!(names(folder.path()), ["steps.csv"]);
}

#[test]
fn a_folder_that_another_process_writes_into_is_refused() {
    let parent = TempDir::new().expect("a folder");
    let path = parent.path().join("frames");
    let first = OutputFolder::create(&path).expect("a folder");
    let error = OutputFolder::create(&path).err().expect("a refusal").to_string();
    assert_eq!(error, format!("cannot write {}: another process is writing into it", path.display()));
    drop(first);
    drop(OutputFolder::create(&path).expect("a folder"));
    assert!(!path.exists());
}

#[test]
fn writers_of_one_file_at_once_leave_a_whole_one() {
    let folder = TempDir::new().expect("a folder");
    let path = folder.path().join("cube.palp");
    std::thread::scope(|scope| {
        for writer in 0..4_u8 {
            let path = &path;
            scope.spawn(move || {
                for _ in 0..25 {
                    write_atomically(path, &[writer; 10_000]).expect("written");
                }
            });
        }
    });
    let bytes = std::fs::read(&path).expect("a file");
    assert!(bytes.len() == 10_000 && bytes.iter().all(|byte| *byte == bytes[0]));
    assert_eq!(names(folder.path()), ["cube.palp"]);
}

#[test]
fn a_part_file_stays_from_its_first_flush_on_and_an_older_file_stays_until_it_is_finished() {
    let folder = TempDir::new().expect("a folder");
    let path = folder.path().join("run.mcap");
    std::fs::write(&path, "an older run").expect("a file");
    let mut file = PartFile::create(&path, &[]).expect("a file");
    file.write_all(b"header").expect("written");
    drop(file);
    assert_eq!(names(folder.path()), ["run.mcap"], "it was worth nothing");

    let mut file = PartFile::create(&path, &[]).expect("a file");
    file.write_all(b"header, step 1").expect("written");
    file.flush().expect("written");
    let error = PartFile::create(&path, &[]).err().expect("a refusal").to_string();
    assert_eq!(error, format!("cannot write {}: another process is writing it", path.display()));
    file.write_all(b", step 2").expect("written");
    drop(file);
    assert_eq!(names(folder.path()), ["run.mcap", "run.mcap.part"]);
    assert_eq!(std::fs::read(&path).expect("a file"), b"an older run");
    assert!(std::fs::read(part_of(&path)).expect("a file").starts_with(b"header, step 1"));

    // The next run destroys neither.
    let error = PartFile::create(&path, &[]).err().expect("a refusal").to_string();
    let expected = format!(
        "cannot write {}: {} is there, left by a run that was killed or had no room; keep what is in it (`palpate recover` makes a \
         whole log), or remove it",
        path.display(),
        part_of(&path).display()
    );
    assert_eq!(error, expected);
    std::fs::remove_file(part_of(&path)).expect("removed");
    let mut file = PartFile::create(&path, &[]).expect("a file");
    file.write_all(b"a newer run").expect("written");
    assert_eq!(file.finish().expect("finished"), path);
    assert_eq!(names(folder.path()), ["run.mcap"]);
    assert_eq!(std::fs::read(&path).expect("a file"), b"a newer run");
}

#[test]
fn what_is_unfinished_is_removed_when_a_signal_ends_the_process_and_a_flushed_part_file_stays() {
    let folder = TempDir::new().expect("a folder");
    let steps = AtomicFile::create(&folder.path().join("steps.csv"), &[]).expect("a file");
    let begun = PartFile::create(&folder.path().join("begun.mcap"), &[]).expect("a file");
    let mut grown = PartFile::create(&folder.path().join("grown.mcap"), &[]).expect("a file");
    grown.write_all(b"header, step 1").expect("written");
    grown.flush().expect("written");
    let frames = OutputFolder::create(&folder.path().join("frames")).expect("a folder");
    let temporary = TemporaryFolder::new().expect("a folder");
    std::fs::write(temporary.path().join("cube.palp"), "of a log").expect("a file");
    remove_unfinished(|| {
        assert_eq!(names(folder.path()), ["grown.mcap.part"]);
        assert!(!temporary.path().exists());
    });
    drop((steps, begun, grown, frames, temporary));
    assert_eq!(names(folder.path()), ["grown.mcap.part"]);
}
