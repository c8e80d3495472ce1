//! Elastic body in contact: its recording, contact patches and samples, and the sphere tree over its surface.
//!
//! Equations: docs/theory.md (C27), (C28), (C29).

mod residual;

use super::contact_location::{ContactLocation, Footprint};
use super::level_residual::LevelResidual;
use super::modal_distances::{ModalDistances, residual_size};
use super::patch_field::{PatchCentres, PatchField};
use super::sample_surface::SampleSurface;
use super::subtree_compliance::SubtreeCompliance;
use crate::dot_products::{dot3, dot3_single};
use crate::recording::Recording;
use crate::surface::{
    Bands, Bounds, Cell, DeformationBound, MIN_CONTACT_SAMPLES, SphereTree, Surface, SurfacePoint, band,
    node_normals, smooth_heights, triangles_around,
};
use alloc::sync::Arc;
use alloc::vec::Vec;
use glam::DVec3;

/// Number of partners of an object for which the coarsest level of contact samples finds room.
const PARTNERS: usize = 4;

/// Limits of the contacts of a surface.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ContactLimits {
    /// Upper limit of contact samples against one partner; `usize::MAX` for all nodes.
    pub(crate) max_samples: usize,
    /// Upper limit of contact points of an object.
    pub(crate) max_points: usize,
}

impl ContactLimits {
    /// Contact points of a surface: one for every side of a node, within the limit.
    fn points_of(&self, surface: &Surface) -> usize {
        let is_fine = surface.positions.len() >= self.max_points;
        if is_fine { self.max_points } else { surface.node_sides().min(self.max_points) }
    }

    /// Samples of the coarsest level that is needed.
    fn coarsest_level(&self, surface_points: usize) -> usize {
        let is_limited = surface_points == self.max_points;
        let of_points = if is_limited { self.max_points / PARTNERS } else { usize::MAX };
        self.max_samples.min(of_points.max(MIN_CONTACT_SAMPLES))
    }
}

/// Elastic body of one object; immutable.
#[derive(Debug, Clone)]
pub(crate) struct Body {
    pub(crate) recording: Arc<Recording>,
    /// Upper limit of contact points against planes, obstacles and other objects.
    pub(crate) surface_points: usize,
    /// Patches of the devices' radii, those of the contact samples of each level, finest first, and the cells of clamps.
    pub(crate) patches: Vec<PatchField>,
    /// Number of patches of devices, and of levels.
    device_patches: usize,
    levels: usize,
    /// Residual compliance between the contact samples of two levels, level by level.
    between_levels: Vec<LevelResidual>,
    tree: SphereTree,
    bounds: Bounds,
    /// Residual compliance of the tree's subtrees; none where nothing meets the surface.
    subtrees: Option<SubtreeCompliance>,
    /// Mean edge length of the triangles at rest [m].
    pub(crate) edge: f64,
    /// Distance below which contacts depend on one another [m]: between the model's nodes, of an embedded surface; 0 of others.
    pub(crate) node_spacing: f64,
    /// Triangles around every surface node, node after node, and the index of each node's first.
    around: Vec<u32>,
    first_around: Vec<u32>,
    /// Outward unit normal of every surface node at rest [body].
    normals: Vec<DVec3>,
    /// Height of the smooth surface over every surface node [m], and the largest.
    heights: Vec<f64>,
    pub(crate) max_height: f64,
    /// Bounding box at rest [m, body].
    low: DVec3,
    high: DVec3,
}

