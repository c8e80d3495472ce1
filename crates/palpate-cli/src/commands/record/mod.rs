//! `palpate record`: from a mesh to a recording.

mod dry_run;
mod table;

use crate::commands::inspect;
use crate::failure::Failure;
use crate::progress::Bars;
use crate::standard_streams::{FOLDER, STANDARD_INPUT, read_input, refuse, takes_output};
use crate::terminal::print_bytes;
use clap::Args;
use palpate::{Damping, Material};
use palpate_export::{check_writable, write_atomically};
use palpate_fem::{ElementOrder, ErrorTarget, Precision, Progress, RecordExtent, ResidualChoice};
use palpate_mesh::{MergeNodes, MeshingParameters, PieceChoice, Repair};
use palpate_scene::{BodySource, MaterialChoice, RecordOptions};
use std::path::{Path, PathBuf};
use table::{TableArguments, TableCommand};

/// Record the impulse responses of an elastic body by finite elements
///
/// Reads or makes a tetrahedral mesh, or fills a closed surface with tetrahedra, computes its lowest elastic modes and the residual compliance, certifies the error
/// against the unreduced model, and writes one recording for `palpate run`.
#[derive(Args, Debug, Clone)]
#[command(after_help = "Examples:
  palpate record box:0.1x0.1x0.1/12x12x12 --order 1 --young 2000 --poisson 0.49 --density 110 --rayleigh 2,2e-4 -o cube.palp
  palpate record liver.msh --scale 0.001 --young 5e3 --poisson 0.45 --density 1060 --fix ligament -o liver.palp
  palpate record box:0.2x0.05x0.05/12x3x3 --material rubber --fix 'x: x<-0.099' --spring '1e6: z<-0.024' -o bar.palp
  palpate record liver.stl --scale 0.001 --young 5e3 --poisson 0.45 --density 1060 --cell-size 0.008 -o liver.palp
  palpate record liver.msh --scale 0.001 --material liver --damping-ratio 0.1 -o liver.palp     # `palpate materials` has the names
  palpate record liver.stl --scale 0.001 --cell-size 0.004 --material liver --dry-run     # what it will take
  palpate record hand.msh --materials hand.toml -o hand.palp
  palpate record box:0.1x0.1x0.1/12x12x12 --order 1 --young 2000 --poisson 0.49 --density 110 --rayleigh 2,2e-4 \
      --dense cube.zarr --method transient --step 0.002 --duration 1

A material file has a table per region of the mesh:
  [[material]]
  region = \"skin\"      # name or number in the mesh file
  young = 5e4          # Pa
  poisson = 0.45
  density = 1000.0     # kg/m³
In place of young and poisson a table may have name = \"liver\", or for anisotropic materials
  orthotropic = { young = [E1, E2, E3], poisson = [ν12, ν13, ν23], shear = [G12, G13, G23] }
  stiffness = [21 numbers]          # upper triangle by rows; xx, yy, zz, yz, xz, xy; Pa
  axes = [[1, 0, 0], [0, 1, 0]]     # the material's first and second axis in the mesh")]
