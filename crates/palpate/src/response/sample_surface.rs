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
//! Nodes across an edge are left out: a sample of an edge or of a corner stays there, and a body rests on it. Such a sample has one-sided
//! patches as well, one for each smooth side; a contact with an obstacle takes the one whose normal opposes it most. The residual
//! compliance D [m/N] between samples is that of the nodes, averaged on both sides: as exact as it is recorded, and positive
//! semi-definite with it.
//!
//! Equations: docs/theory.md (C59), (C60), (C92).

use super::subtree_compliance::SubtreeCompliance;
use crate::recording::{NearField, Recording, ResidualCompliance, block_at};
use crate::spatial::frobenius_square;
use crate::surface::{
    EDGE_COSINE, OneSidedPatch, PatchWeights, SampleLevel, SphereTree, Surface, SurfacePoint,
};
use alloc::vec;
use alloc::vec::Vec;
use core::ops::Range;
use glam::{DMat3, DVec3};

/// No triangle.
const NONE: u32 = u32::MAX;

/// Contact samples of a surface, with the decimated surface between them. Its vertices are the samples and, after them, the one-sided
/// patches of samples on creases; or the cells of clamps.
#[derive(Debug, Clone)]
pub(crate) struct SampleSurface {
    /// Number of samples, which are the first vertices.
    samples: usize,
    /// Sample of each further vertex; they stand sample after sample.
    one_sided: Vec<u32>,
    /// Outward unit normal of every vertex at rest [body]; zero on a sheet of no thickness.
    normals: Vec<DVec3>,
    /// Decimated surface between the positions X̂ of the vertices, and a degenerate triangle for every vertex without one.
    pub(crate) surface: Surface,
    /// Whether the level has a decimated surface.
    pub(crate) is_surface: bool,
    /// One triangle of each vertex.
    triangle: Vec<u32>,
    /// Tree over the decimated surface, or over the samples where there is none.
    pub(crate) tree: SphereTree,
    /// Residual compliance of its subtrees.
    pub(super) subtrees: SubtreeCompliance,
    /// Residual compliance D between vertices [m/N].
    pub(super) residual: ResidualCompliance,
    /// Residual compliance between vertices and the model's nodes [m/N].
    pub(super) to_nodes: PatchNodeCompliance,
    /// Largest displacement of a node per force on each vertex, over that of the vertex [1]: a node within a patch moves farther than its average.
    peaks: Vec<f32>,
}

/// Vertices of a sample surface before the response of the body is known: where they are, and the decimated surface between them.
pub(super) struct SampleVertices {
    samples: usize,
    one_sided: Vec<u32>,
    normals: Vec<DVec3>,
    surface: Surface,
}

impl SampleVertices {
    /// Contact samples of a level, whose patches have these weights; with the outward normals of all surface nodes and the heights of
    /// the smooth surface over them [m].
    pub(super) fn new(
        rest: &Surface,
        level: &SampleLevel,
        (weights, one_sided): (&PatchWeights, &[OneSidedPatch]),
        (normals, heights): (&[DVec3], &[f64]),
    ) -> Self {
        let samples = level.nodes.len();
        let of_sample: Vec<u32> = one_sided.iter().map(|side| side.sample as u32).collect();
        let nodes: Vec<u32> =
            level.nodes.iter().copied().chain(of_sample.iter().map(|&of| level.nodes[of as usize])).collect();
        let at_nodes = level.nodes.iter().map(|&node| normals[node as usize]);
        let vertex_normals: Vec<DVec3> = at_nodes.chain(one_sided.iter().map(|side| side.normal)).collect();
        let triangles = if level.triangles.is_empty() {
            Vec::new()
        } else {
            let mut index = vec![u32::MAX; rest.positions.len()];
            level.nodes.iter().enumerate().for_each(|(sample, &node)| index[node as usize] = sample as u32);
            let sample = |node: u32| index[node as usize];
            level.triangles.iter().map(|corners| corners.map(sample)).collect()
        };
        let positions = averaged_positions(rest, (&nodes, &vertex_normals), weights, (normals, heights));
        let source_nodes = nodes.iter().map(|&node| rest.source_nodes[node as usize]).collect();
        let surface = Surface { positions, triangles, source_nodes };
        Self { samples, one_sided: of_sample, normals: vertex_normals, surface }
    }

    /// Cells of clamps with these weights, whose positions at rest are their centroids.
    pub(super) fn of_cells(rest: &Surface, weights: &PatchWeights) -> Self {
        let count = weights.len();
        let centroid = |c: usize| weights.of(c).map(|(node, w)| rest.positions[node] * w).sum();
        let positions: Vec<DVec3> = (0..count).map(centroid).collect();
        let surface = Surface { positions, triangles: Vec::new(), source_nodes: vec![0; count] };
        Self { samples: count, one_sided: Vec::new(), normals: vec![DVec3::ZERO; count], surface }
    }
}

