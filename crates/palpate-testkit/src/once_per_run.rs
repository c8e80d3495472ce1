//! Files that are made once per run of the tests, however many processes it has: nextest gives every test a process of its own.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Age from which on the files of another run are removed: no run takes that long.
const OUTDATED: Duration = Duration::from_secs(3600);

/// Folder of a name below a temporary folder (`CARGO_TARGET_TMPDIR`), filled by the first process of a run that asks for it; others
/// wait until it is there.
///
/// # Panics
/// If the folder is not writable.
pub fn made_once_per_run(temporary: &Path, name: &str, make: impl FnOnce(&Path)) -> PathBuf {
    let run = std::env::var("NEXTEST_RUN_ID").unwrap_or_else(|_| std::process::id().to_string());
    let all = temporary.join(name);
    fs::create_dir_all(&all).expect("a writable folder");
    // The lock ends with the file.
    let lock = File::create(all.join("lock")).expect("a writable folder");
    lock.lock().expect("a lock");
    let (folder, done) = (all.join(&run), all.join(format!("{run}.done")));
    if !done.exists() {
        remove_outdated(&all);
        fs::create_dir_all(&folder).expect("a writable folder");
        make(&folder);
        File::create(done).expect("a writable folder");
    }
    folder
}

/// Removes what runs of the past have left, as far as possible.
fn remove_outdated(all: &Path) {
    for entry in fs::read_dir(all).into_iter().flatten().flatten() {
        let modified = entry.metadata().and_then(|metadata| metadata.modified());
        let age = modified.ok().and_then(|modified| modified.elapsed().ok());
        if age.is_some_and(|age| age > OUTDATED) {
            let _ = if entry.path().is_dir() {
                fs::remove_dir_all(entry.path())
            } else {
                fs::remove_file(entry.path())
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    #[test]
    fn files_are_made_once_and_found_again() {
        let temporary = std::env::temp_dir().join(format!("palpate-once-per-run-{}", std::process::id()));
        let made = Cell::new(0);
        let make = |folder: &Path| {
            made.set(made.get() + 1);
            fs::write(folder.join("file"), "text").expect("a writable folder");
        };
        let first = made_once_per_run(&temporary, "fixture", make);
        let second = made_once_per_run(&temporary, "fixture", make);
        assert_eq!((made.get(), &first), (1, &second));
        assert_eq!(fs::read(second.join("file")).expect("a file"), b"text");
        fs::remove_dir_all(temporary).expect("a folder");
    }
}
