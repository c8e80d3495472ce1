//! `palpate mesh`: report on a mesh file before anything is recorded.

use crate::commands::record::MergeChoice;
use crate::failure::Failure;
use crate::standard_streams::{self, STANDARD_INPUT, is_stream, read_input, takes_output};
use crate::terminal::{print_bytes, print_json};
use clap::Args;
use palpate_export::{check_writable, write_atomically};
use palpate_mesh::{
    ANGLE_BIN_DEG, Files, MeshFile, MeshReport, MeshingParameters, MeshingReport, PieceChoice, Repair,
    VolumeReport,
};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// Show what a mesh file holds, in what state it is, and what keeps it from being recorded
///
/// The format is found by the content of the file, not by its name. Of solid elements it shows regions, groups and pieces, the size
/// with a question about the unit, the dihedral angles of the tetrahedra, the boundary, and what was repaired; of a surface whether it is
/// watertight, and the tetrahedra that it is filled with. It ends with status 1 if the body can't be recorded.
#[derive(Args)]
#[command(after_help = "Formats:
  solids    Gmsh 1, 2.2, 4.0, 4.1; VTK legacy; VTU; TetGen .node with .ele; MEDIT .mesh, .meshb; Vega .veg; Abaqus .inp
  surfaces  STL, OBJ, PLY, OFF, glTF (.gltf, .glb): filled with tetrahedra, or for obstacles

Examples:
  palpate mesh liver.vtu
  palpate mesh bunny.1.ele --scale 0.001     # a file in millimetres
  palpate mesh parts.msh --piece largest     # as `palpate record parts.msh --piece largest` takes it
  palpate mesh liver.stl --scale 0.001 --cell-size 0.008 -o liver.vtk
  palpate mesh liver.inp --json | jq .volume.dihedral_range_deg

