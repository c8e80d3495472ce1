//! Shape functions on surface triangles: linear, or quadratic over the face of a quadratic element that the triangle is a
//! quarter of.
//!
//! A quadratic face of corners a, b, c and mid-edge nodes ab, bc, ca is stored in the surface as four triangles, one after another:
//! (a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca).

use super::{EDGE_COSINE, Surface, area_normal};
use alloc::collections::BTreeMap;
use alloc::vec;
use alloc::vec::Vec;
use glam::DVec3;

/// Triangle as a part of a quadratic face.
#[derive(Debug, Clone, Copy)]
struct Part {
    /// Corner nodes of the face, and the mid-edge node after each.
    corners: [u32; 3],
    middles: [u32; 3],
    /// Barycentric weights of the triangle's corners on the face.
    vertices: [[f64; 3]; 3],
}

/// Barycentric weights of a node of a quadratic face.
fn weights(corners: [u32; 3], middles: [u32; 3], node: u32) -> [f64; 3] {
    let mut weights = [0.0; 3];
    for k in 0..3 {
        if corners[k] == node {
            weights[k] = 1.0;
        } else if middles[k] == node {
            (weights[k], weights[(k + 1) % 3]) = (0.5, 0.5);
        }
    }
    weights
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
        for (at, four) in (0..).step_by(4).zip(surface.triangles.chunks_exact(4)) {
            let (&[a, ab, ca], &[_, b, bc], &[_, _, c]) = (&four[0], &four[1], &four[2]);
            if four[1][0] == ab && four[2][..2] == [ca, bc] && four[3] == [ab, bc, ca] {
                let (corners, middles) = ([a, b, c], [ab, bc, ca]);
                for t in at..at + 4 {
                    let vertices = surface.triangles[t].map(|node| weights(corners, middles, node));
                    faces.parts[t] = Some(Part { corners, middles, vertices });
                }
            }
        }
        faces
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

/// Height [m] of the smooth surface over every node, along its normal: that of a cubic curve with the normals of both corners over the
/// middle of each straight edge, 0 elsewhere (PN triangles, Vlachos et al. 2001, Proc. I3D, 159). Edges between faces that are
/// no smooth surface stay straight.
///
/// Equations: docs/theory.md (C80).
pub(crate) fn smooth_heights(surface: &Surface, order: u32) -> Vec<f64> {
    let faces = QuadraticFaces::new(surface, order);
    let mut heights = vec![0.0; surface.positions.len()];
    let position = |node: u32| surface.positions[node as usize];
    // Faces around each corner, with their normals and weights there, exact on a ball (Max 1999, J. Graph. Tools 4(2), 1); ends and
    // normals of each middle's faces.
    let mut around: BTreeMap<u32, Vec<(DVec3, f64)>> = BTreeMap::new();
    let mut edges: BTreeMap<u32, ([u32; 2], DVec3, usize)> = BTreeMap::new();
    for (triangle, part) in faces.parts.iter().enumerate() {
        let Some(Part { corners, middles, .. }) = part else { continue };
        // Each face once, by its middle triangle.
        if !surface.triangles[triangle].iter().all(|node| middles.contains(node)) {
            continue;
        }
        let Some(normal) = area_normal(corners.map(position)).try_normalize() else { continue };
        for k in 0..3 {
            let [own, next, last] = [0, 1, 2].map(|at| position(corners[(k + at) % 3]));
            let (e, f) = (next - own, last - own);
            let weight = e.cross(f).length() / (e.length_squared() * f.length_squared());
            around.entry(corners[k]).or_default().push((normal, weight));
            let ends = [corners[k], corners[(k + 1) % 3]];
            let (_, sum, count) = edges.entry(middles[k]).or_insert((ends, DVec3::ZERO, 0));
            (*sum, *count) = (*sum + normal, *count + 1);
        }
    }
    for (middle, ([a, b], sum, count)) in edges {
        let edge = position(b) - position(a);
        let is_straight =
            (position(middle) - (position(a) + position(b)) * 0.5).length() < STRAIGHT * edge.length();
        // Two unit normals at an angle have a sum of length 2·cos(angle/2).
        let is_smooth = count == 2 && 0.5 * sum.length_squared() - 1.0 > EDGE_COSINE;
        if !(is_straight && is_smooth) {
            continue;
        }
        let out = sum.normalize();
        let normal_at = |corner: u32| {
            let of = around[&corner].iter().filter(|(normal, _)| normal.dot(out) > EDGE_COSINE);
            of.map(|(normal, weight)| *normal * *weight).sum::<DVec3>().normalize_or_zero()
        };
        let (of_a, of_b) = (normal_at(a), normal_at(b));
        let curve = (of_b * edge.dot(of_b) - of_a * edge.dot(of_a)) * 0.125;
        heights[middle as usize] = curve.dot(out);
    }
    heights
}

/// Distance of a mid-edge node from the middle of its edge below which the edge is straight, as a share of its length.
const STRAIGHT: f64 = 1e-6;

#[cfg(test)]
mod tests {
    use super::super::test_surfaces::ball;
    use super::*;

    /// Quadratic faces of a linear surface: a node in the middle of every edge.
    fn quadratic(surface: &Surface) -> Surface {
        let mut out = Surface { triangles: Vec::new(), ..surface.clone() };
        let mut middles = BTreeMap::new();
        for &[a, b, c] in &surface.triangles {
            let mut middle = |i: u32, j: u32| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    let at = |n: u32| surface.positions[n as usize];
                    out.positions.push((at(i) + at(j)) * 0.5);
                    out.positions.len() as u32 - 1
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            out.triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        out.source_nodes = (0..out.positions.len() as u32).collect();
        out
    }

    #[test]
    fn middles_of_a_ball_are_lifted_onto_it_and_those_of_a_cube_stay() {
        let surface = quadratic(&ball(3));
        let radius = surface.positions[0].length();
        let heights = smooth_heights(&surface, 2);
        let mut largest = 0.0_f64;
        for (position, height) in surface.positions.iter().zip(&heights) {
            let sag = radius - position.length();
            largest = largest.max(sag);
            // The cubic's own error is of the fourth order: 5·φ⁴/384 of the radius beside the sag of φ²/8, with φ = 0.5 at most.
            assert!((height - sag).abs() < 0.03 * sag + 1e-12, "{height} for {sag}");
        }
        assert!(largest > 1e-3 * radius);
        assert!(smooth_heights(&surface, 1).iter().all(|height| *height == 0.0));
        let corner = |k: u32| DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2));
        let squares = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = squares.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        let cube =
            Surface { positions: (0..8).map(corner).collect(), triangles, source_nodes: (0..8).collect() };
        assert!(smooth_heights(&quadratic(&cube), 2).iter().all(|height| height.abs() < 1e-15));
    }
}
