//! Tetrahedral meshes: readers, primitives, the check; triangle meshes for rigid obstacles.

mod check;
mod coincident;
mod error;
mod faces;
mod gmsh;
mod obj;
mod primitives;
mod scan;
mod stl;
mod surface_mesh;
mod volume_mesh;
mod vtk;

pub use error::{FilePosition, MeshError};
pub use gmsh::read_gmsh;
pub use obj::read_obj;
pub use primitives::{ball_mesh, box_mesh};
pub use stl::read_stl;
pub use surface_mesh::SurfaceMesh;
pub use volume_mesh::{Mesh, NodeGroup, Region};
pub use vtk::read_vtk;
