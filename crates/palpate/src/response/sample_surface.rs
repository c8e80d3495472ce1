//! Contact samples of a level of detail, with the decimated surface between them.
//!
//! A sample stands for the surface around it: its patch averages displacement and distributes force. Its position at rest is
//! averaged along its normal as well, so that its gap is the weighted gap of mortar methods (Puso & Laursen 2004, Comput. Methods
//! Appl. Mech. Eng. 193, 601):
//!
//! ```text
//! X̂_c = X_c + n_c·Σ wᵢ·n_c·(Xᵢ − X_c)/Σ wᵢ        over the nodes i of the patch with n_c·nᵢ > cos 32°
//! D_cd = Σᵢⱼ w_ci·Sᵢⱼ·w_dj
//! ```
//!
//! Nodes across an edge are left out: a sample of an edge or of a corner stays there, and a body rests on it. The residual
//! compliance D [m/N] between samples is that of the nodes, averaged on both sides: as exact as it is recorded, and positive
//! semi-definite with it.
//!
//! Equations: docs/theory.md (C59), (C60).

use crate::recording::{NearField, Recording, ResidualCompliance, block_at};
use crate::surface::{EDGE_COSINE, PatchWeights, SampleLevel, SphereTree, Surface, SurfacePoint};
use alloc::vec;
use alloc::vec::Vec;
use glam::{DMat3, DVec3};

/// Contact samples of a surface, with the decimated surface between them.
#[derive(Debug, Clone)]
pub(crate) struct SampleSurface {
    /// Sample index of each surface node; [`NONE`] for the others.
    indices: Vec<u32>,
    /// Surface node of each sample.
    nodes: Vec<u32>,
    /// Decimated surface between the positions X̂ of the samples; a degenerate triangle per sample where the level has none.
    pub(crate) surface: Surface,
    /// Whether the level has a decimated surface.
    pub(crate) is_surface: bool,
    /// One triangle of each sample.
    triangle: Vec<u32>,
    pub(crate) tree: SphereTree,
    /// Residual compliance D between samples [m/N].
    pub(super) residual: ResidualCompliance,
    /// Residual compliance between samples and surface nodes [m/N].
    pub(super) to_nodes: PatchNodeCompliance,
}

/// Sample index of a surface node without sample.
const NONE: u32 = u32::MAX;

impl SampleSurface {
    /// Contact samples of a level, whose patches have these weights; with the outward normals of all surface nodes and the heights of
    /// the smooth surface over them [m].
    pub(super) fn new(
        recording: &Recording,
        level: &SampleLevel,
        weights: &PatchWeights,
        (normals, heights): (&[DVec3], &[f64]),
    ) -> Self {
        let (surface, nodes) = (&recording.surface, &level.nodes);
        let mut indices = vec![NONE; surface.positions.len()];
        nodes.iter().enumerate().for_each(|(index, &node)| indices[node as usize] = index as u32);
        let is_surface = !level.triangles.is_empty();
        let triangles =
            if is_surface { level.triangles.clone() } else { nodes.iter().map(|&node| [node; 3]).collect() };
        let mut triangle = vec![0; nodes.len()];
        for (t, corners) in triangles.iter().enumerate() {
            corners.iter().for_each(|node| triangle[indices[*node as usize] as usize] = t as u32);
        }
        let surface = Surface {
            triangles,
            positions: averaged_positions(surface, nodes, weights, (normals, heights)),
            ..surface.clone()
        };
        let tree = SphereTree::new(&surface.positions, &surface.triangles);
        let to_nodes = PatchNodeCompliance::new(&recording.residual, weights, surface.positions.len());
        let residual = averaged(&recording.residual, &to_nodes, weights);
        Self { indices, nodes: nodes.clone(), surface, is_surface, triangle, tree, residual, to_nodes }
    }

    /// Cells with these weights: each has the node next to its centroid that no other cell has, as its name, and its position at rest
    /// is the centroid.
    pub(super) fn of_cells(recording: &Recording, weights: &PatchWeights) -> Self {
        let rest = &recording.surface.positions;
        let (mut indices, mut nodes) = (vec![NONE; rest.len()], Vec::with_capacity(weights.len()));
        let mut positions = rest.clone();
        for c in 0..weights.len() {
            let centroid: DVec3 = weights.of(c).map(|(node, w)| rest[node] * w).sum();
            let distance = |node: &usize| (rest[*node] - centroid).length_squared();
            let unused = (0..rest.len()).filter(|node| indices[*node] == NONE);
            let Some(node) = unused.min_by(|a, b| distance(a).total_cmp(&distance(b))) else { break };
            indices[node] = c as u32;
            positions[node] = centroid;
            nodes.push(node as u32);
        }
        let triangles: Vec<[u32; 3]> = nodes.iter().map(|&node| [node; 3]).collect();
        let triangle = (0..nodes.len() as u32).collect();
        let surface = Surface { triangles, positions, ..recording.surface.clone() };
        let tree = SphereTree::new(&surface.positions, &surface.triangles);
        let to_nodes = PatchNodeCompliance::new(&recording.residual, weights, rest.len());
        let residual = averaged(&recording.residual, &to_nodes, weights);
        Self { indices, nodes, surface, is_surface: false, triangle, tree, residual, to_nodes }
    }

