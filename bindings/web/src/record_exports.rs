//! Function for recording a mesh that JavaScript calls: conventions as in [`exports`](crate::exports).

#![allow(missing_docs)]

use crate::exports::{DATA, TEXT, bytes, or_error, send, send_json, text};
use palpate::Material;
use palpate_scene::{MeshUpload, MeshingParameters, ProgressFn};
use serde_json::{Value, json};

/// Records the mesh of a file; false after an error was sent.
///
/// `about` is JSON: `{ "name", "scale", "young", "poisson", "density", "modes", "nodes" }`, in metres per unit, Pa and kg/m³; without `nodes` a
/// surface is filled with 2,000. Sent are texts in JSON for the
/// progress, `{ "phase", "fraction" }`, the bytes of the recording, and as JSON what was repaired, in sentences.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mesh_record(
    about: *const u8,
    about_length: usize,
    address: *const u8,
    length: usize,
) -> bool {
    // SAFETY: as promised by the caller.
    let (about, content) = unsafe { (text(about, about_length), bytes(address, length)) };
    or_error(record(&about, content).map(|()| true))
}

fn record(about: &str, content: &[u8]) -> Result<(), String> {
    let about: Value = serde_json::from_str(about).map_err(|error| error.to_string())?;
    let number = |key: &str| about.get(key).and_then(Value::as_f64).ok_or(format!("{key} is not a number"));
    let upload = MeshUpload {
        name: about.get("name").and_then(Value::as_str).unwrap_or("the mesh").to_string(),
        bytes: content.to_vec(),
        scale: number("scale")?,
        meshing: MeshingParameters {
            nodes: number("nodes").ok().map(|n| n as u32),
            cell_size: None,
            curved: false,
        },
        material: Material::isotropic(number("young")?, number("poisson")?, number("density")?),
        modes: number("modes")? as usize,
    };
    let mut progress = ProgressFn::new(|phase: &str, fraction: Option<f64>| {
        send(TEXT, json!({ "phase": phase, "fraction": fraction }).to_string().as_bytes());
    });
    let (recording, repairs) = upload.record(&mut progress).map_err(|error| error.to_string())?;
    send(DATA, &recording.to_bytes().map_err(|error| error.to_string())?);
    send_json(&json!(repairs));
    Ok(())
}
