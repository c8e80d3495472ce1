//! The moving, deformed surface of an object as it is at a moment: where its nodes and triangles are, without passing over
//! the surface.

use crate::contact::ContactPoints;
use crate::response::{Acting, Body, NodalForces, Place, Reading, ResponseState};
use crate::surface::{
    Centre, Moving, Surface, Visit, Walk, area_normal, at_weights, low_modes, nearest_on_triangle,
};
use alloc::vec;
use alloc::vec::Vec;
use glam::DVec3;

/// Faces of one object that a tip can meet at once.
pub(crate) const MOST_FACES: usize = 4;

/// A triangle near a point, body frame.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Found {
    pub(crate) triangle: u32,
    pub(crate) weights: [f64; 3],
    /// Its nearest point [m], and how far that is [m].
    pub(crate) position: DVec3,
    pub(crate) distance: f64,
    /// Outward normal of the deformed triangle.
    pub(crate) normal: DVec3,
}

/// Where the nodes of an object are, found once per moment; buffers of the object.
#[derive(Debug, Clone)]
pub(crate) struct NodeCache {
    positions: Vec<DVec3>,
    stamps: Vec<u64>,
    now: u64,
    /// At the end of the step without contact force.
    free: Vec<DVec3>,
    free_stamps: Vec<u64>,
    /// The same with dents: all of them, or some.
    whole: Vec<DVec3>,
    whole_stamps: Vec<u64>,
    whole_now: u64,
    some_dents: bool,
    moment: Option<(u64, Reading)>,
    /// Radii of the tree's spheres about where their centres are by the modes [m], as far as they are known.
    tight: Vec<(f64, u64)>,
    /// Modal coordinates, now and at the end of the step without contact force, in single precision for patches.
    single: [Vec<f32>; 2],
    /// Which nodes a walk has come to.
    visits: Vec<u32>,
    visit: u32,
}

impl NodeCache {
    pub(crate) fn new(body: &Body) -> Self {
        let nodes = body.recording.surface.positions.len();
        Self {
            positions: vec![DVec3::ZERO; nodes],
            stamps: vec![0; nodes],
            now: 0,
            free: vec![DVec3::ZERO; nodes],
            free_stamps: vec![0; nodes],
            whole: vec![DVec3::ZERO; nodes],
            whole_stamps: vec![0; nodes],
            whole_now: 0,
            some_dents: false,
            moment: None,
            single: [(); 2].map(|()| vec![0.0; body.recording.modes.len()]),
            tight: vec![(0.0, 0); body.tree(Reading::Point).spheres()],
            visits: vec![0; nodes],
            visit: 0,
        }
    }

    /// Begin a moment, with or without all dents. What is known of the same one stays; says whether it is another.
    fn begin(&mut self, moment: Option<(u64, Reading)>) -> bool {
        let same = moment.is_some() && self.moment == moment;
        if !same {
            self.now += 1;
            self.moment = moment;
        }
        if !same || self.some_dents {
            self.whole_now += 1;
            self.some_dents = false;
        }
        !same
    }

    fn take_single(&mut self, moments: [&[f64]; 2]) {
        for (single, q) in self.single.iter_mut().zip(moments) {
            single.iter_mut().zip(q).for_each(|(single, q)| *single = *q as f32);
        }
    }

    /// Take over where contact points are that are nodes.
    fn take_nodes(&mut self, points: &ContactPoints, reading: Reading) {
        for point in points.points.iter().filter(|point| point.place.reading == reading) {
            let Some(node) = point.node else { continue };
            let by_modes = point.placed.displacement - point.placed.residual;
            self.positions[node] = point.rest + by_modes;
            self.free[node] = point.rest + point.free - point.placed.sag;
            self.whole[node] = point.rest + point.placed.displacement;
            (self.stamps[node], self.free_stamps[node]) = (self.now, self.now);
            self.whole_stamps[node] = self.whole_now;
        }
    }
}

