//! Triangle cache: the triangles near a point that moves little from step to step, a Verlet list with a skin.
//!
//! A list built with reach r + skin holds all triangles within r while point and surface together have moved less than the
//! skin since. The next list is built before that, a part of the traversal in each step.
//!
//! Equations: docs/theory.md (C20).

use super::deformed_surface::{DeformedSurface, TriangleProjection};
use super::parameters::{COLLISION, MAX_ITERATIONS, ROUND_OFF};
use super::proximity::{MAX_TRIANGLES, ProximityQuery, collect_within, keep_local_minima, sort_by_distance};
use crate::response::Body;
use crate::surface::Traversal;
use alloc::vec;
use alloc::vec::Vec;
use glam::DVec3;

/// Room for seeds.
const MAX_SEEDS: usize = 8;

/// Verlet list of the triangles around a point.
#[derive(Debug, Clone)]
struct TriangleList {
    /// Triangles, the nearest first, with their distances when it was built [m].
    triangles: Vec<(u32, f64)>,
    /// Seeds, where there are too many triangles; else empty.
    seeds: Vec<u32>,
    /// Point [m, body], modal coordinates, and the range of the largest residual displacement [m] while it was built.
    point: DVec3,
    q: Vec<f64>,
    residual: [f64; 2],
    /// Distance within which it is complete [m]; 0 for an empty list.
    reach: f64,
}

impl TriangleList {
    fn new(modes: usize) -> Self {
        Self {
            triangles: Vec::with_capacity(MAX_TRIANGLES),
            seeds: Vec::with_capacity(MAX_SEEDS),
            point: DVec3::ZERO,
            q: vec![0.0; modes],
            residual: [0.0; 2],
            reach: 0.0,
        }
    }

    /// Upper bound of the relative displacement of point and surface since the list was built [m].
    fn displacement_since_build(&self, surface: &DeformedSurface, p: DVec3) -> f64 {
        let deformed = surface.body.displacement_bound(&self.q[..surface.q.len()], surface.q);
        let residual = self.residual.map(|residual| libm::fabs(surface.max_residual() - residual));
        deformed + 2.0 * residual[0].max(residual[1]) + (p - self.point).length()
    }
}

/// Triangle cache of one device on one object.
#[derive(Debug, Clone)]
pub(crate) struct TriangleCache {
    current: TriangleList,
    /// List that is being built, its triangles so far, and its traversal.
    next: TriangleList,
    found: Vec<TriangleProjection>,
    traversal: Traversal,
    /// Spheres and triangles that the last rebuild visited.
    last_visits: usize,
    seed_above: usize,
}

/// Triangle caches of one device: on the objects that it was near last.
#[derive(Debug, Clone)]
pub(crate) struct TriangleCaches {
    /// Caches with the object and the last step of each.
    slots: Vec<(Option<usize>, u64, TriangleCache)>,
}

/// Upper limit of objects whose triangles near a device are kept.
const OBJECTS_PER_DEVICE: usize = 4;

impl TriangleCaches {
    /// Caches for a number of objects with so many modes at most.
    pub(crate) fn new(objects: usize, modes: usize) -> Self {
        let slot = |_| (None, 0, TriangleCache::new(modes));
        Self { slots: (0..objects.min(OBJECTS_PER_DEVICE)).map(slot).collect() }
    }

    /// Cache on an object in a step: the one that it has, or the one that was used least recently, without its content.
    pub(crate) fn of(&mut self, object: usize, step: u64) -> &mut TriangleCache {
        let own = self.slots.iter().position(|slot| slot.0 == Some(object));
        let age = |&at: &usize| (self.slots[at].0.is_some(), self.slots[at].1);
        let at = own.or_else(|| (0..self.slots.len()).min_by_key(age)).unwrap_or(0);
        let slot = &mut self.slots[at];
        if slot.0 != Some(object) {
            slot.2.clear();
        }
        (slot.0, slot.1) = (Some(object), step);
        &mut slot.2
    }

