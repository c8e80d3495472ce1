//! Recording of a mesh: from nodes and tetrahedra to modes, residual compliance and certificate.

use crate::assembly::Assembly;
use crate::body::RecordedBody;
use crate::carriers::Carriers;
use crate::certificate::{FORCE_ERROR_UNUSABLE, certificate};
use crate::discretisation::Discretisation;
use crate::element::ElementOrder;
use crate::kernels::avx_section;
use crate::material::{self, library_material};
use crate::memory::check_memory;
use crate::modes::{ElasticModes, lowest_modes};
use crate::progress::Progress;
use crate::record_error::RecordError;
use crate::residual::{Precision, ResidualChoice, gravity_response, residual_compliance};
use crate::solve_error::SolveError;
use crate::supports::{self, Supports};
use crate::system::System;
use glam::DVec3;
use palpate::{
    COMPACT_FORMAT_VERSION, Certificate, CertificateLevel, Damping, EMBEDDED_FORMAT_VERSIONS, FORMAT_VERSION,
    MIN_CONTACT_SAMPLES, Material, MeshCounts, Metadata, ModalBasis, Provenance, Recording, Support,
};
use palpate_mesh::{Mesh, SurfaceMesh};

/// Parameters of a recording.
#[derive(Debug, Clone)]
pub struct RecordParameters {
    /// Materials, one per region of the mesh.
    pub materials: Vec<Material>,
    /// Order of the elements.
    pub order: ElementOrder,
    /// Number of elastic modes to keep; all of them if the body has fewer.
    pub modes: usize,
    /// Damping of the elastic modes.
    pub damping: Damping,
    /// Part of the residual compliance to keep.
    pub residual: ResidualChoice,
    /// Precision of the numbers to keep.
    pub precision: Precision,
    /// Fixed nodes of the mesh; none for a free body. Mid-edge nodes that the mesh lacks are fixed where both ends of their edge are:
    /// [`Mesh::add_mid_edge_nodes`] gives it all, to be fixed by their own place.
    pub fixed_nodes: Vec<u32>,
    /// Other supports: nodes that are held along some axes, and springs.
    pub supports: Supports,
    /// Surface to be seen and touched in place of the boundary, in the frame of the mesh: it is embedded in the elements, and may be finer. Closed, with
    /// its triangles outwards, see [`palpate_mesh::closed_surface`].
    pub surface: Option<SurfaceMesh>,
    /// Name of the mesh, for the file.
    pub source: String,
    /// Extent of the computation.
    pub extent: RecordExtent,
}

impl Default for RecordParameters {
    /// Quadratic elements, since linear ones lock; 200 modes, for events of some 10 ms; no damping. The materials are to be filled in, one per
    /// region of the mesh.
    fn default() -> Self {
        Self::new(Vec::new(), ElementOrder::Quadratic, 200, Damping::Ratio(0.0))
    }
}

impl RecordParameters {
    /// Parameters of a free body: whole residual compliance, full precision, certificate, source "mesh".
    pub fn new(materials: Vec<Material>, order: ElementOrder, modes: usize, damping: Damping) -> Self {
        Self {
            materials,
            order,
            modes,
            damping,
            residual: ResidualChoice::Automatic,
            precision: Precision::Full,
            fixed_nodes: Vec::new(),
            supports: Supports::default(),
            surface: None,
            source: "mesh".into(),
            extent: RecordExtent::Full,
        }
    }
}

/// Extent of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum RecordExtent {
    /// Modes, residual compliance, levels of contact samples, and certificate.
    #[default]
    Full,
    /// Modes and residual compliance: for tables in closed form.
    NoCertificate,
    /// Surface and mass alone: for tables by time integration.
    NoModes,
}

/// Share of fixed nodes above which the user is warned.
const MANY_FIXED: f64 = 0.3;

/// Records a mesh: checks and assembles it, computes modes, residual compliance and certificate.
///
/// # Errors
/// [`RecordError`] when the mesh, a material or a parameter is not usable, the body cannot be solved, or the listener
/// interrupts.
pub fn record(
    mesh: Mesh,
    parameters: &RecordParameters,
    progress: &mut dyn Progress,
) -> Result<Recording, RecordError> {
    RecordedBody::new(mesh, parameters, progress).map(|body| body.recording)
}

