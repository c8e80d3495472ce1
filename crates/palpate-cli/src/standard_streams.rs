//! Standard input and output in place of files: `-`.

use crate::failure::Failure;
use crate::terminal::{notify, print, size_text};
use palpate_fem::available_memory;
use std::io::Read;
use std::path::Path;

/// Name of standard input in messages, and of what was read from it.
pub const STANDARD_INPUT: &str = "standard input";

/// Reasons that a path cannot be a stream.
pub const LOG_INPUT: &str = "a log is read at several places";
pub const LOG_OUTPUT: &str = "a log grows under a name of its own until it is whole";
pub const FOLDER: &str = "it is a folder of files";
pub const SEEKS: &str = "its beginning is written last";
pub const SERVED: &str = "what is served is read again when it restarts";

/// Whether a path means a standard stream; `./-` is a file of that name.
pub fn is_stream(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// Share of the free memory that standard input may take: what is read is taken apart beside it.
const INPUT_SHARE: f64 = 0.5;

/// Free memory where the system does not state it [bytes].
const UNKNOWN_MEMORY: f64 = 8e9;

/// Content of standard input, if it fits into memory, as a file has to.
pub fn read_input() -> Result<Vec<u8>, Failure> {
    let limit = INPUT_SHARE * available_memory().unwrap_or(UNKNOWN_MEMORY);
    read_within(std::io::stdin().lock(), limit as usize)
}

/// Content of a stream of at most a number of bytes.
fn read_within(stream: impl Read, limit: usize) -> Result<Vec<u8>, Failure> {
    let mut bytes = Vec::new();
    let failed = |error| Failure(format!("cannot read {STANDARD_INPUT}: {error}"));
    // One byte more tells whether there is more.
    stream.take(limit as u64 + 1).read_to_end(&mut bytes).map_err(failed)?;
    if bytes.len() > limit {
        return Err(Failure(format!(
            "{STANDARD_INPUT} has more than {}, half of the memory that is free: is it endless? A body or a scene that is as large \
             needs a machine with more memory",
            size_text(limit)
        )));
    }
    if bytes.is_empty() {
        return Err(Failure(format!("{STANDARD_INPUT} is empty")));
    }
    Ok(bytes)
}

/// Refuses `-` for paths that cannot be streams: option, path and reason.
pub fn refuse(given: &[(&str, Option<&Path>, &str)]) -> Result<(), Failure> {
    match given.iter().find(|(_, path, _)| path.is_some_and(is_stream)) {
        Some((option, _, reason)) => {
            Err(Failure(format!("{option} can't be -: {reason}; give a path (a file named - is ./-)")))
        }
        None => Ok(()),
    }
}

/// Whether an output goes to standard output, which nothing else may then use.
pub fn takes_output(outputs: &[(&str, Option<&Path>)], json: bool) -> Result<bool, Failure> {
    let stream = outputs.iter().find(|(_, path)| path.is_some_and(is_stream));
    match stream {
        Some((option, _)) if json => {
            Err(Failure(format!("{option} - and --json both write to standard output: give one a path")))
        }
        stream => Ok(stream.is_some()),
    }
}

/// Prints a report: on standard error where standard output has data.
pub fn report(text: &str, output_is_taken: bool) -> Result<(), Failure> {
    if output_is_taken {
        notify(text.trim_end());
        return Ok(());
    }
    print(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stream_without_end_is_refused_at_the_limit() {
        let endless = read_within(std::io::repeat(7), 3_000_000).map_err(|Failure(text)| text);
        let expected = "standard input has more than 3.0 MB, half of the memory that is free: is it endless? A body or a scene that is as \
                        large needs a machine with more memory";
        assert_eq!(endless, Err(expected.to_string()));
        assert_eq!(read_within(&[7; 3][..], 3), Ok(vec![7; 3]));
        let empty = read_within(&[][..], 3);
        assert_eq!(empty, Err(Failure("standard input is empty".into())));
    }
}
