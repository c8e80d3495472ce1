//! `palpate inspect`: contents of a recording, a store or a log, and the stable couplings of a device.

mod log;
mod stability;

use crate::failure::Failure;
use crate::log_kind::is_log;
use crate::progress::Bars;
use crate::standard_streams::{STANDARD_INPUT, is_stream, read_input, report};
use crate::terminal::{print_json, size_text};
use clap::Args;
use glam::DVec3;
use palpate::{Damping, Material, Recording, ResidualCompliance, Support};
use palpate_fem::Progress;
use palpate_scene::{certificate_table, read_recording};
use palpate_store::{Location, TableStore};
use serde_json::{Value, json};
use stability::StabilityArguments;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Show a recording with its force-error certificate, a store of impulse responses, or a log
///
/// Of a store it lists the shards that exist and those that are missing, and checks the former; of a log how many steps it has, and
/// whether it was cut. With --device it shows which
/// virtual couplings (scene key `coupling`) are stable for that device on this object at a rate, with a delay, in a hand; the
/// margins; where oscillation begins; and the default, the stiffest with margins of twice the gains and twice the delay.
#[derive(Args)]
#[command(after_help = "Examples:
  palpate inspect cube.palp
  palpate inspect run.mcap.part
  palpate inspect cube.palp --device touch
  palpate inspect cube.palp --device omega.3 --rate 4000 --grip firm --point 0,0.05,0
  palpate inspect cube.palp --device touch --delay 0.02      # over a link, 20 ms there and back")]
pub struct Arguments {
    /// The recording (`-` for standard input), the log (.mcap), or the store: a folder or s3://BUCKET/PREFIX
    file: PathBuf,
    /// Don't read a store's shards to check them
    #[arg(long)]
    quick: bool,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
    /// Coupling of a device
    #[command(flatten)]
    stability: StabilityArguments,
}

/// Runs the command.
pub fn inspect(arguments: &Arguments) -> Result<(), Failure> {
    if is_stream(&arguments.file) {
        let bytes = read_input()?;
        let refused = |error| Failure(format!("{STANDARD_INPUT}: {error}; a log or a store needs a path"));
        let recording = Recording::from_bytes(&bytes).map_err(refused)?;
        return inspect_recording(arguments, &recording, bytes.len());
    }
    let text = arguments.file.to_string_lossy();
    if arguments.file.is_dir() || text.contains("://") {
        return inspect_store(arguments, &Location::parse(&text));
    }
    if is_log(&arguments.file) {
        return log::inspect(&arguments.file, arguments.json);
    }
    let recording = read_recording(&arguments.file)?;
    let bytes = std::fs::metadata(&arguments.file).map_or(0, |m| m.len() as usize);
    inspect_recording(arguments, &recording, bytes)
}

fn inspect_recording(arguments: &Arguments, recording: &Recording, bytes: usize) -> Result<(), Failure> {
    if arguments.stability.print_if_given(recording, arguments.json)? {
        return Ok(());
    }
    if arguments.json {
        return print_as_json(recording);
    }
    let is_piped = is_stream(&arguments.file);
    let name = if is_piped { Path::new(STANDARD_INPUT) } else { &arguments.file };
    print_as_text(recording, name, bytes, false)
}

fn inspect_store(arguments: &Arguments, location: &Location) -> Result<(), Failure> {
    let store = TableStore::open(location)?;
    let mut damaged = Vec::new();
    if !arguments.quick {
        let present = store.present()?;
        let mut progress = Bars::new();
        progress.begin("checking shards", present.len() as u64);
        for shard in (0..present.len()).filter(|&shard| present[shard].is_some()) {
            if let Err(error) = store.check_shard(shard) {
                damaged.push((shard, error.to_string()));
            }
            progress.advance(1);
        }
    }
    let printed = if arguments.json {
        print_store_as_json(&store, &damaged)
    } else {
        print_store_as_text(&store, &damaged, false)
    };
    match damaged.into_iter().next() {
        Some((_, what)) => Err(Failure(what)),
        None => printed,
    }
}

/// Prints a store as JSON; `damaged` are the shards that do not decode, with the reason.
pub fn print_store_as_json(store: &TableStore, damaged: &[(usize, String)]) -> Result<(), Failure> {
    let (content, present) = (store.content(), store.present()?);
    let attributes = &content.attributes;
    let missing: Vec<usize> = (0..present.len()).filter(|&shard| present[shard].is_none()).collect();
    print_json(&json!({
        "shards_total": store.shards(),
        "shards_done": present.len() - missing.len() - damaged.len(),
        "shards_missing": missing,
        "shards_damaged": damaged.iter().map(|(shard, _)| shard).collect::<Vec<_>>(),
        "columns_per_shard": attributes.columns_per_shard,
        "touchable_dofs": content.touchable_dofs.len(),
        "samples": content.samples,
        "observed_dofs": content.observed_dofs.len(),
        "step_s": attributes.step_s,
        "sampling": attributes.sampling,
        "method": attributes.method,
        "dtype": content.number.name(),
        "compression": attributes.compression,
        "bytes": present.iter().flatten().sum::<u64>(),
        "bytes_uncompressed": content.raw_bytes(),
        "recording": attributes.recording,
    }))
}

