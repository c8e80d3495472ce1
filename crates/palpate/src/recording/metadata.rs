//! Metadata of a recording; stored as JSON in the file.

use super::LARGEST;
use crate::error::{RecordingError, RecordingPart};
use crate::surface::{SampleLevel, Surface};
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use serde::{Deserialize, Serialize};

/// Description of a recording.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Metadata {
    /// Version of the file's layout, [`crate::FORMAT_VERSION`] when written.
    pub format_version: u32,
    /// Sampling of force and displacement: always `held force, displacement at end of step`.
    pub hold: String,
    /// Unit system: always `SI`.
    pub units: String,
    /// Whether the body is free to move or held by fixed nodes.
    pub support: Support,
    /// Materials, one per region.
    pub materials: Vec<Material>,
    /// Damping law of the elastic modes.
    pub damping: Damping,
    /// Size of the finite element model.
    pub mesh: MeshCounts,
    /// Mass, centre and inertia.
    pub mass: MassProperties,
    /// Error against the unreduced finite element model; absent if not measured.
    pub certificate: Option<Certificate>,
    /// Origin of the recording.
    pub provenance: Provenance,
}

/// Sampling of this format version.
const HOLD: &str = "held force, displacement at end of step";

/// Units of this format version.
const UNITS: &str = "SI";

impl Metadata {
    /// Value of [`Self::hold`].
    pub fn hold() -> String {
        HOLD.into()
    }

    /// Value of [`Self::units`].
    pub fn units() -> String {
        UNITS.into()
    }

    pub(super) fn validate(&self) -> Result<(), RecordingError> {
        let fail = |what| Err(RecordingError::Inconsistent { part: RecordingPart::Metadata, what });
        if self.hold != HOLD || self.units != UNITS {
            return fail(format!(
                "it is sampled as {:?} in units {:?}, expected {HOLD:?} in {UNITS:?}",
                self.hold, self.units
            ));
        }
        let range = |name: &str, value: f64, low: f64, high: f64| {
            if (low..high).contains(&value) {
                return Ok(());
            }
            fail(format!("{name} is {value:e}, expected a number from {low:e} to below {high:e}"))
        };
        for material in &self.materials {
            let Material { region, young_pa, poisson, density_kg_m3, stiffness_pa } = material;
            let name = |key: &str| format!("materials.{key} of the region {region:?}");
            range(&name("young_pa"), *young_pa, f64::MIN_POSITIVE, LARGEST)?;
            range(&name("poisson"), *poisson, -1.0, 0.5)?;
            range(&name("density_kg_m3"), *density_kg_m3, f64::MIN_POSITIVE, LARGEST)?;
            for entry in stiffness_pa.iter().flatten().flatten() {
                range(&name("stiffness_pa"), *entry, -LARGEST, LARGEST)?;
            }
        }
        match self.damping {
            Damping::Rayleigh { alpha, beta } => {
                range("damping.alpha", alpha, 0.0, LARGEST)?;
                range("damping.beta", beta, 0.0, LARGEST)?;
            }
            Damping::Ratio(zeta) => range("damping.ratio", zeta, 0.0, LARGEST)?,
        }
        if !(1..=2).contains(&self.mesh.order) {
            return fail(format!("mesh.order is {}, expected 1 or 2", self.mesh.order));
        }
        if (self.mesh.fixed_nodes > 0) != (self.support == Support::Fixed) {
            let (fixed, support) = (self.mesh.fixed_nodes, self.support);
            return fail(format!(
                "mesh.fixed_nodes is {fixed} with the support {support:?}, which contradict"
            ));
        }
        match self.certificate.as_ref().and_then(Certificate::outlier) {
            Some((name, value)) => {
                fail(format!("certificate.{name} is {value:e}, expected a number below {LARGEST:e}"))
            }
            None => Ok(()),
        }
    }
}

