//! Loads of the residual compliance at the vertices of a body's surfaces, and their displacements.
//!
//! A force at a surface point loads the corners of its triangle. What sliding contacts leave behind gathers at the vertices of the contact area,
//! whose number bounds the cost of a displacement. Patches of tips, which may lie anywhere, are apart (`spring_forces`).
//!
//! Equations: docs/theory.md (C55) to (C57).

use super::body::used;
use super::sampled_residual::{ResidualMemory, SampledResidual};
use super::{Body, ContactLocation, Footprint};
use crate::bounded_vec::BoundedVec;
use crate::recording::ResidualCompliance;
use alloc::vec;
use alloc::vec::Vec;
use glam::DVec3;

/// Load at a vertex whose largest part is below this share of the object's largest one is forgotten: round-off.
const FORGOTTEN: f64 = 1e-13;

/// Share of the object's largest load from which on one that no contact causes counts [1]: an error of that share of the bounds.
const LEFT: f64 = 1e-6;

/// Load at a vertex of a footprint's surface: force whose static displacement it has [N, body].
#[derive(Debug, Clone, Copy)]
pub(super) struct VertexLoad {
    pub(super) footprint: Footprint,
    pub(super) vertex: u32,
    pub(super) force: DVec3,
}

/// Loads on a body: of its nodes, of the contact samples of each level, and of the cells of its clamps.
#[derive(Debug, Clone)]
pub(crate) struct ResidualLoads {
    surfaces: Vec<VertexLoads>,
}

/// Loads at the vertices of one surface.
#[derive(Debug, Clone)]
struct VertexLoads {
    footprint: Footprint,
    /// Loaded vertices with the forces whose static displacement they have [N, body].
    forces: BoundedVec<(u32, DVec3)>,
    /// Memory of the forces on each, and the part of its force by the contacts of the last step [N, body].
    memories: BoundedVec<ResidualMemory>,
    present: BoundedVec<DVec3>,
    /// Index of each vertex among the loaded ones, from 1; 0 for others.
    at: Vec<u32>,
    /// Cached residual displacements of vertices [m, body], and the vertices that have one.
    displacements: Vec<Option<DVec3>>,
    cached: BoundedVec<u32>,
}

impl ResidualLoads {
    pub(super) fn new(body: &Body) -> Self {
        let surfaces = (0..body.vertex_surfaces()).map(|surface| {
            let footprint = body.footprint_of_surface(surface);
            VertexLoads::new(footprint, body.vertices(footprint))
        });
        Self { surfaces: surfaces.collect() }
    }

    /// All loads, surface by surface.
    pub(super) fn iter(&self) -> impl Iterator<Item = VertexLoad> {
        self.surfaces.iter().flat_map(|own| {
            let load =
                |&(vertex, force): &(u32, DVec3)| VertexLoad { footprint: own.footprint, vertex, force };
            own.forces.iter().map(load)
        })
    }

    /// Upper limit of loaded vertices.
    pub(super) fn room(&self) -> usize {
        self.surfaces.iter().map(|own| own.at.len()).sum()
    }

    /// Size of the largest load [N].
    pub(super) fn largest(&self) -> f64 {
        let sizes = self.surfaces.iter().flat_map(|own| own.memories.iter().map(ResidualMemory::size));
        sizes.fold(0.0, f64::max)
    }

    /// Forget the cached displacements.
    pub(super) fn clear_cache(&mut self) {
        for VertexLoads { displacements, cached, .. } in &mut self.surfaces {
            cached.drain(..).for_each(|vertex| displacements[vertex as usize] = None);
        }
    }

    /// Let all memories pass over a step without force, and forget those that are small beside the largest load [N] of the object.
    pub(super) fn relax(&mut self, residual: &SampledResidual, largest: f64) {
        self.clear_cache();
        self.surfaces.iter_mut().for_each(|own| own.relax(residual, FORGOTTEN * largest));
    }

    /// Add the memory of a force at a location.
    pub(super) fn add(
        &mut self,
        body: &Body,
        location: &ContactLocation,
        memory: &ResidualMemory,
        residual: &SampledResidual,
    ) {
        if let Some(surface) = body.vertex_surface(location.footprint) {
            self.surfaces[surface].add(body.corners(location), memory, residual);
        }
    }

    /// Add the force of a contact of the last step [N, body] to those that loads are compared with.
    pub(super) fn add_present(&mut self, body: &Body, location: &ContactLocation, force: DVec3) {
        let Some(surface) = body.vertex_surface(location.footprint) else { return };
        let VertexLoads { at, present, .. } = &mut self.surfaces[surface];
        for (vertex, weight) in used(body.corners(location)) {
            if let Some(index) = at[vertex].checked_sub(1) {
                present[index as usize] += force * weight;
            }
        }
    }

