//! Contents of a log.

use crate::failure::Failure;
use crate::terminal::{print, print_json, size_text, warn_of_cut};
use palpate_scene::LogReplay;
use serde_json::json;
use std::path::Path;

/// Prints what a log holds, and warns where it was cut.
pub(super) fn inspect(path: &Path, as_json: bool) -> Result<(), Failure> {
    let log = LogReplay::read(path)?;
    warn_of_cut(&log);
    let scene = &log.scene;
    let (steps, step_s) = (log.steps, scene.model.parameters().step_s);
    let bytes = std::fs::metadata(path).map_or(0, |metadata| metadata.len());
    let devices: Vec<&str> = scene.devices.iter().map(|device| device.name.as_str()).collect();
    if as_json {
        return print_json(&json!({
            "steps": steps,
            "step_s": step_s,
            "whole": !log.is_cut(),
            "version": log.version(),
            "objects": scene.object_names,
            "devices": devices,
            "bytes": bytes,
        }));
    }
    let of = |names: &[&str]| if names.is_empty() { "none".to_string() } else { names.join(", ") };
    let objects: Vec<&str> = scene.object_names.iter().map(String::as_str).collect();
    print(&format!(
        "{} ({}), a log of palpate {}\n  steps        {steps} of {step_s} s: {:.3} s\n  objects      {}\n  devices      {}\n",
        path.display(),
        size_text(bytes as usize),
        log.version(),
        steps as f64 * step_s,
        of(&objects),
        of(&devices)
    ))
}
