//! Recording: responses, surface, mass and certificate of one body, computed offline for the runtime.

mod column;
mod embedding;
mod file;
mod impulse_response;
mod metadata;
mod quantised;
mod rescale;
mod residual;
mod sample_levels;
mod validation;

pub use column::{Column, ResponseSeries, arrange_column};
pub use embedding::Embedding;
pub use file::{COMPACT_FORMAT_VERSION, EMBEDDED_FORMAT_VERSIONS, FORMAT_VERSION};
pub use impulse_response::{ColumnsInMemory, ImpulseColumns, ImpulseResponse, Sampling};
pub use metadata::{
    Certificate, CertificateEvent, CertificateLevel, Damping, MassProperties, Material, MeshCounts, Metadata,
    PeakForceError, Provenance, Support,
};
pub use quantised::{MAX_QUANTISED_NODES, QuantisedCompliance, round_mode_shape};
pub(crate) use residual::block_at;
pub use residual::{NearField, ResidualCompliance};

use crate::surface::{SampleLevel, Surface};
use alloc::vec::Vec;
use glam::{DMat3, DVec3};

/// Responses of one elastic body, in modal form with residual compliance:
/// u = Φ·q + S·f on the surface, q by the exact recursion of each mode.
#[derive(Debug, Clone, PartialEq)]
pub struct Recording {
    /// Units, conventions, material, mass, certificate and origin.
    pub metadata: Metadata,
    /// Free surface at rest.
    pub surface: Surface,
    /// Kept elastic modes.
    pub modes: ModalBasis,
    /// Static compliance of the modes that are not kept.
    pub residual: ResidualCompliance,
    /// Sag of a body with fixed nodes under its weight; none for a free body.
    pub gravity: Option<GravityResponse>,
    /// Levels of contact samples, finest first; empty: a model makes them.
    pub sample_levels: Vec<SampleLevel>,
    /// Embedding of the surface in the finite elements; none where the surface is their boundary. The residual compliance is then that between
    /// the nodes of the model.
    pub embedding: Option<Embedding>,
}

/// Elastic modes, orthonormal in the mass matrix: ΦᵀMΦ = I.
#[derive(Debug, Clone, PartialEq)]
pub struct ModalBasis {
    /// Angular frequencies ω [rad/s], ascending and positive; length m.
    pub angular_frequencies: Vec<f64>,
    /// Damping ratios ζ [1], not negative; length m.
    pub damping_ratios: Vec<f64>,
    /// Mode shapes Φ at the surface nodes [1/√kg], row by row: (3·node + axis)·m + mode.
    pub mode_shapes: Vec<f64>,
}

/// Response of a body with fixed nodes to a uniform acceleration field, per axis of the body.
#[derive(Debug, Clone, PartialEq)]
pub struct GravityResponse {
    /// Modal force per unit acceleration [√kg]: axis·m + mode.
    pub modal_forces: Vec<f64>,
    /// Static displacement beyond the modes, per unit acceleration [s²]:
    /// (3·node + axis of displacement)·3 + axis of acceleration.
    pub residual_displacements: Vec<f64>,
}

impl ModalBasis {
    /// Number of modes, m.
    pub fn len(&self) -> usize {
        self.angular_frequencies.len()
    }

    /// Whether no mode is kept.
    pub fn is_empty(&self) -> bool {
        self.angular_frequencies.is_empty()
    }

    /// Row of Φ at a surface node and axis: m numbers [1/√kg].
    pub fn row(&self, node: usize, axis: usize) -> &[f64] {
        let m = self.len();
        &self.mode_shapes[(3 * node + axis) * m..][..m]
    }
}

impl GravityResponse {
    /// Displacement of a node beyond the modes [m], under an acceleration [m/s²].
    pub fn residual_displacement(&self, node: usize, acceleration: DVec3) -> DVec3 {
        sag_at(&self.residual_displacements, node, acceleration)
    }
}

/// Displacement of a node under an acceleration, by its three rows.
fn sag_at(displacements: &[f64], node: usize, acceleration: DVec3) -> DVec3 {
    let row = |axis: usize| DVec3::from_slice(&displacements[(3 * node + axis) * 3..]);
    DVec3::new(row(0).dot(acceleration), row(1).dot(acceleration), row(2).dot(acceleration))
}

/// Upper limit of sizes [SI units], and inverse of the lower limit, so that a step cannot overflow.
const LARGEST: f64 = 1e18;

/// Sum of barycentric weights of movable nodes [1] below which a point counts as fixed. Compliance falls with its square: 10⁻⁶ of a
/// free point's, at a thousandth of an edge.
const MIN_MOVABLE_WEIGHT: f64 = 1e-3;

/// Barycentric weight [1] up to which a corner counts as round-off: of places that are given with six digits.
const ROUND_OFF_WEIGHT: f64 = 1e-6;

/// Whether a corner carries more weight than round-off.
pub(crate) fn has_weight(&(_, weight): &(usize, f64)) -> bool {
    weight > ROUND_OFF_WEIGHT
}

/// Whether corners with barycentric weights can move: those of nodes that move carry more than a thousandth.
fn carry_movable_weight(corners: [(usize, f64); 3], moves: impl Fn(usize) -> bool) -> bool {
    let movable: f64 = corners.into_iter().filter(|&(node, _)| moves(node)).map(|(_, weight)| weight).sum();
    movable > MIN_MOVABLE_WEIGHT
}

impl Recording {
    /// Add the modal forces of a gravity [m/s², body] on a body with fixed nodes [N/√kg]; a free body has none.
    pub(crate) fn add_gravity_load(&self, gravity: DVec3, forces: &mut [f64]) {
        let Some(response) = &self.gravity else { return };
        for (axis, a) in gravity.to_array().into_iter().enumerate() {
            for (force, load) in forces.iter_mut().zip(&response.modal_forces[axis * self.modes.len()..]) {
                *force += a * load;
            }
        }
    }

    /// Whether a surface point can move along every axis: its corners are not all nodes that are fixed or held along an axis, but for a
    /// thousandth of their weight.
    ///
    /// # Real time
    pub fn is_movable(&self, point: &crate::surface::SurfacePoint) -> bool {
        let moves = |node: usize| {
            (0..3).all(|axis| {
                self.modes.row(node, axis).iter().any(|phi| *phi != 0.0)
                    || self.residual_between(node, node).col(axis)[axis] != 0.0
            })
        };
        carry_movable_weight(self.surface.corners(point), moves)
    }

    /// Relaxation time of the residual compliance [s], see [`Damping::residual_relaxation_s`].
    pub fn residual_relaxation_s(&self) -> f64 {
        let highest = self.modes.angular_frequencies.last();
        highest.map_or(0.0, |highest| self.metadata.damping.residual_relaxation_s(*highest))
    }

    /// Order of the faces that the triangles of the surface are of: 1 where they are plane.
    pub(crate) fn surface_order(&self) -> u32 {
        if self.embedding.is_some() { 1 } else { self.metadata.mesh.order }
    }

    /// Mass [kg] of the body.
    pub fn mass(&self) -> f64 {
        self.metadata.mass.mass_kg
    }

    /// Inertia [kg·m²] about the centre of mass, in body axes.
    pub fn inertia(&self) -> DMat3 {
        DMat3::from_cols_array_2d(&self.metadata.mass.inertia_kg_m2)
    }
}
