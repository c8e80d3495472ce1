//! The whole way from a mesh to a recording.

use crate::assembly::Assembly;
use crate::certificate::{CertificateError, DOUBTFUL, WORTHLESS, certificate};
use crate::discretisation::Discretisation;
use crate::element::Order;
use crate::factor::check_memory;
use crate::material::{self, MaterialError};
use crate::mesh::{Mesh, MeshError, check};
use crate::modes::{Modes, ModesError, lowest_modes};
use crate::progress::Progress;
use crate::residual::{ResidualChoice, gravity_response, residual_compliance};
use crate::system::{System, SystemError};
use glam::DVec3;
use palpate::{
    Certificate, Damping, FORMAT_VERSION, Material, MeshCounts, Metadata, ModalBasis, Provenance, Recording,
    Support, Surface,
};

/// What is recorded and how.
#[derive(Debug, Clone)]
pub struct RecordParameters {
    /// One material per region of the mesh.
    pub materials: Vec<Material>,
    /// Order of the elements.
    pub order: Order,
    /// Number of elastic modes to keep.
    pub modes: usize,
    /// Damping of the elastic modes.
    pub damping: Damping,
    /// What is kept of the residual compliance.
    pub residual: ResidualChoice,
    /// Nodes of the mesh that are fixed; none for a free body.
    pub fixed_nodes: Vec<u32>,
    /// Where the mesh came from, for the file.
    pub source: String,
    /// How much is computed.
    pub extent: Extent,
}

/// How much of a recording is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Extent {
    /// Modes, residual compliance and certificate.
    #[default]
    Whole,
    /// Without the certificate: for tables in closed form.
    Uncertified,
    /// The body alone, without modes: for tables by time integration.
    Body,
}

