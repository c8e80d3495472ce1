//! Deformed-surface view: positions of surface nodes and triangles of an object at a moment, in the body frame, without
//! passing over the whole surface.
//!
//! ```text
//! xᵢ = Xᵢ + Φᵢ·q + uᵢ        uᵢ = Σ_c S_ic·f_c        residual displacement of the forces f of the last step
//! ```
//!
//! Equations: docs/theory.md (C19).

use super::node_cache::NodePositionCache;
use super::parameters::COLLISION;
use crate::response::{
    Body, ContactLocation, ContactPoints, Footprint, NodalForces, ResponseState, SpringForce,
    SubtreeCompliance,
};
use crate::surface::{
    Centre, DeformationBound, DeformingNodes, Surface, Traversal, area_normal, at_weights,
    nearest_on_triangle,
};
use glam::DVec3;

/// Upper limit of simultaneous contacts of a tip with one object.
pub(crate) const MAX_TIP_CONTACTS: usize = 4;

/// Projection of a point onto a triangle, body frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct TriangleProjection {
    pub(crate) triangle: u32,
    /// Barycentric weights of the nearest point.
    pub(crate) weights: [f64; 3],
    /// Nearest point [m].
    pub(crate) position: DVec3,
    /// Distance to the nearest point [m], not negative.
    pub(crate) distance: f64,
    /// Outward unit normal of the deformed triangle.
    pub(crate) normal: DVec3,
}

/// Time within a step at which a surface is evaluated.
#[derive(Debug, Clone, Copy)]
pub(crate) enum SurfaceTime<'a> {
    /// Start of the step with this number: node positions are kept for the step.
    StepStart(u64),
    /// Modal coordinates of another moment.
    Coordinates(&'a [f64]),
}

/// Contacts whose own residual displacement is excluded, with the displacement of their location [m].
type OwnContacts = [Option<(ContactLocation, DVec3)>; MAX_TIP_CONTACTS];

/// Norms of a body's deformation at modal coordinates, read with a contact footprint.
pub(super) fn deformation_bound(
    body: &Body,
    footprint: Footprint,
    state: &ResponseState,
    q: &[f64],
) -> DeformationBound {
    DeformationBound {
        modal: body.band_norms(q),
        residual: state.residual_norm(),
        max_residual: state.max_residual(body.is_tip(footprint)),
        slope: body.residual_slope(footprint),
    }
}

/// Surface of an object at a moment, read with a contact footprint; body frame.
pub(crate) struct DeformedSurface<'a> {
    pub(crate) body: &'a Body,
    footprint: Footprint,
    /// Modal coordinates q at the moment.
    pub(super) q: &'a [f64],
    /// Modal coordinates at the end of the step without contact force.
    free: &'a [f64],
    /// Spring forces of the residual compliance, and those of them that act at points, by nodes.
    spring_forces: &'a [SpringForce],
    tip_springs: &'a [u32],
    nodal: &'a NodalForces,
    /// Excluded contacts, and the distance from them up to which the surface moves as their location does [m].
    own: OwnContacts,
    flat_radius: f64,
    cache: &'a mut NodePositionCache,
    bound: DeformationBound,
    /// Bounds of the residual displacement by subtrees, where they are used.
    local: Option<LocalBounds<'a>>,
}

/// Subtrees whose residual displacement is bounded one by one.
struct LocalBounds<'a> {
    level: usize,
    subtrees: &'a SubtreeCompliance,
    /// Distance of a table's surface from that of its modes [m].
    surface_error: f64,
}

