//! A body as contacts see it: its recording, how displacement is read on it, and the tree over its surface.

use super::dot_products::{dot3, dot3_single};
use super::patch_field::{ModalDistances, PatchField, residual_size};
use crate::recording::Recording;
use crate::surface::{
    Bands, Bounds, DeformationBound, SphereTree, Surface, SurfacePoint, band, poisson_disk_sample,
    triangles_around,
};
use alloc::sync::Arc;
use alloc::vec::Vec;
use glam::{DMat3, DVec3};

/// Levels of places: how much farther apart those of each are than those before, of more places than [`MANY`] and of fewer;
/// and how wide their patches are beside that, for which a cube that lands bounces as high as by its nodes.
const MOST_LEVELS: usize = 24;
const MANY: usize = 4096;
const COARSER: [f64; 2] = [2.0, 1.45];
const OVERLAP: f64 = 1.5;

/// How displacement is read, and force spread, at a place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) enum Footprint {
    /// At the point itself, by the weights of its triangle.
    #[default]
    Point,
    /// Over the patch of this number among the body's.
    Patch(u32),
}

/// Where a force can act on a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ContactLocation {
    pub(crate) point: SurfacePoint,
    pub(crate) footprint: Footprint,
}

/// What is known of a place at the start of a step [m, body].
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct LocationState {
    /// Elastic displacement.
    pub(crate) displacement: DVec3,
    /// The part of it that the residual compliance and the weight cause.
    pub(crate) residual: DVec3,
    /// The part that the weight causes beside the modes; lasts, since only bodies that stay where they are have one.
    pub(crate) sag: DVec3,
}

/// A force that acted over the last step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct AppliedForce {
    pub(crate) location: ContactLocation,
    /// [N, body]
    pub(crate) force: DVec3,
    /// Where at rest [m, body].
    pub(crate) rest: DVec3,
    /// For patches Aᵀ·f [√J] of the patch field's equation, and where; between places that stand for others at each corner.
    pulls: [(DVec3, DVec3); 3],
}

/// One object's body; immutable.
#[derive(Debug, Clone)]
pub(crate) struct Body {
    pub(crate) recording: Arc<Recording>,
    /// Those of devices, then those that stand for the nodes of faces in contact, finest first (see `contact::against`).
    pub(crate) patches: Vec<PatchField>,
    devices: usize,
    tree: SphereTree,
    bounds: Bounds,
    /// Mean edge of the triangles at rest [m].
    pub(crate) edge: f64,
    /// The triangles around every surface node, one after the other.
    around: Vec<u32>,
    first_around: Vec<u32>,
    /// The box around the body at rest [m, body].
    low: DVec3,
    high: DVec3,
}

impl Body {
    /// With patches of the given radii [m], and faces that meet something at so many places at most.
    pub(crate) fn new(recording: Arc<Recording>, radii: &[f64], max_contact_samples: usize) -> Self {
        let tree = SphereTree::new(&recording.surface.positions, &recording.surface.triangles);
        let shapes = &recording.modes.mode_shapes;
        let distances = ModalDistances::new(&recording, shapes);
        let modal = |i: usize, c: Option<usize>| distances.between(i, c);
        let bounds = tree.bounds(&recording.surface.triangles, modal, |i| residual_size(&recording, i));
        let mut patches: Vec<PatchField> =
            radii.iter().map(|&radius| PatchField::new(&recording, &tree, radius)).collect();
        let edge = recording.surface.mean_edge();
        let mut apart = edge;
        let mut count = recording.surface.positions.len();
        for _ in 0..MOST_LEVELS {
            if count <= max_contact_samples {
                break;
            }
            apart *= COARSER[usize::from(count <= MANY)];
            let nodes = poisson_disk_sample(&recording.surface, apart);
            if nodes.len() < count {
                count = nodes.len();
                patches.push(PatchField::about(&recording, &nodes, OVERLAP * apart));
            }
        }
        let (mut around, mut first_around) = (Vec::new(), alloc::vec![0]);
        for triangles in triangles_around(&recording.surface) {
            around.extend(triangles);
            first_around.push(around.len() as u32);
        }
        let (low, high) = recording.surface.extent();
        Self { recording, patches, devices: radii.len(), tree, bounds, edge, around, first_around, low, high }
    }

    /// Whether a place [m, body] is within a reach [m] of the box around the body at rest.
    pub(crate) fn rest_box_is_within(&self, location: DVec3, reach: f64) -> bool {
        (location - location.clamp(self.low, self.high)).length() < reach
    }

    /// The triangles around a surface node.
    pub(crate) fn triangles_around(&self, node: usize) -> &[u32] {
        &self.around[self.first_around[node] as usize..self.first_around[node + 1] as usize]
    }

