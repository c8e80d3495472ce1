//! Files of a scene, where there are any.

#[cfg(feature = "native")]
pub(crate) use palpate_mesh::{read_regular_file, read_regular_text};

/// Content of a file: without a file system every part is in memory.
#[cfg(not(feature = "native"))]
pub(crate) fn read_regular_file(_: &std::path::Path) -> std::io::Result<Vec<u8>> {
    Err(std::io::Error::other("it is not among the files that were given"))
}

/// Text of a file.
#[cfg(not(feature = "native"))]
pub(crate) fn read_regular_text(path: &std::path::Path) -> std::io::Result<String> {
    read_regular_file(path).map(|_| String::new())
}