    /// Whether there are loads that the contacts of the last step do not cause, by the largest load [N].
    pub(super) fn has_left(&self, largest: f64) -> bool {
        let pairs = self.surfaces.iter().flat_map(|own| own.forces.iter().zip(own.present.iter()));
        pairs.into_iter().any(|((_, force), present)| (*force - *present).length() > LEFT * largest)
    }

    /// Displacements of a vertex by every part of the memories [m, body].
    ///
    /// # Real time
    /// Costs the loaded vertices.
    pub(super) fn displacements_by_memory(
        &self,
        body: &Body,
        footprint: Footprint,
        vertex: usize,
    ) -> ResidualMemory {
        let mut sum = ResidualMemory::default();
        for own in self.surfaces.iter().filter(|own| !own.forces.is_empty()) {
            let Some(row) = body.residual_row(footprint, vertex, own.footprint) else { continue };
            for ((other, _), memory) in own.forces.iter().zip(own.memories.iter()) {
                sum.add_displacements(&row.block(*other as usize), memory);
            }
        }
        sum
    }

    /// Residual displacement of a vertex [m, body].
    ///
    /// # Real time
    /// Costs the loaded vertices, unless it is cached.
    pub(crate) fn displacement(&self, body: &Body, footprint: Footprint, vertex: usize) -> DVec3 {
        let Some(surface) = body.vertex_surface(footprint) else { return DVec3::ZERO };
        let sum = || {
            let mut sum = DVec3::ZERO;
            for own in self.surfaces.iter().filter(|own| !own.forces.is_empty()) {
                let Some(row) = body.residual_row(footprint, vertex, own.footprint) else { continue };
                for &(other, force) in own.forces.iter() {
                    sum += row.block(other as usize) * force;
                }
            }
            sum
        };
        self.surfaces[surface].displacements[vertex].unwrap_or_else(sum)
    }

    /// Cache the residual displacement of a vertex [m, body].
    pub(super) fn store(&mut self, surface: usize, vertex: usize, displacement: DVec3) {
        let VertexLoads { displacements, cached, .. } = &mut self.surfaces[surface];
        if displacements[vertex].replace(displacement).is_none() {
            cached.push(vertex as u32);
        }
    }
}

impl VertexLoads {
    fn new(footprint: Footprint, vertices: usize) -> Self {
        Self {
            footprint,
            forces: BoundedVec::new(vertices),
            memories: BoundedVec::new(vertices),
            present: BoundedVec::new(vertices),
            at: vec![0; vertices],
            displacements: vec![None; vertices],
            cached: BoundedVec::new(vertices),
        }
    }

    fn relax(&mut self, residual: &SampledResidual, least: f64) {
        let Self { forces, memories, present, at, .. } = self;
        let mut kept = 0;
        for index in 0..forces.len() {
            let vertex = forces[index].0;
            let mut memory = memories[index];
            residual.relax(&mut memory);
            let is_kept = memory.size() > least;
            at[vertex as usize] = if is_kept { kept as u32 + 1 } else { 0 };
            if is_kept {
                (forces[kept], memories[kept]) = ((vertex, residual.effective(&memory)), memory);
                kept += 1;
            }
        }
        forces.truncate(kept);
        memories.truncate(kept);
        present.truncate(kept);
        present.fill(DVec3::ZERO);
    }

    fn add(&mut self, corners: [(usize, f64); 3], memory: &ResidualMemory, residual: &SampledResidual) {
        for (vertex, weight) in used(corners) {
            if self.at[vertex] == 0 {
                self.forces.push((vertex as u32, DVec3::ZERO));
                self.memories.push(ResidualMemory::default());
                self.present.push(DVec3::ZERO);
                self.at[vertex] = self.forces.len() as u32;
            }
            let index = self.at[vertex] as usize - 1;
            self.memories[index].add(&memory.map(|force| force * weight));
            self.forces[index].1 = residual.effective(&self.memories[index]);
        }
    }
}

/// Add the residual displacements of all nodes under nodal forces [N] to `out` [m]. Costs nodes × forces, or for a near field
/// the blocks of the loaded nodes.
pub(super) fn add_residual_displacements(
    residual: &ResidualCompliance,
    loads: &[(u32, DVec3)],
    out: &mut [DVec3],
) {
    for &(node, force) in loads {
        let node = node as usize;
        match residual {
            // S is symmetric: the blocks of a column are those of the row, transposed.
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
    fn residual_displacements_are_the_sums_of_blocks() {
        let bytes = include_bytes!("../../../../data/recordings/v1/free.palp");
        let recording = Recording::from_bytes(bytes).expect("a released recording");
        let (whole, n) = (recording.residual, recording.surface.positions.len());
        // A near field of rows of blocks without every third one.
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
