//! Kinds of files, by their names and first bytes.

use palpate_export::PART;
use palpate_mesh::open_regular_file;
use std::io::Read;
use std::path::Path;

/// Magic bytes of MCAP files.
const MCAP: &[u8] = b"\x89MCAP0\r\n";

/// Whether a file is a log, by its magic bytes or its ending; an unfinished one ends in `.mcap.part`.
pub fn is_log(path: &Path) -> bool {
    let mut start = [0; MCAP.len()];
    let begins = open_regular_file(path).and_then(|mut file| file.read_exact(&mut start));
    let is_part =
        has_ending(path, PART) && path.file_stem().is_some_and(|name| has_ending(Path::new(name), "mcap"));
    has_ending(path, "mcap") || is_part || (begins.is_ok() && start == MCAP)
}

/// Whether the name of a file has an ending, in any case.
pub fn has_ending(path: &Path, ending: &str) -> bool {
    path.extension().is_some_and(|own| own.eq_ignore_ascii_case(ending))
}