impl RecordedBody {
    /// Records a mesh like [`record`], and keeps the finite element model for tables and reference solutions.
    ///
    /// # Errors
    /// As of [`record`].
    pub fn new(
        mesh: Mesh,
        parameters: &RecordParameters,
        progress: &mut dyn Progress,
    ) -> Result<Self, RecordError> {
        avx_section(|| record_body(mesh, parameters, progress))
    }
}

fn record_body(
    mesh: Mesh,
    parameters: &RecordParameters,
    progress: &mut dyn Progress,
) -> Result<RecordedBody, RecordError> {
    check_parameters(&mesh, parameters)?;
    progress.begin("mesh, assembly, factor", 4);
    let mesh = mesh.checked()?;
    mesh.warnings.iter().for_each(|warning| progress.warn(warning));
    warn_about_locking(parameters, progress);
    let doubt = first_doubt(&mesh, &parameters.materials, progress);
    match parameters.order {
        ElementOrder::Quadratic => mesh.check_curved()?,
        ElementOrder::Linear => warn_about_straight_edges(&mesh, progress),
    }
    progress.advance(1);
    let discretisation = Discretisation::new(&mesh, parameters.order);
    let carriers = Carriers::new(&discretisation, parameters.surface.as_ref())?;
    check_memory(needed_bytes(discretisation.dofs() as f64, parameters.modes as f64))?;
    let mut assembly = Assembly::new(&discretisation, &parameters.materials);
    let supported =
        supports::apply(&parameters.fixed_nodes, &parameters.supports, &discretisation, &mut assembly)?;
    let fixed = supported.fixed.chunks_exact(3).filter(|axes| axes.iter().all(|fixed| *fixed)).count();
    let share = fixed as f64 / discretisation.nodes.len() as f64;
    if share > MANY_FIXED {
        progress.warn(&format!(
            "{:.0} % of the nodes are fixed; conditions are in metres of the mesh",
            100.0 * share
        ));
    }
    progress.advance(1);
    let system = System::new(discretisation, assembly, supported)?;
    progress.advance(2);

    let no_modes = parameters.extent == RecordExtent::NoModes;
    let count = if no_modes { 0 } else { parameters.modes.min(system.elastic_modes()) };
    if count < parameters.modes && !no_modes {
        progress.warn(&format!(
            "{} modes are requested, the model has {count} elastic modes: all of them are kept",
            parameters.modes
        ));
    }
    let mut modes =
        if no_modes { ElasticModes::none(&system) } else { lowest_modes(&system, count, progress)? };
    let centre = DVec3::from_array(system.mass.center_of_mass_m);
    let surface = carriers.surface_about(centre);
    let residual = residual_compliance(
        &system,
        &modes,
        &carriers.nodes,
        carriers.mean_edge,
        if no_modes { ResidualChoice::None } else { parameters.residual },
        parameters.precision,
        progress,
    )?;
    warn_about_damping(parameters.damping, &modes, progress);
    if parameters.precision == Precision::Compact {
        // After the residual compliance: as the difference of rounded numbers it would be indefinite where it is small.
        modes.round_at(&carriers.nodes);
    }
    let (mut sample_levels, mut stated) = (Vec::new(), None);
    if parameters.extent == RecordExtent::Full {
        progress.begin("contact samples", 2);
        sample_levels = surface.sample_levels(MIN_CONTACT_SAMPLES);
        progress.advance(1);
        let level_errors = sample_levels.iter().map(|level| CertificateLevel::new(&surface, level)).collect();
        progress.advance(1);
        let certificate =
            certificate(&system, &modes, &surface, &carriers, &residual, parameters.damping, progress)
                .map_err(certificate_error)?;
        warn_about_certificate(&certificate, doubt, progress);
        stated = Some(Certificate { sample_levels: level_errors, ..certificate });
    }

    let free = system.supported_nodes == 0;
    let metadata = Metadata {
        format_version: format_version(parameters.precision, carriers.embedding.is_some()),
        hold: Metadata::hold(),
        units: Metadata::units(),
        support: if free { Support::Free } else { Support::Fixed },
        materials: parameters.materials.clone(),
        damping: parameters.damping,
        mesh: MeshCounts {
            nodes: system.discretisation.nodes.len() as u64,
            elements: mesh.tets.len() as u64,
            order: if parameters.order == ElementOrder::Linear { 1 } else { 2 },
            fixed_nodes: system.supported_nodes as u64,
        },
        mass: system.mass.clone(),
        certificate: stated,
        provenance: Provenance {
            source: parameters.source.clone(),
            mesh_hash: mesh_hash(&mesh),
            palpate_version: env!("CARGO_PKG_VERSION").into(),
        },
    };
    let mut recording = Recording {
        metadata,
        surface,
        modes: modal_basis(&modes, &carriers.nodes, parameters.damping),
        residual,
        gravity: (!free).then(|| gravity_response(&system, &modes, &carriers.nodes)),
        sample_levels,
        embedding: None,
    };
    if let Some(embedding) = carriers.embedding {
        recording.embed(embedding)?;
    }
    Ok(RecordedBody { recording, system, modes })
}