impl Body {
    /// Body with patches of the given radii [m], levels of contact samples within limits (none where nothing meets its surface), and the cells
    /// of its clamps.
    pub(crate) fn new(
        recording: Arc<Recording>,
        radii: &[f64],
        limits: Option<ContactLimits>,
        cells: &[Cell],
    ) -> Self {
        let tree = SphereTree::new(&recording.surface.positions, &recording.surface.triangles);
        let shapes = &recording.modes.mode_shapes;
        let distances = ModalDistances::new(&recording, shapes);
        let modal = |i: usize, c: Option<usize>| distances.between(i, c);
        let bounds = tree.bounds(&recording.surface.triangles, modal, |i| residual_size(&recording, i));
        let mut patches: Vec<PatchField> =
            radii.iter().map(|&radius| PatchField::new(&recording, &tree, radius)).collect();
        let edge = recording.surface.mean_edge();
        let node_spacing = recording.embedding.as_ref().map_or(0.0, |embedding| embedding.mean_edge);
        let normals = node_normals(&recording.surface);
        let heights = smooth_heights(&recording.surface, recording.surface_order());
        let max_height = heights.iter().copied().fold(0.0, f64::max);
        let surface_points = limits.map_or(0, |limits| limits.points_of(&recording.surface));
        let coarsest = limits.map_or(usize::MAX, |limits| limits.coarsest_level(surface_points));
        for level in &*recording.levels_down_to(coarsest) {
            patches.push(PatchField::at_samples(&recording, level, &normals, &heights));
        }
        let levels = patches.len() - radii.len();
        let between_levels = LevelResidual::of_pairs(&patches[radii.len()..]);
        if !cells.is_empty() {
            patches.push(PatchField::at_cells(&recording, cells));
        }
        let subtrees = limits.map(|_| SubtreeCompliance::of_surface(&recording, &tree));
        let (mut around, mut first_around) = (Vec::new(), alloc::vec![0]);
        for triangles in triangles_around(&recording.surface) {
            around.extend(triangles);
            first_around.push(around.len() as u32);
        }
        let (low, high) = recording.surface.extent();
        let device_patches = radii.len();
        Self {
            recording,
            surface_points,
            patches,
            device_patches,
            levels,
            between_levels,
            tree,
            bounds,
            subtrees,
            edge,
            node_spacing,
            around,
            first_around,
            normals,
            heights,
            max_height,
            low,
            high,
        }
    }

    /// Whether a point [m, body] is within a reach [m] of the bounding box at rest.
    pub(crate) fn rest_box_is_within(&self, p: DVec3, reach: f64) -> bool {
        (p - p.clamp(self.low, self.high)).length() < reach
    }

    /// Triangles around a surface node.
    pub(crate) fn triangles_around(&self, node: usize) -> &[u32] {
        &self.around[self.first_around[node] as usize..self.first_around[node + 1] as usize]
    }

    /// Triangle on the other side of an edge; none at a border.
    pub(crate) fn triangle_across(&self, triangle: u32, a: u32, b: u32) -> Option<u32> {
        let has = |t: u32| t != triangle && self.recording.surface.triangles[t as usize].contains(&b);
        self.triangles_around(a as usize).iter().copied().find(|&t| has(t))
    }

    /// Node of a footprint's surface as a surface point, always the same one.
    pub(crate) fn node_point(&self, footprint: Footprint, node: usize) -> SurfacePoint {
        if let Some(samples) = self.samples(footprint) {
            return samples.node_point(node);
        }
        let triangle = self.triangles_around(node)[0];
        let corners = self.recording.surface.triangles[triangle as usize];
        let weights = corners.map(|corner| if corner as usize == node { 1.0 } else { 0.0 });
        SurfacePoint { triangle, weights }
    }

    /// √(Σω²·q²) of every band of modes [√J]: √(2·elastic energy) of modal coordinates.
    pub(crate) fn band_norms(&self, q: &[f64]) -> Bands {
        self.norms_of(q.iter().copied())
    }

    /// Displacement bound of any surface node between two vectors of modal coordinates [m].
    pub(crate) fn displacement_bound(&self, from: &[f64], to: &[f64]) -> f64 {
        let modal = self.norms_of(from.iter().zip(to).map(|(a, b)| b - a));
        self.bounds.max_displacement(&DeformationBound { modal, ..DeformationBound::STILL })
    }

    fn norms_of(&self, q: impl Iterator<Item = f64>) -> Bands {
        let omegas = &self.recording.modes.angular_frequencies;
        let mut squares = omegas.iter().zip(q).map(|(omega, q)| (omega * q) * (omega * q));
        core::array::from_fn(|at| libm::sqrt(squares.by_ref().take(band(omegas.len(), at).len()).sum()))
    }

    /// Footprint of a patch radius [m]; the point for 0.
    pub(crate) fn footprint(&self, radius: f64) -> Footprint {
        let patch = self.patches.iter().position(|patch| patch.radius == radius);
        patch.map_or(Footprint::Point, |index| Footprint::Patch(index as u32))
    }

    /// Radius of a footprint's patch [m]; 0 for the point.
    pub(crate) fn patch_radius(&self, footprint: Footprint) -> f64 {
        self.patch(footprint).map_or(0.0, |patch| patch.radius)
    }