    /// The triangle on the other side of an edge; none at a border.
    pub(crate) fn triangle_across(&self, triangle: u32, a: u32, b: u32) -> Option<u32> {
        let has = |t: u32| t != triangle && self.recording.surface.triangles[t as usize].contains(&b);
        self.triangles_around(a as usize).iter().copied().find(|&t| has(t))
    }

    /// A node that a footprint knows as a surface point, always the same.
    pub(crate) fn node_point(&self, footprint: Footprint, node: usize) -> SurfacePoint {
        if let Some(some) = self.patch(footprint).and_then(|patch| patch.some.as_ref()) {
            return some.node_point(node);
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

    /// How far any surface node can go between two modal coordinates [m].
    pub(crate) fn displacement_bound(&self, from: &[f64], to: &[f64]) -> f64 {
        let modal = self.norms_of(from.iter().zip(to).map(|(a, b)| b - a));
        self.bounds.max_displacement(&DeformationBound { modal, ..DeformationBound::STILL })
    }

    fn norms_of(&self, q: impl Iterator<Item = f64>) -> Bands {
        let omegas = &self.recording.modes.angular_frequencies;
        let mut squares = omegas.iter().zip(q).map(|(omega, q)| (omega * q) * (omega * q));
        core::array::from_fn(|at| libm::sqrt(squares.by_ref().take(band(omegas.len(), at).len()).sum()))
    }

    /// The footprint for a patch of a radius [m]; the point itself for 0.
    pub(crate) fn footprint(&self, radius: f64) -> Footprint {
        let patch = self.patches.iter().position(|patch| patch.radius == radius);
        patch.map_or(Footprint::Point, |at| Footprint::Patch(at as u32))
    }

    /// How a face is read: by its nodes at level 0, then by ever fewer places.
    pub(crate) fn footprint_at_level(&self, level: usize) -> Footprint {
        if level == 0 { Footprint::Point } else { Footprint::Patch((self.devices + level - 1) as u32) }
    }

    /// The coarsest of these.
    pub(crate) fn coarsest_level(&self) -> usize {
        self.patches.len() - self.devices
    }

    /// The coarsest of these that, with all before it, is a surface that other objects can meet.
    pub(crate) fn coarsest_surface_level(&self) -> usize {
        let is_surface = |patch: &&PatchField| patch.some.as_ref().is_some_and(|some| some.is_surface);
        self.patches[self.devices..].iter().take_while(is_surface).count()
    }

    /// The surface that a footprint knows: all of it, or a coarser one between places.
    pub(crate) fn surface(&self, footprint: Footprint) -> &Surface {
        self.patch(footprint).map_or(&self.recording.surface, |patch| patch.surface(&self.recording))
    }

    /// The tree over it.
    pub(crate) fn tree(&self, footprint: Footprint) -> &SphereTree {
        let some = self.patch(footprint).and_then(|patch| patch.some.as_ref());
        some.map_or(&self.tree, |some| &some.tree)
    }

    /// The corners of a place's triangle with their weights.
    pub(crate) fn corners(&self, location: &ContactLocation) -> [(usize, f64); 3] {
        self.surface(location.footprint).corners(&location.point)
    }

    /// The way that a place which stands for others faces at rest [body]; zero for nodes, which stand for themselves.
    pub(crate) fn outward_normal(&self, footprint: Footprint, node: usize) -> DVec3 {
        let some = self.patch(footprint).and_then(|patch| patch.some.as_ref());
        some.map_or(DVec3::ZERO, |some| some.facing(node))
    }

    /// Where a place is at rest [m, body].
    pub(crate) fn rest_position(&self, location: &ContactLocation) -> DVec3 {
        self.surface(location.footprint).rest_position(&location.point)
    }

    /// The nodes that a footprint knows.
    pub(super) fn places(&self, footprint: Footprint) -> Vec<u32> {
        match self.patch(footprint).and_then(|patch| patch.some.as_ref()) {
            Some(some) => some.nodes().to_vec(),
            None => (0..self.recording.surface.positions.len() as u32).collect(),
        }
    }

    /// Which of these a node is.
    ///
    /// # Real time
    pub(super) fn number(&self, footprint: Footprint, node: usize) -> usize {
        self.patch(footprint).map_or(node, |patch| patch.number(node))
    }

    pub(super) fn patch(&self, footprint: Footprint) -> Option<&PatchField> {
        match footprint {
            Footprint::Point => None,
            Footprint::Patch(at) => self.patches.get(at as usize),
        }
    }

    /// What the first few modes, or all, do to a surface node [m, body], as a footprint sees it: for patches, which are kept
    /// and read in single precision, by `single`.
    ///
    /// # Real time
    pub(crate) fn displacement(&self, footprint: Footprint, node: usize, q: &[f64], single: &[f32]) -> DVec3 {
        let (m, shapes) = (self.recording.modes.len(), &self.recording.modes.mode_shapes);
        let own = |number: usize| 3 * m * number..3 * m * (number + 1);
        match self.patch(footprint) {
            None => dot3(&shapes[own(node)], q),
            Some(patch) => dot3_single(&patch.rows[own(patch.number(node))], single),
        }
    }

    /// Add the mode shapes of a surface node with a weight, as a footprint sees them: three rows.
    ///
    /// # Real time
    pub(crate) fn add_rows(&self, footprint: Footprint, node: usize, weight: f64, rows: &mut [f64]) {
        let length = rows.len();
        let own = |number: usize| length * number..length * (number + 1);
        match self.patch(footprint) {
            None => rows
                .iter_mut()
                .zip(&self.recording.modes.mode_shapes[own(node)])
                .for_each(|(row, phi)| *row += weight * phi),
            Some(patch) => {
                let pairs = rows.iter_mut().zip(&patch.rows[own(patch.number(node))]);
                pairs.for_each(|(row, phi)| *row += weight * f64::from(*phi));
            }
        }
    }

    /// What of a dent can change over a distance, as a share per metre; infinite where dents have no shape that is worth
    /// looking at: between nodes, and between places that stand for others.
    pub(crate) fn residual_slope(&self, footprint: Footprint) -> f64 {
        let patch = self.patch(footprint).filter(|patch| patch.some.is_none());
        patch.map_or(f64::INFINITY, PatchField::residual_slope)
    }

    /// How far the surface can go, as a footprint sees it.
    pub(crate) fn bounds(&self, footprint: Footprint) -> &Bounds {
        self.patch(footprint).map_or(&self.bounds, |patch| &patch.bounds)
    }

    /// Residual compliance between two places [m/N]; none between different readings, whose places answer each other
    /// by the modes alone.
    ///
    /// # Real time
    pub(crate) fn residual(&self, a: &ContactLocation, b: &ContactLocation) -> DMat3 {
        let recording = &*self.recording;
        match (a.footprint == b.footprint, self.patch(a.footprint)) {
            (false, _) => DMat3::ZERO,
            (true, Some(patch)) => patch.residual(recording, &a.point, &b.point),
            (true, None) => {
                let corners = |location: &ContactLocation| recording.surface.corners(&location.point);
                let used = |corner: &(usize, f64)| corner.1 != 0.0;
                let mut sum = DMat3::ZERO;
                for (i, wi) in corners(a).into_iter().filter(used) {
                    for (j, wj) in corners(b).into_iter().filter(used) {
                        sum += recording.residual.block(i, j) * (wi * wj);
                    }
                }
                sum
            }
        }
    }

    /// What a force leaves of itself for the step after.
    ///
    /// # Real time
    pub(crate) fn applied_forces(&self, location: ContactLocation, force: DVec3) -> AppliedForce {
        let rest = self.rest_position(&location);
        let patch = self.patch(location.footprint);
        let pulls = patch.map(|patch| patch.pulls(&self.recording, &location.point, rest, force));
        AppliedForce { location, force, rest, pulls: pulls.unwrap_or_default() }
    }

    /// What the residual compliance moves a surface node [m, body], read as the force's place is. Up to a distance
    /// `flat` [m] from the force a patch's dent is as deep as there.
    ///
    /// # Real time
    pub(crate) fn residual_displacement(
        &self,
        node: usize,
        applied_forces: &AppliedForce,
        flat: f64,
    ) -> DVec3 {
        match self.patch(applied_forces.location.footprint) {
            Some(patch) => patch.residual_displacement(&self.recording, node, &applied_forces.pulls, flat),
            None => self.residual_of_node(node, &applied_forces.location) * applied_forces.force,
        }
    }

    /// The nodes that a force at a place acts on, with their weights; a node may come more than once.
    pub(super) fn spread(&self, location: &ContactLocation, mut give: impl FnMut(usize, f64)) {
        for (corner, weight) in self.corners(location) {
            match self.patch(location.footprint) {
                _ if weight == 0.0 => {}
                None => give(corner, weight),
                Some(patch) => {
                    patch.weights.of(patch.number(corner)).for_each(|(node, w)| give(node, w * weight))
                }
            }
        }
    }

    /// Residual compliance from a place to the surface node itself [m/N].
    pub(super) fn residual_of_node(&self, node: usize, location: &ContactLocation) -> DMat3 {
        let mut sum = DMat3::ZERO;
        self.spread(location, |other, weight| sum += self.recording.residual.block(node, other) * weight);
        sum
    }
}
