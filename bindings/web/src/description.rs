//! Descriptions of recordings and scenes as JSON.

use palpate::Recording;
use palpate_scene::{Scene, certificate_lines};
use serde_json::{Value, json};
use std::f64::consts::TAU;

/// Numbers of a recording: nodes, triangles, mass [kg], frequencies [Hz], damping ratios, certificate.
pub fn describe_recording(recording: &Recording) -> Value {
    let modes = &recording.modes;
    let frequencies: Vec<f64> = modes.angular_frequencies.iter().map(|omega| omega / TAU).collect();
    json!({
        "source": recording.metadata.provenance.source,
        "nodes": recording.surface.positions.len(),
        "triangles": recording.surface.triangles.len(),
        "mass": recording.mass(),
        "frequencies": frequencies,
        "dampingRatios": modes.damping_ratios,
        "certificate": certificate_lines(recording),
        "forceError": recording.metadata.certificate.as_ref().map(|certificate| certificate.force_error_max),
    })
}

/// Names of a scene's parts, its step [s], and its warnings.
pub fn describe_scene(scene: &Scene) -> Value {
    let names = scene.names();
    json!({
        "step": scene.model.parameters().step_s,
        "duration": scene.end_s(),
        "objectNames": names.objects,
        "deviceNames": names.devices,
        "obstacleNames": names.obstacles,
        "clampNames": names.clamps,
        "warnings": scene.warnings.iter().map(ToString::to_string).collect::<Vec<_>>(),
    })
}