    /// Surface nodes of the samples.
    pub(super) fn nodes(&self) -> &[u32] {
        &self.nodes
    }

    /// Index of the sample at a surface node that is one.
    ///
    /// # Real time
    pub(super) fn index(&self, node: usize) -> usize {
        self.indices[node] as usize
    }

    /// Sample as a point of the decimated surface.
    pub(super) fn node_point(&self, node: usize) -> SurfacePoint {
        let triangle = self.triangle[self.index(node)];
        let corners = self.surface.triangles[triangle as usize];
        let first = corners.iter().position(|corner| *corner as usize == node);
        SurfacePoint { triangle, weights: [0, 1, 2].map(|k| if Some(k) == first { 1.0 } else { 0.0 }) }
    }

    /// Residual compliance [m/N] of a sample: its displacement per force at a point of the decimated surface.
    ///
    /// # Real time
    pub(super) fn residual_at(&self, node: usize, point: &SurfacePoint) -> DMat3 {
        let between = |other: usize| self.residual.block(self.index(node), self.index(other));
        self.used_corners(point).map(|(other, weight)| between(other) * weight).sum()
    }

    fn used_corners(&self, point: &SurfacePoint) -> impl Iterator<Item = (usize, f64)> {
        self.surface.corners(point).into_iter().filter(|corner| corner.1 != 0.0)
    }
}

/// Node positions [m] with those of the samples on the smooth surface, averaged along their normals.
fn averaged_positions(
    surface: &Surface,
    samples: &[u32],
    weights: &PatchWeights,
    (normals, heights): (&[DVec3], &[f64]),
) -> Vec<DVec3> {
    let mut positions = surface.positions.clone();
    for (c, node) in samples.iter().map(|&node| node as usize).enumerate() {
        let (centre, normal) = (surface.positions[node], normals[node]);
        let smooth = weights.of(c).filter(|(other, _)| normals[*other].dot(normal) > EDGE_COSINE);
        let (sum, height) = smooth.fold((0.0, 0.0), |(sum, height), (other, w)| {
            let over = surface.positions[other] - centre + normals[other] * heights[other];
            (sum + w, height + w * normal.dot(over))
        });
        if sum > 0.0 {
            positions[node] += normal * (height / sum);
        }
    }
    positions
}

/// Residual compliance between patches, averaged over both, from that between patches and nodes: (W·S)·Wᵀ.
fn averaged(
    residual: &ResidualCompliance,
    to_nodes: &PatchNodeCompliance,
    weights: &PatchWeights,
) -> ResidualCompliance {
    let count = weights.len();
    match residual {
        ResidualCompliance::None => ResidualCompliance::None,
        ResidualCompliance::Whole(_) => {
            let mut packed = vec![0.0; 3 * count * (3 * count + 1) / 2];
            for (c, d) in (0..count).flat_map(|c| (0..=c).map(move |d| (c, d))) {
                let block = to_nodes.averaged(c, weights.of(d));
                for axis in 0..3 {
                    let row = 3 * c + axis;
                    let width = if c == d { axis + 1 } else { 3 };
                    let at = row * (row + 1) / 2 + 3 * d;
                    for (out, x) in packed[at..at + width].iter_mut().zip(block.row(axis).to_array()) {
                        *out = x as f32;
                    }
                }
            }
            ResidualCompliance::Whole(packed)
        }
        ResidualCompliance::NearField(near) => {
            ResidualCompliance::NearField(averaged_near_field(near.radius, to_nodes, weights))
        }
    }
}

