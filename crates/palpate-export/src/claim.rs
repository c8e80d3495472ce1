//! Claims of files that are being written: one writer at a time, and a claim ends with its process, however that ends.
//!
//! A claim is an advisory lock of the operating system on the file itself. Reference: flock(2).

use std::fs::{File, OpenOptions, TryLockError};
use std::io;
use std::path::Path;

/// Result of a claim.
pub(crate) enum Claim {
    /// The file is new.
    New(File),
    /// The file was left by a process that ended before it was finished.
    Left(File),
    /// Another writer has the file; its lock is free when that writer is done.
    Held(File),
}

impl Claim {
    /// Empty file for a writer who does not need what was left.
    pub fn emptied(self) -> io::Result<Result<File, File>> {
        match self {
            Self::New(file) => Ok(Ok(file)),
            Self::Left(file) => file.set_len(0).map(|()| Ok(file)),
            Self::Held(file) => Ok(Err(file)),
        }
    }
}

/// Claims a file, which is created where it is missing. A link is not followed.
pub(crate) fn claim(path: &Path) -> io::Result<Claim> {
    loop {
        let (file, is_new) = match OpenOptions::new().write(true).create_new(true).open(path) {
            Ok(file) => (file, true),
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => match open_left(path)? {
                Some(file) => (file, false),
                None => continue,
            },
            Err(error) => return Err(error),
        };
        match file.try_lock() {
            Err(TryLockError::WouldBlock) => return Ok(Claim::Held(file)),
            // On file systems without locks two writers are not told apart.
            Ok(()) | Err(TryLockError::Error(_)) => {}
        }
        // Its writer may have finished between opening and locking; then it has another name, or none.
        if stands_at(&file, path)? {
            return Ok(if is_new { Claim::New(file) } else { Claim::Left(file) });
        }
    }
}

/// Existing file; none where it is gone again.
fn open_left(path: &Path) -> io::Result<Option<File>> {
    let gone = |error: io::Error| {
        if error.kind() == io::ErrorKind::NotFound { Ok(None) } else { Err(error) }
    };
    match std::fs::symlink_metadata(path) {
        Ok(metadata) if metadata.is_file() => {
            OpenOptions::new().write(true).open(path).map(Some).or_else(gone)
        }
        Ok(_) => Err(io::Error::other(format!("{} is not a file", path.display()))),
        Err(error) => gone(error),
    }
}

/// Whether an open file is the one at the path.
#[cfg(unix)]
fn stands_at(file: &File, path: &Path) -> io::Result<bool> {
    use std::os::unix::fs::MetadataExt;
    let own = file.metadata()?;
    match std::fs::symlink_metadata(path) {
        Ok(there) => Ok((there.dev(), there.ino()) == (own.dev(), own.ino())),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error),
    }
}

/// Whether there is a file at the path; the standard library compares files on Unix only.
#[cfg(not(unix))]
fn stands_at(_: &File, path: &Path) -> io::Result<bool> {
    path.try_exists()
}

/// Makes the name of a file survive a power cut, where the system can.
pub(crate) fn sync_folder(path: &Path) {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    // The data are safe by their own calls; folders can't be opened on every system.
    let _ = File::open(folder).and_then(|folder| folder.sync_all());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_claim_is_exclusive_and_ends_with_its_file() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a");
        let Claim::New(first) = claim(&path).expect("claimed") else { panic!("there was none") };
        assert!(matches!(claim(&path).expect("looked at"), Claim::Held(_)));
        drop(first);
        assert!(matches!(claim(&path).expect("claimed"), Claim::Left(_)));
    }

    #[cfg(unix)]
    #[test]
    fn a_link_in_the_place_of_a_claim_is_refused_and_left_alone() {
        let folder = tempfile::tempdir().expect("a folder");
        let (target, link) = (folder.path().join("target"), folder.path().join("link"));
        std::fs::write(&target, "of somebody else").expect("written");
        std::os::unix::fs::symlink(&target, &link).expect("a link");
        let error = claim(&link).err().expect("a refusal").to_string();
        assert_eq!(error, format!("{} is not a file", link.display()));
        assert_eq!(std::fs::read(&target).expect("a file"), b"of somebody else");
    }
}