pub(crate) fn check_parameters(mesh: &Mesh, parameters: &RecordParameters) -> Result<(), RecordError> {
    parameters.materials.iter().try_for_each(material::check)?;
    let (materials, regions) = (parameters.materials.len(), mesh.regions.len());
    if materials != regions {
        return Err(RecordError::MaterialCount { materials, regions });
    }
    if parameters.modes == 0 {
        return Err(RecordError::NoModes);
    }
    if let ResidualChoice::NearField(radius) = parameters.residual
        && !(radius.is_finite() && radius > 0.0)
    {
        return Err(RecordError::ResidualRadius { radius });
    }
    match parameters.damping {
        Damping::Rayleigh { alpha, beta }
            if !(alpha >= 0.0 && beta >= 0.0 && alpha.is_finite() && beta.is_finite()) =>
        {
            Err(RecordError::RayleighDamping { alpha, beta })
        }
        Damping::Ratio(ratio) if !(ratio >= 0.0 && ratio.is_finite()) => {
            Err(RecordError::DampingRatio { ratio })
        }
        _ => Ok(()),
    }
}

fn certificate_error(error: SolveError) -> RecordError {
    match error {
        SolveError::Interrupted => RecordError::Interrupted,
        error => RecordError::Certificate(error),
    }
}

/// Density [kg/m³] below which it looks as if given in g/cm³: the lightest foams have 10, osmium has 22.6 g/cm³.
const LOW_DENSITY_KG_M3: f64 = 10.0;

/// Rough estimate of the needed memory [bytes]: the factor grows with dofs^(4/3) (measured: 0.6 GB at 81 000 with
/// linear elements), the Krylov basis holds about four columns per mode, in three copies.
fn needed_bytes(dofs: f64, modes: f64) -> f64 {
    0.6e9 * (dofs / 81e3).powf(4.0 / 3.0) + 3.0 * 8.0 * dofs * (4.0 * modes).min(dofs)
}

/// Warn of modes that creep back in place of vibrating.
fn warn_about_damping(damping: Damping, modes: &ElasticModes, progress: &mut dyn Progress) {
    let Some(lowest) = modes.squares.first().map(|square| square.sqrt()) else { return };
    let ratio = damping.ratio(lowest);
    if ratio > 1.0 {
        let hint = match damping {
            Damping::Ratio(ratio) => format!("give {} for {ratio} %", ratio / 100.0),
            Damping::Rayleigh { .. } => "Rayleigh's α is in 1/s and comes first, β is in s".to_string(),
        };
        progress.warn(&format!(
            "the damping ratio of the lowest mode is {ratio:.3}: above 1 the body creeps back in place of vibrating; {hint}"
        ));
    }
}

fn warn_about_locking(parameters: &RecordParameters, progress: &mut dyn Progress) {
    let largest = parameters.materials.iter().map(|m| m.poisson).fold(0.0, f64::max);
    if parameters.order == ElementOrder::Linear && largest > 0.45 {
        progress.warn(&format!(
            "linear elements lock at Poisson's ratio {largest}: frequencies come out some per cent too high; \
             --order 2 avoids it"
        ));
    }
    if largest > 0.4999 {
        progress.warn(&format!(
            "Poisson's ratio {largest} is so near to 0.5 that even quadratic elements lock; 0.49 is usual for rubber"
        ));
    }
}

