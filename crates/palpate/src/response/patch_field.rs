//! Contact patches of one radius on a body: mode shapes averaged over the patch about every surface node, or about every
//! contact sample, and the residual compliance between patches.
//!
//! ```text
//! G_c = Σᵢ wᵢ·Φᵢ
//! ```
//!
//! w are the weights of the patch about node c; G [1/√kg] is interpolated between nodes.
//!
//! Equations: docs/theory.md (C26), (C27), (C28).

use super::modal_distances::ModalDistances;
use super::residual_kernel::ResidualKernel;
use super::sample_surface::{SampleSurface, SampleVertices};
use crate::recording::Recording;
use crate::surface::{Bounds, Cell, PatchWeights, SampleLevel, SphereTree, Surface};
use alloc::boxed::Box;
use alloc::vec;
use alloc::vec::Vec;
use glam::DVec3;

/// Contact patches of one radius on one body; immutable.
#[derive(Debug, Clone)]
pub(crate) struct PatchField {
    /// Patch radius a [m].
    pub(crate) radius: f64,
    /// Weights of the model's nodes in each patch.
    pub(crate) weights: PatchWeights,
    /// Averaged mode shapes G [1/√kg]: (3·patch + axis)·m + mode. Single precision halves the time of queries on a fine
    /// mesh.
    pub(crate) rows: Vec<f32>,
    pub(crate) bounds: Bounds,
    pub(super) centres: PatchCentres,
}

/// Centres of patches, with the residual compliance between them.
#[derive(Debug, Clone)]
pub(super) enum PatchCentres {
    /// All surface nodes: a patch may lie at any surface point.
    Nodes(ResidualKernel),
    /// Contact samples, or cells of clamps.
    Samples(Box<SampleSurface>),
}

impl PatchField {
    /// Patches about all surface nodes, with the sphere tree over the surface.
    pub(crate) fn new(recording: &Recording, tree: &SphereTree, radius: f64) -> Self {
        let all: Vec<u32> = (0..recording.surface.positions.len() as u32).collect();
        let weights = PatchWeights::new(&recording.surface, recording.surface_order(), radius, &all);
        let weights = at_model_nodes(recording, weights);
        let kernel = ResidualKernel::new(recording, &weights, radius);
        let rows = averaged_rows(recording, &weights);
        let distances = ModalDistances::new(recording, &rows);
        let triangles = &recording.surface.triangles;
        let bounds = tree.bounds(triangles, |i, c| distances.between(i, c), |i| kernel.size(i));
        Self { radius, weights, rows, bounds, centres: PatchCentres::Nodes(kernel) }
    }

    /// Patches about the contact samples of a level, with the outward normals of all surface nodes and the
    /// heights [m] of the smooth surface over them. A patch reaches to the next
    /// samples, so that patches cover the surface.
    pub(crate) fn at_samples(
        recording: &Recording,
        level: &SampleLevel,
        normals: &[DVec3],
        heights: &[f64],
    ) -> Self {
        let radius = level.spacing;
        let order = recording.surface_order();
        let (weights, one_sided) = PatchWeights::of_samples(&recording.surface, order, radius, &level.nodes);
        let vertices =
            SampleVertices::new(&recording.surface, level, (&weights, &one_sided), (normals, heights));
        let weights = at_model_nodes(recording, weights);
        Self::averaged_at(recording, SampleSurface::new(recording, vertices, &weights), weights, radius)
    }

    /// Cells of the body's clamps.
    pub(crate) fn at_cells(recording: &Recording, cells: &[Cell]) -> Self {
        let weights = PatchWeights::of_cells(cells);
        let vertices = SampleVertices::of_cells(&recording.surface, &weights);
        let weights = at_model_nodes(recording, weights);
        // No patch radius asks for them.
        Self::averaged_at(recording, SampleSurface::new(recording, vertices, &weights), weights, f64::NAN)
    }

    /// Patches with given weights about the nodes of a sample surface.
    fn averaged_at(
        recording: &Recording,
        samples: SampleSurface,
        weights: PatchWeights,
        radius: f64,
    ) -> Self {
        let rows = averaged_rows(recording, &weights);
        let distances = ModalDistances::new(recording, &rows);
        let between = |i: usize, c: Option<usize>| distances.between(i, c);
        let size = |i: usize| libm::sqrt(samples.residual.trace(i, i));
        let bounds = samples.tree.bounds(&samples.surface.triangles, between, size);
        Self { radius, weights, rows, bounds, centres: PatchCentres::Samples(Box::new(samples)) }
    }

    /// Contact samples; none where every surface node has a patch.
    pub(super) fn samples(&self) -> Option<&SampleSurface> {
        match &self.centres {
            PatchCentres::Nodes(_) => None,
            PatchCentres::Samples(samples) => Some(samples),
        }
    }

    /// Surface between the nodes that have a patch.
    ///
    /// # Real time
    pub(super) fn surface<'a>(&'a self, recording: &'a Recording) -> &'a Surface {
        self.samples().map_or(&recording.surface, |samples| &samples.surface)
    }
}

/// Weights of the model's nodes in patches whose surface nodes have these weights.
fn at_model_nodes(recording: &Recording, weights: PatchWeights) -> PatchWeights {
    if recording.embedding.is_none() {
        return weights;
    }
    weights.distributed(recording.model_nodes(), |node| recording.model_nodes_of(node))
}

/// Mode shapes averaged over patches.
fn averaged_rows(recording: &Recording, weights: &PatchWeights) -> Vec<f32> {
    let (m, shapes) = (recording.modes.len(), recording.model_mode_shapes());
    let mut rows = Vec::with_capacity(3 * weights.len() * m);
    let mut sums = vec![0.0; 3 * m];
    for c in 0..weights.len() {
        sums.fill(0.0);
        for (node, w) in weights.of(c) {
            let from = &shapes[3 * node * m..3 * (node + 1) * m];
            sums.iter_mut().zip(from).for_each(|(sum, phi)| *sum += w * phi);
        }
        rows.extend(sums.iter().map(|&sum| sum as f32));
    }
    rows
}
