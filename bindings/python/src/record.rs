//! `palpate.record`: from a mesh to a recording, with the options of `palpate record`.

use crate::arrays::{Numbers, check_finite, read_integers};
use crate::errors::{Class, catch_panic, exception, input_error, internal_error, scene_error};
use crate::keywords::keywords_in;
use crate::progress::PythonProgress;
use crate::recording::Recording;
use crate::scalars::{Text, Whole};
use crate::workers::{Workers, no_threads};
use glam::DVec3;
use palpate::{Damping, Material};
use palpate_fem::{ElementOrder, ErrorTarget, Precision, ResidualChoice, library_material};
use palpate_mesh::{MergeNodes, Mesh, MeshingParameters, PieceChoice, Region, Repair};
use palpate_scene::{BodySource, MaterialChoice, RecordOptions, SceneError};
use pyo3::prelude::*;
use std::num::NonZero;
use std::path::PathBuf;
use std::sync::OnceLock;

/// Mesh of an argument.
enum Source {
    /// Primitive or file.
    Text(String),
    /// Nodes and tetrahedra.
    Arrays(Mesh),
}

/// Process that recorded first: the threads of the numerics live in it.
static FIRST_PROCESS: OnceLock<u32> = OnceLock::new();

/// Recording of a mesh by finite elements, with the options of `palpate record` (docs/recording.md).
///
/// Parameters
/// ----------
/// mesh : str, path, or (nodes, tetrahedra)
///     Mesh file of any format that palpate reads, a surface to be filled, a primitive as `"box:0.1x0.1x0.1/6x6x6"` or `"sphere:0.05/4"`, or
///     arrays: positions of shape (n, 3), integers of shape (m, 4).
/// young, poisson, density : float, optional
///     Young's modulus [Pa], Poisson's ratio [1] and density [kg/m³] of the whole body.
/// material : str, optional
///     Material by name instead, as `palpate materials` lists them.
/// materials : str, path, or list of dict, optional
///     Materials by region of the mesh instead: a material file, or its tables, as `[{"region": "skin", "name": "liver"}, {"region": "bone",
///     "young": 1e9, "poisson": 0.3, "density": 1800}]` (docs/recording.md). Without any the materials of the mesh file.
/// rayleigh : (float, float), optional
///     Rayleigh damping α [1/s], β [s].
/// damping_ratio : float, optional
///     Damping ratio of all modes instead [1]. Without either nothing is damped, unless a named material says so.
/// modes : int
///     Number of elastic modes to keep.
/// force_error, bandwidth : float, optional
///     Instead of `modes`: the fewest whose certificate keeps this peak force error [1] and this bandwidth [Hz].
/// order : {2, 1}
///     Order of the elements.
/// scale : float
///     Metres per unit of the mesh.
/// cell_size : float, optional
///     Side of the cells that a surface is filled with [m].
/// surface : path, optional
///     Mesh file of the surface to be seen and touched, in the unit of the mesh: it is embedded in the tetrahedra and may be much finer.
/// fix, spring : str or list of str, optional
///     Nodes that are fixed, and faces on springs, as on the command line: `fix="x<-0.049"`.
/// merge_nodes : {"auto", "always", "never"}
///     Whether nodes on one point are merged; "auto" where the body falls into fewer pieces by it.
/// piece : "largest" or int, optional
///     Piece of a mesh in several pieces, by its number in `palpate mesh`, from 1.
/// residual : {"auto", "whole", "none"} or float, optional
///     Part of the residual compliance to keep, or a cut-off radius [m].
/// precision : {"compact", "full"}
///     Precision of the numbers that are kept.
/// progress : callable, optional
///     Called as `progress(stage, share)`, at most a hundred times a stage; `share` is from 0 to 1, or None.
///
/// Returns
/// -------
/// Recording
///
/// Raises
/// ------
/// MeshError, RecordingError, FileError, InputError
///     If the mesh, the material or an argument cannot be used.
/// KeyboardInterrupt
///     If Ctrl-C is pressed meanwhile. Other threads run meanwhile, too.
#[pyfunction]
#[pyo3(signature = (mesh, *, young=None, poisson=None, density=None, material=None, materials=None, rayleigh=None, damping_ratio=None,
    modes=200, force_error=None, bandwidth=None, order=2, scale=1.0, cell_size=None, surface=None, fix=None, spring=None, merge_nodes="auto",
    piece=None, residual=None, precision="compact", progress=None))]
