//! Runs as a user has them: `palpate` in processes of its own.

use crate::Failure;
use serde_json::Value;
use std::path::Path;
use std::process::{Child, Command, Stdio};

fn failed(error: &std::io::Error) -> Failure {
    Failure(format!("palpate can't be run in a process of its own: {error}"))
}

/// Start `palpate` in a folder; it will report as JSON.
pub fn start(folder: &Path, arguments: &[&str]) -> Result<Child, Failure> {
    let program = std::env::current_exe().map_err(|e| failed(&e))?;
    let mut command = Command::new(program);
    command.args(arguments).arg("--json").current_dir(folder);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    command.spawn().map_err(|e| failed(&e))
}

/// What it reports when it has ended.
pub fn report(child: Child) -> Result<Value, Failure> {
    let output = child.wait_with_output().map_err(|e| failed(&e))?;
    let said = String::from_utf8_lossy(&output.stderr);
    serde_json::from_slice(&output.stdout)
        .map_err(|_| Failure(format!("a process ended without a report: {}", said.trim())))
}

/// A number of a report.
pub fn number(report: &Value, pointer: &str) -> Result<f64, Failure> {
    let found = report.pointer(pointer).and_then(Value::as_f64);
    found.ok_or_else(|| Failure(format!("the report of a run has no {pointer}")))
}
