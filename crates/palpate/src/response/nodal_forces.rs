//! The forces of the last step as forces on surface nodes.

use crate::recording::ResidualCompliance;
use alloc::vec;
use alloc::vec::Vec;
use glam::DVec3;

/// Forces [N, body] that act at points, by the weights of the nodes around them: many points share their nodes.
#[derive(Debug, Clone)]
pub(crate) struct NodalForces {
    loaded: Vec<(u32, DVec3)>,
    /// Where every surface node stands among them, from 1; 0 where it does not.
    at: Vec<u32>,
    /// What they do to a node by the residual compliance [m], and those nodes of which it is known.
    displacements: Vec<Option<DVec3>>,
    known: Vec<u32>,
}

impl NodalForces {
    pub(super) fn new(nodes: usize, points: usize) -> Self {
        Self {
            loaded: Vec::with_capacity(nodes.min(3 * points)),
            at: vec![0; nodes],
            displacements: vec![None; nodes],
            known: Vec::with_capacity(nodes),
        }
    }

    /// The nodes where a force acts, with it [N, body], and the most that there can be.
    pub(super) fn loaded(&self) -> &[(u32, DVec3)] {
        &self.loaded
    }

    pub(super) fn capacity(&self) -> usize {
        self.loaded.capacity()
    }

    pub(super) fn clear(&mut self) {
        self.loaded.drain(..).for_each(|(node, _)| self.at[node as usize] = 0);
        self.known.drain(..).for_each(|node| self.displacements[node as usize] = None);
    }

    pub(super) fn add(&mut self, corners: [(usize, f64); 3], force: DVec3) {
        for (node, weight) in corners.into_iter().filter(|(_, weight)| *weight != 0.0) {
            if self.at[node] == 0 {
                self.loaded.push((node as u32, DVec3::ZERO));
                self.at[node] = self.loaded.len() as u32;
            }
            self.loaded[self.at[node] as usize - 1].1 += force * weight;
        }
    }

    /// What they do to a node by the residual compliance [m, body].
    ///
    /// # Real time
    /// Costs the nodes where a force acts, unless it is known.
    pub(crate) fn residual_displacement(&self, residual: &ResidualCompliance, node: usize) -> DVec3 {
        let sum =
            || self.loaded.iter().map(|&(other, force)| residual.block(node, other as usize) * force).sum();
        self.displacements[node].unwrap_or_else(sum)
    }

    /// The same, known from then on.
    pub(super) fn find_residual_displacement(&mut self, residual: &ResidualCompliance, node: usize) -> DVec3 {
        let displacement = self.residual_displacement(residual, node);
        self.know(node, displacement);
        displacement
    }

    pub(super) fn know(&mut self, node: usize, displacement: DVec3) {
        if self.displacements[node].replace(displacement).is_none() {
            self.known.push(node as u32);
        }
    }
}

/// Add what forces [N] on nodes do to all nodes by the residual compliance [m]. Costs nodes × forces, of a near field the blocks
/// around the forces.
pub(super) fn add_residual_displacements(
    residual: &ResidualCompliance,
    loads: &[(u32, DVec3)],
    out: &mut [DVec3],
) {
    for &(node, force) in loads {
        let node = node as usize;
        match residual {
            // S is symmetric: what a row's node feels of others is what they feel of it, transposed.
            ResidualCompliance::NearField(near) => {
                near.row(node).for_each(|(other, block)| out[other] += block.transpose() * force);
            }
            _ => out.iter_mut().enumerate().for_each(|(i, u)| *u += residual.block(i, node) * force),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::{NearField, Recording};

    #[test]
    fn dents_are_the_sums_of_blocks() {
        let bytes = include_bytes!("../../../../data/recordings/v1/free.palp");
        let recording = Recording::from_bytes(bytes).expect("a released recording");
        let (whole, n) = (recording.residual, recording.surface.positions.len());
        // The same as rows of blocks, of which every third is missing.
        let kept = |i: usize, j: usize| (i + j) % 3 != 1;
        let mut near = NearField { radius: 1.0, offsets: vec![0], nodes: Vec::new(), blocks: Vec::new() };
        for i in 0..n {
            for j in (0..n).filter(|&j| kept(i, j)) {
                near.nodes.push(j as u32);
                let block = whole.block(i, j);
                near.blocks.extend((0..3).flat_map(|row| block.row(row).to_array()).map(|x| x as f32));
            }
            near.offsets.push(near.nodes.len() as u32);
        }
        let loads =
            [(0, DVec3::X), (5, DVec3::new(0.3, -1.0, 2.0)), (n as u32 - 1, DVec3::new(-1.0, 0.5, 0.1))];
        for residual in [whole, ResidualCompliance::NearField(near), ResidualCompliance::None] {
            let mut out = vec![DVec3::Y; n];
            add_residual_displacements(&residual, &loads, &mut out);
            for (i, u) in out.into_iter().enumerate() {
                let sum: DVec3 = loads.iter().map(|&(j, f)| residual.block(i, j as usize) * f).sum();
                assert!((u - DVec3::Y - sum).length() < 1e-14 * (1.0 + sum.length()), "{i}: {u} {sum}");
            }
        }
    }
}