#[expect(clippy::too_many_arguments, reason = "keywords of Python")]
pub fn record(
    py: Python<'_>,
    mesh: &Bound<'_, PyAny>,
    young: Option<f64>,
    poisson: Option<f64>,
    density: Option<f64>,
    material: Option<Text>,
    materials: Option<&Bound<'_, PyAny>>,
    rayleigh: Option<&Bound<'_, PyAny>>,
    damping_ratio: Option<f64>,
    #[pyo3(from_py_with = Whole::number_of)] modes: i64,
    force_error: Option<f64>,
    bandwidth: Option<f64>,
    #[pyo3(from_py_with = Whole::number_of)] order: i64,
    scale: f64,
    cell_size: Option<f64>,
    surface: Option<PathBuf>,
    fix: Option<&Bound<'_, PyAny>>,
    spring: Option<&Bound<'_, PyAny>>,
    merge_nodes: &str,
    piece: Option<&Bound<'_, PyAny>>,
    residual: Option<&Bound<'_, PyAny>>,
    precision: &str,
    progress: Option<Py<PyAny>>,
) -> PyResult<Recording> {
    let refused = |message: String| input_error(py, message);
    let material = material.as_ref().map(|Text(name)| name.as_str());
    let damping = match (rayleigh, damping_ratio) {
        (Some(_), Some(_)) => return Err(refused("give rayleigh or damping_ratio, not both".into())),
        (Some(given), None) => Some(read_rayleigh(given)?),
        (None, ratio) => ratio.map(Damping::Ratio),
    };
    let options = RecordOptions {
        materials: read_materials(py, (young, poisson, density), material, materials)?,
        damping,
        modes: usize::try_from(modes)
            .map_err(|_| refused(format!("modes is {modes}, expected at least 1")))?,
        target: ErrorTarget { force_error, bandwidth_hz: bandwidth },
        order: match order {
            1 => ElementOrder::Linear,
            2 => ElementOrder::Quadratic,
            other => return Err(refused(format!("order is {other}, expected 1 or 2"))),
        },
        scale,
        meshing: MeshingParameters { cell_size, nodes: None, curved: false },
        surface,
        fix: texts(fix, "fix")?,
        spring: texts(spring, "spring")?,
        residual: residual.map_or(Ok(ResidualChoice::Automatic), read_residual)?,
        precision: match precision {
            "compact" => Precision::Compact,
            "full" => Precision::Full,
            other => {
                return Err(refused(format!("precision is {other:?}, expected \"compact\" or \"full\"")));
            }
        },
        repair: Repair {
            merge_nodes: match merge_nodes {
                "auto" => MergeNodes::JoiningPieces,
                "always" => MergeNodes::Always,
                "never" => MergeNodes::Never,
                other => {
                    let message =
                        format!("merge_nodes is {other:?}, expected \"auto\", \"always\" or \"never\"");
                    return Err(refused(message));
                }
            },
            piece: piece.map_or(Ok(PieceChoice::default()), read_piece)?,
        },
    };
    let source = read_source(mesh)?;
    let mut progress = PythonProgress::new(progress);
    let record = || {
        let source = match source {
            Source::Text(ref text) => BodySource::Text(text),
            Source::Arrays(mesh) => BodySource::Mesh(mesh, "arrays"),
        };
        catch_panic(|| options.record(source, &mut progress))
    };
    let recorded = py.detach(|| {
        if *FIRST_PROCESS.get_or_init(std::process::id) == std::process::id() {
            return Ok(record());
        }
        // A fork has none of the threads that its parent records with: multiprocessing.
        let threads = std::thread::available_parallelism().map_or(1, NonZero::get);
        Workers::new(threads)?.run(record)
    });
    let recorded = recorded.map_err(|error| no_threads(py, &error))?;
    // An exception of the callback, or a signal, is the cause of whatever came after it.
    if let Some(error) = progress.failure() {
        return Err(error);
    }
    let recorded = recorded.map_err(|text| internal_error(py, &text))?;
    recorded.map(Recording::new).map_err(|error| scene_error(py, &with_keywords(error)))
}

/// Error whose message has keywords in place of options.
fn with_keywords(mut error: SceneError) -> SceneError {
    error.message = keywords_in(&error.message);
    error
}

/// Materials: by numbers, by name, by region, or those of the mesh file.
fn read_materials(
    py: Python<'_>,
    numbers: (Option<f64>, Option<f64>, Option<f64>),
    name: Option<&str>,
    by_region: Option<&Bound<'_, PyAny>>,
) -> PyResult<MaterialChoice> {
    let refused = |message: &str| Err(input_error(py, message));
    let whole = match (numbers, name) {
        ((None, None, None), None) => None,
        ((None, None, None), Some(name)) => {
            library_material(name).map_err(|error| input_error(py, format!("material: {error}")))?;
            Some(MaterialChoice::Named(vec![name.into()]))
        }
        ((Some(young), Some(poisson), Some(density)), None) => {
            Some(MaterialChoice::Uniform(Material::isotropic(young, poisson, density)))
        }
        _ => return refused("give young, poisson and density together, or material alone"),
    };
    let given = match (whole, by_region) {
        (Some(_), Some(_)) => {
            return refused("give materials, or material, or young, poisson and density: one of them");
        }
        (whole, None) => return Ok(whole.unwrap_or_default()),
        (None, Some(given)) => given,
    };
    if let Ok(path) = given.extract::<PathBuf>() {
        return Ok(MaterialChoice::File(path));
    }
    let text = py.import("palpate._toml")?.call_method1("material_tables", (given,))?.extract()?;
    Ok(MaterialChoice::Text(text, "materials".into()))
}