/// A surface at a moment, as a reading sees it; body frame.
pub(crate) struct Sight<'a> {
    pub(crate) body: &'a Body,
    reading: Reading,
    /// Modal coordinates.
    pub(super) q: &'a [f64],
    /// The same at the end of the step without contact force.
    free: &'a [f64],
    /// Forces of the last step with their places.
    acting: &'a [Acting],
    nodal: Option<&'a NodalForces>,
    /// Places whose own dents do not count: around them, within a distance, the surface goes as the place does, by so
    /// much [m] where a reading's dents have no shape.
    own: [Option<(Place, DVec3)>; MOST_FACES],
    flat: f64,
    /// Whether spheres hold what the step without contact force does, too.
    widened: bool,
    cache: &'a mut NodeCache,
    visit: Visit,
}

impl<'a> Sight<'a> {
    /// The surface at the start of step number `step`, or at another moment with modal coordinates `q`.
    pub(crate) fn new(
        body: &'a Body,
        reading: Reading,
        state: &'a ResponseState,
        points: &ContactPoints,
        cache: &'a mut NodeCache,
        moment: Result<u64, &'a [f64]>,
    ) -> Self {
        let (q, key) = match moment {
            Ok(step) => (state.coordinates(), Some((step, reading))),
            Err(q) => (q, None),
        };
        let free = state.free_coordinates();
        if cache.begin(key) {
            if reading != Reading::Point {
                cache.take_single([q, free]);
            }
            if moment.is_ok() {
                cache.take_nodes(points, reading);
            }
        }
        // No place goes farther by the residual compliance than where the forces act, or hardly.
        let same = points.points.iter().filter(|p| p.place.reading == reading);
        let beside = same.map(|p| p.placed.residual.length()).fold(0.0, f64::max);
        let visit = Visit {
            modal: body.norms(q),
            residual: libm::sqrt(2.0 * state.residual_energy()),
            most_residual: 2.0 * beside,
            slope: body.dent_slope(reading),
        };
        Self {
            body,
            reading,
            q,
            free,
            acting: state.acting(),
            nodal: state.nodal(),
            own: [None; MOST_FACES],
            flat: 0.0,
            widened: false,
            cache,
            visit,
        }
    }

    /// Leave out the own dents of places within a distance [m]: a tip that presses is not beside itself.
    pub(crate) fn without_dents(&mut self, own: [Option<Place>; MOST_FACES], flat: f64) {
        if own.iter().any(Option::is_some) {
            let dent = |place: Place| {
                let its = |other: &&Acting| self.reading == Reading::Point && other.place == place;
                let other = self.acting.iter().find(its);
                (place, other.map_or(DVec3::ZERO, |o| self.body.residual(&place, &place) * o.force))
            };
            (self.own, self.flat) = (own.map(|place| place.map(dent)), flat);
            self.cache.whole_now += 1;
            self.cache.some_dents = true;
        }
    }

    fn dents_have_a_shape(&self) -> bool {
        self.visit.slope.is_finite()
    }

    /// How far any node can be from its place at rest [m].
    pub(crate) fn reach(&self) -> f64 {
        self.body.bounds(self.reading).reach(&self.visit)
    }