pub struct Arguments {
    /// A mesh file (`-` for standard input) of solid elements (Gmsh, VTK, VTU, TetGen, MEDIT, Vega, Abaqus) or of a closed surface (STL, OBJ, PLY, OFF, glTF), see `palpate mesh --help`; box:LXxLYxLZ/NXxNYxNZ (metres / cells; five tetrahedra per cell, or six with /6 after it: for thin plates), sphere:RADIUS/N, instrument:bar, instrument:fork, instrument:bell, body:liver/CELL or body:duck/CELL (metres), body:jelly/RINGS
    pub source: String,
    /// The recording to write, `-` for standard output; may be left out with --dense
    #[arg(short, long, value_name = "OUT.palp", required_unless_present_any = ["dense", "dry_run"])]
    pub output: Option<PathBuf>,
    /// Young's modulus [Pa]; may be left out with its two fellows where the mesh file gives materials
    #[arg(
        long,
        value_name = "PA",
        allow_negative_numbers = true,
        requires = "poisson",
        requires = "density"
    )]
    pub young: Option<f64>,
    /// Poisson's ratio, below 0.5
    #[arg(long, allow_negative_numbers = true, requires = "young", requires = "density")]
    pub poisson: Option<f64>,
    /// Density [kg/m³]
    #[arg(
        long,
        value_name = "KG/M³",
        allow_negative_numbers = true,
        requires = "young",
        requires = "poisson"
    )]
    pub density: Option<f64>,
    /// Material by name, for the whole body or for a region of the mesh: see `palpate materials`; may be repeated
    #[arg(long, value_name = "NAME|REGION=NAME", conflicts_with_all = ["young", "poisson", "density", "materials"])]
    pub material: Vec<String>,
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
    /// Damping ratio of every mode; without it and --rayleigh nothing is damped, unless a --material says so
    #[arg(long, value_name = "ZETA", allow_negative_numbers = true)]
    pub damping_ratio: Option<f64>,
    /// Elastic modes to keep: more for faster events (see `bandwidth` in the certificate)
    #[arg(long, default_value_t = 200)]
    pub modes: usize,
    /// Choose the modes by the error, the fewest of 25, 50, 100, …: upper limit of the peak force error in the certificate, 0.01 for 1 %
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true, conflicts_with_all = ["modes", "dense", "dry_run"])]
    pub force_error: Option<f64>,
    /// Choose the modes by the bandwidth in the certificate: its lower limit [Hz]
    #[arg(long, value_name = "HZ", allow_negative_numbers = true, conflicts_with_all = ["modes", "dense", "dry_run"])]
    pub bandwidth: Option<f64>,
    /// Order of the elements; 1 locks for Poisson's ratios near 0.5, and takes curved edges of the mesh straight
    #[arg(long, default_value_t = 2, value_parser = clap::value_parser!(u8).range(1..=2))]
    pub order: u8,
    /// Scale from the file's units to metres: 0.001 for a file in mm
    #[arg(long, default_value_t = 1.0, allow_negative_numbers = true)]
    pub scale: f64,
    /// Side of the cells that a surface is filled with [m]: tetrahedra have edges of 0.87 to 1 of it. Without it about 2,000 nodes come out
    #[arg(long, value_name = "M", allow_negative_numbers = true)]
    pub cell_size: Option<f64>,
    /// Surface to be seen and touched: a mesh file, in the unit of SOURCE, that is embedded in the tetrahedra and may be much finer, often that which SOURCE names. Without it the boundary of the tetrahedra
    #[arg(long, value_name = "FILE", conflicts_with = "dense")]
    pub surface: Option<PathBuf>,
    /// Fix nodes: a named group of the mesh, a condition such as 'x<0.001' or 'y>0.1 & z<=0' on its coordinates in metres, after --scale, or the words of --touchable; may be repeated. Axes before a colon hold these alone, as rollers do: 'z: z<0.001'. A box: or sphere: is about the origin. Mid-edge nodes of --order 2 count as nodes, each by its own place; in a group they are where the file has them, or else where both ends of their edge are
    #[arg(long, value_name = "[AXES:] GROUP|CONDITION")]
    pub fix: Vec<String>,
    /// Put faces of the surface on springs to the ground: stiffness per area [N/m³], axes (all without), and nodes as for --fix; may be repeated
    #[arg(long, value_name = "STIFFNESS [AXES]: NODES")]
    pub spring: Vec<String>,
    /// Merge nodes at the same point: auto, where the body falls into fewer pieces by it; always; never
    #[arg(long, value_name = "WHEN", value_enum, num_args = 0..=1, require_equals = true, default_value = "auto", default_missing_value = "always")]
    pub merge_nodes: MergeChoice,
    /// Piece of a body in several pieces: largest, or its number in `palpate mesh`
    #[arg(long, value_name = "largest|N", value_parser = piece_choice)]
    pub piece: Option<PieceChoice>,
    /// Residual compliance: auto, whole, none, or a cut-off radius in metres
    #[arg(long, default_value = "auto", allow_hyphen_values = true, value_parser = residual_choice)]
    pub residual: ResidualChoice,
    /// Precision of the file: compact rounds compliances by 0.012 % at most, which the certificate includes. Without it compact, and full with --dense
    #[arg(long)]
    pub precision: Option<PrecisionOption>,
    /// Say what the recording will take, nodes, memory, time and size of the file, and record nothing
    #[arg(long, conflicts_with = "dense")]
    pub dry_run: bool,
    /// Print what `inspect --json` prints; of the store, if there is no -o
    #[arg(long)]
    pub json: bool,
    /// The paper's table
    #[command(flatten)]
    pub dense: TableArguments,
}

/// Values of `--merge-nodes`.
#[derive(clap::ValueEnum, Debug, Clone, Copy)]
pub enum MergeChoice {
    Auto,
    Always,
    Never,
}

impl From<MergeChoice> for MergeNodes {
    fn from(choice: MergeChoice) -> Self {
        match choice {
            MergeChoice::Auto => Self::JoiningPieces,
            MergeChoice::Always => Self::Always,
            MergeChoice::Never => Self::Never,
        }
    }
}

/// Value of `--piece`.
pub fn piece_choice(text: &str) -> Result<PieceChoice, String> {
    match (text, text.parse()) {
        ("largest", _) => Ok(PieceChoice::Largest),
        (_, Ok(number)) if number > 0 => Ok(PieceChoice::Number(number)),
        _ => Err("expected largest, or a number from 1".into()),
    }
}

