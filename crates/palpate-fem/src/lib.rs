//! Records elastic bodies by the finite element method: tetrahedral mesh in, [`palpate::Recording`] out.
//!
//! [`record`] checks the mesh, assembles stiffness and mass, computes the lowest elastic modes and the residual
//! compliance of the truncated ones, and measures a certificate of the force error. Small strain, linear isotropic
//! elasticity, linear or quadratic tetrahedra; SI units throughout.
//!
//! - [`mesh`]: readers (Gmsh, VTK; OBJ and STL surfaces), boxes and balls.
//! - [`RecordParameters`]: materials, element order, modes, damping, supports.
//! - [`table`]: impulse responses for direct convolution, from a [`RecordedBody`].
//! - [`paper_cube`]: the cube of the paper.
//! - [`reference`]: the unreduced finite element solution, for verification.
#![doc = "\n"]
#![doc = include_str!("../README.md")]

mod assembly;
mod body;
mod certificate;
mod discretisation;
mod element;
mod factor;
mod kernels;
mod krylov;
mod material;
mod memory;
pub mod mesh;
mod modes;
pub mod paper_cube;
mod progress;
mod record;
mod record_error;
pub mod reference;
mod regular_file;
mod residual;
mod solve_error;
mod system;
pub mod table;
mod transient;

pub use body::RecordedBody;
pub use certificate::FORCE_ERROR_WARNING;
pub use element::ElementOrder;
pub use material::{MaterialError, materials_from_toml};
pub use memory::check_memory;
pub use progress::{Progress, SilentProgress};
pub use record::{RecordExtent, RecordParameters, record};
pub use record_error::RecordError;
pub use regular_file::{open_regular_file, read_regular_file, read_regular_text};
pub use residual::ResidualChoice;
pub use solve_error::SolveError;
