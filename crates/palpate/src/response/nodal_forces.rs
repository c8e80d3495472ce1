//! Spring forces of the residual compliance on the nodes of the finite element model, and displacements of the surface nodes by them.

use super::sampled_residual::{ResidualMemory, SampledResidual};
use super::{Body, Footprint, SpringForce};
use alloc::vec;
use alloc::vec::Vec;
use glam::DVec3;

/// Forces at points [N, body], distributed to the model's nodes and summed.
#[derive(Debug, Clone)]
pub(crate) struct NodalForces {
    /// Loaded model nodes and the forces whose static displacement they have.
    loaded: Vec<(u32, DVec3)>,
    /// Memory of the forces on each.
    memories: Vec<ResidualMemory>,
    /// Index of each model node in `loaded`, from 1; 0 for unloaded nodes.
    at: Vec<u32>,
    /// Cached residual displacements of surface nodes [m, body], and the nodes that have one.
    displacements: Vec<Option<DVec3>>,
    cached: Vec<u32>,
}

impl NodalForces {
    /// For numbers of model nodes and of surface nodes.
    pub(super) fn new(model_nodes: usize, surface_nodes: usize) -> Self {
        Self {
            loaded: Vec::with_capacity(model_nodes),
            memories: Vec::with_capacity(model_nodes),
            at: vec![0; model_nodes],
            displacements: vec![None; surface_nodes],
            cached: Vec::with_capacity(surface_nodes),
        }
    }

    /// Loaded model nodes with their forces [N, body].
    pub(crate) fn loaded(&self) -> &[(u32, DVec3)] {
        &self.loaded
    }

    /// Upper limit of loaded nodes.
    pub(super) fn capacity(&self) -> usize {
        self.loaded.capacity()
    }

    /// Forget the cached displacements.
    pub(super) fn clear_cache(&mut self) {
        let Self { displacements, cached, .. } = self;
        cached.drain(..).for_each(|node| displacements[node as usize] = None);
    }

    /// Let all memories pass over a step without force, and forget those below a limit [N].
    pub(super) fn relax(&mut self, residual: &SampledResidual, least: f64) {
        self.clear_cache();
        let Self { loaded, memories, at, .. } = self;
        let mut kept = 0;
        for index in 0..loaded.len() {
            let node = loaded[index].0;
            let mut memory = memories[index];
            residual.relax(&mut memory);
            let is_kept = memory.size() > least;
            at[node as usize] = if is_kept { kept as u32 + 1 } else { 0 };
            if is_kept {
                (loaded[kept], memories[kept]) = ((node, residual.effective(&memory)), memory);
                kept += 1;
            }
        }
        loaded.truncate(kept);
        memories.truncate(kept);
    }

    /// Add the memory of a force on model nodes with these weights.
    pub(super) fn add(
        &mut self,
        nodes: impl Iterator<Item = (usize, f64)>,
        memory: &ResidualMemory,
        residual: &SampledResidual,
    ) {
        for (node, weight) in nodes.filter(|(_, weight)| *weight != 0.0) {
            if self.at[node] == 0 {
                self.loaded.push((node as u32, DVec3::ZERO));
                self.memories.push(ResidualMemory::default());
                self.at[node] = self.loaded.len() as u32;
            }
            let index = self.at[node] as usize - 1;
            self.memories[index].add(&memory.map(|force| force * weight));
            self.loaded[index].1 = residual.effective(&self.memories[index]);
        }
    }

    /// Displacements of a node by every part of the memories, and by those of contact samples [m, body].
    ///
    /// # Real time
    /// Costs the loaded nodes and the springs.
    pub(super) fn displacements_by_memory(
        &self,
        body: &Body,
        springs: &[SpringForce],
        node: usize,
    ) -> ResidualMemory {
        let mut sum = ResidualMemory::default();
        for ((other, _), memory) in self.loaded.iter().zip(&self.memories) {
            let block = body.recording.residual_by_model_node(node, *other as usize);
            sum.add_displacements(&block, memory);
        }
        for spring in springs.iter().filter(|spring| spring.location.footprint != Footprint::Point) {
            let block = body.residual_at(Footprint::Point, node, &spring.location);
            sum.add_displacements(&block, &spring.memory);
        }
        sum
    }

    /// Cached residual displacement of a surface node [m, body].
    pub(crate) fn known(&self, node: usize) -> Option<DVec3> {
        self.displacements[node]
    }

    /// Residual displacement of a model node under these forces and the springs of contact samples [m, body].
    ///
    /// # Real time
    /// Costs the loaded nodes and the springs.
    pub(crate) fn displacement_of_model_node(
        &self,
        body: &Body,
        springs: &[SpringForce],
        node: usize,
    ) -> DVec3 {
        let by_nodes = body.recording.residual.displacement(node, &self.loaded);
        let of_samples = springs.iter().filter(|spring| spring.location.footprint != Footprint::Point);
        let by_sample =
            |spring: &SpringForce| body.residual_of_model_node(node, &spring.location) * spring.force;
        by_nodes + of_samples.map(by_sample).sum::<DVec3>()
    }

    /// Cache the residual displacement of a node [m, body].
    pub(super) fn store(&mut self, node: usize, displacement: DVec3) {
        if self.displacements[node].replace(displacement).is_none() {
            self.cached.push(node as u32);
        }
    }
}
