//! Runs of the program `palpate` in processes of their own, as a user has them.

use crate::error::ReproduceError;
use serde_json::Value;
use std::path::Path;
use std::process::{Child, Command, Stdio};

fn failed(error: &std::io::Error) -> ReproduceError {
    ReproduceError::Process(format!("palpate can't be run in a process of its own: {error}"))
}

/// Starts the program in a folder; it reports as JSON.
pub fn start(program: &Path, folder: &Path, arguments: &[&str]) -> Result<Child, ReproduceError> {
    let mut command = Command::new(program);
    command.args(arguments).arg("--json").current_dir(folder);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command.spawn().map_err(|e| failed(&e))
}

/// The report of a process when it has ended.
pub fn report(child: Child) -> Result<Value, ReproduceError> {
    let output = child.wait_with_output().map_err(|e| failed(&e))?;
    let said = String::from_utf8_lossy(&output.stderr);
    serde_json::from_slice(&output.stdout)
        .map_err(|_| ReproduceError::Process(format!("a process ended without a report: {}", said.trim())))
}

/// A number of a report.
pub fn number(report: &Value, pointer: &str) -> Result<f64, ReproduceError> {
    let found = report.pointer(pointer).and_then(Value::as_f64);
    found.ok_or_else(|| ReproduceError::Process(format!("the report of a run has no {pointer}")))
}

/// Waits for a process that reports nothing that is needed.
pub fn finish(child: Child) -> Result<(), ReproduceError> {
    let output = child.wait_with_output().map_err(|e| failed(&e))?;
    let said = String::from_utf8_lossy(&output.stderr);
    let ended =
        || ReproduceError::Process(format!("a process ended with {}: {}", output.status, said.trim()));
    output.status.success().then_some(()).ok_or_else(ended)
}
