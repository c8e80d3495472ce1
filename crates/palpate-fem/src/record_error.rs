//! Errors of a recording.

use crate::material::MaterialError;
#[cfg(doc)]
use crate::progress::Progress;
use crate::solve_error::SolveError;
use glam::DVec3;
use palpate_mesh::MeshError;

/// A recording that cannot be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordError {
    /// The mesh is not one sound body.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A material is out of range.
    #[error(transparent)]
    Material(#[from] MaterialError),
    /// The body cannot be factored, or its modes cannot be found.
    #[error(transparent)]
    Solve(SolveError),
    /// The reference of the certificate cannot be computed.
    #[error("certificate: {0}")]
    Certificate(SolveError),
    /// The number of materials is not that of the mesh's regions.
    #[error("{materials} materials for {regions} regions")]
    MaterialCount {
        /// Number of materials.
        materials: usize,
        /// Number of regions.
        regions: usize,
    },
    /// No mode is requested.
    #[error("0 modes are requested, expected 1 or more")]
    NoModes,
    /// The radius of the near field is not a positive number.
    #[error("residual radius is {radius} m, expected a positive number")]
    ResidualRadius {
        /// The given radius [m].
        radius: f64,
    },
    /// A coefficient of Rayleigh damping is negative or not finite.
    #[error("Rayleigh damping is {alpha} 1/s, {beta} s, expected two numbers that are not negative")]
    RayleighDamping {
        /// Coefficient of the mass matrix [1/s].
        alpha: f64,
        /// Coefficient of the stiffness matrix [s].
        beta: f64,
    },
    /// The damping ratio is negative or not finite.
    #[error("damping ratio is {ratio}, expected a number that is not negative")]
    DampingRatio {
        /// The given ratio.
        ratio: f64,
    },
    /// The nodes to fix belong to no tetrahedron.
    #[error("the nodes to fix belong to no tetrahedron")]
    FixedNodesUnused,
    /// All nodes are fixed.
    #[error("all nodes are fixed: nothing can move")]
    AllNodesFixed,
    /// The stiffness of springs is not a positive number.
    #[error("spring stiffness is {stiffness} N/m³, expected a positive number")]
    SpringStiffness {
        /// The given stiffness [N/m³].
        stiffness: f64,
    },
    /// The nodes on springs hold no whole boundary face.
    #[error(
        "the nodes on springs hold no whole face of the surface, and springs act on areas: select more nodes"
    )]
    SpringsWithoutFace,
    /// A node of the embedded surface is too far from the elements to move with them.
    #[error(
        "node {node} of the embedded surface, at ({:.4}, {:.4}, {:.4}) m, is {distance:.4} m outside of the tetrahedra, farther than the nearest of \
         them is large: take smaller cells, or a surface of the same body in the same unit", position.x, position.y, position.z
    )]
    SurfaceOutside {
        /// Node of the surface.
        node: usize,
        /// Its position [m].
        position: DVec3,
        /// Its distance from the nearest element [m].
        distance: f64,
    },
    /// The recording is too large for its form.
    #[error(transparent)]
    Recording(#[from] palpate::RecordingError),
    /// A target is not a positive number.
    #[error("the target of the {what} is {given}, expected a positive number")]
    Target {
        /// Number that is aimed at.
        what: &'static str,
        /// The given number.
        given: f64,
    },
    /// No number of modes keeps the target.
    #[error(
        "with {modes} modes the peak force error is {:.2} %, the bandwidth {bandwidth_hz:.1} Hz: more modes don't help; refine the \
         mesh, or ask for less", 100.0 * force_error
    )]
    TargetMissed {
        /// Number of modes of the last attempt.
        modes: u64,
        /// Its peak force error [1].
        force_error: f64,
        /// Its bandwidth [Hz].
        bandwidth_hz: f64,
    },
    /// The listener interrupted the work, see [`Progress::is_interrupted`].
    #[error("interrupted")]
    Interrupted,
}

impl From<SolveError> for RecordError {
    fn from(error: SolveError) -> Self {
        match error {
            SolveError::Interrupted => Self::Interrupted,
            error => Self::Solve(error),
        }
    }
}
