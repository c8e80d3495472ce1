//! Standard input and output in place of files: `-`.

use crate::failure::Failure;
use crate::terminal::{notify, print};
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

/// Content of standard input.
pub fn read_input() -> Result<Vec<u8>, Failure> {
    let mut bytes = Vec::new();
    let failed = |error| Failure(format!("cannot read {STANDARD_INPUT}: {error}"));
    std::io::stdin().lock().read_to_end(&mut bytes).map_err(failed)?;
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

/// Writes data to standard output; a reader that has gone away is no failure.
pub fn write_output(bytes: &[u8]) -> Result<(), Failure> {
    use std::io::Write;
    let mut out = std::io::stdout().lock();
    match out.write_all(bytes).and_then(|()| out.flush()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Failure(format!("cannot write to standard output: {error}")))
        }
        _ => Ok(()),
    }
}
