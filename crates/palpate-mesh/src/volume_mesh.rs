//! A tetrahedral mesh as a file gives it: nodes, tetrahedra, regions and named groups.

use super::error::MeshError;
use glam::DVec3;
use std::collections::BTreeMap;

/// A mesh of tetrahedra, with straight edges or with nodes on them.
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
    /// Nodes on edges, ascending by edge, for elements of order 2: edges without one are straight.
    pub mid_edge_nodes: Vec<MidEdgeNode>,
    /// Other nodes of elements of higher order that are no corners, ascending: they keep their numbers and are not used.
    pub mid_side_nodes: Vec<u32>,
    /// Whether the user was asked about the unit, so that [`Mesh::checked`] asks no more.
    pub is_unit_asked: bool,
    /// Warnings of the reader and of [`Mesh::checked`] for the user, a sentence each.
    pub warnings: Vec<String>,
}

/// Node on an edge between two corners.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct MidEdgeNode {
    /// Corners at the ends of the edge, ascending.
    pub ends: [u32; 2],
    /// Number of the node.
    pub node: u32,
}

/// A part of the body with one material: a Gmsh physical volume, a VTK cell label, a Vega region, an Abaqus section.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Region {
    /// Number in the file.
    pub tag: i64,
    /// Name in the file, if it has one.
    pub name: Option<String>,
    /// Material in the file, if it has one.
    pub material: Option<RegionMaterial>,
}

/// Isotropic elastic material that a mesh file gives to a region.
#[derive(Debug, Clone, PartialEq)]
pub struct RegionMaterial {
    /// Name in the file.
    pub name: String,
    /// Young's modulus E [Pa].
    pub young_pa: f64,
    /// Poisson's ratio ν.
    pub poisson: f64,
    /// Density ρ [kg/m³].
    pub density_kg_m3: f64,
}

/// A volume mesh file: what it held, and the mesh of it.
#[derive(Debug, Clone, PartialEq)]
pub struct VolumeFile {
    /// Format, version and encoding, as in "Gmsh 4.1, binary".
    pub format: String,
    /// Number of elements by the plural of their shape.
    pub elements: BTreeMap<&'static str, usize>,
    /// Mesh of the solid elements.
    pub mesh: Mesh,
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
        scale_points(&mut self.nodes, factor)
    }
}

/// Multiplies coordinates by a positive factor.
pub(crate) fn scale_points(points: &mut [DVec3], factor: f64) -> Result<(), MeshError> {
    if !(factor.is_finite() && factor > 0.0) {
        return Err(MeshError::Scale { factor });
    }
    points.iter_mut().for_each(|point| *point *= factor);
    Ok(())
}
