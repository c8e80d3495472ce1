//! Free surface of a body: rest positions, triangles, and points on them.
//!
//! A point on a triangle with corners i, j, k and barycentric weights w has the displacement Σ w·u of its corners. A force at
//! the point is distributed to the corners with the same weights, so that work is preserved and reciprocity holds.

mod cells;
mod decimation;
mod patch_weights;
mod poisson_disk;
mod quadratic_face;
mod sample_level;
mod smooth_parts;
mod sphere_tree;
#[cfg(test)]
mod test_surfaces;
mod triangle;

pub(crate) use cells::{Cell, cells};
pub(crate) use decimation::decimate;
pub(crate) use patch_weights::{OneSidedPatch, PatchWeights, patch_kernel, triangles_around};
pub(crate) use poisson_disk::{EDGE_COSINE, node_normals, poisson_disk_sample};
pub(crate) use quadratic_face::smooth_heights;
pub(crate) use sample_level::MAX_LEVELS;
pub use sample_level::{MIN_CONTACT_SAMPLES, SampleLevel};
pub(crate) use sphere_tree::{
    Bands, Bounds, Centre, DeformationBound, DeformingNodes, RigidNodes, SphereTree, Traversal, UpperPart,
    band,
};
pub(crate) use triangle::{area_normal, at_weights, nearest_on_triangle};

use alloc::vec::Vec;
use glam::DVec3;

/// Boundary triangles of a body.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    /// Rest position of each surface node [m, body frame].
    pub positions: Vec<DVec3>,
    /// Three surface nodes per triangle, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Number of each surface node in the finite element model: first the nodes of the input mesh in their order, then the
    /// mid-edge nodes of quadratic elements.
    pub source_nodes: Vec<u32>,
}

/// A material point on the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// Index in [`Surface::triangles`].
    pub triangle: u32,
    /// Barycentric weights of the triangle's corners; they sum to 1.
    pub weights: [f64; 3],
}

impl Surface {
    /// Corner nodes of the point's triangle with their weights.
    pub fn corners(&self, point: &SurfacePoint) -> [(usize, f64); 3] {
        let [i, j, k] = self.triangles[point.triangle as usize];
        let [wi, wj, wk] = point.weights;
        [(i as usize, wi), (j as usize, wj), (k as usize, wk)]
    }

    /// Rest position of a surface point [m, body frame].
    pub fn rest_position(&self, point: &SurfacePoint) -> DVec3 {
        self.corners(point).iter().map(|&(node, weight)| self.positions[node] * weight).sum()
    }

    /// Radius [m] of the smallest sphere about the body frame's origin that holds the surface.
    pub fn radius(&self) -> f64 {
        self.positions.iter().map(|p| p.length()).fold(0.0, f64::max)
    }

    /// Lowest and highest corner of the bounding box at rest [m, body frame].
    pub fn extent(&self) -> (DVec3, DVec3) {
        let low = self.positions.iter().copied().reduce(DVec3::min).unwrap_or_default();
        let high = self.positions.iter().copied().reduce(DVec3::max).unwrap_or_default();
        (low, high)
    }

    /// Diagonal [m] of the bounding box at rest.
    pub fn diagonal(&self) -> f64 {
        let (low, high) = self.extent();
        (high - low).length()
    }

    /// Whether a point's triangle exists and its weights are barycentric.
    pub fn contains(&self, point: &SurfacePoint) -> bool {
        (point.triangle as usize) < self.triangles.len()
            && libm::fabs(point.weights.iter().sum::<f64>() - 1.0) < 1e-9
            && point.weights.iter().all(|w| (-1e-9..=1.0 + 1e-9).contains(w))
    }

    /// Mean edge length [m] of the triangles at rest.
    pub fn mean_edge(&self) -> f64 {
        let mut sum = 0.0;
        for corners in &self.triangles {
            let [a, b, c] = corners.map(|node| self.positions[node as usize]);
            sum += (a - b).length() + (b - c).length() + (c - a).length();
        }
        sum / (3 * self.triangles.len().max(1)) as f64
    }

    /// Nearest point of the surface at rest to a body point [m], and its distance [m]; none without triangles.
    ///
    /// Costs all triangles: for setup, not for a step.
    pub fn nearest(&self, point_in_body: DVec3) -> Option<(SurfacePoint, f64)> {
        let mut best: Option<(SurfacePoint, f64)> = None;
        for (triangle, corners) in self.triangles.iter().enumerate() {
            let corners = corners.map(|node| self.positions[node as usize]);
            let weights = nearest_on_triangle(corners, point_in_body);
            let nearest = at_weights(corners, weights);
            let distance = (nearest - point_in_body).length();
            if best.is_none_or(|(_, least)| distance < least) {
                best = Some((SurfacePoint { triangle: triangle as u32, weights }, distance));
            }
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::vec;

    fn square() -> Surface {
        Surface {
            positions: vec![DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            source_nodes: vec![0, 1, 2, 3],
        }
    }

    #[test]
    fn nearest_point_beats_a_dense_sampling_of_the_surface() {
        let surface = square();
        for query in [
            DVec3::new(0.3, 0.2, 0.5),
            DVec3::new(-0.4, 0.5, -0.1),
            DVec3::new(2.0, 3.0, 0.0),
            DVec3::new(0.6, -0.7, 0.2),
            DVec3::new(1.3, 0.4, 0.2),
        ] {
            let (point, distance) = surface.nearest(query).expect("two triangles");
            let mut sampled = f64::INFINITY;
            let n = 200;
            for (i, j) in (0..=n).flat_map(|i| (0..=n).map(move |j| (i, j))) {
                let sample = DVec3::new(f64::from(i), f64::from(j), 0.0) / f64::from(n);
                sampled = sampled.min((sample - query).length());
            }
            assert!(distance <= sampled && sampled - distance < 0.01, "{query}: {distance} {sampled}");
            assert!((surface.rest_position(&point) - query).length() - distance < 1e-15);
            assert!(point.weights.iter().all(|w| (0.0..=1.0).contains(w)));
        }
    }
}
