//! The surface as the boundary of a body: where boundary nodes may slide.
//!
//! Where parts of a surface intersect, the rest of each lies inside the other, and is no wall.

use super::prepare::Prepared;
use super::smoothing::{Freedom, Stars};
use super::tree::SurfaceTree;
use crate::faces::sorted_faces;
use glam::DVec3;

/// Distance of a node from the surface, in cells, from which it closes a hole.
const OFF_SURFACE: f64 = 1e-5;

/// Distance before a wall, in cells, at which it is outside.
const BEFORE: f64 = 0.05;

/// Surface about the boundary of a mesh.
pub(super) struct Walls<'a> {
    pub surface: &'a SurfaceTree,
    /// Side of a cell [m].
    pub cell: f64,
    overlaps: bool,
    /// Outward normals of the boundary at its nodes; zero at others.
    normals: Vec<DVec3>,
}

impl<'a> Walls<'a> {
    pub fn new(prepared: &'a Prepared, stars: &Stars, cell: f64) -> Self {
        let mut normals = vec![DVec3::ZERO; stars.nodes.len()];
        for same in sorted_faces(&stars.tets).chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() == 1) {
            let [a, b, c] = same[0].0.map(|node| stars.nodes[node as usize]);
            let area = (b - a).cross(c - a) * if same[0].1 { 0.5 } else { -0.5 };
            same[0].0.iter().for_each(|&node| normals[node as usize] += area);
        }
        normals.iter_mut().for_each(|normal| *normal = normal.normalize_or_zero());
        Self { surface: &prepared.tree, cell, overlaps: prepared.overlaps, normals }
    }

    /// Freedoms of the nodes of a mesh.
    pub fn freedoms(&self, stars: &Stars) -> Vec<Freedom> {
        let freedom = |(node, normal): (&DVec3, &DVec3)| {
            if *normal == DVec3::ZERO {
                Freedom::Inside
            } else if self.surface.closest(*node).1 > OFF_SURFACE * self.cell {
                Freedom::Fixed
            } else {
                Freedom::OnSurface
            }
        };
        stars.nodes.iter().zip(&self.normals).map(freedom).collect()
    }

    /// Outward normal at a node of the boundary.
    pub fn normal(&self, node: u32) -> DVec3 {
        self.normals[node as usize]
    }

    /// Whether a place on the surface, for a node nearby, is on the boundary of the body.
    pub fn are_at(&self, node: u32, place: DVec3) -> bool {
        !self.overlaps || !self.surface.has_inside(place + self.normal(node) * (BEFORE * self.cell))
    }
}
