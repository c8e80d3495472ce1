//! A tetrahedral mesh as it came in: nodes, tetrahedra, regions and named groups. Triangle meshes for what is rigid.

mod check;
mod error;
pub mod gmsh;
pub mod obj;
mod primitives;
mod scan;
pub mod stl;
mod surface_mesh;
pub mod vtk;

pub use check::{boundary, check, merge_nodes};
pub use error::MeshError;
pub use primitives::{ball_mesh, box_mesh};
pub use surface_mesh::SurfaceMesh;

use glam::DVec3;

/// A mesh of linear tetrahedra.
///
/// Node numbers are positions in [`Mesh::nodes`], in the order of the input file, and keep
/// that meaning in everything that is derived from the mesh.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Node positions [m], in the file's frame.
    pub nodes: Vec<DVec3>,
    /// Four corner nodes per tetrahedron.
    pub tets: Vec<[u32; 4]>,
    /// For each tetrahedron, the position of its region in [`Mesh::regions`].
    pub tet_regions: Vec<u32>,
    /// The regions that tetrahedra may belong to; materials are given per region.
    pub regions: Vec<Region>,
    /// Named sets of nodes, for `--fix NAME`.
    pub groups: Vec<NodeGroup>,
    /// Remarks of the reader that the user should see, a sentence each.
    pub remarks: Vec<String>,
}

/// A part of the body with one material: a Gmsh physical volume or a VTK cell label.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Region {
    /// The number that the file gives it.
    pub tag: i64,
    /// Its name, where the file has one.
    pub name: Option<String>,
}

/// A named set of nodes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NodeGroup {
    /// The group's name in the file; its number as text where it has no name.
    pub name: String,
    /// Node numbers, ascending, without repeats.
    pub nodes: Vec<u32>,
}

impl Mesh {
    /// Multiply all coordinates, to come from the file's unit to metres.
    ///
    /// # Errors
    /// When the factor is not a positive number.
    pub fn scale(&mut self, factor: f64) -> Result<(), MeshError> {
        if !(factor.is_finite() && factor > 0.0) {
            return Err(MeshError::Unusable(format!("scale is {factor}, expected a positive number")));
        }
        self.nodes.iter_mut().for_each(|node| *node *= factor);
        Ok(())
    }
}
