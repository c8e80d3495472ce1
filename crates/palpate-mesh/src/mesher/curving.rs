//! Curved edges: mid-edge nodes of the boundary on the surface that the mesh was made of, for elements of order 2.
//!
//! A chord of a curved surface lies inside of it: a ball of 1,000 tetrahedra lacks 5 % of its volume with straight edges, and 0.02 % with curved
//! ones.

use super::tree::SurfaceTree;
use crate::faces::{EDGES, tet_volume};
use crate::volume_mesh::{Mesh, MidEdgeNode};
use glam::DVec3;
use rayon::prelude::*;
use std::collections::HashMap;

/// Distance of a mid-edge node from the middle of its edge up to which it is moved, as a share of its length: an arc of 106°. What is farther is
/// another part of the surface.
const LARGEST_SAG: f64 = 0.25;

/// Distance below which an edge is straight, as a share of its length: round-off of flat faces.
const FLAT: f64 = 1e-6;

/// Least determinant of the Jacobian of an element, as a share of that with straight edges: below it the condition of its stiffness grows more than
/// the surface gains.
const LEAST_DETERMINANT: f64 = 0.3;

/// Times that the nodes of a distorted element go back by a half, before its edges are straight again.
const HALVINGS: usize = 3;

/// Adds mid-edge nodes on the surface to the edges of the boundary that are not straight.
pub(super) fn curve(mesh: &mut Mesh, tree: &SurfaceTree) {
    let mut edges: Vec<[u32; 2]> = mesh
        .boundary()
        .iter()
        .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
        .map(|[a, b]| [a.min(b), a.max(b)])
        .collect();
    edges.sort_unstable();
    edges.dedup();
    let move_of = |&[a, b]: &[u32; 2]| {
        let [a, b] = [a, b].map(|node| mesh.nodes[node as usize]);
        let middle = (a + b) * 0.5;
        let away = tree.closest(middle).0 - middle;
        let share = away.length() / (b - a).length();
        (FLAT..=LARGEST_SAG).contains(&share).then_some(away)
    };
    let found: Vec<Option<DVec3>> = edges.par_iter().map(move_of).collect();
    let mut moves: HashMap<[u32; 2], DVec3> =
        edges.into_iter().zip(found).filter_map(|(edge, away)| Some((edge, away?))).collect();
    for attempt in 0..=HALVINGS {
        let mut distorted: Vec<[u32; 2]> = mesh
            .tets
            .iter()
            .filter(|tet| is_distorted(mesh, tet, &moves))
            .flat_map(edges_of)
            .filter(|edge| moves.contains_key(edge))
            .collect();
        if distorted.is_empty() {
            break;
        }
        distorted.sort_unstable();
        distorted.dedup();
        for edge in &distorted {
            match moves.get_mut(edge) {
                Some(away) if attempt < HALVINGS => *away *= 0.5,
                _ => drop(moves.remove(edge)),
            }
        }
    }
    let mut moves: Vec<([u32; 2], DVec3)> = moves.into_iter().collect();
    moves.sort_unstable_by_key(|(ends, _)| *ends);
    for (ends, away) in moves {
        let node = mesh.nodes.len() as u32;
        let [a, b] = ends.map(|end| mesh.nodes[end as usize]);
        mesh.nodes.push((a + b) * 0.5 + away);
        mesh.mid_edge_nodes.push(MidEdgeNode { ends, node });
    }
}

fn edges_of(tet: &[u32; 4]) -> [[u32; 2]; 6] {
    EDGES.map(|[a, b]| [tet[a].min(tet[b]), tet[a].max(tet[b])])
}

/// Whether moved mid-edge nodes distort a tetrahedron too much, by the bound of its determinant.
fn is_distorted(mesh: &Mesh, tet: &[u32; 4], moves: &HashMap<[u32; 2], DVec3>) -> bool {
    let of_edges = edges_of(tet).map(|edge| moves.get(&edge));
    if of_edges.iter().all(Option::is_none) {
        return false;
    }
    let mut element = mesh.quadratic_tet(tet);
    for (middle, away) in element.0[4..].iter_mut().zip(of_edges) {
        *middle += away.copied().unwrap_or_default();
    }
    let straight = 6.0 * tet_volume(&mesh.nodes, tet);
    element.least_determinant() < LEAST_DETERMINANT * straight
}

#[cfg(test)]
mod tests {
    use super::super::{MeshingParameters, tetrahedralise};
    use crate::{Mesh, SurfaceMesh, ball_mesh, box_mesh};
    use std::f64::consts::PI;
    use std::ops::ControlFlow;

    fn filled(surface: &SurfaceMesh, cell: f64) -> Mesh {
        let parameters = MeshingParameters { cell_size: Some(cell), nodes: None, curved: true };
        tetrahedralise(surface, &parameters, &mut |_| ControlFlow::Continue(())).expect("a mesh").0
    }

    fn volume(mesh: &Mesh) -> f64 {
        mesh.tets.iter().map(|tet| mesh.quadratic_volume(tet)).sum()
    }

    #[test]
    fn a_ball_of_curved_elements_has_the_volume_and_the_radius_of_its_surface() {
        let surface = SurfaceMesh::from_boundary(ball_mesh(0.05, 24).expect("a ball")).expect("a surface");
        for cell in [0.025, 0.015] {
            let mesh = filled(&surface, cell);
            mesh.check_curved().expect("no fold");
            let curved = volume(&mesh) / surface.volume() - 1.0;
            let mut straight = mesh.clone();
            straight.straighten();
            let chords = volume(&straight) / surface.volume() - 1.0;
            assert!(curved.abs() < 0.08 * chords.abs(), "cells of {cell} m: {curved} {chords}");
            for found in &mesh.mid_edge_nodes {
                let radius = mesh.nodes[found.node as usize].length();
                // The facets of the surface are chords, too.
                assert!((radius / 0.05 - 1.0).abs() < 2e-3, "{radius}");
            }
        }
        assert!((surface.volume() / (4.0 / 3.0 * PI * 0.05_f64.powi(3)) - 1.0).abs() < 0.01);
    }

    #[test]
    fn flat_faces_and_sharp_edges_stay_straight() {
        let surface = SurfaceMesh::from_boundary(box_mesh([0.1, 0.08, 0.06], [2; 3]).expect("a box"))
            .expect("a surface");
        let mesh = filled(&surface, 0.02);
        mesh.check_curved().expect("no fold");
        let curved = volume(&mesh) / surface.volume() - 1.0;
        let mut straight = mesh.clone();
        straight.straighten();
        let chords = volume(&straight) / surface.volume() - 1.0;
        // Nodes follow the sharp edges that the tetrahedra cut off.
        assert!(curved.abs() < chords.abs() && chords.abs() < 0.01, "{curved} {chords}");
        assert!(mesh.mid_edge_nodes.len() < mesh.boundary().len() / 20, "{}", mesh.mid_edge_nodes.len());
        let outside = |p: glam::DVec3| (p.abs() - glam::DVec3::new(0.05, 0.04, 0.03)).max_element();
        let farthest = mesh.nodes.iter().map(|&node| outside(node)).fold(f64::NEG_INFINITY, f64::max);
        assert!(farthest < 1e-9, "{farthest}");
    }
}
