//! Records elastic bodies by the finite element method: tetrahedral mesh in, [`palpate::Recording`] out.
//!
//! [`record`] checks the mesh, assembles stiffness and mass, computes the lowest elastic modes and the residual
//! compliance of the truncated ones, and measures a certificate of the force error. Small strain, linear
//! elasticity, isotropic or not, linear or quadratic tetrahedra; SI units throughout.
//!
//! - [`palpate_mesh`]: readers of mesh files, boxes and balls.
//! - [`RecordParameters`]: materials, element order, modes, damping, supports.
//! - [`table`]: impulse responses for direct convolution, from a [`RecordedBody`].
//! - [`paper_cube`]: the cube of the paper.
//! - [`reference`]: the unreduced finite element solution, for verification.
#![doc = "\n"]
#![doc = include_str!("../README.md")]

mod assembly;
mod body;
mod carriers;
mod certificate;
mod discretisation;
mod element;
mod elimination_order;
mod error_target;
mod estimate;
mod factor;
mod kernels;
mod krylov;
mod material;
mod memory;
mod modes;
pub mod paper_cube;
mod progress;
mod quantise;
mod record;
mod record_error;
pub mod reference;
mod residual;
mod selected_inverse;
mod solve_error;
mod substitution;
mod supports;
mod system;
pub mod table;
mod transient;

pub use body::RecordedBody;
pub use element::ElementOrder;
pub use error_target::ErrorTarget;
pub use estimate::{Estimate, estimate};
pub use material::{
    ElasticLaw, LibraryMaterial, MATERIALS, MaterialError, Orthotropic, anisotropic, library_material,
    materials_from_toml, rotated_stiffness,
};
pub use memory::{available_memory, check_memory};
pub use progress::{Progress, SilentProgress};
pub use record::{RecordExtent, RecordParameters, record};
pub use record_error::RecordError;
pub use residual::{Precision, ResidualChoice};
pub use solve_error::SolveError;
pub use supports::{GroundSprings, HeldNodes, Supports};