    /// Caches that are being rebuilt, with their objects.
    pub(crate) fn rebuilding(&mut self) -> impl Iterator<Item = (usize, &mut TriangleCache)> {
        let slots = self.slots.iter_mut().filter(|slot| !slot.2.traversal.is_finished());
        slots.filter_map(|(object, _, cache)| Some(((*object)?, cache)))
    }
}

impl TriangleCache {
    pub(crate) fn new(modes: usize) -> Self {
        Self {
            current: TriangleList::new(modes),
            next: TriangleList::new(modes),
            found: Vec::with_capacity(MAX_TRIANGLES),
            traversal: Traversal::FINISHED,
            last_visits: 0,
            seed_above: COLLISION.seed_above,
        }
    }

    /// Forget the lists.
    fn clear(&mut self) {
        (self.current.reach, self.traversal) = (0.0, Traversal::FINISHED);
    }

    /// Find the triangles within a reach [m] of a body point, or some more; of many only the local minima.
    ///
    /// # Real time
    /// Costs the listed triangles; a full rebuild where the skin is used up before the next list is built.
    pub(crate) fn find(
        &mut self,
        query: &mut ProximityQuery,
        surface: &mut DeformedSurface,
        p: DVec3,
        reach: f64,
    ) {
        let displacement = self.current.displacement_since_build(surface, p);
        let skin = self.current.reach - reach;
        let left = skin - displacement;
        if left <= 0.0 || self.current.reach == 0.0 {
            self.begin_rebuild(surface, p, reach);
            self.resume_rebuild(surface, usize::MAX);
            self.finish_rebuild(surface.body);
            query.found.clone_from(&self.found);
            return;
        }
        if self.traversal.is_finished() && left < 0.5 * skin {
            self.begin_rebuild(surface, p, reach);
        }
        let found = &mut query.found;
        found.clear();
        if self.current.seeds.is_empty() {
            let triangles = self.current.triangles.iter();
            let within = triangles.take_while(|(_, distance)| *distance < reach + displacement);
            found.extend(within.map(|&(triangle, _)| surface.project_on_triangle(triangle, p)));
        } else {
            found.extend(self.current.seeds.iter().map(|&seed| descend(surface, seed, p)));
        }
        sort_by_distance(found);
    }

    /// Take the modal coordinates at which the next list is being built.
    pub(crate) fn take_rebuild_coordinates(&mut self) -> Vec<f64> {
        core::mem::take(&mut self.next.q)
    }

    /// Continue an incremental rebuild, on the surface at the coordinates of its beginning with the present residual
    /// displacement.
    ///
    /// # Real time
    /// Costs a part of a rebuild.
    pub(crate) fn continue_rebuild(&mut self, surface: &mut DeformedSurface) {
        self.resume_rebuild(surface, self.last_visits.div_ceil(COLLISION.rebuild_steps));
    }

    /// Return the coordinates; a finished list becomes the current one.
    pub(crate) fn return_rebuild_coordinates(&mut self, coordinates: Vec<f64>, body: &Body) {
        self.next.q = coordinates;
        if self.traversal.is_finished() {
            self.finish_rebuild(body);
        }
    }

    fn begin_rebuild(&mut self, surface: &DeformedSurface, p: DVec3, reach: f64) {
        let next = &mut self.next;
        next.q[..surface.q.len()].copy_from_slice(surface.q);
        (next.point, next.residual) = (p, [surface.max_residual(); 2]);
        next.reach = reach + COLLISION.skin * (surface.body.edge + reach);
        self.traversal = Traversal::START;
        self.found.clear();
    }

    /// Resume the traversal on the surface at the coordinates of its beginning.
    fn resume_rebuild(&mut self, surface: &mut DeformedSurface, visits: usize) {
        let Self { next, found, traversal, .. } = self;
        let (p, reach, residual) = (next.point, next.reach, surface.max_residual());
        next.residual = [next.residual[0].min(residual), next.residual[1].max(residual)];
        collect_within(surface, (traversal, visits), p, reach, found);
    }

