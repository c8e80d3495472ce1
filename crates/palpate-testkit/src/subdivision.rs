//! Recordings with finer surfaces: modes and residual compliance interpolated between the nodes, so that a mesh of any fineness needs
//! no finite elements of its own.
//!
//! Each triangle is split into four at the midpoints of its edges. A new node is the mean of its two parents, and so are its rows of Φ
//! and of S: `S(m, n) = ¼·Σ S(parents of m, parents of n)`.

use glam::{DMat3, DVec3};
use palpate::{
    EMBEDDED_FORMAT_VERSIONS, Embedding, GravityResponse, Metadata, ModalBasis, NearField, Recording,
    ResidualCompliance, Surface,
};
use std::collections::HashMap;

/// Radius of the near field of [`subdivided_near_field`], in mean edges of the new surface.
const NEAR_FIELD_EDGES: f64 = 3.0;

/// A body whose surface triangles are split in four a number of times, with the residual compliance between all nodes.
pub fn subdivided(recording: &Recording, times: usize) -> Recording {
    (0..times).fold(recording.clone(), |coarse, _| {
        let (surface, parents) = split(&coarse.surface);
        let residual = whole_residual(&parents, &coarse.residual);
        interpolated(&coarse, surface, &parents, residual)
    })
}

/// A body whose surface triangles are split in four once, with the residual compliance between nodes that are near each other.
pub fn subdivided_near_field(coarse: &Recording) -> Recording {
    let (surface, parents) = split(&coarse.surface);
    let residual = ResidualCompliance::NearField(near_field(&surface, &parents, &coarse.residual));
    interpolated(coarse, surface, &parents, residual)
}

/// A body whose surface triangles are split in four once, and embedded in its nodes: each new one moves with its two parents.
pub fn embedded(coarse: &Recording) -> Recording {
    let (surface, parents) = split(&coarse.surface);
    let embedding = Embedding {
        model_nodes: coarse.surface.positions.len(),
        // Mean edge of the new surface, for the kernels between patches of the subdivided body.
        mean_edge: surface.mean_edge(),
        offsets: (0..=parents.len() as u32).map(|node| 2 * node).collect(),
        nodes: parents.iter().flatten().map(|&node| node as u32).collect(),
        weights: vec![0.5; 2 * parents.len()],
        ..Embedding::default()
    };
    let format_version = EMBEDDED_FORMAT_VERSIONS[0];
    let metadata = Metadata { certificate: None, format_version, ..coarse.metadata.clone() };
    let mut fine = Recording { metadata, surface, sample_levels: Vec::new(), ..coarse.clone() };
    fine.embed(embedding).expect("an embedding that fits");
    fine
}

/// The split surface, and for every node the two nodes that it is the mean of (twice the same for one that was there).
fn split(surface: &Surface) -> (Surface, Vec<[usize; 2]>) {
    let mut parents: Vec<[usize; 2]> = (0..surface.positions.len()).map(|n| [n, n]).collect();
    let mut middles = HashMap::new();
    let mut triangles = Vec::with_capacity(4 * surface.triangles.len());
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
    let mean = |of: &[usize; 2]| (surface.positions[of[0]] + surface.positions[of[1]]) * 0.5;
    let positions: Vec<DVec3> = parents.iter().map(mean).collect();
    let source_nodes = (0..positions.len() as u32).collect();
    (Surface { positions, triangles, source_nodes }, parents)
}

/// The recording on the new surface.
fn interpolated(
    coarse: &Recording,
    surface: Surface,
    parents: &[[usize; 2]],
    residual: ResidualCompliance,
) -> Recording {
    let mut mode_shapes = Vec::with_capacity(3 * parents.len() * coarse.modes.len());
    for &[a, b] in parents {
        for axis in 0..3 {
            let (a, b) = (coarse.modes.row(a, axis), coarse.modes.row(b, axis));
            mode_shapes.extend(a.iter().zip(b).map(|(x, y)| 0.5 * (x + y)));
        }
    }
    let modes = ModalBasis { mode_shapes, ..coarse.modes.clone() };
    let mean = |values: &[f64], [a, b]: [usize; 2]| -> Vec<f64> {
        (0..9).map(|at| 0.5 * (values[9 * a + at] + values[9 * b + at])).collect()
    };
    let gravity = coarse.gravity.as_ref().map(|gravity| GravityResponse {
        residual_displacements: parents
            .iter()
            .flat_map(|&of| mean(&gravity.residual_displacements, of))
            .collect(),
        ..gravity.clone()
    });
    // The certificate states the errors of the coarse body.
    let metadata = Metadata { certificate: None, ..coarse.metadata.clone() };
    Recording { metadata, surface, modes, residual, gravity, sample_levels: Vec::new(), embedding: None }
}

