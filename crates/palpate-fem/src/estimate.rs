//! Cost of a recording before it is made: sizes, memory, file and time.
//!
//! Sizes of the model, the factor and the file are counted: the elimination order of the factor is computed, which is a small part of the work.
//! Memory and time are models of them, with constants that were fitted to bodies of 6,000 to 30,000 (memory) and to 275,000 (time) degrees of
//! freedom:
//!
//! ```text
//! memory = base + 6.2·factor + 2·file                 (a compact file: 8.5·(surface dofs)² in place of 2·file)
//! time   = a·(entries that the inverse visits) + b·(factor entries)·modes + c·dofs·modes² + d·dofs + e·(surface dofs)³
//! ```
//!
//! The entries of G at the surface visit those of the factor on the paths of the elimination tree: once forwards, and backwards as many for a near
//! field, half of all for the whole matrix. e is that of the factorisation which proves a compact S positive definite. The compressed size of a
//! compact S is a guess: it depends on the body.
//!
//! docs/recording.md states how well they predict six bodies.

use crate::assembly::Assembly;
use crate::carriers::Carriers;
use crate::discretisation::Discretisation;
use crate::factor::Pattern;
use crate::memory::check_memory;
use crate::record::{RecordExtent, RecordParameters, check_parameters};
use crate::record_error::RecordError;
use crate::residual::{Precision, ResidualChoice, automatic_radius};
use crate::supports;
use palpate::MAX_QUANTISED_NODES;
use palpate_mesh::Mesh;

/// Cost of a recording.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Nodes, with mid-edge nodes.
    pub nodes: usize,
    /// Elements.
    pub elements: usize,
    /// Degrees of freedom that can move.
    pub dofs: usize,
    /// Nodes of the surface.
    pub surface_nodes: usize,
    /// Nodes of the model that carry it: as many, but for an embedded surface.
    pub carriers: usize,
    /// Modes that are kept.
    pub modes: usize,
    /// Size of one factor [bytes].
    pub factor_bytes: u64,
    /// Largest memory in use [bytes].
    pub memory_bytes: u64,
    /// Size of the file [bytes].
    pub file_bytes: u64,
    /// Threads.
    pub threads: usize,
    /// Time [s] on so many idle cores.
    pub seconds: f64,
}

/// Cost of a recording of a mesh, which is checked as for [`crate::record`].
///
/// # Errors
/// As of [`crate::record`], but for what only the numbers of the factor tell.
pub fn estimate(mesh: Mesh, parameters: &RecordParameters) -> Result<Estimate, RecordError> {
    check_parameters(&mesh, parameters)?;
    let mesh = mesh.checked()?;
    if parameters.order == crate::ElementOrder::Quadratic {
        mesh.check_curved()?;
    }
    let discretisation = Discretisation::new(&mesh, parameters.order);
    let mut assembly = Assembly::new(&discretisation, &parameters.materials);
    let supported =
        supports::apply(&parameters.fixed_nodes, &parameters.supports, &discretisation, &mut assembly)?;
    let pattern = Pattern::new(&assembly)?;
    let carriers = Carriers::new(&discretisation, parameters.surface.as_ref())?;
    let free_dofs = supported.fixed.iter().filter(|fixed| !**fixed).count();
    let is_free = !supported.fixed.contains(&true) && !supported.sprung.contains(&true);
    let elastic = free_dofs - if is_free { 6 } else { 0 };
    let modes = if parameters.extent == RecordExtent::NoModes { 0 } else { parameters.modes.min(elastic) };
    let (residual, is_whole) = residual_bytes(&discretisation, &carriers, parameters);
    let is_compact = parameters.precision == Precision::Compact;
    let is_quantised = is_compact && is_whole && carriers.nodes.len() <= MAX_QUANTISED_NODES;
    let mut estimate = Estimate {
        nodes: discretisation.nodes.len(),
        elements: mesh.tets.len(),
        dofs: free_dofs,
        surface_nodes: carriers.surface.positions.len(),
        carriers: carriers.nodes.len(),
        modes,
        factor_bytes: pattern.factor_bytes(),
        memory_bytes: 0,
        file_bytes: 0,
        threads: rayon::current_num_threads(),
        seconds: 0.0,
    };
    let residual = if is_quantised { quantised_bytes(carriers.nodes.len()) } else { residual };
    estimate.file_bytes = file_bytes(&estimate, &carriers, residual, is_free, is_compact);
    estimate.memory_bytes = memory_bytes(&estimate, is_quantised);
    let backwards = 0.5 * (estimate.factor_bytes / 8) as f64 * 3.0 * carriers.nodes.len() as f64;
    let forwards = pattern.path_entries(&carriers.nodes) as f64;
    let visited = match (residual > 0, is_whole) {
        (false, _) => 0.0,
        (true, true) => forwards + backwards,
        (true, false) => 2.0 * forwards,
    };
    estimate.seconds = seconds(&estimate, visited, is_quantised);
    Ok(estimate)
}

