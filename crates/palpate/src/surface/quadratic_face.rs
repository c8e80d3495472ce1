//! Shape functions on surface triangles: linear, or quadratic over the face of a quadratic element that the triangle is a
//! quarter of.
//!
//! A quadratic face is stored in the surface as four triangles: one of its three mid-edge nodes, and one at each corner.
//! Mid-edge nodes have larger numbers in the finite element model than corners.

use super::Surface;
use alloc::collections::BTreeMap;
use alloc::vec;
use alloc::vec::Vec;

/// Triangle as a part of a quadratic face.
#[derive(Debug, Clone, Copy)]
struct Part {
    /// Corner nodes of the face, and the mid-edge node after each.
    corners: [u32; 3],
    middles: [u32; 3],
    /// Barycentric weights of the triangle's corners on the face.
    vertices: [[f64; 3]; 3],
}

/// Quadratic faces of a surface's triangles.
#[derive(Debug, Clone)]
pub(crate) struct QuadraticFaces {
    parts: Vec<Option<Part>>,
}

impl QuadraticFaces {
    /// Faces of a surface with finite elements of an order. Triangles outside of whole faces are linear.
    pub(crate) fn new(surface: &Surface, order: u32) -> Self {
        let mut faces = Self { parts: vec![None; surface.triangles.len()] };
        if order != 2 {
            return faces;
        }
        // Every triangle of a quadratic face has at least two mid-edge nodes; the smallest of all is second in some triangle.
        let second = |corners: &[u32; 3]| {
            let mut numbers = corners.map(|node| surface.source_nodes[node as usize]);
            numbers.sort_unstable();
            numbers[1]
        };
        let least = surface.triangles.iter().map(second).min().unwrap_or_default();
        let is_middle = |node: u32| surface.source_nodes[node as usize] >= least;
        // Corner triangles, by their edge between two mid-edge nodes.
        let mut at_corners = BTreeMap::new();
        for (t, nodes) in surface.triangles.iter().enumerate() {
            if let Some(k) = (0..3).find(|&k| !is_middle(nodes[k])) {
                at_corners.insert((nodes[(k + 2) % 3], nodes[(k + 1) % 3]), (t, nodes[k]));
            }
        }
        for (t, middles) in surface.triangles.iter().enumerate() {
            if middles.iter().all(|&node| is_middle(node)) {
                let over = |k: usize| at_corners.get(&(middles[k], middles[(k + 1) % 3])).copied();
                if let (Some(a), Some(b), Some(c)) = (over(0), over(1), over(2)) {
                    faces.insert(surface, t, *middles, [a, b, c]);
                }
            }
        }
        faces
    }

    /// Insert the face of a middle triangle and the triangles at its corners, in the order of the middle one's edges.
    fn insert(&mut self, surface: &Surface, middle: usize, nodes: [u32; 3], around: [(usize, u32); 3]) {
        let corners = around.map(|(_, corner)| corner);
        // Between the first two corners lies the node that the first two edges share.
        let middles = [nodes[1], nodes[2], nodes[0]];
        let weights = |node: u32| {
            let mut weights = [0.0; 3];
            for k in 0..3 {
                if corners[k] == node {
                    weights[k] = 1.0;
                } else if middles[k] == node {
                    (weights[k], weights[(k + 1) % 3]) = (0.5, 0.5);
                }
            }
            weights
        };
        for t in [middle, around[0].0, around[1].0, around[2].0] {
            let vertices = surface.triangles[t].map(weights);
            self.parts[t] = Some(Part { corners, middles, vertices });
        }
    }

    /// Nodes and shape functions at a point of a triangle with barycentric weights, passed to `give`.
    pub(crate) fn shapes(
        &self,
        surface: &Surface,
        triangle: usize,
        weights: [f64; 3],
        mut give: impl FnMut(u32, f64),
    ) {
        let Some(part) = &self.parts[triangle] else {
            let nodes = surface.triangles[triangle].into_iter();
            return nodes.zip(weights).for_each(|(node, w)| give(node, w));
        };
        let on_face = |k: usize| -> f64 { (0..3).map(|v| weights[v] * part.vertices[v][k]).sum() };
        let l = [on_face(0), on_face(1), on_face(2)];
        for k in 0..3 {
            give(part.corners[k], l[k] * (2.0 * l[k] - 1.0));
            give(part.middles[k], 4.0 * l[k] * l[(k + 1) % 3]);
        }
    }
}