/// Prints a store as text, on standard error where standard output is data.
pub fn print_store_as_text(
    store: &TableStore,
    damaged: &[(usize, String)],
    output_is_taken: bool,
) -> Result<(), Failure> {
    let present = store.present()?;
    let text = describe_store(store, &present, damaged).map_err(|e| Failure(e.to_string()))?;
    report(&text, output_is_taken)
}

fn describe_store(
    store: &TableStore,
    present: &[Option<u64>],
    damaged: &[(usize, String)],
) -> Result<String, std::fmt::Error> {
    let content = store.content();
    let attributes = &content.attributes;
    let bytes = present.iter().flatten().sum::<u64>();
    let mut out = String::new();
    let source = &attributes.recording.provenance.source;
    writeln!(out, "{} ({}), from {source}", store.location(), size_text(bytes as usize))?;
    writeln!(
        out,
        "  table        {} touchable × {} samples × {} observed degrees of freedom, {}, {} before packing",
        content.touchable_dofs.len(),
        content.samples,
        content.observed_dofs.len(),
        content.number.name(),
        size_text(content.raw_bytes() as usize)
    )?;
    let end =
        if attributes.sampling == "end" { "at the end of each" } else { "mean of middle and end of each" };
    writeln!(out, "  samples      {} steps of {} ms, {end}", content.samples, 1000.0 * attributes.step_s)?;
    writeln!(out, "  method       {}", attributes.method)?;
    for material in &attributes.recording.materials {
        writeln!(out, "  material     {}", material_text(material))?;
    }
    let missing: Vec<usize> = (0..present.len()).filter(|&shard| present[shard].is_none()).collect();
    let done = present.len() - missing.len() - damaged.len();
    writeln!(
        out,
        "  shards       {done} of {} done, {} columns each",
        present.len(),
        attributes.columns_per_shard
    )?;
    if !missing.is_empty() {
        writeln!(out, "  missing      {}: record again with the same command to go on", ranges(&missing))?;
    }
    if !damaged.is_empty() {
        let shards: Vec<usize> = damaged.iter().map(|(shard, _)| *shard).collect();
        writeln!(out, "  damaged      {}", ranges(&shards))?;
    }
    Ok(out)
}

/// Ascending numbers as `0-3, 7`.
fn ranges(numbers: &[usize]) -> String {
    let mut runs: Vec<(usize, usize)> = Vec::new();
    for &number in numbers {
        match runs.last_mut() {
            Some((_, last)) if *last + 1 == number => *last = number,
            _ => runs.push((number, number)),
        }
    }
    let text = |&(first, last): &(usize, usize)| {
        if first == last { first.to_string() } else { format!("{first}-{last}") }
    };
    runs.iter().map(text).collect::<Vec<_>>().join(", ")
}

fn material_text(material: &Material) -> String {
    let region = if material.region.is_empty() { String::new() } else { format!("{}: ", material.region) };
    let Material { young_pa, poisson, density_kg_m3, .. } = material;
    let law = match material.stiffness_pa {
        None => format!("E = {young_pa} Pa, ν = {poisson}"),
        Some(_) => format!("anisotropic, means E = {young_pa:.3e} Pa, ν = {poisson:.3}"),
    };
    format!("{region}{law}, ρ = {density_kg_m3} kg/m³")
}

fn frequencies_hz(recording: &Recording) -> Vec<f64> {
    recording.modes.angular_frequencies.iter().map(|omega| omega / std::f64::consts::TAU).collect()
}

/// Lower and upper corner of the bounding box [m], in the mesh's coordinates.
fn bounding_box_m(recording: &Recording) -> [[f64; 3]; 2] {
    let (low, high) = recording.surface.extent();
    let centre = DVec3::from_array(recording.metadata.mass.center_of_mass_m);
    [(low + centre).to_array(), (high + centre).to_array()]
}