    /// Make the next list the current one.
    fn finish_rebuild(&mut self, body: &Body) {
        self.last_visits = self.traversal.visits;
        let Self { current, next, found, .. } = self;
        sort_by_distance(found);
        next.triangles.clear();
        next.triangles.extend(found.iter().map(|found| (found.triangle, found.distance)));
        // A full list is complete up to its farthest triangle only.
        if let (MAX_TRIANGLES, Some(farthest)) = (found.len(), found.last()) {
            next.reach = farthest.distance;
        }
        next.seeds.clear();
        if next.triangles.len() > self.seed_above {
            keep_local_minima(found, body, f64::INFINITY, MAX_SEEDS);
            next.seeds.extend(found.iter().map(|found| found.triangle));
        }
        core::mem::swap(current, next);
    }
}

/// Local minimum of the distance to a body point, from a triangle over edges and corners while that leads nearer.
fn descend(surface: &mut DeformedSurface, triangle: u32, p: DVec3) -> TriangleProjection {
    let mut best = surface.project_on_triangle(triangle, p);
    let body = surface.body;
    for _ in 0..MAX_ITERATIONS {
        let corners = body.recording.surface.triangles[best.triangle as usize];
        let mut on = corners.iter().zip(best.weights).filter(|(_, w)| *w > ROUND_OFF).map(|(node, _)| *node);
        let before = best;
        let mut look = |surface: &mut DeformedSurface, triangle: u32| {
            let one = surface.project_on_triangle(triangle, p);
            if one.distance < best.distance {
                best = one;
            }
        };
        match (on.next(), on.next(), on.next()) {
            (Some(a), Some(b), None) => {
                if let Some(over) = body.triangle_across(before.triangle, a, b) {
                    look(surface, over);
                }
            }
            (Some(corner), None, None) => {
                body.triangles_around(corner as usize).iter().for_each(|&other| look(surface, other));
            }
            _ => {}
        }
        if best.triangle == before.triangle {
            break;
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::collision::deformed_surface::SurfaceTime;
    use crate::collision::node_cache::NodePositionCache;
    use crate::recording::Recording;
    use crate::response::{ContactPoints, Footprint, Response, ResponseForm};
    use alloc::sync::Arc;

    /// Deterministic number in [-1, 1] of a case.
    fn wave(case: u32, k: f64) -> f64 {
        libm::sin(12.9 * f64::from(case) + 7.3 * k + 1.0)
    }

    /// A point moves about a deforming body. Counts steps with all triangles, steps with seeds, those of the latter that had
    /// the nearest one, rebuilds at once, and incremental rebuilds.
    fn follow(footprint_of: impl Fn(&Body) -> Footprint, seed_above: usize, speed: f64) -> [u32; 5] {
        let bytes = include_bytes!("../../../../data/recordings/v1/free.palp");
        let recording = Arc::new(Recording::from_bytes(bytes).expect("a released recording"));
        let body = Body::new(recording.clone(), &[2.0 * recording.surface.mean_edge()], None, &[]);
        let footprint = footprint_of(&body);
        let response = Response::new(&recording, ResponseForm::Modal, 1e-3).expect("a modal response");
        let (state, points) = (response.at_rest(&recording, 1), ContactPoints::new(1));
        let (mut cache, mut query) = (NodePositionCache::new(&body), ProximityQuery::new());
        let omegas = &recording.modes.angular_frequencies;
        let mut counts = [0; 5];
        for case in 0..40 {
            let mut triangles = TriangleCache::new(omegas.len());
            triangles.seed_above = seed_above;
            for step in 0..200 {
                let t = speed * f64::from(step);
                let mode = |(k, omega): (usize, &f64)| {
                    0.05 * wave(case, k as f64 + 1.0) * omegas[0] / omega * libm::sin(t * (1.0 + k as f64))
                };
                let q: Vec<f64> = omegas.iter().enumerate().map(mode).collect();
                let aside =
                    DVec3::new(wave(case, 1.6), wave(case, 1.9), wave(case, 1.3)) * libm::sin(3.0 * t);
                let p = DVec3::new(wave(case, 0.3), wave(case, 0.6), wave(case, 0.9)) * 0.06 + aside * 0.02;
                let reach = 0.01 * (2.0 + wave(case, 0.2) + 0.2 * libm::sin(t));
                let mut surface = DeformedSurface::new(
                    &body,
                    footprint,
                    &state,
                    &points,
                    &mut cache,
                    SurfaceTime::Coordinates(&q),
                );
                counts[3] += u32::from(
                    triangles.current.reach - reach - triangles.current.displacement_since_build(&surface, p)
                        <= 0.0,
                );
                triangles.find(&mut query, &mut surface, p, reach);
                let distances = (0..recording.surface.triangles.len() as u32)
                    .map(|triangle| surface.project_on_triangle(triangle, p).distance)
                    .filter(|distance| *distance < reach);
                if triangles.current.seeds.is_empty() {
                    let near = query.found.iter().filter(|one| one.distance < reach).count();
                    assert_eq!(near, distances.count(), "case {case} step {step}");
                    counts[0] += 1;
                } else {
                    // The nearest triangle, or one that was as near when the list was built.
                    let least = distances.fold(f64::INFINITY, f64::min);
                    let off = query.found[0].distance.min(reach) - least.min(reach);
                    assert!(
                        off <= 2.0 * triangles.current.displacement_since_build(&surface, p) + 1e-12,
                        "case {case} step {step}: {off}"
                    );
                    (counts[1], counts[2]) = (counts[1] + 1, counts[2] + u32::from(off < 1e-9));
                }
                if !triangles.traversal.is_finished() {
                    let moment = triangles.take_rebuild_coordinates();
                    let mut surface = DeformedSurface::new(
                        &body,
                        footprint,
                        &state,
                        &points,
                        &mut cache,
                        SurfaceTime::Coordinates(&moment),
                    );
                    triangles.continue_rebuild(&mut surface);
                    triangles.return_rebuild_coordinates(moment, &body);
                    counts[4] += u32::from(triangles.traversal.is_finished());
                }
            }
        }
        counts
    }

    #[test]
    fn no_near_triangle_is_missed_during_incremental_rebuilds() {
        for footprint in [Footprint::Point, Footprint::Patch(0)] {
            let [all, some, ..] = follow(|_| footprint, usize::MAX, 1e-2);
            assert_eq!((all, some), (8000, 0));
            let [_, some, nearest, ..] = follow(|_| footprint, 4, 1e-2);
            assert!(some > 3000 && 100 * nearest > 99 * some, "{nearest} of {some}");
        }
    }

    #[test]
    fn an_object_that_was_near_least_recently_gives_its_cache_away() {
        let mut caches = TriangleCaches::new(9, 3);
        for (step, object) in [(1, 0), (2, 1), (3, 2), (4, 3), (5, 0)] {
            caches.of(object, step).current.reach = 1.0 + object as f64;
        }
        assert_eq!(caches.of(7, 6).current.reach, 0.0, "of object 1, and empty");
        assert_eq!([0, 2, 3].map(|object| caches.of(object, 7).current.reach), [1.0, 3.0, 4.0]);
    }

    #[test]
    fn slow_motion_never_rebuilds_at_once() {
        for speed in [1e-4, 3e-4] {
            let [.., at_once, in_parts] =
                follow(|body| body.footprint_at_level(0), COLLISION.seed_above, speed);
            // The first build of each case.
            assert_eq!(at_once, 40, "{speed}");
            assert!(in_parts >= 40, "{speed}: {in_parts}");
        }
    }
}