    /// Footprint of a level of detail: all nodes at level 0, then ever fewer contact samples.
    pub(crate) fn footprint_at_level(&self, level: usize) -> Footprint {
        if level == 0 { Footprint::Point } else { Footprint::Patch((self.device_patches + level - 1) as u32) }
    }

    /// Level of detail of a footprint; none of a device's patch and of a clamp's cells.
    pub(crate) fn level_of(&self, footprint: Footprint) -> Option<usize> {
        match footprint {
            Footprint::Point => Some(0),
            Footprint::Patch(index) => {
                let level = (index as usize + 1).checked_sub(self.device_patches)?;
                (1..=self.levels).contains(&level).then_some(level)
            }
        }
    }

    /// Finest level of detail that its finite elements resolve: all nodes, or of an embedded surface the samples that are as far apart as the model's nodes.
    /// Contacts that are closer to each other depend on one another.
    pub(crate) fn finest_level(&self) -> usize {
        let spacing = |level: usize| self.patch_radius(self.footprint_at_level(level));
        (0..self.levels).find(|&level| spacing(level) >= self.node_spacing).unwrap_or(self.levels)
    }

    /// Coarsest level of detail.
    pub(crate) fn coarsest_level(&self) -> usize {
        self.levels
    }

    /// Number of cells of its clamps.
    pub(crate) fn cells(&self) -> usize {
        let of_clamps = self.patches.get(self.device_patches + self.levels);
        of_clamps.map_or(0, |patches| patches.weights.len())
    }

    /// Contact location of a cell of the clamps.
    pub(crate) fn cell_location(&self, cell: usize) -> ContactLocation {
        let footprint = Footprint::Patch((self.device_patches + self.levels) as u32);
        // A degenerate triangle per cell.
        let point = SurfacePoint { triangle: cell as u32, weights: [1.0, 0.0, 0.0] };
        ContactLocation { point, footprint }
    }

    /// Coarsest level up to which every level has a decimated surface, for contact with other objects.
    pub(crate) fn coarsest_surface_level(&self) -> usize {
        let is_surface = |patch: &&PatchField| patch.samples().is_some_and(|samples| samples.is_surface);
        self.patches[self.device_patches..self.device_patches + self.levels]
            .iter()
            .take_while(is_surface)
            .count()
    }

    /// Surface of a footprint: all triangles, or the decimated surface between contact samples.
    pub(crate) fn surface(&self, footprint: Footprint) -> &Surface {
        self.patch(footprint).map_or(&self.recording.surface, |patch| patch.surface(&self.recording))
    }

    /// Sphere tree over the surface of a footprint.
    pub(crate) fn tree(&self, footprint: Footprint) -> &SphereTree {
        self.samples(footprint).map_or(&self.tree, |samples| &samples.tree)
    }

    /// Corner nodes of a location's triangle with their weights.
    pub(crate) fn corners(&self, location: &ContactLocation) -> [(usize, f64); 3] {
        self.surface(location.footprint).corners(&location.point)
    }

    /// Outward unit normal of a vertex of a footprint's surface at rest [body]; zero on a sheet of no thickness.
    pub(crate) fn outward_normal(&self, footprint: Footprint, vertex: usize) -> DVec3 {
        self.samples(footprint).map_or_else(|| self.normals[vertex], |samples| samples.normal(vertex))
    }

    /// Height [m] of the smooth surface over a location; 0 on the decimated surface between contact samples, which lie on it.
    ///
    /// # Real time
    pub(crate) fn smooth_height(&self, location: &ContactLocation) -> f64 {
        match location.footprint {
            Footprint::Patch(_) => 0.0,
            Footprint::Point => {
                self.corners(location).into_iter().map(|(node, weight)| self.heights[node] * weight).sum()
            }
        }
    }

    /// Height [m] of the smooth surface over a footprint's node.
    pub(crate) fn node_height(&self, footprint: Footprint, node: usize) -> f64 {
        if footprint == Footprint::Point { self.heights[node] } else { 0.0 }
    }

    /// Rest position of a location [m, body].
    pub(crate) fn rest_position(&self, location: &ContactLocation) -> DVec3 {
        self.surface(location.footprint).rest_position(&location.point)
    }

    /// Number of vertices of a footprint's surface: nodes, or contact samples with the one-sided patches of those on creases.
    pub(crate) fn vertices(&self, footprint: Footprint) -> usize {
        self.samples(footprint).map_or(self.recording.surface.positions.len(), SampleSurface::len)
    }

