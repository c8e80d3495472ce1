//! Contact forces from elastic objects that are free to move.
//!
//! A [`Recording`] holds the impulse responses of one elastic body, computed once from a mesh.
//! A [`Model`] puts recordings into a scene, a [`State`] advances in time by [`step`]:
//!
//! ```text
//! step(&Model, &mut State, &Input) -> &Output
//! ```
//!
//! Each step takes device positions and gives forces. Its cost grows with the modes and the
//! contacts, never with the mesh. It allocates nothing, takes no lock and makes no system call.
//!
//! # Interface
//!
//! - **Scene.** [`Model`] of [`ModelParameters`] and [`ModelObject`]s with their [`ObjectStart`] and [`ResponseForm`];
//!   [`DeviceParameters`] with a [`Coupling`]; [`Obstacle`] with a [`Shape`] or an [`ObstacleMesh`]; [`RigidCompliance`] and
//!   [`RigidIntegrator`]; [`Pose`] and [`Twist`], with [`cayley`] and [`inertia_in_world`].
//! - **Step.** [`step`] takes [`Input`] ([`DeviceInput`], [`DeviceMode`], [`Grasp`]) and gives [`Output`]: [`DeviceOutput`],
//!   [`ObjectOutput`], [`ObstacleOutput`], [`ContactOutput`] against a [`Collider`], [`EnergyLedger`] and [`StepStatus`].
//! - **State.** [`State`] resumes from [`ObjectSnapshot`]s; a [`DeformationSnapshot`] gives surfaces to another thread, with a
//!   [`ResidualFieldCache`].
//! - **Surface.** [`Surface`] and [`SurfacePoint`]; [`SampleLevel`]s of contact samples, at least [`MIN_CONTACT_SAMPLES`].
//! - **Recording.** [`Recording`] of [`Metadata`], [`ModalBasis`], [`ResidualCompliance`] ([`NearField`]) and
//!   [`GravityResponse`]; file format [`FORMAT_VERSION`]. Metadata: [`Support`], [`Material`], [`Damping`], [`MeshCounts`],
//!   [`MassProperties`], [`Provenance`], and the [`Certificate`] of a [`CertificateEvent`] and of [`CertificateLevel`]s.
//! - **Table.** [`ImpulseResponse`] of the paper, with its [`Sampling`] and [`ImpulseColumns`] ([`Column`],
//!   [`ColumnsInMemory`]).
//! - **Modes.** [`SampledOscillator`] and [`OscillatorState`]; [`SampledResidual`].
//! - **Errors.** [`Error`] with the kinds of [`RecordingError`] ([`RecordingPart`]) and [`ModelError`].
//!
//! Vectors and rotations are those of [`glam`], in the version that is re-exported here.
//!
//! # Conventions
//!
//! - SI units. Names carry frames: `world_from_body` maps body to world coordinates.
//! - The body frame has its origin at the centre of mass and the axes of the mesh file.
//! - A force with index t is **held constant** over step t, and the displacement with index t is
//!   the one at the **end** of that step. Elastic and rigid motion are sampled exactly for such
//!   a force, so force times displacement is exactly the work done at a device.
//! - The motion is split into the rigid motion of a frame at the centre of mass and the elastic
//!   displacement in that frame, orthogonal to the rigid modes (paper, section 2.1).
//!
//! "The paper" is *A Study on Haptic Interaction and Simulation of Motion and Deformation of
//! Elastic Object*; the code cites its equation numbers.
#![no_std]
extern crate alloc;

/// Compiles the README's program.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

mod bounded_vec;
mod clamp;
mod collision;
mod contact;
mod device;
mod disjoint_sets;
mod dot_products;
mod energy;
mod error;
mod io;
mod motion;
mod object;
mod obstacle;
mod recording;
mod response;
mod scene;
mod sleep;
mod snapshot;
mod spatial;
mod state;
mod step;
mod surface;

pub use clamp::Clamp;
pub use collision::{Collider, Grasp};
pub use device::{Coupling, DeviceParameters};
pub use energy::EnergyLedger;
pub use error::{Error, ModelError, RecordingError, RecordingPart};
pub use glam;
pub use io::{
    AppliedForce, ClampOutput, ContactOutput, DeviceInput, DeviceMode, DeviceOutput, Input, ObjectOutput,
    ObstacleOutput, Output, StepStatus,
};
pub use motion::RigidIntegrator;
pub use object::{InitialDeformation, ObjectStart};
pub use obstacle::{Obstacle, ObstacleMesh, Shape};
pub use recording::{
    COMPACT_FORMAT_VERSION, Certificate, CertificateEvent, CertificateLevel, Column, ColumnsInMemory,
    Damping, EMBEDDED_FORMAT_VERSIONS, Embedding, FORMAT_VERSION, GravityResponse, ImpulseColumns,
    ImpulseResponse, MAX_QUANTISED_NODES, MassProperties, Material, MeshCounts, Metadata, ModalBasis,
    NearField, PeakForceError, Provenance, QuantisedCompliance, Recording, ResidualCompliance,
    ResponseSeries, Sampling, Support, arrange_column, round_mode_shape,
};
pub use response::{OscillatorState, ResponseForm, SampledOscillator, SampledResidual};
pub use scene::{Model, ModelObject, ModelParameters, RigidCompliance};
pub use snapshot::{DeformationSnapshot, ResidualFieldCache};
pub use spatial::{Pose, Twist, cayley, inertia_in_world};
pub use state::{ObjectSnapshot, State, Workspace};
pub use step::{step, step_in};
pub use surface::{MIN_CONTACT_SAMPLES, SampleLevel, Surface, SurfacePoint};