impl Certificate {
    /// First number that is no number, or beyond all sizes, with its name.
    fn outlier(&self) -> Option<(&'static str, f64)> {
        let peaks = self.peak_force_error_max.iter().flat_map(|peak| [peak.held, peak.touched]).flatten();
        let levels = self.sample_levels.iter().flat_map(|level| [level.spacing_m, level.distance_or_zero()]);
        let CertificateEvent { step_s, rise_s, duration_s } = self.event;
        [
            ("force_error_max", self.force_error_max),
            ("force_error_median", self.force_error_median),
            ("static_compliance_error_max", self.static_compliance_error_max),
            ("instantaneous_compliance_error_max", self.instantaneous_compliance_error_max),
            ("bandwidth_hz", self.bandwidth_hz),
            ("reference_error", self.reference_error),
            ("worst_patch_radius_m", self.worst_patch_radius_m),
            ("event.step_s", step_s),
            ("event.rise_s", rise_s),
            ("event.duration_s", duration_s),
        ]
        .into_iter()
        .chain(self.worst_at_m.map(|coordinate| ("worst_at_m", coordinate)))
        .chain(peaks.map(|error| ("peak_force_error_max", error)))
        .chain(levels.map(|length| ("sample_levels", length)))
        .find(|(_, number)| number.is_nan() || number.abs() >= LARGEST)
    }
}

/// Support of a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Support {
    /// Free in space: six rigid motions.
    Free,
    /// Some nodes are fixed; the body frame does not move.
    Fixed,
}

/// Linear elastic material.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Material {
    /// Region of the mesh; empty when there is one region.
    pub region: String,
    /// Young's modulus [Pa]; of an anisotropic material a mean.
    pub young_pa: f64,
    /// Poisson's ratio [1]; of an anisotropic material a mean.
    pub poisson: f64,
    /// Density [kg/m³].
    pub density_kg_m3: f64,
    /// Stiffness matrix [Pa] of an anisotropic material: stress by strain in the order xx, yy, zz, yz, xz, xy with engineering shear
    /// strains; none for an isotropic one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stiffness_pa: Option<[[f64; 6]; 6]>,
}

impl Material {
    /// Isotropic material of a body of one region: Young's modulus [Pa], Poisson's ratio, density [kg/m³].
    pub const fn isotropic(young_pa: f64, poisson: f64, density_kg_m3: f64) -> Self {
        Self { region: String::new(), young_pa, poisson, density_kg_m3, stiffness_pa: None }
    }

    /// Sag of a column of a height [m] under its own weight, ρ·g·L/2E, as a share of the height [1].
    pub fn sag(&self, height_m: f64) -> f64 {
        const EARTH_M_S2: f64 = 9.81;
        self.density_kg_m3 * EARTH_M_S2 * height_m / (2.0 * self.young_pa)
    }
}

/// Damping of the elastic modes. The rigid motion is not damped.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Damping {
    /// C = αM + βK: ζ = α/(2ω) + βω/2.
    Rayleigh {
        /// α [1/s].
        alpha: f64,
        /// β [s].
        beta: f64,
    },
    /// Equal ratio ζ [1] for every mode.
    Ratio(f64),
}

impl Damping {
    /// Damping ratio ζ [1] of a mode with angular frequency ω [rad/s].
    pub fn ratio(&self, angular_frequency: f64) -> f64 {
        match *self {
            Self::Rayleigh { alpha, beta } => {
                alpha / (2.0 * angular_frequency) + beta * angular_frequency / 2.0
            }
            Self::Ratio(zeta) => zeta,
        }
    }

    /// Relaxation time τ of truncated modes [s], above the highest angular frequency that is kept [rad/s]. They are stiff, so
    /// that their inertia counts little: u + τ·u̇ = S·f. β of Rayleigh damping, or 2ζ/ω; 0 without damping.
    pub fn residual_relaxation_s(&self, highest: f64) -> f64 {
        match *self {
            Self::Rayleigh { beta, .. } => beta,
            Self::Ratio(zeta) => 2.0 * zeta / highest,
        }
    }
}

/// Size of the finite element model.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct MeshCounts {
    /// Nodes, mid-edge nodes of quadratic elements included.
    pub nodes: u64,
    /// Tetrahedra.
    pub elements: u64,
    /// 1: linear, 2: quadratic.
    pub order: u32,
    /// Nodes that are fixed, held along an axis, or on springs.
    pub fixed_nodes: u64,
}

/// Mass properties, integrated with the consistent mass matrix.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MassProperties {
    /// Mass [kg].
    pub mass_kg: f64,
    /// Centre of mass [m], in the coordinates of the input mesh (after `--scale`).
    pub center_of_mass_m: [f64; 3],
    /// Inertia [kg·m²] about the centre of mass, in the axes of the input mesh.
    pub inertia_kg_m2: [[f64; 3]; 3],
}

