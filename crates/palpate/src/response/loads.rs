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
    dents: Vec<Option<DVec3>>,
    known: Vec<u32>,
}

impl NodalForces {
    pub(super) fn new(nodes: usize, points: usize) -> Self {
        Self {
            loaded: Vec::with_capacity(nodes.min(3 * points)),
            at: vec![0; nodes],
            dents: vec![None; nodes],
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
        self.known.drain(..).for_each(|node| self.dents[node as usize] = None);
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
    pub(crate) fn dent(&self, residual: &ResidualCompliance, node: usize) -> DVec3 {
        let sum =
            || self.loaded.iter().map(|&(other, force)| residual.block(node, other as usize) * force).sum();
        self.dents[node].unwrap_or_else(sum)
    }

    /// The same, known from then on.
    pub(super) fn find_dent(&mut self, residual: &ResidualCompliance, node: usize) -> DVec3 {
        let dent = self.dent(residual, node);
        self.know(node, dent);
        dent
    }

    pub(super) fn know(&mut self, node: usize, dent: DVec3) {
        if self.dents[node].replace(dent).is_none() {
            self.known.push(node as u32);
        }
    }
}