    /// Largest number of vertices of any footprint's surface.
    pub(crate) fn max_vertices(&self) -> usize {
        let of_patches = (0..self.patches.len()).map(|at| self.vertices(Footprint::Patch(at as u32)));
        of_patches.fold(self.vertices(Footprint::Point), usize::max)
    }

    /// Vertex of a node or contact sample that faces a direction [body]: on a crease the patch on the side with the nearest normal.
    ///
    /// # Real time
    pub(crate) fn facing_vertex(
        &self,
        footprint: Footprint,
        sample: usize,
        direction: impl FnOnce() -> DVec3,
    ) -> usize {
        self.samples(footprint).map_or(sample, |samples| samples.facing_vertex(sample, direction))
    }

    pub(super) fn patch(&self, footprint: Footprint) -> Option<&PatchField> {
        match footprint {
            Footprint::Point => None,
            Footprint::Patch(index) => self.patches.get(index as usize),
        }
    }

    fn samples(&self, footprint: Footprint) -> Option<&SampleSurface> {
        self.patch(footprint).and_then(PatchField::samples)
    }

    /// Displacement of a surface node by modal coordinates of the first modes [m, body], averaged over the footprint. Patches
    /// are stored and evaluated in single precision, with the coordinates `single`.
    ///
    /// # Real time
    pub(crate) fn displacement(&self, footprint: Footprint, node: usize, q: &[f64], single: &[f32]) -> DVec3 {
        let (m, shapes) = (self.recording.modes.len(), &self.recording.modes.mode_shapes);
        let own = |index: usize| 3 * m * index..3 * m * (index + 1);
        match self.patch(footprint) {
            None => dot3(&shapes[own(node)], q),
            Some(patch) => dot3_single(&patch.rows[own(node)], single),
        }
    }

    /// Add the mode shapes of a surface node times a weight, averaged over the footprint: three rows.
    ///
    /// # Real time
    pub(crate) fn add_rows(&self, footprint: Footprint, node: usize, weight: f64, rows: &mut [f64]) {
        let length = rows.len();
        let own = |index: usize| length * index..length * (index + 1);
        match self.patch(footprint) {
            None => rows
                .iter_mut()
                .zip(&self.recording.modes.mode_shapes[own(node)])
                .for_each(|(row, phi)| *row += weight * phi),
            Some(patch) => {
                let pairs = rows.iter_mut().zip(&patch.rows[own(node)]);
                pairs.for_each(|(row, phi)| *row += weight * f64::from(*phi));
            }
        }
    }

    /// Largest relative change of residual displacement per distance [1/m]; infinite between nodes and between contact
    /// samples, whose residual displacements are unrelated.
    pub(crate) fn residual_slope(&self, footprint: Footprint) -> f64 {
        match self.patch(footprint).map(|patch| &patch.centres) {
            Some(PatchCentres::Nodes(kernel)) => kernel.slope(),
            _ => f64::INFINITY,
        }
    }

    /// Displacement bounds of the surface, averaged over the footprint.
    pub(crate) fn bounds(&self, footprint: Footprint) -> &Bounds {
        self.patch(footprint).map_or(&self.bounds, |patch| &patch.bounds)
    }

    /// Residual compliance of the subtrees of a footprint's tree; none of patches of tips and of clamps.
    pub(crate) fn subtrees(&self, footprint: Footprint) -> Option<&SubtreeCompliance> {
        match footprint {
            Footprint::Point => self.subtrees.as_ref(),
            Footprint::Patch(_) => self.level_of(footprint).and(self.samples(footprint)).map(|s| &s.subtrees),
        }
    }

    /// Sag of a location beyond the modes under a gravity [m/s², body]; zero for a free body [m, body]. That of a contact sample is averaged
    /// over its patch.
    pub(crate) fn sag(&self, location: &ContactLocation, gravity: DVec3) -> DVec3 {
        let Some(response) = &self.recording.gravity else { return DVec3::ZERO };
        let of = |(node, weight): (usize, f64)| response.residual_displacement(node, gravity) * weight;
        if self.samples(location.footprint).is_none() {
            return self.corners(location).into_iter().map(of).sum();
        }
        let mut sum = DVec3::ZERO;
        self.distribute(location, |node, weight| {
            sum += self.recording.model_sag(response, node, gravity) * weight;
        });
        sum
    }
}
