//! A tetrahedral mesh as a file gives it: nodes, tetrahedra, regions and named groups.

use super::error::MeshError;
use glam::DVec3;

/// A mesh of linear tetrahedra.
///
/// Node numbers are positions in [`Mesh::nodes`], in the order of the input file. Everything that is derived from
/// the mesh refers to these numbers.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// Node positions [m], in the file's frame.
    pub nodes: Vec<DVec3>,
    /// Four corner nodes per tetrahedron.
    pub tets: Vec<[u32; 4]>,
    /// Index in [`Mesh::regions`] of each tetrahedron's region.
    pub tet_regions: Vec<u32>,
    /// Regions of the body; materials are given per region.
    pub regions: Vec<Region>,
    /// Named sets of nodes, for instance to fix them.
    pub groups: Vec<NodeGroup>,
    /// Warnings of the reader and of [`Mesh::checked`] for the user, a sentence each.
    pub warnings: Vec<String>,
}

/// A part of the body with one material: a Gmsh physical volume or a VTK cell label.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Region {
    /// Number in the file.
    pub tag: i64,
    /// Name in the file, if it has one.
    pub name: Option<String>,
}

/// A named set of nodes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct NodeGroup {
    /// Name in the file; its number as text if it has no name.
    pub name: String,
    /// Node numbers, ascending, without repeats.
    pub nodes: Vec<u32>,
}

impl Region {
    /// Name of the region, or its number as text if it has no name.
    pub fn label(&self) -> String {
        self.name.clone().unwrap_or_else(|| self.tag.to_string())
    }
}

impl Mesh {
    /// Multiplies all coordinates by a factor, for instance 0.001 for a file in millimetres.
    ///
    /// # Errors
    /// [`MeshError::Scale`] unless the factor is a positive number.
    pub fn scale(&mut self, factor: f64) -> Result<(), MeshError> {
        if !(factor.is_finite() && factor > 0.0) {
            return Err(MeshError::Scale { factor });
        }
        self.nodes.iter_mut().for_each(|node| *node *= factor);
        Ok(())
    }
}