Good tetrahedra have dihedral angles of 15° to 150°. A few slivers make a body too stiff near them; a flat tetrahedron is an error.")]
pub struct Arguments {
    /// The mesh file, `-` for standard input; of a TetGen pair either
    file: PathBuf,
    /// Scale from the file's units to metres: 0.001 for a file in mm
    #[arg(long, default_value_t = 1.0, allow_negative_numbers = true)]
    scale: f64,
    /// Merge nodes at the same point: auto, where the body falls into fewer pieces by it; always; never
    #[arg(long, value_name = "WHEN", value_enum, num_args = 0..=1, require_equals = true, default_value = "auto", default_missing_value = "always")]
    merge_nodes: MergeChoice,
    /// Piece of a body in several pieces: largest, or its number in this report
    #[arg(long, value_name = "largest|N", value_parser = super::record::piece_choice)]
    piece: Option<PieceChoice>,
    /// Side of the cells that a surface is filled with [m]; without it about 2,000 nodes come out
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    cell_size: Option<f64>,
    /// Write the tetrahedra, in metres and repaired: VTK legacy or Gmsh 2.2, by the name; `-` for VTK on standard output
    #[arg(short, long, value_name = "OUT.vtk|OUT.msh", value_parser = output_path)]
    output: Option<PathBuf>,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

/// Pieces and groups that the text lists; JSON has all.
const LISTED: usize = 10;

/// Length of the longest bar of the histogram [characters].
const LONGEST_BAR: f64 = 40.0;

/// Runs the command.
pub fn mesh(arguments: &Arguments) -> Result<(), Failure> {
    let output = arguments.output.as_deref();
    let output_is_taken = takes_output(&[("-o", output)], arguments.json)?;
    if let Some(output) = output.filter(|_| !output_is_taken) {
        check_writable(output, &[&arguments.file])?;
    }
    let (file, name) = if is_stream(&arguments.file) {
        let files = BTreeMap::from([(PathBuf::from(STANDARD_INPUT), read_input()?)]);
        (MeshFile::read(Files::Memory(&files), Path::new(STANDARD_INPUT))?, STANDARD_INPUT.to_string())
    } else {
        (MeshFile::read(Files::Disk, &arguments.file)?, arguments.file.display().to_string())
    };
    let repair =
        Repair { merge_nodes: arguments.merge_nodes.into(), piece: arguments.piece.unwrap_or_default() };
    let meshing = MeshingParameters { cell_size: arguments.cell_size, nodes: None, curved: true };
    let mut never = |_share| ControlFlow::Continue(());
    let (report, mesh) = MeshReport::new(file, arguments.scale, &repair, &meshing, &mut never);
    if arguments.json {
        let value = serde_json::to_value(&report).map_err(|error| Failure(error.to_string()))?;
        print_json(&value)?;
    } else {
        let text = as_text(&name, &report).map_err(|error| Failure(error.to_string()))?;
        standard_streams::report(&text, output_is_taken)?;
    }
    if let (Some(output), Some(mesh)) = (&arguments.output, mesh) {
        let text = if has_ending(output, "msh") { mesh.to_gmsh() } else { mesh.to_vtk() };
        if output_is_taken {
            print_bytes(text.as_bytes())?;
        } else {
            write_atomically(output, text.as_bytes())?;
        }
    }
    match report.problem {
        Some(problem) => Err(Failure(format!("{name}: {problem}"))),
        None => Ok(()),
    }
}

/// Value of `--output`.
fn output_path(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    if has_ending(&path, "vtk") || has_ending(&path, "msh") || is_stream(&path) {
        Ok(path)
    } else {
        Err("expected a name that ends in .vtk or .msh, or - for VTK on standard output".into())
    }
}

fn has_ending(path: &Path, ending: &str) -> bool {
    path.extension().is_some_and(|own| own.eq_ignore_ascii_case(ending))
}

fn as_text(name: &str, report: &MeshReport) -> Result<String, std::fmt::Error> {
    let mut out = String::new();
    writeln!(out, "{name}: {}", report.format)?;
    let elements: Vec<_> = report.elements.iter().map(|(shape, count)| format!("{count} {shape}")).collect();
    writeln!(out, "  file         {} nodes, {}", report.nodes, elements.join(", "))?;
    let [low, high] = report.bounding_box_m;
    let extent = [0, 1, 2].map(|axis| high[axis] - low[axis]);
    writeln!(
        out,
        "  size         {:.4} × {:.4} × {:.4} m, from ({:.4}, {:.4}, {:.4}) to ({:.4}, {:.4}, {:.4})",
        extent[0], extent[1], extent[2], low[0], low[1], low[2], high[0], high[1], high[2]
    )?;
    let is_surface = report.elements.keys().all(|shape| shape == "triangles");
    if let Some(volume) = report.volume.as_ref().filter(|_| !is_surface) {
        write_volume(&mut out, volume)?;
    }
    let surface = &report.surface;
    let what = if is_surface { "surface" } else { "boundary" };
    write!(out, "  {what:<12} {} triangles, {} vertices, ", surface.triangles, surface.vertices)?;
    let faults = [
        (surface.open_edges, "open edges"),
        (surface.crossing_edges, "edges of more than two triangles"),
        (surface.flipped_edges, "edges between triangles that face each other"),
    ];
    let faults: Vec<_> = faults
        .iter()
        .filter(|(count, _)| *count > 0)
        .map(|(count, what)| format!("{count} {what}"))
        .collect();
    let state = if faults.is_empty() { "watertight".to_owned() } else { faults.join(", ") };
    let parts = if surface.parts > 1 { format!(", {} parts", surface.parts) } else { String::new() };
    writeln!(out, "{state}{parts}")?;
    if let Some(volume) = surface.volume_m3.filter(|_| is_surface) {
        writeln!(out, "  inside       {volume:.4e} m³")?;
    }
    if let Some(meshing) = &report.meshing {
        write_meshing(&mut out, meshing, surface.is_watertight())?;
    }
    if let Some(volume) = report.volume.as_ref().filter(|_| is_surface) {
        write_volume(&mut out, volume)?;
    }
    for warning in &report.warnings {
        writeln!(out, "  warning      {warning}")?;
    }
    if let Some(question) = &report.unit_question {
        writeln!(out, "  unit         {question}")?;
    }
    Ok(out)
}

fn write_meshing(out: &mut String, meshing: &MeshingReport, is_watertight: bool) -> std::fmt::Result {
    let use_as =
        if is_watertight { "a body or an obstacle" } else { "a body; an obstacle must be watertight" };
    writeln!(out, "  use          {use_as}")?;
    writeln!(out, "  as a body    {} nodes, cells of {:.3e} m", meshing.nodes, meshing.cell_size_m)?;
    let volume = meshing.volume_error.map_or(String::new(), |e| format!(", {:+.2} % volume", 100.0 * e));
    let [most, all] = meshing.distance_cells;
    writeln!(out, "  likeness     95 % within {most:.2} cells of the surface, all within {all:.2}{volume}")
}

fn write_volume(out: &mut String, volume: &VolumeReport) -> std::fmt::Result {
    let pieces = match volume.pieces.len() {
        1 => "one piece".to_owned(),
        count => format!("{count} pieces"),
    };
    let curved = match volume.curved_tetrahedra {
        0 => String::new(),
        count => format!(" ({count} with curved edges)"),
    };
    writeln!(
        out,
        "  body         {} tetrahedra{curved}, {:.4e} m³, {pieces}",
        volume.tetrahedra, volume.volume_m3
    )?;
    if volume.pieces.len() > 1 {
        for (number, piece) in (1..=LISTED).zip(&volume.pieces) {
            let [x, y, z] = piece.near_m;
            writeln!(
                out,
                "  piece {number:<6} {} tetrahedra, {:.4e} m³, near ({x:.4}, {y:.4}, {z:.4})",
                piece.tetrahedra, piece.volume_m3
            )?;
        }
    }
    for region in &volume.regions {
        let name = region.name.as_ref().map_or(String::new(), |name| format!(" '{name}'"));
        let material = region.material.as_ref().map_or(String::new(), |name| format!(", material {name}"));
        writeln!(
            out,
            "  region       {}{name}: {} tetrahedra, {:.4e} m³{material}",
            region.number, region.tetrahedra, region.volume_m3
        )?;
    }
    for (name, nodes) in volume.groups.iter().take(LISTED) {
        writeln!(out, "  group        '{name}': {nodes} nodes")?;
    }
    for (count, what) in [(volume.pieces.len(), "pieces"), (volume.groups.len(), "groups")] {
        if count > LISTED {
            writeln!(out, "  …            {} {what} more (--json)", count - LISTED)?;
        }
    }
    let [least, most] = volume.dihedral_range_deg;
    writeln!(out, "  angles       {least:.1}° to {most:.1}° between faces")?;
    let largest = volume.dihedral_histogram.iter().copied().max().unwrap_or(0).max(1) as f64;
    for (bin, &count) in volume.dihedral_histogram.iter().enumerate().filter(|(_, count)| **count > 0) {
        let from = bin as f64 * ANGLE_BIN_DEG;
        let bar = "█".repeat((LONGEST_BAR * count as f64 / largest).ceil() as usize);
        writeln!(out, "    {from:>3} to {:>3}° {bar} {count}", from + ANGLE_BIN_DEG)?;
    }
    Ok(())
}
