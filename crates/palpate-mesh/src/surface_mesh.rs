//! Triangle meshes, for rigid obstacles.

use super::coincident::{COINCIDENT, coincident_pairs};
use super::error::MeshError;
use super::volume_mesh::{Mesh, scale_points};
use glam::DVec3;

/// Triangle mesh of a surface.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SurfaceMesh {
    /// Node positions [m], in the file's frame.
    pub positions: Vec<DVec3>,
    /// Three nodes per triangle, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

/// A surface file.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceFile {
    /// Format and encoding, as in "STL, binary".
    pub format: String,
    /// Triangles as the file has them: those of STL files share no vertices before [`SurfaceMesh::weld`].
    pub mesh: SurfaceMesh,
}

impl SurfaceMesh {
    /// Boundary of a tetrahedral mesh, also of several pieces.
    ///
    /// # Errors
    /// [`MeshError`] when the mesh is not sound, see [`Mesh::checked`].
    pub fn from_boundary(mesh: Mesh) -> Result<Self, MeshError> {
        let mesh = mesh.check_pieces()?.mesh;
        let mut surface = Self { triangles: mesh.boundary(), positions: mesh.nodes };
        surface.remove_unused_nodes();
        Ok(surface)
    }

    /// Multiplies all coordinates by a factor, for instance 0.001 for a file in millimetres.
    ///
    /// # Errors
    /// [`MeshError::Scale`] unless the factor is a positive number.
    pub fn scale(&mut self, factor: f64) -> Result<(), MeshError> {
        scale_points(&mut self.positions, factor)
    }

    /// Merges nodes on one point and removes triangles without three distinct corners.
    pub fn weld(&mut self) {
        let finite = || self.positions.iter().copied().filter(|p| p.is_finite());
        let low = finite().reduce(DVec3::min).unwrap_or_default();
        let high = finite().reduce(DVec3::max).unwrap_or_default();
        let used = vec![true; self.positions.len()];
        let mut first: Vec<u32> = (0..self.positions.len() as u32).collect();
        for (a, b) in coincident_pairs(&self.positions, &used, COINCIDENT * (high - low).length()) {
            first[b as usize] = a;
        }
        for triangle in &mut self.triangles {
            *triangle = triangle.map(|node| first[node as usize]);
        }
        self.triangles.retain(|[a, b, c]| a != b && b != c && c != a);
        self.remove_unused_nodes();
    }

    /// Corners of the triangles [m].
    pub(crate) fn corners(&self) -> Vec<[DVec3; 3]> {
        self.triangles.iter().map(|triangle| triangle.map(|node| self.positions[node as usize])).collect()
    }

    /// Enclosed volume [m³] of a closed surface, negative when its triangles face inwards.
    pub fn volume(&self) -> f64 {
        // About a vertex, since far from the origin the sum would cancel.
        let base = self.positions.first().copied().unwrap_or_default();
        let of = |corners: [DVec3; 3]| {
            let [a, b, c] = corners.map(|corner| corner - base);
            a.dot(b.cross(c)) / 6.0
        };
        self.corners().into_iter().map(of).sum()
    }

    /// Reverses the orientation of all triangles.
    pub fn flip_orientation(&mut self) {
        self.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
    }

    /// Number of a vertex, if there is one with this number.
    pub(crate) fn known_vertex(&self, number: u64) -> Option<u32> {
        u32::try_from(number).ok().filter(|&vertex| (vertex as usize) < self.positions.len())
    }

    /// Adds a polygon, as a fan of triangles from its first corner.
    pub(crate) fn push_polygon(&mut self, corners: &[u32]) {
        let pairs = corners.windows(2).skip(1);
        self.triangles.extend(pairs.map(|pair| [corners[0], pair[0], pair[1]]));
    }

    /// Removes nodes without triangles.
    pub(crate) fn remove_unused_nodes(&mut self) {
        let mut number = vec![u32::MAX; self.positions.len()];
        let mut kept = Vec::new();
        for node in self.triangles.iter_mut().flatten() {
            let known = &mut number[*node as usize];
            if *known == u32::MAX {
                *known = kept.len() as u32;
                kept.push(self.positions[*node as usize]);
            }
            *node = *known;
        }
        self.positions = kept;
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::primitives::box_mesh;

    #[test]
    fn the_surface_of_a_box_is_closed_and_has_its_volume() {
        let mut surface = SurfaceMesh::from_boundary(box_mesh([1.0, 2.0, 3.0], [2, 2, 2]).unwrap()).unwrap();
        // 3³ nodes of which one lies within; two triangles a face of a cell.
        assert_eq!((surface.positions.len(), surface.triangles.len()), (26, 48));
        assert!((surface.volume() - 6.0).abs() < 1e-12);
        let before = surface.clone();
        surface.weld();
        assert_eq!(surface.triangles.len(), before.triangles.len());
        surface.flip_orientation();
        assert!((surface.volume() + 6.0).abs() < 1e-12);
    }

    #[test]
    fn the_boundary_of_several_pieces_encloses_all_of_them() {
        let mut mesh = box_mesh([1.0; 3], [1; 3]).unwrap();
        let other = mesh.clone();
        mesh.nodes.extend(other.nodes.iter().map(|&node| node + DVec3::X * 2.0));
        mesh.tets.extend(other.tets.iter().map(|tet| tet.map(|node| node + 8)));
        mesh.tet_regions.extend(other.tet_regions);
        assert!(mesh.clone().checked().is_err());
        let surface = SurfaceMesh::from_boundary(mesh).unwrap();
        assert_eq!((surface.positions.len(), surface.triangles.len()), (16, 24));
        assert!((surface.volume() - 2.0).abs() < 1e-12);
    }

    #[test]
    fn welding_leaves_out_triangles_that_have_become_edges() {
        let positions = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::X + DVec3::Z * 1e-9];
        let mut surface = SurfaceMesh { positions, triangles: vec![[0, 1, 2], [0, 1, 3]] };
        surface.weld();
        assert_eq!((surface.positions.len(), surface.triangles), (3, vec![[0, 1, 2]]));
    }
}
