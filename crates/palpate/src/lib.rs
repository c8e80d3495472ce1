//! Contact forces from elastic objects that are free to move.
//!
//! A [`Recording`] holds the impulse responses of one elastic body, made once from a mesh.
//! A [`Model`] puts recordings into a scene, a [`State`] moves through time by [`step`]:
//!
//! ```text
//! step(&Model, &mut State, &Input) -> &Output
//! ```
//!
//! Each step takes device positions and gives forces. Its cost grows with the modes and the
//! contacts, never with the mesh. It allocates nothing, takes no lock and makes no system call.
//!
//! # Conventions
//!
//! - SI units. Frames stand in names: `world_from_body` maps body to world coordinates.
//! - The body frame has its origin at the centre of mass and the axes of the mesh file.
//! - A force with index t is **held constant** over step t, and the displacement with index t is
//!   the one at the **end** of that step. Elastic and rigid motion are sampled exactly for such
//!   a force, so force times displacement is exactly the work done at a device.
//! - The motion is split into the rigid motion of a frame at the centre of mass and the elastic
//!   displacement in that frame, orthogonal to the rigid modes (paper, section 2.1).
//!
//! "The paper" is *A Study on Haptic Interaction and Simulation of Motion and Deformation of
//! Elastic Object*; its equation numbers are given where they are used.
#![no_std]
extern crate alloc;

mod collision;
mod contact;
mod device;
mod energy;
mod error;
mod io;
mod motion;
mod object;
mod obstacle;
mod recording;
mod response;
mod scene;
mod snapshot;
mod spatial;
mod state;
mod step;
mod surface;

pub use collision::{Collider, Grasp};
pub use device::{Coupling, DeviceParameters};
pub use energy::EnergyLedger;
pub use error::Error;
pub use io::{ContactOutput, DeviceInput, DeviceMode, DeviceOutput, Input, ObjectOutput, Output, StepStatus};
pub use motion::RigidIntegrator;
pub use object::ObjectStart;
pub use obstacle::{Obstacle, ObstacleMesh, Shape};
pub use recording::{
    Certificate, CertificateEvent, Column, ColumnsInMemory, Damping, FORMAT_VERSION, GravityResponse,
    ImpulseColumns, ImpulseResponse, MassProperties, Material, MeshCounts, Metadata, ModalBasis, NearField,
    Provenance, Recording, ResidualCompliance, Sampling, Support,
};
pub use response::{OscillatorState, ResponseForm, SampledOscillator};
pub use scene::{Model, ModelObject, ModelParameters, RigidCompliance};
pub use snapshot::{DeformationSnapshot, ResidualFieldCache};
pub use spatial::{Pose, Twist, cayley, inertia_in_world};
pub use state::{ObjectSnapshot, State};
pub use step::step;
pub use surface::{Surface, SurfacePoint};