impl Estimate {
    /// Refuses a recording that needs more memory than is free. Passes where the system does not state its free memory.
    ///
    /// # Errors
    /// [`crate::SolveError::Memory`] with both numbers.
    pub fn check_memory(&self) -> Result<(), RecordError> {
        Ok(check_memory(self.memory_bytes as f64)?)
    }
}

/// Size of a quantised residual compliance [bytes], which is compressed.
fn quantised_bytes(carriers: usize) -> u64 {
    let dofs = 3.0 * carriers as f64;
    (4.0 * dofs + COMPRESSED_BYTES * 0.5 * dofs * (dofs + 1.0)) as u64
}

/// Size of the residual compliance in full precision [bytes]: its lower triangle, or the blocks of near nodes; and whether it is whole.
fn residual_bytes(
    discretisation: &Discretisation,
    carriers: &Carriers,
    parameters: &RecordParameters,
) -> (u64, bool) {
    let n = carriers.nodes.len() as u64;
    let whole = 2 * 3 * n * (3 * n + 1);
    let radius = match parameters.residual {
        _ if parameters.extent == RecordExtent::NoModes => return (0, false),
        ResidualChoice::None => return (0, false),
        ResidualChoice::Whole => return (whole, true),
        ResidualChoice::NearField(radius) => radius,
        ResidualChoice::Automatic => match automatic_radius(carriers.nodes.len(), || carriers.mean_edge) {
            Some(radius) => radius,
            None => return (whole, true),
        },
    };
    let positions: Vec<glam::DVec3> =
        carriers.nodes.iter().map(|&node| discretisation.nodes[node as usize]).collect();
    let near = |a: &glam::DVec3| positions.iter().filter(|b| (**b - *a).length() < radius).count() as u64;
    (8 + 4 * (n + 1) + 40 * positions.iter().map(near).sum::<u64>(), false)
}

/// Size of the file [bytes]: surface, modes, residual compliance, gravity; contact samples and certificate are about two numbers a node.
fn file_bytes(
    estimate: &Estimate,
    carriers: &Carriers,
    residual: u64,
    is_free: bool,
    is_compact: bool,
) -> u64 {
    let surface = &carriers.surface;
    let weights = carriers
        .embedding
        .as_ref()
        .map_or(0, |embedding| 4 * surface.positions.len() + 8 * embedding.weights.len());
    let surface = 28 * surface.positions.len() + 12 * surface.triangles.len() + weights;
    let (surface, n, m) = (surface as u64, estimate.carriers as u64, estimate.modes as u64);
    let modes = if is_compact { 24 * m + 6 * n * m } else { 16 * m + 24 * n * m };
    let gravity = if is_free { 0 } else { 24 * m + 72 * n };
    surface + modes + residual + gravity + 16 * estimate.surface_nodes as u64 + HEADER_BYTES
}

/// Compressed size of an entry of a quantised residual compliance [bytes]: 0.74 of a ball of 2,600 surface nodes with 200 modes, 1.2 of
/// a thin plate with 100.
const COMPRESSED_BYTES: f64 = 0.95;

/// Size of names, metadata and certificate [bytes].
const HEADER_BYTES: u64 = 6_000;

/// Memory of the process without a body [bytes].
const BASE_BYTES: f64 = 1.4e8;

/// Factors, matrices and vectors in units of one factor: the stiffness's, two shifted ones of the certificate, and what they are made from.
const FACTORS: f64 = 6.2;

/// The content of the file is held, and again while it is written.
const FILES: f64 = 2.0;

/// The triangle in single precision, its whole numbers, and the factor that proves it positive definite, per squared degree of freedom of the
/// surface [bytes].
const QUANTISATION_BYTES: f64 = 8.5;

fn memory_bytes(estimate: &Estimate, is_quantised: bool) -> u64 {
    let surface_dofs = 3.0 * estimate.carriers as f64;
    let residual = if is_quantised {
        QUANTISATION_BYTES * surface_dofs * surface_dofs
    } else {
        FILES * estimate.file_bytes as f64
    };
    (BASE_BYTES + FACTORS * estimate.factor_bytes as f64 + residual) as u64
}