/// Prints a recording as JSON.
pub fn print_as_json(recording: &Recording) -> Result<(), Failure> {
    let metadata = &recording.metadata;
    let failed = |e: serde_json::Error| Failure(format!("JSON: {e}"));
    let residual: Value = match &recording.residual {
        ResidualCompliance::None => json!({ "kind": "none" }),
        ResidualCompliance::Whole(_) => json!({ "kind": "whole" }),
        ResidualCompliance::Quantised(_) => json!({ "kind": "whole", "quantised": true }),
        ResidualCompliance::NearField(near) => {
            json!({ "kind": "near_field", "radius_m": near.radius })
        }
    };
    print_json(&json!({
        "format_version": metadata.format_version,
        "nodes": metadata.mesh.nodes,
        "elements": metadata.mesh.elements,
        "order": metadata.mesh.order,
        "fixed_nodes": metadata.mesh.fixed_nodes,
        "surface_nodes": recording.surface.positions.len(),
        "surface_triangles": recording.surface.triangles.len(),
        "embedded_in_nodes": recording.embedding.as_ref().map(|embedding| embedding.model_nodes),
        "bounding_box_m": bounding_box_m(recording),
        "support": metadata.support,
        "mass_kg": metadata.mass.mass_kg,
        "center_of_mass_m": metadata.mass.center_of_mass_m,
        "inertia_kg_m2": metadata.mass.inertia_kg_m2,
        "materials": serde_json::to_value(&metadata.materials).map_err(failed)?,
        "damping": serde_json::to_value(metadata.damping).map_err(failed)?,
        "modes": recording.modes.len(),
        "frequencies_hz": frequencies_hz(recording),
        "damping_ratios": recording.modes.damping_ratios,
        "residual_compliance": residual,
        "certificate": serde_json::to_value(&metadata.certificate).map_err(failed)?,
        "hold": metadata.hold,
        "units": metadata.units,
        "provenance": serde_json::to_value(&metadata.provenance).map_err(failed)?,
    }))
}

/// Prints a recording as text.
pub fn print_as_text(
    recording: &Recording,
    path: &Path,
    bytes: usize,
    output_is_taken: bool,
) -> Result<(), Failure> {
    report(&describe(recording, path, bytes).map_err(|e| Failure(e.to_string()))?, output_is_taken)
}

fn describe(recording: &Recording, path: &Path, bytes: usize) -> Result<String, std::fmt::Error> {
    let metadata = &recording.metadata;
    let mut out = String::new();
    writeln!(out, "{} ({}), from {}", path.display(), size_text(bytes), metadata.provenance.source)?;
    let mesh = &metadata.mesh;
    let kind = if mesh.order == 1 { "linear" } else { "quadratic" };
    writeln!(out, "  mesh         {} nodes, {} {kind} tetrahedra", mesh.nodes, mesh.elements)?;
    let surface = &recording.surface;
    let embedded = match &recording.embedding {
        Some(embedding) => format!(", embedded: moved by {} nodes of the mesh", embedding.model_nodes),
        None => String::new(),
    };
    writeln!(
        out,
        "  surface      {} nodes, {} triangles{embedded}",
        surface.positions.len(),
        surface.triangles.len()
    )?;
    let [low, high] = bounding_box_m(recording);
    let range = |axis: usize| format!("{:.4} … {:.4}", low[axis] + 0.0, high[axis] + 0.0);
    writeln!(out, "  extent       x {}, y {}, z {} m in the mesh file", range(0), range(1), range(2))?;
    match metadata.support {
        Support::Free => writeln!(out, "  support      free in space")?,
        Support::Fixed => writeln!(out, "  support      {} nodes fixed", mesh.fixed_nodes)?,
    }
    for material in &metadata.materials {
        writeln!(out, "  material     {}", material_text(material))?;
    }
    match metadata.damping {
        Damping::Rayleigh { alpha, beta } => writeln!(out, "  damping      α = {alpha} 1/s, β = {beta} s")?,
        Damping::Ratio(0.0) => writeln!(out, "  damping      none")?,
        Damping::Ratio(zeta) => writeln!(out, "  damping      ζ = {zeta}")?,
    }
    let mass = &metadata.mass;
    let [x, y, z] = mass.center_of_mass_m.map(|v| if v.abs() < 1e-12 { 0.0 } else { v });
    writeln!(
        out,
        "  mass         {:.6} kg, centre ({x:.6}, {y:.6}, {z:.6}) m in the mesh file",
        mass.mass_kg
    )?;
    let frequencies = frequencies_hz(recording);
    let shown: Vec<String> = frequencies.iter().take(8).map(|f| format!("{f:.4}")).collect();
    let last = frequencies.last().copied().unwrap_or_default();
    writeln!(out, "  modes        {} elastic, {} … {last:.4} Hz", frequencies.len(), shown.join(" "))?;
    match &recording.residual {
        ResidualCompliance::None => {
            writeln!(out, "  residual     none: forces are off by up to several times")?
        }
        ResidualCompliance::Whole(_) => {
            writeln!(out, "  residual     compliance of what the modes miss: whole")?
        }
        ResidualCompliance::Quantised(_) => {
            writeln!(out, "  residual     compliance of what the modes miss: whole, in 16 bits")?
        }
        ResidualCompliance::NearField(near) => {
            writeln!(out, "  residual     compliance of what the modes miss: within {:.4} m", near.radius)?
        }
    }
    match &metadata.certificate {
        None => writeln!(out, "  certificate  none")?,
        Some(certificate) => out += &certificate_table(certificate),
    }
    Ok(out)
}