/// S between all new nodes.
fn whole_residual(parents: &[[usize; 2]], coarse: &ResidualCompliance) -> ResidualCompliance {
    let mut blocks = Vec::new();
    for (i, of_i) in parents.iter().enumerate() {
        for of_j in &parents[..=i] {
            let pairs = of_i.iter().flat_map(|&a| of_j.iter().map(move |&b| (a, b)));
            let block: DMat3 = pairs.map(|(a, b)| coarse.block(a, b) * 0.25).sum();
            blocks.extend(block.transpose().to_cols_array().map(|x| x as f32));
        }
    }
    ResidualCompliance::Whole(blocks)
}

/// S between new nodes within a few edges of each other, tapered to zero at the radius.
fn near_field(surface: &Surface, parents: &[[usize; 2]], coarse: &ResidualCompliance) -> NearField {
    let radius = NEAR_FIELD_EDGES * surface.mean_edge();
    let cell = |p: DVec3| (p / radius).floor().to_array().map(|x| x as i64);
    let mut cells: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
    for (node, p) in surface.positions.iter().enumerate() {
        cells.entry(cell(*p)).or_default().push(node as u32);
    }
    let mut near = NearField { radius, offsets: vec![0], nodes: Vec::new(), blocks: Vec::new() };
    for (i, p) in surface.positions.iter().enumerate() {
        let [x, y, z] = cell(*p);
        let around =
            (-1..=1).flat_map(|dx| (-1..=1).flat_map(move |dy| (-1..=1).map(move |dz| [dx, dy, dz])));
        let mut others: Vec<u32> = around
            .filter_map(|[dx, dy, dz]| cells.get(&[x + dx, y + dy, z + dz]))
            .flatten()
            .copied()
            .filter(|&j| (surface.positions[j as usize] - *p).length() < radius)
            .collect();
        others.sort_unstable();
        for j in others {
            let mut block = DMat3::ZERO;
            for a in parents[i] {
                for b in parents[j as usize] {
                    block += coarse.block(a, b) * 0.25;
                }
            }
            let distance = (surface.positions[j as usize] - *p).length();
            block *= NearField::taper(distance / radius);
            near.nodes.push(j);
            near.blocks.extend((0..3).flat_map(|row| block.row(row).to_array()).map(|x| x as f32));
        }
        near.offsets.push(near.nodes.len() as u32);
    }
    near
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::free_block;

    #[test]
    fn a_split_surface_has_four_times_the_triangles_and_keeps_its_nodes() {
        let coarse = free_block();
        let fine = subdivided(&coarse, 1);
        assert_eq!(fine.surface.triangles.len(), 4 * coarse.surface.triangles.len());
        let nodes = coarse.surface.positions.len();
        assert_eq!(fine.surface.positions[..nodes], coarse.surface.positions[..]);
        assert_eq!(fine.residual.block(0, 1), coarse.residual.block(0, 1));
    }

    #[test]
    fn the_near_field_is_the_whole_residual_at_a_node_and_nothing_beyond_its_radius() {
        let coarse = free_block();
        let (whole, near) = (subdivided(&coarse, 1), subdivided_near_field(&coarse));
        let node = whole.surface.positions.len() - 1;
        assert_eq!(near.residual.block(node, node), whole.residual.block(node, node));
        let away = |n: &usize| (near.surface.positions[*n] - near.surface.positions[0]).length();
        let farthest = (0..near.surface.positions.len()).max_by(|a, b| away(a).total_cmp(&away(b)));
        assert_eq!(near.residual.block(0, farthest.expect("nodes")), DMat3::ZERO);
    }
}
