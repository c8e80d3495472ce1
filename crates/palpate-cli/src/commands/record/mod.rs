//! `palpate record`: from a mesh to a recording.

mod node_selection;
mod table;

use crate::commands::inspect;
use crate::failure::Failure;
use crate::progress::Bars;
use clap::Args;
use node_selection::select;
use palpate::{Damping, Material};
use palpate_export::{check_writable, write_atomically};
use palpate_fem::mesh::Mesh;
use palpate_fem::{
    ElementOrder, Progress, RecordExtent, RecordParameters, RecordedBody, ResidualChoice,
    materials_from_toml, read_regular_text,
};
use palpate_scene::{read_mesh, source_name};
use std::path::{Path, PathBuf};
use table::{TableArguments, TableCommand};

/// Record the impulse responses of an elastic body by finite elements
///
/// Reads or makes a tetrahedral mesh, computes its lowest elastic modes and the residual compliance, certifies the error
/// against the unreduced model, and writes one recording for `palpate run`.
#[derive(Args, Debug, Clone)]
#[command(after_help = "Examples:
  palpate record box:0.1x0.1x0.1/12x12x12 --order 1 --young 2000 --poisson 0.49 --density 110 --rayleigh 2,2e-4 -o cube.palp
  palpate record liver.msh --scale 0.001 --young 5e3 --poisson 0.45 --density 1060 --fix ligament -o liver.palp
  palpate record hand.msh --materials hand.toml -o hand.palp
  palpate record box:0.1x0.1x0.1/12x12x12 --order 1 --young 2000 --poisson 0.49 --density 110 --rayleigh 2,2e-4 \
      --dense cube.zarr --method transient --step 0.002 --duration 1

A material file has a table per region of the mesh:
  [[material]]
  region = \"skin\"      # name or number in the mesh file
  young = 5e4          # Pa
  poisson = 0.45
  density = 1000.0     # kg/m³")]
pub struct Arguments {
    /// A Gmsh (.msh) or VTK legacy (.vtk) file, box:LXxLYxLZ/NXxNYxNZ (metres / cells), or sphere:RADIUS/N
    pub source: String,
    /// The recording to write; may be left out with --dense
    #[arg(short, long, value_name = "OUT.palp", required_unless_present = "dense")]
    pub output: Option<PathBuf>,
    /// Young's modulus [Pa]
    #[arg(long, value_name = "PA", allow_negative_numbers = true, required_unless_present = "materials")]
    pub young: Option<f64>,
    /// Poisson's ratio, below 0.5
    #[arg(long, allow_negative_numbers = true, required_unless_present = "materials")]
    pub poisson: Option<f64>,
    /// Density [kg/m³]
    #[arg(long, value_name = "KG/M³", allow_negative_numbers = true, required_unless_present = "materials")]
    pub density: Option<f64>,
    /// Materials by region of the mesh, a TOML file (see below)
    #[arg(long, value_name = "FILE.toml", conflicts_with_all = ["young", "poisson", "density"])]
    pub materials: Option<PathBuf>,
    /// Rayleigh damping C = αM + βK: α [1/s], β [s]
    #[arg(
        long,
        value_name = "ALPHA,BETA",
        value_delimiter = ',',
        num_args = 1,
        allow_negative_numbers = true,
        conflicts_with = "damping_ratio"
    )]
    pub rayleigh: Option<Vec<f64>>,
    /// Damping ratio of every mode; without it and --rayleigh nothing is damped
    #[arg(long, value_name = "ZETA", allow_negative_numbers = true)]
    pub damping_ratio: Option<f64>,
    /// Elastic modes to keep: more for faster events (see `bandwidth` in the certificate)
    #[arg(long, default_value_t = 200)]
    pub modes: usize,
    /// Order of the elements; 1 locks for Poisson's ratios near 0.5
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u8).range(1..=2))]
    pub order: u8,
    /// Scale from the file's units to metres: 0.001 for a file in mm
    #[arg(long, default_value_t = 1.0, allow_negative_numbers = true)]
    pub scale: f64,
    /// Fix nodes: a named group of the mesh, a condition such as 'x<0.001' or 'y>0.1 & z<=0' on its coordinates in metres, after --scale, or the words of --touchable; may be repeated. A box: or sphere: is about the origin. Mid-edge nodes of --order 2 are fixed when both ends of their edge are
    #[arg(long, value_name = "GROUP|CONDITION")]
    pub fix: Vec<String>,
    /// Merge nodes at the same point
    #[arg(long)]
    pub merge_nodes: bool,
    /// Residual compliance: auto, whole, none, or a cut-off radius in metres
    #[arg(long, default_value = "auto", allow_hyphen_values = true, value_parser = residual_choice)]
    pub residual: ResidualChoice,
    /// Print what `inspect --json` prints; of the store, if there is no -o
    #[arg(long)]
    pub json: bool,
    /// The paper's table
    #[command(flatten)]
    pub dense: TableArguments,
}