/// Precision, as on the command line.
#[derive(Debug, Clone, Copy, clap::ValueEnum)]
pub enum PrecisionOption {
    /// 16 bits, compressed: about 4 MB for 900 surface nodes.
    Compact,
    /// Mode shapes of 64 bits, compliances of 32: four to five times larger.
    Full,
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
    let output = arguments.output.as_deref();
    refuse(&[("--dense", arguments.dense.dense.as_deref().map(Path::new), FOLDER)])?;
    // A dry run writes no recording: standard output has its estimate.
    let output_is_taken = takes_output(&[("-o", output)], arguments.json && !arguments.dry_run)?;
    let inputs: Vec<&Path> =
        [Some(Path::new(&arguments.source)), arguments.materials.as_deref(), arguments.surface.as_deref()]
            .into_iter()
            .flatten()
            .collect();
    if let Some(output) = output.filter(|_| !output_is_taken) {
        check_writable(output, &inputs)?;
    }
    let mut progress = Bars::new();
    let piped = if arguments.source == "-" { Some(read_input()?) } else { None };
    let source = piped
        .as_ref()
        .map_or(BodySource::Text(&arguments.source), |bytes| BodySource::Bytes(bytes, STANDARD_INPUT));
    let mut body = options(arguments)?.prepare(source, &mut progress)?;
    let table = TableCommand::new(&arguments.dense, &body.mesh)?;
    body.parameters.extent =
        table.as_ref().map_or(RecordExtent::Full, |table| table.extent(arguments.output.is_some()));
    if arguments.dry_run {
        return dry_run::print_estimate(arguments, body);
    }
    let recorded = body.record(&mut progress)?;
    let mut written = None;
    if let Some(output) = &arguments.output {
        progress.begin("writing", 1);
        let bytes = recorded.recording.to_bytes()?;
        if output_is_taken {
            print_bytes(&bytes)?;
        } else {
            write_atomically(output, &bytes)?;
        }
        written = Some((output, bytes.len()));
    }
    progress.finish();
    let store = table.map(|table| table.record(&recorded, &mut progress)).transpose()?;
    match (written, store) {
        (Some(_), _) if arguments.json => inspect::print_as_json(&recorded.recording),
        (None, Some(store)) if arguments.json => inspect::print_store_as_json(&store, &[]),
        (written, store) => {
            if let Some((output, bytes)) = written {
                inspect::print_as_text(&recorded.recording, output, bytes, output_is_taken)?;
            }
            store.map_or(Ok(()), |store| inspect::print_store_as_text(&store, &[], output_is_taken))
        }
    }
}

/// Options of the library, by the arguments.
fn options(arguments: &Arguments) -> Result<RecordOptions, Failure> {
    Ok(RecordOptions {
        materials: materials(arguments)?,
        damping: damping(arguments)?,
        modes: arguments.modes,
        target: ErrorTarget { force_error: arguments.force_error, bandwidth_hz: arguments.bandwidth },
        order: if arguments.order == 1 { ElementOrder::Linear } else { ElementOrder::Quadratic },
        scale: arguments.scale,
        meshing: MeshingParameters { cell_size: arguments.cell_size, nodes: None, curved: false },
        surface: arguments.surface.clone(),
        repair: Repair {
            merge_nodes: arguments.merge_nodes.into(),
            piece: arguments.piece.unwrap_or_default(),
        },
        fix: arguments.fix.clone(),
        spring: arguments.spring.clone(),
        residual: arguments.residual,
        precision: match (arguments.precision, &arguments.dense.dense) {
            (Some(PrecisionOption::Compact), _) | (None, None) => Precision::Compact,
            (Some(PrecisionOption::Full), _) | (None, Some(_)) => Precision::Full,
        },
    })
}

fn materials(arguments: &Arguments) -> Result<MaterialChoice, Failure> {
    if !arguments.material.is_empty() {
        return Ok(MaterialChoice::Named(arguments.material.clone()));
    }
    match (&arguments.materials, arguments.young, arguments.poisson, arguments.density) {
        (Some(path), ..) => Ok(MaterialChoice::File(path.clone())),
        (None, Some(young), Some(poisson), Some(density)) => {
            Ok(MaterialChoice::Uniform(Material::isotropic(young, poisson, density)))
        }
        (None, None, None, None) => Ok(MaterialChoice::OfMesh),
        _ => Err(Failure("give --young, --poisson and --density, or --material, or --materials".into())),
    }
}

fn damping(arguments: &Arguments) -> Result<Option<Damping>, Failure> {
    match (arguments.rayleigh.as_deref(), arguments.damping_ratio) {
        (Some(&[alpha, beta]), _) => Ok(Some(Damping::Rayleigh { alpha, beta })),
        (Some(other), _) => Err(Failure(format!("--rayleigh is {other:?}, expected two numbers ALPHA,BETA"))),
        (None, ratio) => Ok(ratio.map(Damping::Ratio)),
    }
}
