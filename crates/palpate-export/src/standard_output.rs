//! Standard output, whose reader may go away at any time.

use crate::error::ExportError;
use std::io::{self, ErrorKind};
use std::path::Path;

/// Path that means standard output.
pub(crate) const STANDARD_OUTPUT: &str = "-";

/// Whether the reader of standard output is still there after a write; one that has gone away, as `head` does, is no failure.
///
/// # Errors
/// [`ExportError::Io`] for any other refusal.
pub fn has_reader(written: io::Result<()>) -> Result<bool, ExportError> {
    match written {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(false),
        Err(error) => Err(ExportError::io("write to", Path::new("standard output"), error)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reader_that_has_gone_is_told_apart_from_a_full_disk() {
        let refusal = |kind: ErrorKind| has_reader(Err(kind.into())).map_err(|error| error.to_string());
        assert_eq!(has_reader(Ok(())).map_err(|error| error.to_string()), Ok(true));
        assert_eq!(refusal(ErrorKind::BrokenPipe), Ok(false));
        let full = "cannot write to standard output: no storage space";
        assert_eq!(refusal(ErrorKind::StorageFull), Err(full.to_string()));
    }
}