fn residual_choice(text: &str) -> Result<ResidualChoice, String> {
    match text {
        "auto" => Ok(ResidualChoice::Automatic),
        "whole" => Ok(ResidualChoice::Whole),
        "none" => Ok(ResidualChoice::None),
        _ => text
            .parse()
            .map(ResidualChoice::NearField)
            .map_err(|_| "expected auto, whole, none, or a radius in metres".into()),
    }
}

/// Runs the command.
pub fn record(arguments: &Arguments) -> Result<(), Failure> {
    let inputs: Vec<&Path> =
        [Some(Path::new(&arguments.source)), arguments.materials.as_deref()].into_iter().flatten().collect();
    if let Some(output) = &arguments.output {
        check_writable(output, &inputs)?;
    }
    let mut progress = Bars::new();
    let mut mesh = read_mesh(&arguments.source)?;
    mesh.scale(arguments.scale)?;
    if arguments.merge_nodes {
        let merged = mesh.merge_coincident_nodes();
        progress.warn(&format!("{merged} nodes lay on others and were merged"));
    }
    let table = TableCommand::new(&arguments.dense, &mesh)?;
    let extent = table.as_ref().map_or(RecordExtent::Full, |table| table.extent(arguments.output.is_some()));
    let parameters = parameters(arguments, extent, &mesh)?;
    let recorded = RecordedBody::new(mesh, &parameters, &mut progress)
        .map_err(|e| Failure(format!("{}: {e}", source_name(&arguments.source))))?;
    let mut written = None;
    if let Some(output) = &arguments.output {
        progress.begin("writing", 1);
        let bytes = recorded.recording.to_bytes()?;
        write_atomically(output, &bytes)?;
        written = Some((output, bytes.len()));
    }
    progress.finish();
    let store = table.map(|table| table.record(&recorded, &mut progress)).transpose()?;
    match (written, store) {
        (Some(_), _) if arguments.json => inspect::print_as_json(&recorded.recording),
        (None, Some(store)) if arguments.json => inspect::print_store_as_json(&store, &[]),
        (written, store) => {
            if let Some((output, bytes)) = written {
                inspect::print_as_text(&recorded.recording, output, bytes)?;
            }
            store.map_or(Ok(()), |store| inspect::print_store_as_text(&store, &[]))
        }
    }
}

fn parameters(arguments: &Arguments, extent: RecordExtent, mesh: &Mesh) -> Result<RecordParameters, Failure> {
    let materials = match (&arguments.materials, arguments.young, arguments.poisson, arguments.density) {
        (Some(path), ..) => {
            let text = read_regular_text(path).map_err(|e| Failure::file("read the materials", path, &e))?;
            materials_from_toml(&text, mesh).map_err(|e| Failure(format!("{}: {e}", path.display())))?
        }
        (None, Some(young_pa), Some(poisson), Some(density_kg_m3)) => {
            let material = Material { region: String::new(), young_pa, poisson, density_kg_m3 };
            vec![material; mesh.regions.len()]
        }
        _ => {
            return Err(Failure("give --young, --poisson and --density, or --materials".into()));
        }
    };
    let damping = match (arguments.rayleigh.as_deref(), arguments.damping_ratio) {
        (Some(&[alpha, beta]), _) => Damping::Rayleigh { alpha, beta },
        (Some(other), _) => {
            return Err(Failure(format!("--rayleigh is {other:?}, expected two numbers ALPHA,BETA")));
        }
        (None, ratio) => Damping::Ratio(ratio.unwrap_or(0.0)),
    };
    let mut fixed_nodes = Vec::new();
    for selection in &arguments.fix {
        fixed_nodes.extend(select(mesh, "--fix", selection)?.mesh_nodes);
    }
    Ok(RecordParameters {
        materials,
        order: if arguments.order == 1 { ElementOrder::Linear } else { ElementOrder::Quadratic },
        modes: arguments.modes,
        damping,
        residual: arguments.residual,
        fixed_nodes,
        source: source_name(&arguments.source),
        extent,
    })
}
