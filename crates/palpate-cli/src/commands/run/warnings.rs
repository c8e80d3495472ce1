//! Warnings of a run, offline or in real time.

use crate::failure::Failure;
use palpate_scene::{Scene, Warning};
use serde_json::{Value, json};
use std::fmt::Write;

/// Lines of a summary.
pub(super) fn text(warnings: &[Warning]) -> String {
    warnings.iter().fold(String::new(), |mut out, warning| {
        // Writing to a String can't fail.
        let _ = writeln!(out, "  warning      {warning}");
        out
    })
}

/// All warnings of a scene and its run as JSON.
pub(super) fn json(scene: &Scene, of_run: &[Warning]) -> Value {
    let all = scene.warnings.iter().chain(of_run);
    let one =
        |warning: &Warning| json!({ "kind": warning.kind, "part": warning.part, "message": warning.message });
    all.map(one).collect()
}

/// Failure for warnings where none are allowed.
pub(super) fn refuse(strict: bool, warnings: &[Warning]) -> Result<(), Failure> {
    match warnings {
        [first, ..] if strict => Err(Failure(format!("{first} (a warning; --strict makes it an error)"))),
        _ => Ok(()),
    }
}
