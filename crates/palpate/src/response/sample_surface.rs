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

use crate::recording::{NearField, Recording, ResidualCompliance};
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
}

/// Sample index of a surface node without sample.
const NONE: u32 = u32::MAX;

impl SampleSurface {
    /// Contact samples of a level, whose patches have these weights; with the outward normals of all surface nodes.
    pub(super) fn new(
        recording: &Recording,
        level: &SampleLevel,
        weights: &PatchWeights,
        normals: &[DVec3],
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
            positions: averaged_positions(surface, nodes, weights, normals),
            ..surface.clone()
        };
        let tree = SphereTree::new(&surface.positions, &surface.triangles);
        let residual = averaged(&recording.residual, weights, surface.positions.len());
        Self { indices, nodes: nodes.clone(), surface, is_surface, triangle, tree, residual }
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
        let residual = averaged(&recording.residual, weights, rest.len());
        Self { indices, nodes, surface, is_surface: false, triangle, tree, residual }
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

    /// Residual compliance [m/N] between two points of the decimated surface, interpolated between its corners as the modes are.
    ///
    /// # Real time
    pub(super) fn residual(&self, a: &SurfacePoint, b: &SurfacePoint) -> DMat3 {
        self.used_corners(a).map(|(node, weight)| self.residual_at(node, b) * weight).sum()
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

/// Node positions [m] with those of the samples averaged along their normals.
fn averaged_positions(
    surface: &Surface,
    samples: &[u32],
    weights: &PatchWeights,
    normals: &[DVec3],
) -> Vec<DVec3> {
    let mut positions = surface.positions.clone();
    for (c, node) in samples.iter().map(|&node| node as usize).enumerate() {
        let (centre, normal) = (surface.positions[node], normals[node]);
        let smooth = weights.of(c).filter(|(other, _)| normals[*other].dot(normal) > EDGE_COSINE);
        let (sum, height) = smooth.fold((0.0, 0.0), |(sum, height), (other, w)| {
            (sum + w, height + w * normal.dot(surface.positions[other] - centre))
        });
        if sum > 0.0 {
            positions[node] += normal * (height / sum);
        }
    }
    positions
}

/// Residual compliance between patches, averaged over both: W·S·Wᵀ.
fn averaged(residual: &ResidualCompliance, weights: &PatchWeights, nodes: usize) -> ResidualCompliance {
    // Patches that each node belongs to, with its weights in them.
    let mut patches_of = vec![Vec::new(); nodes];
    for c in 0..weights.len() {
        weights.of(c).for_each(|(node, w)| patches_of[node].push((c, w)));
    }
    match residual {
        ResidualCompliance::None => ResidualCompliance::None,
        ResidualCompliance::Whole(packed) => {
            ResidualCompliance::Whole(averaged_whole(packed, weights, &patches_of))
        }
        ResidualCompliance::NearField(near) => {
            ResidualCompliance::NearField(averaged_near_field(near, weights, &patches_of))
        }
    }
}

/// W·S·Wᵀ of a packed lower triangle. With its half L, S = L + Lᵀ, so that only contiguous rows are read.
fn averaged_whole(packed: &[f32], weights: &PatchWeights, patches_of: &[Vec<(usize, f64)>]) -> Vec<f32> {
    let count = weights.len();
    let start = |row: usize| row * (row + 1) / 2;
    let mut out = vec![0.0; start(3 * count)];
    let mut rows = vec![0.0; 9 * patches_of.len()];
    let mut sums = vec![0.0; 9 * count];
    for c in 0..count {
        // Three rows of W·L.
        rows.fill(0.0);
        let width = 3 * patches_of.len();
        for (node, w) in weights.of(c) {
            for (axis, row) in rows.chunks_exact_mut(width).enumerate() {
                let at = 3 * node + axis;
                let numbers = &packed[start(at)..start(at + 1)];
                row.iter_mut().zip(numbers).for_each(|(sum, x)| *sum += w * f64::from(*x));
                // Half of the diagonal.
                row[at] -= 0.5 * w * f64::from(numbers[at]);
            }
        }
        // Three rows of W·L·Wᵀ.
        sums.fill(0.0);
        for (row, sums) in rows.chunks_exact(width).zip(sums.chunks_exact_mut(3 * count)) {
            for (numbers, patches) in row.chunks_exact(3).zip(patches_of) {
                if numbers != [0.0; 3] {
                    for &(d, w) in patches {
                        sums[3 * d..3 * d + 3].iter_mut().zip(numbers).for_each(|(sum, x)| *sum += w * x);
                    }
                }
            }
        }
        for (axis, sums) in sums.chunks_exact(3 * count).enumerate() {
            let own = 3 * c + axis;
            for (other, sum) in sums.iter().enumerate() {
                let at = start(own.max(other)) + own.min(other);
                out[at] += (if own == other { 2.0 * sum } else { *sum }) as f32;
            }
        }
    }
    out
}

/// W·S·Wᵀ of a near field: blocks between patches with nodes within each other's near field.
fn averaged_near_field(
    near: &NearField,
    weights: &PatchWeights,
    patches_of: &[Vec<(usize, f64)>],
) -> NearField {
    let mut field = Accumulator::new(patches_of.len());
    let mut sums = Accumulator::new(weights.len());
    let mut lower: Vec<Vec<(u32, DMat3)>> = Vec::with_capacity(weights.len());
    for c in 0..weights.len() {
        for (node, w) in weights.of(c) {
            near.row(node).for_each(|(other, block)| field.add(other, block * w));
        }
        for (node, block) in field.drain() {
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
    let mut out = NearField { radius: near.radius, offsets: vec![0], nodes: Vec::new(), blocks: Vec::new() };
    for row in rows {
        for (d, block) in row {
            out.nodes.push(d);
            out.blocks.extend(block.transpose().to_cols_array().map(|x| x as f32));
        }
        out.offsets.push(out.nodes.len() as u32);
    }
    out
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