    /// The surface that the reading knows.
    pub(crate) fn surface(&self) -> &'a Surface {
        self.body.surface(self.reading)
    }

    fn rest(&self, node: usize) -> DVec3 {
        self.body.recording.surface.positions[node]
    }

    fn is_known(&self, node: usize) -> bool {
        self.cache.stamps[node] == self.cache.now
    }

    /// The most [m] that a dent moves any node.
    pub(crate) fn most_dent(&self) -> f64 {
        self.visit.most_residual
    }

    /// Forget which nodes were come to.
    pub(crate) fn begin_visit(&mut self) {
        self.cache.visit = self.cache.visit.wrapping_add(1);
    }

    /// Whether a node is come to for the first time.
    pub(crate) fn first_visit(&mut self, node: usize) -> bool {
        core::mem::replace(&mut self.cache.visits[node], self.cache.visit) != self.cache.visit
    }

    /// Let spheres hold also what the step without contact force does.
    pub(crate) fn widen(&mut self) {
        self.widened = true;
        let free = self.body.norms(self.free);
        self.visit.modal = core::array::from_fn(|band| self.visit.modal[band].max(free[band]));
    }

    /// A node's place by the modes at the end of the step without contact force.
    pub(crate) fn free_node(&mut self, node: usize) -> DVec3 {
        if self.cache.free_stamps[node] != self.cache.now {
            self.cache.free_stamps[node] = self.cache.now;
            self.cache.free[node] = self.rest(node) + self.displacement(node, self.free, 1);
        }
        self.cache.free[node]
    }

    fn displacement(&self, node: usize, q: &[f64], moment: usize) -> DVec3 {
        self.body.displacement(self.reading, node, q, &self.cache.single[moment][..q.len()])
    }

    /// How far the step without contact force moves the corners of a triangle by deformation, at most [m].
    pub(crate) fn deformation(&mut self, found: &Found) -> f64 {
        let corners = self.surface().triangles[found.triangle as usize];
        let mut most = 0.0_f64;
        for node in corners {
            most = most.max((self.free_node(node as usize) - self.smooth(node as usize)).length());
        }
        most
    }

    /// A node's place by the modes.
    pub(crate) fn smooth(&mut self, node: usize) -> DVec3 {
        if !self.is_known(node) {
            self.cache.stamps[node] = self.cache.now;
            self.cache.positions[node] = self.rest(node) + self.displacement(node, self.q, 0);
        }
        self.cache.positions[node]
    }

    /// A node's place.
    pub(crate) fn node(&mut self, node: usize) -> DVec3 {
        if self.cache.whole_stamps[node] == self.cache.whole_now {
            return self.cache.whole[node];
        }
        let smooth = self.smooth(node);
        let place = self.with_dents(node, smooth);
        (self.cache.whole[node], self.cache.whole_stamps[node]) = (place, self.cache.whole_now);
        place
    }

    fn with_dents(&self, node: usize, smooth: DVec3) -> DVec3 {
        let acting = self.acting.iter().filter(|other| other.place.reading == self.reading);
        let own = || self.own.iter().flatten();
        if self.reading != Reading::Point {
            let flat =
                |other: &Acting| if own().any(|(own, _)| *own == other.place) { self.flat } else { 0.0 };
            return smooth + acting.map(|other| self.body.dent(node, other, flat(other))).sum::<DVec3>();
        }
        let mut place = smooth;
        if let Some(nodal) = self.nodal {
            place += nodal.dent(&self.body.recording.residual, node);
        }
        // A dent that a point leaves has no shape between the nodes: those beside it go as it does.
        for (own, dent) in own() {
            let beside =
                |other: &&Acting| other.place == *own && (self.rest(node) - other.rest).length() < self.flat;
            if let Some(other) = acting.clone().find(beside) {
                place += *dent - self.body.dent(node, other, 0.0);
            }
        }
        place
    }

    /// A node's place by the low modes.
    pub(crate) fn low(&self, node: usize) -> DVec3 {
        self.low_place(node, self.q, 0)
    }

    /// The same at the end of the step without contact force.
    pub(crate) fn free_low(&self, node: usize) -> DVec3 {
        self.low_place(node, self.free, 1)
    }

    fn low_place(&self, node: usize, q: &[f64], moment: usize) -> DVec3 {
        self.rest(node) + self.displacement(node, &q[..low_modes(q.len())], moment)
    }

    /// Where the corners of a triangle are.
    pub(crate) fn corners(&mut self, triangle: u32) -> [DVec3; 3] {
        let [a, b, c] = self.surface().triangles[triangle as usize].map(|n| n as usize);
        [self.node(a), self.node(b), self.node(c)]
    }

    /// The nearest point of a triangle.
    pub(crate) fn nearest_on(&mut self, triangle: u32, p: DVec3) -> Found {
        let corners = self.corners(triangle);
        let weights = nearest_on_triangle(corners, p);
        let position = at_weights(corners, weights);
        let normal = area_normal(corners).normalize_or_zero();
        Found { triangle, weights, position, distance: (p - position).length(), normal }
    }

    /// How far the surface goes in a direction of unit length [m, body], or `least` if it does not go so far.
    ///
    /// # Real time
    /// Costs the nodes that come near to that.
    pub(crate) fn support(&mut self, direction: DVec3, least: f64) -> f64 {
        let farthest = core::cell::Cell::new(least);
        let beside = self.most_dent();
        self.walk(
            |_, _, centre, radius| centre.dot(direction) + radius > farthest.get(),
            |sight, triangle, _| {
                for node in sight.surface().triangles[triangle as usize] {
                    let place = sight.smooth(node as usize).dot(direction) + beside;
                    farthest.set(farthest.get().max(place));
                }
            },
        );
        farthest.get()
    }

    /// Whether anything of the surface may be within a reach [m] of a body point.
    ///
    /// # Real time
    /// Costs less than to look what it is.
    pub(crate) fn may_reach(&mut self, p: DVec3, reach: f64) -> bool {
        let reached = core::cell::Cell::new(false);
        self.walk(
            |_, _, centre, radius| !reached.get() && (p - centre).length() - radius < reach,
            |_, _, _| reached.set(true),
        );
        reached.get()
    }

    /// Visit all triangles in spheres that `near` takes: (what its centre is, centre, radius) in the body frame, see
    /// [`crate::surface::SurfaceTree::walk`].
    pub(crate) fn walk(
        &mut self,
        near: impl Fn(&mut Self, Centre, DVec3, f64) -> bool,
        found: impl FnMut(&mut Self, u32, f64),
    ) {
        self.walk_on((&mut Walk::BEGUN.clone(), usize::MAX), near, found);
    }

    /// The same from where a walk stands, past so many spheres and triangles. Gives how many they were.
    pub(crate) fn walk_on(
        &mut self,
        walk: (&mut Walk, usize),
        near: impl Fn(&mut Self, Centre, DVec3, f64) -> bool,
        found: impl FnMut(&mut Self, u32, f64),
    ) -> usize {
        let body = self.body;
        let visit = self.visit;
        let tree = body.tree(self.reading);
        tree.walk_on(walk, (body.bounds(self.reading), &visit), self, near, found)
    }
}

