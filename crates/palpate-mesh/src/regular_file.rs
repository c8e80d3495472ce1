//! Reading of files that users name: regular files, and nothing that waits for a writer or never ends.

use std::fs::{File, FileType};
use std::io::{self, Read};
use std::path::Path;

/// Opens a regular file.
///
/// # Errors
/// When it is a folder, a pipe, a socket or a device, or when the system refuses.
pub fn open_regular_file(path: &Path) -> io::Result<File> {
    // Before it is opened: that would wait for the other end of a pipe.
    check(std::fs::metadata(path)?.file_type())?;
    File::open(path)
}

/// Content of a regular file.
///
/// # Errors
/// As [`open_regular_file`].
pub fn read_regular_file(path: &Path) -> io::Result<Vec<u8>> {
    let mut file = open_regular_file(path)?;
    let length = file.metadata().map_or(0, |metadata| metadata.len());
    let mut bytes = Vec::new();
    // A file that is larger than memory is an error, not an abort.
    bytes.try_reserve_exact(length.try_into().unwrap_or(usize::MAX))?;
    file.read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// Text of a regular file.
///
/// # Errors
/// As [`open_regular_file`], and when it is not UTF-8.
pub fn read_regular_text(path: &Path) -> io::Result<String> {
    let bytes = read_regular_file(path)?;
    String::from_utf8(bytes).map_err(|_| io::Error::new(io::ErrorKind::InvalidData, "it is not text (UTF-8)"))
}

fn check(kind: FileType) -> io::Result<()> {
    if kind.is_file() {
        return Ok(());
    }
    Err(io::Error::new(io::ErrorKind::InvalidInput, format!("it is {}, not a file", name_of(kind))))
}

#[cfg(unix)]
fn name_of(kind: FileType) -> &'static str {
    use std::os::unix::fs::FileTypeExt;
    if kind.is_dir() {
        "a folder"
    } else if kind.is_fifo() {
        "a pipe"
    } else if kind.is_socket() {
        "a socket"
    } else {
        "a device"
    }
}

#[cfg(not(unix))]
fn name_of(kind: FileType) -> &'static str {
    if kind.is_dir() { "a folder" } else { "a device" }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::os::unix::net::UnixListener;
    use std::process::Command;

    #[test]
    fn only_regular_files_are_opened_and_nothing_is_waited_for() {
        let folder = tempfile::tempdir().expect("a folder");
        let at = |name: &str| folder.path().join(name);
        assert!(Command::new("mkfifo").arg(at("pipe")).status().is_ok_and(|status| status.success()));
        let _socket = UnixListener::bind(at("socket")).expect("a socket");
        std::os::unix::fs::symlink(at("pipe"), at("link")).expect("a link");
        std::fs::write(at("file"), "text").expect("a file");
        std::fs::write(at("bytes"), b"\xff\xfe").expect("a file");
        let error = |path: &Path| read_regular_file(path).expect_err("a refusal").to_string();
        assert_eq!(error(&at("pipe")), "it is a pipe, not a file");
        assert_eq!(error(&at("link")), "it is a pipe, not a file");
        assert_eq!(error(&at("socket")), "it is a socket, not a file");
        assert_eq!(error(folder.path()), "it is a folder, not a file");
        assert_eq!(error(Path::new("/dev/zero")), "it is a device, not a file");
        assert_eq!(read_regular_text(&at("file")).expect("a file"), "text");
        assert_eq!(
            read_regular_text(&at("bytes")).expect_err("no text").to_string(),
            "it is not text (UTF-8)"
        );
    }
}