/// Why no recording could be made.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A material.
    #[error(transparent)]
    Material(#[from] MaterialError),
    /// Supports or factor.
    #[error(transparent)]
    System(#[from] SystemError),
    /// The modes.
    #[error(transparent)]
    Modes(#[from] ModesError),
    /// The certificate.
    #[error(transparent)]
    Certificate(#[from] CertificateError),
    /// Another option.
    #[error("{0}")]
    Option(String),
}

/// Share of fixed nodes above which the user is asked whether that was meant.
const MUCH_FIXED: f64 = 0.3;

/// Everything about a recorded body, for checks that need more than the recording.
pub struct Recorded {
    /// What is written.
    pub recording: Recording,
    /// The assembled body.
    pub system: System,
    /// The modes at all nodes.
    pub modes: Modes,
}

/// Record a mesh: check, assemble, factor, modes, residual compliance, certificate.
///
/// # Errors
/// Says what is wrong with the mesh, the material or the options.
pub fn record(
    mesh: Mesh,
    parameters: &RecordParameters,
    progress: &mut dyn Progress,
) -> Result<Recorded, RecordError> {
    check_parameters(&mesh, parameters)?;
    progress.begin("mesh, assembly, factor", 4);
    let mesh = check(mesh)?;
    mesh.remarks.iter().for_each(|remark| progress.remark(remark));
    remark_on_locking(parameters, progress);
    progress.advance(1);
    let discretisation = Discretisation::new(&mesh, parameters.order);
    check_memory(needed_bytes(discretisation.dofs() as f64, parameters.modes as f64))
        .map_err(SystemError::from)?;
    let fixed_nodes = fixed_nodes(&discretisation, &parameters.fixed_nodes)?;
    let share = fixed_nodes.len() as f64 / discretisation.nodes.len() as f64;
    if share > MUCH_FIXED {
        progress.remark(&format!(
            "{:.0} % of the nodes are fixed; conditions are in metres of the mesh",
            100.0 * share
        ));
    }
    let assembly = Assembly::new(&discretisation, &parameters.materials);
    progress.advance(1);
    let system = System::new(discretisation, assembly, fixed_nodes)?;
    progress.advance(2);

    let body_only = parameters.extent == Extent::Body;
    let wanted = if body_only { 0 } else { parameters.modes.min(system.elastic_modes()) };
    if wanted < parameters.modes && !body_only {
        progress.remark(&format!(
            "{} modes are wanted, the model has {wanted} elastic modes: all of them are kept",
            parameters.modes
        ));
    }
    let modes = if body_only { Modes::none(&system) } else { lowest_modes(&system, wanted, progress)? };
    let surface_nodes = system.discretisation.surface_nodes();
    let surface = surface(&system, &surface_nodes);
    let residual = residual_compliance(
        &system,
        &modes,
        &surface_nodes,
        surface.mean_edge(),
        if body_only { ResidualChoice::None } else { parameters.residual },
        progress,
    );
    let mut stated = None;
    if parameters.extent == Extent::Whole {
        let certificate =
            certificate(&system, &modes, &surface, &surface_nodes, &residual, parameters.damping, progress)?;
        remark_on_certificate(&certificate, progress);
        stated = Some(certificate);
    }

    let free = system.fixed_nodes.is_empty();
    let metadata = Metadata {
        format_version: FORMAT_VERSION,
        hold: Metadata::hold(),
        units: Metadata::units(),
        support: if free { Support::Free } else { Support::Fixed },
        materials: parameters.materials.clone(),
        damping: parameters.damping,
        mesh: MeshCounts {
            nodes: system.discretisation.nodes.len() as u64,
            elements: mesh.tets.len() as u64,
            order: if parameters.order == Order::Linear { 1 } else { 2 },
            fixed_nodes: system.fixed_nodes.len() as u64,
        },
        mass: system.mass.clone(),
        certificate: stated,
        provenance: Provenance {
            source: parameters.source.clone(),
            mesh_hash: mesh_hash(&mesh),
            palpate_version: env!("CARGO_PKG_VERSION").into(),
        },
    };
    let recording = Recording {
        metadata,
        surface,
        modes: modal_basis(&modes, &surface_nodes, parameters.damping),
        residual,
        gravity: (!free).then(|| gravity_response(&system, &modes, &surface_nodes)),
    };
    Ok(Recorded { recording, system, modes })
}

fn check_parameters(mesh: &Mesh, parameters: &RecordParameters) -> Result<(), RecordError> {
    let fail = |what: String| Err(RecordError::Option(what));
    parameters.materials.iter().try_for_each(material::check)?;
    if parameters.materials.len() != mesh.regions.len() {
        return fail(format!("{} materials for {} regions", parameters.materials.len(), mesh.regions.len()));
    }
    if parameters.modes == 0 {
        return fail("0 modes are wanted, expected 1 or more".into());
    }
    if let ResidualChoice::NearField(radius) = parameters.residual
        && !(radius.is_finite() && radius > 0.0)
    {
        return fail(format!("residual radius is {radius} m, expected a positive number"));
    }
    match parameters.damping {
        Damping::Rayleigh { alpha, beta }
            if !(alpha >= 0.0 && beta >= 0.0 && alpha.is_finite() && beta.is_finite()) =>
        {
            fail(format!(
                "Rayleigh damping is {alpha} 1/s, {beta} s, expected two numbers that are not negative"
            ))
        }
        Damping::Ratio(zeta) if !(zeta >= 0.0 && zeta.is_finite()) => {
            fail(format!("damping ratio is {zeta}, expected a number that is not negative"))
        }
        _ => Ok(()),
    }
}

/// A rough estimate before anything large is made: the factor grows with dofs^(4/3) (measured: 0.6 GB at 81 000 with
/// linear elements), the basis of the modes holds about four columns per mode, three times over.
fn needed_bytes(dofs: f64, modes: f64) -> f64 {
    0.6e9 * (dofs / 81e3).powf(4.0 / 3.0) + 3.0 * 8.0 * dofs * (4.0 * modes).min(dofs)
}

fn remark_on_locking(parameters: &RecordParameters, progress: &mut dyn Progress) {
    let stiffest = parameters.materials.iter().map(|m| m.poisson).fold(0.0, f64::max);
    if parameters.order == Order::Linear && stiffest > 0.45 {
        progress.remark(&format!(
            "linear elements lock at Poisson's ratio {stiffest}: frequencies come out some per cent too high; \
             --order 2 avoids it"
        ));
    }
    if stiffest > 0.4999 {
        progress.remark(&format!(
            "Poisson's ratio {stiffest} is so near to 0.5 that even quadratic elements lock; 0.49 is usual for rubber"
        ));
    }
}

fn remark_on_certificate(certificate: &Certificate, progress: &mut dyn Progress) {
    let error = certificate.force_error_max;
    let place = DVec3::from_array(certificate.worst_at_m);
    if error > WORTHLESS {
        progress.remark(&format!(
            "the force of this recording is worth nothing near ({:.4}, {:.4}, {:.4}) m from its centre of mass (see the \
             certificate): keep the residual compliance and more modes",
            place.x, place.y, place.z
        ));
    } else if error > DOUBTFUL {
        progress.remark(&format!(
            "even in a smooth press at one place the force of this recording is off by up to {:.0} % (see the \
             certificate): keep the residual compliance and more modes",
            100.0 * error
        ));
    }
}

/// Nodes of the discretisation that are fixed, from nodes of the mesh.
fn fixed_nodes(discretisation: &Discretisation, wanted: &[u32]) -> Result<Vec<u32>, RecordError> {
    let fixed = discretisation.among(wanted);
    if !wanted.is_empty() && !fixed.contains(&true) {
        return Err(RecordError::Option("the nodes to fix belong to no tetrahedron".into()));
    }
    if !fixed.contains(&false) {
        return Err(RecordError::Option("all nodes are fixed: nothing can move".into()));
    }
    Ok((0..fixed.len()).filter(|&node| fixed[node]).map(|node| node as u32).collect())
}

fn surface(system: &System, surface_nodes: &[u32]) -> Surface {
    let discretisation = &system.discretisation;
    let centre = DVec3::from_array(system.mass.center_of_mass_m);
    let mut number = vec![0_u32; discretisation.nodes.len()];
    surface_nodes.iter().enumerate().for_each(|(at, &node)| number[node as usize] = at as u32);
    Surface {
        positions: surface_nodes.iter().map(|&node| discretisation.nodes[node as usize] - centre).collect(),
        triangles: discretisation.triangles.iter().map(|t| t.map(|node| number[node as usize])).collect(),
        source_nodes: surface_nodes.iter().map(|&node| discretisation.source_nodes[node as usize]).collect(),
    }
}

fn modal_basis(modes: &Modes, surface_nodes: &[u32], damping: Damping) -> ModalBasis {
    let angular_frequencies: Vec<f64> = modes.squares.iter().map(|square| square.sqrt()).collect();
    let rows = surface_nodes.iter().flat_map(|&node| (0..3).map(move |axis| 3 * node as usize + axis));
    let mode_shapes = rows.flat_map(|row| (0..modes.squares.len()).map(move |i| (row, i)));
    ModalBasis {
        damping_ratios: angular_frequencies.iter().map(|&omega| damping.ratio(omega)).collect(),
        angular_frequencies,
        mode_shapes: mode_shapes.map(|at| modes.shapes[at]).collect(),
    }
}

/// BLAKE3 over nodes, tetrahedra and regions.
fn mesh_hash(mesh: &Mesh) -> String {
    let mut hasher = blake3::Hasher::new();
    mesh.nodes.iter().flat_map(|p| p.to_array()).for_each(|v| {
        hasher.update(&v.to_le_bytes());
    });
    mesh.tets.iter().flatten().chain(&mesh.tet_regions).for_each(|v| {
        hasher.update(&v.to_le_bytes());
    });
    hasher.finalize().to_hex().to_string()
}