impl<'a> DeformedSurface<'a> {
    pub(crate) fn new(
        body: &'a Body,
        footprint: Footprint,
        state: &'a ResponseState,
        points: &ContactPoints,
        cache: &'a mut NodePositionCache,
        moment: SurfaceTime<'a>,
    ) -> Self {
        let (q, key) = match moment {
            SurfaceTime::StepStart(step) => (state.coordinates(), Some((step, footprint))),
            SurfaceTime::Coordinates(q) => (q, None),
        };
        let free = state.free_coordinates();
        if cache.select(key) {
            if footprint != Footprint::Point {
                cache.set_single([q, free]);
            }
            if key.is_some() {
                cache.take_contact_points(points, footprint);
            }
        }
        let bound = deformation_bound(body, footprint, state, q);
        Self {
            body,
            footprint,
            q,
            free,
            spring_forces: state.spring_forces(),
            tip_springs: state.tip_springs(),
            nodal: state.nodal(),
            own: [None; MAX_TIP_CONTACTS],
            flat_radius: 0.0,
            cache,
            bound,
            local: None,
        }
    }

    /// Bound the residual displacement subtree by subtree from now on, at the start of a step: farther from the forces it is smaller. Bounds that
    /// outlive the step must not use it.
    ///
    /// # Real time
    /// Costs the forces times the subtrees, once a step and level of detail.
    pub(crate) fn localise_residual(&mut self, state: &ResponseState, step: u64) {
        let is_large = self.bound.max_residual > COLLISION.local_residual * self.body.edge;
        let subtrees = self.body.subtrees(self.footprint).filter(|_| is_large);
        if let (Some(level), Some(subtrees)) = (self.body.level_of(self.footprint), subtrees) {
            self.cache.residual_bounds.compute((level, subtrees), self.body, state, step);
            self.local = Some(LocalBounds { level, subtrees, surface_error: state.surface_error() });
        }
    }

    /// Bound of the residual displacement of a subtree [m], chosen among those of its level.
    fn residual_of(&self, subtree: impl FnOnce(&SubtreeCompliance) -> usize) -> f64 {
        let Some(LocalBounds { level, subtrees, surface_error }) = &self.local else { return f64::INFINITY };
        self.cache.residual_bounds.of(*level, subtree(subtrees)) + surface_error
    }

    /// Exclude the contacts' own residual displacement within a radius [m] of their locations: the indentation by a tip does not
    /// become a wall beside it.
    pub(crate) fn exclude_own_residual(
        &mut self,
        own: [Option<ContactLocation>; MAX_TIP_CONTACTS],
        flat_radius: f64,
    ) {
        if own.iter().any(Option::is_some) {
            let own_displacement = |location: ContactLocation| {
                let is_its =
                    |force: &&SpringForce| self.footprint == Footprint::Point && force.location == location;
                let force = self.spring_forces.iter().find(is_its);
                let displacement =
                    force.map_or(DVec3::ZERO, |f| self.body.residual(&location, &location) * f.force);
                (location, displacement)
            };
            (self.own, self.flat_radius) = (own.map(|location| location.map(own_displacement)), flat_radius);
            self.cache.exclude_own();
        }
    }

    /// Whether residual displacement varies smoothly between nodes, so that bounds can use its slope.
    fn residual_is_smooth(&self) -> bool {
        self.bound.slope.is_finite()
    }

    /// Upper bound of the distance of any node from its rest position [m].
    pub(crate) fn max_displacement(&self) -> f64 {
        self.body.bounds(self.footprint).max_displacement(&self.bound)
    }

