//! Meshes for palpate: files of many formats, recognised by their content, checked and repaired; boxes and balls.
//!
//! - [`read_body`], [`read_surface`]: a file of any format; [`MeshFile::read`] from memory too.
//! - [`Mesh`]: tetrahedra with regions and groups; [`Mesh::checked`] holds it to be one sound body.
//! - [`SurfaceMesh`]: triangles; [`tetrahedralise`] fills them with tetrahedra.
//! - [`Mesh::to_vtk`], [`Mesh::to_gmsh`]: files for other programs.
//! - [`box_mesh`], [`split_box_mesh`], [`ball_mesh`], [`ArchedBar`], [`TuningFork`], [`Bell`], [`Liver`], [`Jelly`], [`Duck`]: generated meshes.
#![doc = "\n"]
#![doc = include_str!("../README.md")]
#![deny(missing_docs)]

mod abaqus;
mod check;
mod coincident;
mod elements;
mod error;
mod faces;
mod files;
mod format;
mod gltf;
mod gmsh;
mod instruments;
mod medit;
mod mesher;
mod mid_edge;
mod numbering;
mod obj;
mod off;
mod pieces;
mod ply;
mod primitives;
mod read;
mod regular_file;
mod repair;
mod report;
mod rows;
mod scan;
mod sets;
mod soft_bodies;
mod stl;
mod surface_mesh;
mod tetgen;
mod toy_duck;
mod vega;
mod volume_mesh;
mod vtk;
mod write;

pub use error::{FilePosition, MeshError};
pub use files::Files;
pub use format::{Format, Recognised, recognise};
pub use instruments::{ArchedBar, Bell, TuningFork};
pub use mesher::{MeshingParameters, MeshingReport, WatchFn, closed_surface, tetrahedralise};
pub use mid_edge::QuadraticTet;
pub use pieces::Piece;
pub use primitives::{CellSplit, ball_mesh, box_mesh, split_box_mesh};
pub use read::{MeshFile, read_body, read_surface};
pub use regular_file::{open_regular_file, read_regular_file, read_regular_text};
pub use repair::{MergeNodes, PieceChoice, Repair};
pub use report::{ANGLE_BIN_DEG, MeshReport, PieceReport, RegionReport, SurfaceReport, VolumeReport};
pub use soft_bodies::{Jelly, Liver};
pub use surface_mesh::{SurfaceFile, SurfaceMesh};
pub use toy_duck::Duck;
pub use volume_mesh::{Mesh, MidEdgeNode, NodeGroup, Region, RegionMaterial, VolumeFile};
