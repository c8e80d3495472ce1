//! Places of the surface at which a certificate is measured: points, and patches as wide as a fingertip.

use crate::carriers::Carriers;
use crate::system::System;
use faer::Mat;
use glam::{DMat3, DVec3};
use palpate::{ResidualCompliance, Surface};
use std::collections::BTreeMap;

/// Number of sampled points that are spread over the surface: on a cube the corners, then a face.
const SPREAD: usize = 9;

/// Number of sampled points around the last of them: hands that are near each other feel a stiffer body.
const NEAR: usize = 3;

/// Distance of these points as a share of the body's diagonal.
const NEAR_DIAGONAL: f64 = 0.2;

/// Number of sampled points that are the centre of a patch as well.
const PATCHES: usize = 4;

/// Radius of a patch as a share of the body's diagonal: a fingertip on the paper's cube.
const PATCH_DIAGONAL: f64 = 0.03;

/// Least radius of a patch in mean edges of the surface.
const PATCH_EDGES: f64 = 2.0;

/// Sampled point or patch: carriers of the surface with weights that sum to one.
pub(super) struct Place {
    pub nodes: Vec<(usize, f64)>,
    /// Centre [m, body frame].
    pub centre: DVec3,
    /// Radius [m]; 0 for a point.
    pub radius: f64,
    /// Unit normal, outward.
    pub normal: DVec3,
}

/// Points spread over the surface by farthest-point sampling, points near the last of them, and patches. A fixed node has no compliance
/// to compare, so none is sampled.
pub(super) fn places(system: &System, surface: &Surface, carriers: &Carriers) -> Vec<Place> {
    let movable =
        |node: usize| carriers.of(node).iter().all(|(at, _)| !system.holds_node(carriers.nodes[*at]));
    let positions = &surface.positions;
    let candidates: Vec<usize> = (0..positions.len()).filter(|&node| movable(node)).collect();
    let mut nearest: Vec<f64> = positions.iter().map(|p| p.length()).collect();
    let mut points = Vec::new();
    for _ in 0..(SPREAD + NEAR).min(candidates.len()) {
        let near = |node: &usize| {
            let last: Option<&usize> = points.get(SPREAD - 1);
            last.is_none_or(|&last| {
                (positions[*node] - positions[last]).length() <= NEAR_DIAGONAL * surface.diagonal()
            })
        };
        let farthest =
            candidates.iter().copied().filter(near).max_by(|&a, &b| nearest[a].total_cmp(&nearest[b]));
        let Some(farthest) = farthest else { break };
        points.push(farthest);
        for (node, distance) in nearest.iter_mut().enumerate() {
            let new = (positions[node] - positions[farthest]).length();
            *distance = if points.len() == 1 { new } else { distance.min(new) };
        }
    }
    let area_vectors = node_area_vectors(surface);
    let radius = (PATCH_DIAGONAL * surface.diagonal()).max(PATCH_EDGES * surface.mean_edge());
    let patch = |&centre: &usize| {
        let within = |node: &usize| (positions[*node] - positions[centre]).length() <= radius;
        let nodes: Vec<usize> = candidates.iter().copied().filter(within).collect();
        let total: f64 = nodes.iter().map(|&node| area_vectors[node].1).sum();
        Place {
            nodes: nodes.iter().map(|&node| (node, area_vectors[node].1 / total)).collect(),
            centre: positions[centre],
            radius,
            normal: nodes.iter().map(|&node| area_vectors[node].0).sum::<DVec3>().normalize_or_zero(),
        }
    };
    let point = |&node: &usize| Place {
        nodes: vec![(node, 1.0)],
        centre: positions[node],
        radius: 0.0,
        normal: area_vectors[node].0.normalize_or_zero(),
    };
    // The last of the spread points lie on faces rather than at corners.
    let patches = points[..SPREAD.min(points.len())].iter().rev().take(PATCHES).map(patch);
    let on_surface = points.iter().map(point).chain(patches);
    let carried = |place: Place| {
        let mut sums = BTreeMap::new();
        for &(node, weight) in &place.nodes {
            for (at, share) in carriers.of(node) {
                *sums.entry(at).or_insert(0.0) += share * weight;
            }
        }
        Place { nodes: sums.into_iter().collect(), ..place }
    };
    on_surface.map(carried).collect()
}

/// Area vector and area of each surface node [m²]: a third of its triangles'.
fn node_area_vectors(surface: &Surface) -> Vec<(DVec3, f64)> {
    let mut areas = vec![(DVec3::ZERO, 0.0); surface.positions.len()];
    for triangle in &surface.triangles {
        let [a, b, c] = triangle.map(|node| surface.positions[node as usize]);
        let third = (b - a).cross(c - a) / 6.0;
        for &node in triangle {
            areas[node as usize].0 += third;
            areas[node as usize].1 += third.length();
        }
    }
    areas
}

/// Weighted mean over the nodes of a place.
pub(super) fn weighted(place: &Place, value: impl Fn(usize, usize) -> f64) -> DVec3 {
    let part = |axis| place.nodes.iter().map(|&(node, weight)| weight * value(node, axis)).sum();
    DVec3::new(part(0), part(1), part(2))
}

/// Residual compliance [m/N] of a place for forces on another one, or on itself.
pub(super) fn residual_between(residual: &ResidualCompliance, of: &Place, on: &Place) -> DMat3 {
    let mut sum = DMat3::ZERO;
    for &(i, wi) in &of.nodes {
        for &(j, wj) in &on.nodes {
            sum += residual.block(i, j) * (wi * wj);
        }
    }
    sum
}

/// Unit forces on the places [N], three columns each.
pub(super) fn loads(system: &System, carriers: &[u32], places: &[Place]) -> Mat<f64> {
    let mut loads = Mat::zeros(system.discretisation.dofs(), 3 * places.len());
    for (at, place) in places.iter().enumerate() {
        for (&(node, weight), axis) in place.nodes.iter().flat_map(|n| (0..3).map(move |axis| (n, axis))) {
            let dof = 3 * carriers[node] as usize + axis;
            if !system.is_fixed(dof) {
                loads[(dof, 3 * at + axis)] += weight;
            }
        }
    }
    loads
}