/// Rayleigh's α [1/s] and β [s].
fn read_rayleigh(given: &Bound<'_, PyAny>) -> PyResult<Damping> {
    let numbers = Numbers::read(given, "rayleigh", &[Some(2)])?;
    let &[alpha, beta] = numbers.as_slice()? else {
        return Err(input_error(given.py(), "rayleigh is not two numbers"));
    };
    Ok(Damping::Rayleigh { alpha, beta })
}

/// Piece of a mesh: "largest", or its number.
fn read_piece(given: &Bound<'_, PyAny>) -> PyResult<PieceChoice> {
    match (given.extract::<String>().as_deref(), given.extract::<usize>()) {
        (Ok("largest"), _) => Ok(PieceChoice::Largest),
        (_, Ok(number)) if number > 0 => Ok(PieceChoice::Number(number)),
        _ => {
            let message = format!("piece is {}, expected \"largest\", or a number from 1", given.repr()?);
            Err(input_error(given.py(), message))
        }
    }
}

/// Part of the residual compliance: "auto", "whole", "none", or a radius in metres.
fn read_residual(given: &Bound<'_, PyAny>) -> PyResult<ResidualChoice> {
    if let Ok(radius) = given.extract::<f64>() {
        return Ok(ResidualChoice::NearField(radius));
    }
    match given.extract::<String>().as_deref() {
        Ok("auto") => Ok(ResidualChoice::Automatic),
        Ok("whole") => Ok(ResidualChoice::Whole),
        Ok("none") => Ok(ResidualChoice::None),
        _ => {
            let message = format!(
                "residual is {}, expected \"auto\", \"whole\", \"none\" or a radius in metres",
                given.repr()?
            );
            Err(input_error(given.py(), message))
        }
    }
}

/// One text, or several.
fn texts(given: Option<&Bound<'_, PyAny>>, name: &str) -> PyResult<Vec<String>> {
    let Some(given) = given else { return Ok(Vec::new()) };
    if let Ok(text) = given.extract::<String>() {
        return Ok(vec![text]);
    }
    given.extract().map_err(|_| {
        input_error(
            given.py(),
            format!("{name} is no text, and no list of texts: write as on the command line, 'x<0.001'"),
        )
    })
}

/// Mesh of an argument: a path or a primitive, or a pair of arrays.
fn read_source(mesh: &Bound<'_, PyAny>) -> PyResult<Source> {
    let py = mesh.py();
    if let Ok(text) = mesh.extract::<String>() {
        return Ok(Source::Text(text));
    }
    if let Ok(path) = mesh.extract::<PathBuf>() {
        let text = path.into_os_string().into_string();
        return text.map(Source::Text).map_err(|path| {
            exception(py, Class::Mesh, format!("the path {} is not UTF-8: rename the file", path.display()))
        });
    }
    let Ok((nodes, tets)) = mesh.extract::<(Bound<'_, PyAny>, Bound<'_, PyAny>)>() else {
        let message = "mesh is no path, no primitive as 'box:0.1x0.1x0.1/6x6x6', and no pair of arrays (nodes, tetrahedra)";
        return Err(input_error(py, message));
    };
    let nodes = Numbers::read(&nodes, "nodes", &[None, Some(3)])?;
    check_finite(py, "nodes", nodes.as_slice()?, 3)?;
    let nodes: Vec<DVec3> = nodes.as_slice()?.chunks_exact(3).map(DVec3::from_slice).collect();
    let corners = read_integers(&tets, "tetrahedra", 4)?;
    let known = |node: i64| u32::try_from(node).ok().filter(|node| (*node as usize) < nodes.len());
    if let Some(at) = corners.iter().position(|corner| known(*corner).is_none()) {
        let message = format!(
            "tetrahedron {} has the node {}, expected 0 to {}",
            at / 4,
            corners[at],
            nodes.len().saturating_sub(1)
        );
        return Err(exception(py, Class::Mesh, message));
    }
    let corners: Vec<u32> = corners.into_iter().filter_map(known).collect();
    let tets: Vec<[u32; 4]> = corners.chunks_exact(4).map(|c| [c[0], c[1], c[2], c[3]]).collect();
    let tet_regions = vec![0; tets.len()];
    Ok(Source::Arrays(Mesh { nodes, tets, tet_regions, regions: vec![Region::default()], ..Mesh::default() }))
}