impl Moving for Sight<'_> {
    fn rest(&self, node: usize) -> DVec3 {
        Sight::rest(self, node)
    }

    fn low(&self, node: usize) -> Option<DVec3> {
        if self.is_known(node) {
            return None;
        }
        let smooth = Sight::low(self, node);
        Some(if self.dents_have_a_shape() { self.with_dents(node, smooth) } else { smooth })
    }

    /// With dents where they have a shape, else they count for a sphere's radius.
    fn moved(&mut self, node: usize) -> DVec3 {
        if self.dents_have_a_shape() { self.node(node) } else { self.smooth(node) }
    }

    /// Patches are looked at by few: what their dents do is not kept.
    fn keeps(&self) -> bool {
        self.reading == Reading::Point && !self.widened
    }

    fn known(&self, node: usize) -> Option<DVec3> {
        self.is_known(node).then(|| self.cache.positions[node])
    }

    fn corners_of(&self, triangle: u32) -> [usize; 3] {
        self.surface().triangles[triangle as usize].map(|node| node as usize)
    }

    fn tight(&self, sphere: usize) -> Option<f64> {
        let (radius, stamp) = self.cache.tight[sphere];
        (self.keeps() && stamp == self.cache.now).then_some(radius)
    }

    fn set_tight(&mut self, sphere: usize, radius: f64) {
        self.cache.tight[sphere] = (radius, self.cache.now);
    }
}
