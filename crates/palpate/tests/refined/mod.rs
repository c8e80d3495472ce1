//! Released recording with a refined surface: modes and residual compliance interpolated between the nodes.

use glam::{DMat3, DVec3};
use palpate::{ModalBasis, Recording, ResidualCompliance, Surface};
use std::collections::HashMap;

/// Recording with every surface triangle cut in four, repeatedly.
pub fn refined(recording: &Recording, times: usize) -> Recording {
    (0..times).fold(recording.clone(), |coarse, _| cut_in_four(&coarse))
}

fn cut_in_four(coarse: &Recording) -> Recording {
    let surface = &coarse.surface;
    let m = coarse.modes.len();
    // Parents of every node: the ends of the edge that it bisects, or twice itself.
    let mut parents: Vec<[usize; 2]> = (0..surface.positions.len()).map(|n| [n, n]).collect();
    let mut middles = HashMap::new();
    let mut triangles = Vec::new();
    for &[a, b, c] in &surface.triangles {
        let mut middle = |i: u32, j: u32| {
            *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                parents.push([i as usize, j as usize]);
                parents.len() as u32 - 1
            })
        };
        let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
        triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
    }
    let midpoint = |of: &[usize; 2]| (surface.positions[of[0]] + surface.positions[of[1]]) * 0.5;
    let positions: Vec<DVec3> = parents.iter().map(midpoint).collect();
    let row = |node: usize, axis: usize| &coarse.modes.mode_shapes[(3 * node + axis) * m..][..m];
    let mut mode_shapes = Vec::with_capacity(3 * positions.len() * m);
    for &[a, b] in &parents {
        for axis in 0..3 {
            mode_shapes.extend(row(a, axis).iter().zip(row(b, axis)).map(|(x, y)| 0.5 * (x + y)));
        }
    }
    let mut packed = Vec::new();
    for (i, of_i) in parents.iter().enumerate() {
        let pairs = |of_j: &[usize; 2]| of_i.iter().flat_map(|&a| of_j.map(|b| (a, b))).collect::<Vec<_>>();
        let block = |of_j: &[usize; 2]| -> DMat3 {
            pairs(of_j).into_iter().map(|(a, b)| coarse.residual.block(a, b) * 0.25).sum()
        };
        let blocks: Vec<DMat3> = parents[..=i].iter().map(block).collect();
        for axis in 0..3 {
            let entries = blocks.iter().flat_map(|block| block.row(axis).to_array());
            packed.extend(entries.take(3 * i + axis + 1).map(|x| x as f32));
        }
    }
    let source_nodes = (0..positions.len() as u32).collect();
    Recording {
        metadata: coarse.metadata.clone(),
        surface: Surface { positions, triangles, source_nodes },
        modes: ModalBasis { mode_shapes, ..coarse.modes.clone() },
        residual: ResidualCompliance::Whole(packed),
        gravity: None,
        sample_levels: Vec::new(),
    }
}