impl SampleSurface {
    /// Samples, and further vertices, whose patches have these weights of the model's nodes.
    pub(super) fn new(recording: &Recording, vertices: SampleVertices, weights: &PatchWeights) -> Self {
        let SampleVertices { samples, one_sided, normals, mut surface } = vertices;
        let is_surface = !surface.triangles.is_empty();
        let mut triangle = vec![NONE; weights.len()];
        for (t, corners) in surface.triangles.iter().enumerate() {
            corners.iter().for_each(|vertex| triangle[*vertex as usize] = t as u32);
        }
        let in_tree = if is_surface { surface.triangles.len() } else { samples };
        for (vertex, triangle) in triangle.iter_mut().enumerate().filter(|(_, t)| **t == NONE) {
            *triangle = surface.triangles.len() as u32;
            surface.triangles.push([vertex as u32; 3]);
        }
        let tree = SphereTree::new(&surface.positions, &surface.triangles[..in_tree]);
        let to_nodes = PatchNodeCompliance::new(&recording.residual, weights, recording.model_nodes());
        let residual = averaged(&recording.residual, &to_nodes, weights);
        let peaks = (0..weights.len()).map(|vertex| to_nodes.peak(vertex, &residual.block(vertex, vertex)));
        let peaks = peaks.collect();
        let subtrees = SubtreeCompliance::of_samples(&tree, &surface, (samples, &one_sided), &to_nodes);
        Self {
            samples,
            one_sided,
            normals,
            surface,
            is_surface,
            triangle,
            tree,
            subtrees,
            residual,
            to_nodes,
            peaks,
        }
    }

    /// Number of vertices: samples and one-sided patches.
    pub(super) fn len(&self) -> usize {
        self.triangle.len()
    }

    /// Vertex of a sample whose normal is nearest to a direction [body].
    ///
    /// # Real time
    pub(super) fn facing_vertex(&self, sample: usize, direction: impl FnOnce() -> DVec3) -> usize {
        let further = one_sided_vertices((self.samples, &self.one_sided), sample);
        if further.is_empty() {
            return sample;
        }
        let direction = direction();
        let facing = |vertex: usize| self.normals[vertex].dot(direction);
        further.fold(sample, |best, vertex| if facing(vertex) > facing(best) { vertex } else { best })
    }

    /// Outward unit normal of a vertex at rest [body].
    ///
    /// # Real time
    pub(super) fn normal(&self, vertex: usize) -> DVec3 {
        self.normals[vertex]
    }

    /// Vertex as a point of the decimated surface.
    pub(super) fn node_point(&self, vertex: usize) -> SurfacePoint {
        let triangle = self.triangle[vertex];
        let corners = self.surface.triangles[triangle as usize];
        let first = corners.iter().position(|corner| *corner as usize == vertex);
        SurfacePoint { triangle, weights: [0, 1, 2].map(|k| if Some(k) == first { 1.0 } else { 0.0 }) }
    }

    /// Residual compliance [m/N] of a vertex: its displacement per force at a point of the decimated surface.
    ///
    /// # Real time
    pub(super) fn residual_at(&self, vertex: usize, point: &SurfacePoint) -> DMat3 {
        let between = |other: usize| self.residual.block(vertex, other);
        self.used_corners(point).map(|(other, weight)| between(other) * weight).sum()
    }

    /// Largest displacement of a node per force on a point of the decimated surface, over that of the point [1]: of the vertices about it.
    ///
    /// # Real time
    pub(super) fn peak(&self, point: &SurfacePoint) -> f64 {
        self.used_corners(point).map(|(vertex, _)| f64::from(self.peaks[vertex])).fold(1.0, f64::max)
    }

    /// Residual compliance of a vertex per force that nodes share by weights [m/N].
    pub(super) fn averaged_residual(
        &self,
        vertex: usize,
        nodes: impl Iterator<Item = (usize, f64)>,
    ) -> DMat3 {
        self.to_nodes.averaged(vertex, nodes)
    }

    fn used_corners(&self, point: &SurfacePoint) -> impl Iterator<Item = (usize, f64)> {
        self.surface.corners(point).into_iter().filter(|corner| corner.1 != 0.0)
    }
}

/// Vertices that are one-sided patches of a sample, by the number of samples and the sample of each such vertex.
pub(super) fn one_sided_vertices((samples, of_sample): (usize, &[u32]), sample: usize) -> Range<usize> {
    let first = of_sample.partition_point(|of| (*of as usize) < sample);
    let count = of_sample[first..].iter().take_while(|of| **of as usize == sample).count();
    samples + first..samples + first + count
}

