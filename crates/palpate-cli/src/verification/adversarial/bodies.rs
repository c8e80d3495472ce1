//! Five bodies: one with flat faces, one thinner than hands go in a step, a round one, a long one, and one that is hollow.

use super::super::scene::Stuff;
use crate::Failure;
use glam::DVec3;
use palpate::Recording;
use palpate_fem::element::Order;
use palpate_fem::mesh::{Mesh, ball_mesh, box_mesh};
use std::sync::Arc;

/// Soft enough to be bent and dented out of all proportion.
const RUBBER: Stuff = Stuff { young: 2e4, poisson: 0.4, density: 500.0, beta: 1e-4 };

const MODES: usize = 40;

/// Their names and recordings.
pub fn bodies() -> Result<Vec<(&'static str, Arc<Recording>)>, Failure> {
    let meshes = [
        ("cube", box_mesh([0.1; 3], [4; 3])?),
        ("plate", box_mesh([0.1, 0.004, 0.1], [6, 1, 6])?),
        ("ball", ball_mesh(0.05, 3)?),
        ("bar", box_mesh([0.2, 0.02, 0.02], [16, 2, 2])?),
        ("U", hollow()?),
    ];
    meshes.into_iter().map(|(name, mesh)| Ok((name, RUBBER.body(mesh, Order::Linear, MODES)?))).collect()
}

/// A box of 5 × 5 × 2 cells without the middle of its upper four layers: a U that opens upwards.
fn hollow() -> Result<Mesh, Failure> {
    let mut mesh = box_mesh([0.1, 0.1, 0.04], [5, 5, 2])?;
    let middle = |tet: &[u32; 4]| tet.iter().map(|&node| mesh.nodes[node as usize]).sum::<DVec3>() / 4.0;
    let kept = |tet: &[u32; 4]| middle(tet).x.abs() > 0.03 || middle(tet).y < -0.03;
    let tets: Vec<[u32; 4]> = mesh.tets.iter().copied().filter(kept).collect();
    let mut number = vec![None; mesh.nodes.len()];
    let mut nodes = Vec::new();
    let mut renumbered = |node: u32| {
        *number[node as usize].get_or_insert_with(|| {
            nodes.push(mesh.nodes[node as usize]);
            nodes.len() as u32 - 1
        })
    };
    let tets: Vec<[u32; 4]> = tets.into_iter().map(|tet| tet.map(&mut renumbered)).collect();
    mesh.tet_regions = vec![0; tets.len()];
    (mesh.nodes, mesh.tets) = (nodes, tets);
    Ok(mesh)
}