    /// Surface that the footprint reads: all triangles, or the decimated surface between contact samples.
    pub(crate) fn surface(&self) -> &'a Surface {
        self.body.surface(self.footprint)
    }

    fn rest(&self, node: usize) -> DVec3 {
        self.body.surface(self.footprint).positions[node]
    }

    /// Upper bound of the residual displacement of any node [m].
    pub(crate) fn max_residual(&self) -> f64 {
        self.bound.max_residual
    }

    /// Upper bound of the residual displacement of a node or contact sample [m].
    pub(crate) fn max_residual_of(&self, node: usize) -> f64 {
        self.bound.max_residual.min(self.residual_of(|subtrees| subtrees.of_vertex(node)))
    }

    /// Begin a traversal that takes every node once.
    pub(crate) fn clear_marks(&mut self) {
        self.cache.clear_marks();
    }

    /// Mark a node; gives whether it was unmarked.
    pub(crate) fn mark_node(&mut self, node: usize) -> bool {
        self.cache.mark(node)
    }

    /// Let bounds also hold at the end of the step without contact force.
    pub(crate) fn cover_prediction(&mut self) {
        let free = self.body.band_norms(self.free);
        self.bound.modal = core::array::from_fn(|band| self.bound.modal[band].max(free[band]));
    }

    /// Nodal position by the modes at the end of the step without contact force [m].
    pub(crate) fn predicted_position(&mut self, node: usize) -> DVec3 {
        if let Some(known) = self.cache.predicted(node) {
            return known;
        }
        let position = self.rest(node) + self.modal_displacement(node, self.free, 1);
        self.cache.set_predicted(node, position);
        position
    }

    fn modal_displacement(&self, node: usize, q: &[f64], moment: usize) -> DVec3 {
        self.body.displacement(self.footprint, node, q, self.cache.single(moment, q.len()))
    }

    /// Largest modal displacement of a triangle's corners over the step without contact force [m].
    pub(crate) fn predicted_motion(&mut self, triangle: u32) -> f64 {
        let mut largest = 0.0_f64;
        for node in self.surface().triangles[triangle as usize] {
            let (end, start) = (self.predicted_position(node as usize), self.modal_position(node as usize));
            largest = largest.max((end - start).length());
        }
        largest
    }

    /// Nodal position by the modes [m].
    pub(crate) fn modal_position(&mut self, node: usize) -> DVec3 {
        if let Some(known) = self.cache.modal(node) {
            return known;
        }
        let position = self.rest(node) + self.modal_displacement(node, self.q, 0);
        self.cache.set_modal(node, position);
        position
    }

    /// Nodal position including residual displacement [m].
    pub(crate) fn position(&mut self, node: usize) -> DVec3 {
        if let Some(known) = self.cache.total(node) {
            return known;
        }
        let modal = self.modal_position(node);
        let position = self.add_residual(node, modal);
        self.cache.set_total(node, position);
        position
    }

    /// Position with the residual displacement of a node added [m], that of excluded contacts left out.
    fn add_residual(&mut self, node: usize, modal: DVec3) -> DVec3 {
        if self.footprint == Footprint::Point {
            return self.add_residual_at_node(node, modal);
        }
        let own = || self.own.iter().flatten();
        if self.body.is_tip(self.footprint) {
            let of_tips = self.tip_springs.iter().map(|&at| &self.spring_forces[at as usize]);
            let coupled = of_tips.filter(|force| force.location.footprint == self.footprint);
            let forces = coupled.map(|force| {
                let is_own = own().any(|(own, _)| *own == force.location);
                (force, if is_own { self.flat_radius } else { 0.0 })
            });
            return modal + self.body.tip_displacement(self.footprint, node, forces);
        }
        let displacement = |force: &SpringForce| self.body.residual_displacement(self.footprint, node, force);
        modal + self.spring_forces.iter().map(displacement).sum::<DVec3>()
    }

    /// Position of a node of the surface with its residual displacement added [m], that of excluded contacts left out.
    fn add_residual_at_node(&mut self, node: usize, modal: DVec3) -> DVec3 {
        let (body, nodal, springs) = (self.body, self.nodal, self.spring_forces);
        let residual = match (nodal.known(node), &body.recording.embedding) {
            (Some(known), _) => known,
            (None, None) => nodal.displacement_of_model_node(body, springs, node),
            (None, Some(embedding)) => {
                let carried = |(carrier, weight): (usize, f64)| {
                    let compute = || nodal.displacement_of_model_node(body, springs, carrier);
                    self.cache.carrier(carrier, compute) * weight
                };
                embedding.of(node).map(carried).sum()
            }
        };
        let mut position = modal + residual;
        // Between nodes a point force's displacement has no shape: nodes beside an excluded contact move as it does.
        for (own, own_displacement) in self.own.iter().flatten() {
            let is_beside = |force: &&SpringForce| {
                force.location == *own && (self.rest(node) - force.rest).length() < self.flat_radius
            };
            if let Some(force) = springs.iter().find(is_beside) {
                position += *own_displacement - body.residual_displacement(Footprint::Point, node, force);
            }
        }
        position
    }

    /// Corner positions of a triangle [m].
    pub(crate) fn corners(&mut self, triangle: u32) -> [DVec3; 3] {
        let [a, b, c] = self.surface().triangles[triangle as usize].map(|n| n as usize);
        [self.position(a), self.position(b), self.position(c)]
    }

    /// Projection of a point [m, body] onto a triangle.
    pub(crate) fn project_on_triangle(&mut self, triangle: u32, p: DVec3) -> TriangleProjection {
        let corners = self.corners(triangle);
        let weights = nearest_on_triangle(corners, p);
        let position = at_weights(corners, weights);
        let normal = area_normal(corners).normalize_or_zero();
        TriangleProjection { triangle, weights, position, distance: (p - position).length(), normal }
    }

    /// Upper bound of the support function of the surface in a unit direction [m, body], or `least` if that is larger.
    ///
    /// # Real time
    /// Costs the nodes that come near to the bound.
    pub(crate) fn support(&mut self, direction: DVec3, least: f64) -> f64 {
        let farthest = core::cell::Cell::new(least);
        self.traverse(
            |_, _, centre, radius| centre.dot(direction) + radius > farthest.get(),
            |surface, triangle| {
                for node in surface.surface().triangles[triangle as usize].map(|node| node as usize) {
                    let residual = surface.max_residual_of(node);
                    let support = surface.modal_position(node).dot(direction) + residual;
                    farthest.set(farthest.get().max(support));
                }
            },
        );
        farthest.get()
    }

    /// Whether bounds leave it open that the surface comes within a reach [m] of a point [m, body].
    ///
    /// # Real time
    /// Costs less than a projection.
    pub(crate) fn may_be_within(&mut self, p: DVec3, reach: f64) -> bool {
        let reached = core::cell::Cell::new(false);
        self.traverse(
            |_, _, centre, radius| !reached.get() && (p - centre).length() - radius < reach,
            |_, _| reached.set(true),
        );
        reached.get()
    }

    /// Traverse the tree: `enter` decides by kind of centre, centre [m, body] and radius [m] of a sphere; `found` takes
    /// the triangles of the leaves, see [`crate::surface::SphereTree::traverse`].
    pub(crate) fn traverse(
        &mut self,
        enter: impl Fn(&mut Self, Centre, DVec3, f64) -> bool,
        found: impl FnMut(&mut Self, u32),
    ) {
        self.resume_traversal((&mut Traversal::START.clone(), usize::MAX), enter, found);
    }

    /// Resume a traversal for so many spheres and triangles.
    pub(crate) fn resume_traversal(
        &mut self,
        traversal: (&mut Traversal, usize),
        enter: impl Fn(&mut Self, Centre, DVec3, f64) -> bool,
        found: impl FnMut(&mut Self, u32),
    ) {
        let body = self.body;
        let bound = self.bound;
        let tree = body.tree(self.footprint);
        tree.resume_traversal(traversal, (body.bounds(self.footprint), &bound), self, enter, found);
    }
}

impl DeformingNodes for DeformedSurface<'_> {
    fn rest(&self, node: usize) -> DVec3 {
        DeformedSurface::rest(self, node)
    }

    fn residual_bound(&self, at: usize) -> f64 {
        self.residual_of(|subtrees| subtrees.of_tree_node(at))
    }

    /// With residual displacement where it is smooth; elsewhere it counts for the sphere's radius.
    fn position(&mut self, node: usize) -> DVec3 {
        if self.residual_is_smooth() {
            DeformedSurface::position(self, node)
        } else {
            self.modal_position(node)
        }
    }
}