/// Force-error certificate: the recording against the unreduced finite element model, measured
/// when it was made. All errors are relative, 0.01 is 1 %.
///
/// A measurement on samples, not a bound: hands that are faster than [`CertificateEvent`], jump, or strike have larger errors; they shrink
/// with more modes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Certificate {
    /// Largest error of the force when a sample is pressed in by a smooth ramp and held:
    /// √(Σ|f − f_fem|² / Σ|f_fem|²) over [`CertificateEvent::duration_s`].
    pub force_error_max: f64,
    /// Median over the samples of that error.
    pub force_error_median: f64,
    /// Peak error of the force during motion; none in recordings of palpate before 0.3.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub peak_force_error_max: Option<PeakForceError>,
    /// Largest error of the static compliance of a sample.
    pub static_compliance_error_max: f64,
    /// Largest error of R[0] of a sample, at [`CertificateEvent::step_s`].
    pub instantaneous_compliance_error_max: f64,
    /// Up to this frequency the dynamic compliance of every sample is within 5 % of its static size.
    pub bandwidth_hz: f64,
    /// Error estimate of the reference itself: its change when its last two spaces are left out.
    pub reference_error: f64,
    /// Number of samples: points and patches, three directions each.
    pub samples: u64,
    /// Number of kept modes, and of all modes of the finite element model.
    pub modes_of: [u64; 2],
    /// Motion of the force error's measurement.
    pub event: CertificateEvent,
    /// Position of the largest force error [m, body frame].
    pub worst_at_m: [f64; 3],
    /// Patch radius of the worst sample [m]; 0 for a point.
    pub worst_patch_radius_m: f64,
    /// Geometric error of each level of contact samples, finest first; empty for a recording that does not hold its levels.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sample_levels: Vec<CertificateLevel>,
}

impl Certificate {
    /// Relative force error from which a recording gets a warning: a smooth press is off by 5 %.
    pub const FORCE_ERROR_WARNING: f64 = 0.05;
}

/// Peak error of the force of hands that move one, two and three places of the body, which moves as a whole as well:
/// max|f − f_fem| / max|f_fem| over [`CertificateEvent::duration_s`], the largest over sets of places and directions. A hand moves by a
/// cubic ramp of [`CertificateEvent::rise_s`]; f_fem is the mean over each step.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct PeakForceError {
    /// Points that hands hold.
    pub held: [f64; 3],
    /// Patches as wide as a fingertip that hands touch from the start on. A hand that strikes has larger errors.
    pub touched: [f64; 3],
}

/// Geometric error of a level of contact samples.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CertificateLevel {
    /// Number of contact samples.
    pub samples: u64,
    /// Sample spacing [m].
    pub spacing_m: f64,
    /// Hausdorff distance between the surface and the decimated one at rest [m]; none without decimated surface.
    pub hausdorff_distance_m: Option<f64>,
}

impl CertificateLevel {
    /// Geometric error of a level of a surface.
    pub fn new(surface: &Surface, level: &SampleLevel) -> Self {
        Self {
            samples: level.nodes.len() as u64,
            spacing_m: level.spacing,
            hausdorff_distance_m: level.hausdorff_distance(surface),
        }
    }

    fn distance_or_zero(&self) -> f64 {
        self.hausdorff_distance_m.unwrap_or_default()
    }

    /// Whether it is the error of a level.
    pub(super) fn is_of(&self, level: &SampleLevel) -> bool {
        self.samples == level.nodes.len() as u64
            && self.spacing_m == level.spacing
            && self.hausdorff_distance_m.is_none() == level.triangles.is_empty()
    }
}

/// Press of the force error's measurement.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CertificateEvent {
    /// Step [s].
    pub step_s: f64,
    /// Rise time of the smooth ramp [s].
    pub rise_s: f64,
    /// Duration of the comparison [s].
    pub duration_s: f64,
}

/// Origin of a recording.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Provenance {
    /// Text of the primitive, or name of the mesh file without its folder.
    pub source: String,
    /// BLAKE3 of the mesh as computed (nodes, tetrahedra, regions), in hexadecimal.
    pub mesh_hash: String,
    /// Version of palpate that made the recording.
    pub palpate_version: String,
}