/// W·S·Wᵀ of a near field: blocks between patches with nodes within each other's near field.
fn averaged_near_field(radius: f64, to_nodes: &PatchNodeCompliance, weights: &PatchWeights) -> NearField {
    // Patches that each node belongs to, with its weights in them.
    let mut patches_of = vec![Vec::new(); to_nodes.node_count];
    for c in 0..weights.len() {
        weights.of(c).for_each(|(node, w)| patches_of[node].push((c, w)));
    }
    let mut sums = Accumulator::new(weights.len());
    let mut lower: Vec<Vec<(u32, DMat3)>> = Vec::with_capacity(weights.len());
    for c in 0..weights.len() {
        for (node, block) in to_nodes.row(c) {
            for &(d, w) in patches_of[node].iter().take_while(|(d, _)| *d <= c) {
                sums.add(d, block * w);
            }
        }
        lower.push(sums.drain().map(|(d, block)| (d as u32, block)).collect());
    }
    let mut rows = lower.clone();
    for (c, row) in lower.iter().enumerate() {
        for (d, block) in row.iter().filter(|(d, _)| *d as usize != c) {
            rows[*d as usize].push((c as u32, block.transpose()));
        }
    }
    let mut out = NearField { radius, offsets: vec![0], nodes: Vec::new(), blocks: Vec::new() };
    for row in rows {
        for (d, block) in row {
            out.nodes.push(d);
            out.blocks.extend(block.transpose().to_cols_array().map(|x| x as f32));
        }
        out.offsets.push(out.nodes.len() as u32);
    }
    out
}

/// Residual compliance W·S between patches and surface nodes [m/N]: displacement of a patch per force at a node. Sparse by rows;
/// a row with all nodes is indexed directly.
#[derive(Debug, Clone)]
pub(super) struct PatchNodeCompliance {
    node_count: usize,
    offsets: Vec<usize>,
    nodes: Vec<u32>,
    blocks: Vec<f32>,
}

impl PatchNodeCompliance {
    fn new(residual: &ResidualCompliance, weights: &PatchWeights, node_count: usize) -> Self {
        let mut out = Self { node_count, offsets: vec![0], nodes: Vec::new(), blocks: Vec::new() };
        let mut sums = Accumulator::new(node_count);
        for c in 0..weights.len() {
            for (node, w) in weights.of(c) {
                match residual {
                    ResidualCompliance::None => {}
                    ResidualCompliance::Whole(_) => {
                        (0..node_count).for_each(|other| sums.add(other, residual.block(node, other) * w));
                    }
                    ResidualCompliance::NearField(near) => {
                        near.row(node).for_each(|(other, block)| sums.add(other, block * w));
                    }
                }
            }
            for (node, block) in sums.drain() {
                out.nodes.push(node as u32);
                out.blocks.extend(block.transpose().to_cols_array().map(|x| x as f32));
            }
            out.offsets.push(out.nodes.len());
        }
        out
    }

    /// Blocks of a patch's row, with their nodes.
    fn row(&self, patch: usize) -> impl Iterator<Item = (usize, DMat3)> + '_ {
        (self.offsets[patch]..self.offsets[patch + 1])
            .map(|at| (self.nodes[at] as usize, block_at(&self.blocks, at)))
    }

    /// Displacement of a patch per force at a node [m/N].
    ///
    /// # Real time
    pub(super) fn between(&self, patch: usize, node: usize) -> DMat3 {
        let (first, end) = (self.offsets[patch], self.offsets[patch + 1]);
        if end - first == self.node_count {
            return block_at(&self.blocks, first + node);
        }
        match self.nodes[first..end].binary_search(&(node as u32)) {
            Ok(at) => block_at(&self.blocks, first + at),
            Err(_) => DMat3::ZERO,
        }
    }

    /// Displacement of a patch per force that nodes share by weights [m/N].
    ///
    /// # Real time
    pub(super) fn averaged(&self, patch: usize, nodes: impl Iterator<Item = (usize, f64)>) -> DMat3 {
        nodes.map(|(node, weight)| self.between(patch, node) * weight).sum()
    }
}

/// Sparse sums of blocks by index.
struct Accumulator {
    sums: Vec<DMat3>,
    is_used: Vec<bool>,
    used: Vec<usize>,
}

impl Accumulator {
    fn new(count: usize) -> Self {
        Self { sums: vec![DMat3::ZERO; count], is_used: vec![false; count], used: Vec::new() }
    }

    fn add(&mut self, at: usize, block: DMat3) {
        if !core::mem::replace(&mut self.is_used[at], true) {
            self.used.push(at);
        }
        self.sums[at] += block;
    }

    /// Take the sums out, by ascending index.
    fn drain(&mut self) -> impl Iterator<Item = (usize, DMat3)> + '_ {
        let Self { sums, is_used, used } = self;
        used.sort_unstable();
        used.drain(..).map(|at| {
            is_used[at] = false;
            (at, core::mem::replace(&mut sums[at], DMat3::ZERO))
        })
    }
}