/// Positions [m] of vertices at these nodes with these normals: on the smooth surface, averaged along the normal.
fn averaged_positions(
    surface: &Surface,
    (nodes, own_normals): (&[u32], &[DVec3]),
    weights: &PatchWeights,
    (normals, heights): (&[DVec3], &[f64]),
) -> Vec<DVec3> {
    let of_vertex = |(vertex, (&node, &normal)): (usize, (&u32, &DVec3))| {
        let centre = surface.positions[node as usize];
        let smooth = weights.of(vertex).filter(|(other, _)| normals[*other].dot(normal) > EDGE_COSINE);
        let (sum, height) = smooth.fold((0.0, 0.0), |(sum, height), (other, w)| {
            let over = surface.positions[other] - centre + normals[other] * heights[other];
            (sum + w, height + w * normal.dot(over))
        });
        if sum > 0.0 { centre + normal * (height / sum) } else { centre }
    };
    nodes.iter().zip(own_normals).enumerate().map(of_vertex).collect()
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
        ResidualCompliance::Whole(_) | ResidualCompliance::Quantised(_) => {
            let pairs = (0..count).flat_map(|c| (0..=c).map(move |d| (c, d)));
            let block = |(c, d): (usize, usize)| {
                let block = to_nodes.averaged(c, weights.of(d));
                // Exactly symmetric where a patch meets itself.
                let block = if c == d { (block + block.transpose()) * 0.5 } else { block };
                block.transpose().to_cols_array().map(|x| x as f32)
            };
            ResidualCompliance::Whole(pairs.flat_map(block).collect())
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

/// Residual compliance W·S between patches and the model's nodes [m/N]: displacement of a patch per force at a node. Sparse by rows;
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
                    ResidualCompliance::Whole(_) | ResidualCompliance::Quantised(_) => {
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

    /// Number of the model's nodes.
    pub(super) fn node_count(&self) -> usize {
        self.node_count
    }

    /// Blocks of a patch's row, with their nodes.
    pub(super) fn row(&self, patch: usize) -> impl Iterator<Item = (usize, DMat3)> + '_ {
        (self.offsets[patch]..self.offsets[patch + 1])
            .map(|at| (self.nodes[at] as usize, block_at(&self.blocks, at)))
    }

    /// Largest displacement of a node per force on a patch, over that of the patch with its own compliance [m/N]; in the Frobenius norm [1].
    fn peak(&self, patch: usize, own: &DMat3) -> f32 {
        let largest = self.row(patch).map(|(_, block)| frobenius_square(&block)).fold(0.0, f64::max);
        let own = frobenius_square(own);
        if own > 0.0 { libm::sqrt(largest / own) as f32 } else { 1.0 }
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

#[cfg(test)]
mod tests {
    use super::super::modal::BEYOND_CONTACTS;
    use super::super::{Body, ContactLimits, ContactLocation, Footprint};
    use crate::recording::Recording;
    use alloc::sync::Arc;
    use glam::DVec3;

    #[test]
    fn no_node_moves_farther_than_the_peak_of_a_sample_allows() {
        let files = [
            &include_bytes!("../../../../data/recordings/v1_levels/ball.palp")[..],
            include_bytes!("../../../../data/recordings/v1/free.palp"),
        ];
        let (mut highest, mut tightest) = (1.0_f64, 0.0_f64);
        for bytes in files {
            let recording = Arc::new(Recording::from_bytes(bytes).expect("a released recording"));
            let limits = ContactLimits { max_samples: 8, max_points: 512 };
            let body = Body::new(recording.clone(), &[], Some(limits), &[]);
            for level in 1..=body.coarsest_level() {
                let footprint = body.footprint_at_level(level);
                for vertex in 0..body.vertices(footprint) {
                    let location = ContactLocation { point: body.node_point(footprint, vertex), footprint };
                    let peak = body.residual_peak(&location);
                    highest = highest.max(peak);
                    for k in 0..13 {
                        let angle = |p: f64| libm::sin(p * f64::from(k) + p);
                        let force = DVec3::new(angle(1.3), angle(2.1), angle(3.7));
                        let own = (body.residual(&location, &location) * force).length();
                        let of_node =
                            |node| (body.residual_at(Footprint::Point, node, &location) * force).length();
                        let most = (0..recording.surface.positions.len()).map(of_node).fold(0.0, f64::max);
                        let share = most / (BEYOND_CONTACTS * peak * own);
                        assert!(share <= 1.0, "level {level}, vertex {vertex}: {share}");
                        tightest = tightest.max(share);
                    }
                }
            }
        }
        assert!(highest > 1.2 && tightest > 0.8, "{highest} {tightest}");
    }
}