/// Seconds of one core per factor entry that the inverse visits, per factor entry and mode, per degree of freedom and two modes, per degree of
/// freedom, and per cube of a surface degree of freedom.
const INVERSE_S: f64 = 4.4e-11;
const SOLVE_S: f64 = 3.5e-9;
const KRYLOV_S: f64 = 6.3e-9;
const CERTIFICATE_S: f64 = 4.4e-4;
const QUANTISATION_S: f64 = 8.3e-12;

fn seconds(estimate: &Estimate, visited: f64, is_quantised: bool) -> f64 {
    let entries = estimate.factor_bytes as f64 / 8.0;
    let (dofs, modes, surface) =
        (estimate.dofs as f64, estimate.modes as f64, 3.0 * estimate.carriers as f64);
    let cpu = INVERSE_S * visited
        + SOLVE_S * entries * modes
        + KRYLOV_S * dofs * modes * modes
        + CERTIFICATE_S * dofs
        + if is_quantised { QUANTISATION_S * surface.powi(3) } else { 0.0 };
    cpu / estimate.threads as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ElementOrder, SilentProgress, paper_cube, record};
    use palpate_mesh::{ball_mesh, box_mesh};

    /// Contact samples and the certificate are not counted one by one.
    const FILE: f64 = 0.01;

    /// Tolerance of the size of a compact file: its entries compress differently from body to body.
    const COMPACT_FILE: f64 = 0.3;

    #[test]
    fn the_file_has_the_size_that_was_said() {
        let near = ResidualChoice::NearField(0.03);
        let (cube, ball) = (|| box_mesh([0.1; 3], [6; 3]), || ball_mesh(0.05, 3));
        let fixed: Vec<u32> = (0..49).collect();
        for (mesh, order, residual, fixed_nodes) in [
            (cube(), ElementOrder::Linear, ResidualChoice::Automatic, Vec::new()),
            (cube(), ElementOrder::Linear, near, fixed),
            (ball(), ElementOrder::Quadratic, ResidualChoice::Whole, Vec::new()),
            (ball(), ElementOrder::Quadratic, ResidualChoice::None, Vec::new()),
        ] {
            let mesh = mesh.expect("a good mesh");
            let parameters =
                RecordParameters { order, residual, fixed_nodes, ..paper_cube::parameters(6, 50) };
            let said = estimate(mesh.clone(), &parameters).expect("an estimate");
            let recording = record(mesh, &parameters, &mut SilentProgress).expect("a recording");
            let bytes = recording.to_bytes().expect("a file").len() as f64;
            let file = said.file_bytes as f64;
            // A small file is mostly what is not counted.
            assert!((file - bytes).abs() < FILE * bytes + 12e3, "{order:?} {residual:?}: {file} {bytes}");
            assert_eq!(said.nodes as u64, recording.metadata.mesh.nodes);
            assert_eq!(
                (said.surface_nodes, said.modes),
                (recording.surface.positions.len(), recording.modes.len())
            );
        }
    }

    #[test]
    fn the_size_of_a_compact_file_is_said_to_a_third() {
        let parameters = RecordParameters { precision: Precision::Compact, ..paper_cube::parameters(6, 100) };
        for (mesh, order) in [
            (box_mesh([0.1; 3], [6; 3]), ElementOrder::Quadratic),
            (box_mesh([0.2, 0.1, 0.02], [12, 6, 2]), ElementOrder::Linear),
            (ball_mesh(0.05, 4), ElementOrder::Quadratic),
        ] {
            let (mesh, parameters) =
                (mesh.expect("a good mesh"), RecordParameters { order, ..parameters.clone() });
            let said = estimate(mesh.clone(), &parameters).expect("an estimate");
            let recording = record(mesh, &parameters, &mut SilentProgress).expect("a recording");
            let ratio = said.file_bytes as f64 / recording.to_bytes().expect("a file").len() as f64;
            assert!((ratio - 1.0).abs() < COMPACT_FILE, "{order:?}: {ratio}");
        }
    }

    #[test]
    fn what_cannot_be_recorded_has_no_estimate_and_what_is_too_large_is_refused() {
        let mesh = box_mesh([0.1; 3], [2; 3]).expect("a good box");
        let none = RecordParameters { modes: 0, ..paper_cube::parameters(2, 1) };
        assert!(matches!(estimate(mesh.clone(), &none), Err(RecordError::NoModes)));
        let mut said = estimate(mesh, &paper_cube::parameters(2, 10)).expect("an estimate");
        said.check_memory().expect("a small body");
        said.memory_bytes = 1 << 60;
        if crate::available_memory().is_some() {
            let text = said.check_memory().expect_err("too large").to_string();
            assert!(text.contains("1152921504.6 GB"), "{text}");
        }
    }
}
