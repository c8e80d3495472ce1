//! Five bodies: flat faces, thinner than a device moves in a step, round, long, and hollow.

use crate::error::VerifyError;
use glam::DVec3;
use palpate::Recording;
use palpate_fem::ElementOrder;
use palpate_mesh::{Mesh, ball_mesh, box_mesh};
use palpate_testkit::ElasticMaterial;
use std::sync::Arc;

/// Soft enough for deformations as large as the body.
const RUBBER: ElasticMaterial =
    ElasticMaterial { young_pa: 2e4, poisson: 0.4, density_kg_m3: 500.0, stiffness_damping_s: 1e-4 };

/// Modes of each body.
const MODES: usize = 40;

/// Names and recordings.
pub(in crate::cases) fn bodies() -> Result<Vec<(&'static str, Arc<Recording>)>, VerifyError> {
    let meshes = [
        ("cube", box_mesh([0.1; 3], [4; 3])?),
        ("plate", box_mesh([0.1, 0.004, 0.1], [6, 1, 6])?),
        ("ball", ball_mesh(0.05, 3)?),
        ("bar", box_mesh([0.2, 0.02, 0.02], [16, 2, 2])?),
        ("U", hollow()?),
    ];
    meshes
        .into_iter()
        .map(|(name, mesh)| Ok((name, RUBBER.free_body(mesh, ElementOrder::Linear, MODES)?)))
        .collect()
}

/// A box of 5 × 5 × 2 cells without the middle of its upper four layers: a U that opens upwards.
fn hollow() -> Result<Mesh, VerifyError> {
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