/// Advice that comes before that of the certificate: about the size of the body, or Young's modulus, where even the stiffest material sags by more
/// than the body's size, of which it warns.
fn first_doubt(mesh: &Mesh, materials: &[Material], progress: &mut dyn Progress) -> Option<&'static str> {
    if mesh.unit_question(1.0).is_some() {
        return Some("see to the unit of the mesh first");
    }
    if let Some(lightest) = materials.iter().find(|material| material.density_kg_m3 < LOW_DENSITY_KG_M3) {
        progress.warn(&format!(
            "the density is {} kg/m³, little more than that of air: the unit is kg/m³, as for foam 30, water 1000 and steel 7850; give \
             1000 times as much for g/cm³",
            lightest.density_kg_m3
        ));
    }
    let used = || mesh.tets.iter().flatten().map(|&node| mesh.nodes[node as usize]);
    let size = (used().reduce(DVec3::max)? - used().reduce(DVec3::min)?).max_element();
    let stiffest = materials.iter().max_by(|a, b| a.young_pa.total_cmp(&b.young_pa))?;
    let sag = stiffest.sag(size);
    if sag <= 1.0 {
        return None;
    }
    let range = |name: &str| {
        let [low, high] = library_material(name).map(|own| own.young_range_pa).unwrap_or_default();
        format!("{name} {low} to {high}")
    };
    progress.warn(&format!(
        "Young's modulus is {} Pa, and the density {} kg/m³: under its own weight the body, {size:.3} m large, would sag by {sag:.1} times its size. The unit is \
         Pa, as for {}, {} and {}; give 1000 times as much for kPa",
        stiffest.young_pa,
        stiffest.density_kg_m3,
        range("fat"),
        range("liver"),
        range("rubber")
    ));
    Some("see to Young's modulus first")
}

fn warn_about_straight_edges(mesh: &Mesh, progress: &mut dyn Progress) {
    if !mesh.is_curved() {
        return;
    }
    let mut straight = mesh.clone();
    straight.straighten();
    let volume = |mesh: &Mesh| mesh.tets.iter().map(|tet| mesh.quadratic_volume(tet)).sum::<f64>();
    let change = 100.0 * (volume(&straight) / volume(mesh) - 1.0);
    progress.warn(&format!(
        "linear elements have straight edges: the volume is off by {change:.1} % of that with the mesh's mid-edge nodes, which --order 2 uses"
    ));
}

fn warn_about_certificate(certificate: &Certificate, doubt: Option<&str>, progress: &mut dyn Progress) {
    let advice = doubt.unwrap_or("keep the residual compliance and more modes");
    let error = certificate.force_error_max;
    let worst_at = DVec3::from_array(certificate.worst_at_m);
    if error > FORCE_ERROR_UNUSABLE {
        progress.warn(&format!(
            "the force of this recording is worth nothing near ({:.4}, {:.4}, {:.4}) m from its centre of mass (see the \
             certificate): {advice}",
            worst_at.x, worst_at.y, worst_at.z
        ));
    } else if error > Certificate::FORCE_ERROR_WARNING {
        progress.warn(&format!(
            "even in a smooth press at one place the force of this recording is off by up to {:.0} % (see the \
             certificate): {advice}",
            100.0 * error
        ));
    }
}

/// Version of the file's layout.
fn format_version(precision: Precision, is_embedded: bool) -> u32 {
    let [full, compact] =
        if is_embedded { EMBEDDED_FORMAT_VERSIONS } else { [FORMAT_VERSION, COMPACT_FORMAT_VERSION] };
    match precision {
        Precision::Full => full,
        Precision::Compact => compact,
    }
}

/// Modes at the nodes that carry the surface.
fn modal_basis(modes: &ElasticModes, carriers: &[u32], damping: Damping) -> ModalBasis {
    let angular_frequencies: Vec<f64> = modes.squares.iter().map(|square| square.sqrt()).collect();
    let rows = carriers.iter().flat_map(|&node| (0..3).map(move |axis| 3 * node as usize + axis));
    let mode_shapes = rows.flat_map(|row| (0..modes.squares.len()).map(move |i| (row, i)));
    ModalBasis {
        damping_ratios: angular_frequencies.iter().map(|&omega| damping.ratio(omega)).collect(),
        angular_frequencies,
        mode_shapes: mode_shapes.map(|at| modes.shapes[at]).collect(),
    }
}

/// BLAKE3 hash of nodes, but those in the middle of straight edges, of tetrahedra and regions, in hexadecimal.
fn mesh_hash(mesh: &Mesh) -> String {
    let mut hasher = blake3::Hasher::new();
    let is_straight = mesh.straight_mid_edge_nodes();
    let nodes = mesh.nodes.iter().zip(is_straight).filter(|(_, is_straight)| !is_straight);
    nodes.flat_map(|(p, _)| p.to_array()).for_each(|v| {
        hasher.update(&v.to_le_bytes());
    });
    mesh.tets.iter().flatten().chain(&mesh.tet_regions).for_each(|v| {
        hasher.update(&v.to_le_bytes());
    });
    hasher.finalize().to_hex().to_string()
}
