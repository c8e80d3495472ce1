//! Proximity queries against the deformed surface of an object: nearest triangles, and local minima of the distance.
//!
//! Equations: docs/theory.md (C21).

use super::deformed_surface::{DeformedSurface, TriangleProjection};
use super::parameters::{COLLISION, ROUND_OFF};
use crate::response::Body;
use crate::surface::Traversal;
use alloc::vec::Vec;
use glam::DVec3;

/// Upper limit of triangles that a query keeps; of more, the nearest count.
pub(super) const MAX_TRIANGLES: usize = 1024;

/// Whether two surfaces with these outward normals can press on each other; always, where one has none (zero). A node on an
/// edge or corner does not meet a face that is beside it.
pub(super) fn opposes(normal: DVec3, facing: DVec3) -> bool {
    facing == DVec3::ZERO || normal.dot(facing) < COLLISION.opposing_cosine
}

/// Distance below which two points are one [m].
fn coincidence(body: &Body) -> f64 {
    ROUND_OFF * body.edge
}

/// Result buffer of a query.
#[derive(Debug, Clone)]
pub(crate) struct ProximityQuery {
    /// Projections of the query point, the nearest first.
    pub(crate) found: Vec<TriangleProjection>,
}

impl ProximityQuery {
    pub(crate) fn new() -> Self {
        Self { found: Vec::with_capacity(MAX_TRIANGLES) }
    }

    /// Find the triangles within a reach [m] of a body point.
    ///
    /// # Real time
    /// Costs the triangles within reach, and the logarithm of all.
    pub(crate) fn triangles_within(&mut self, surface: &mut DeformedSurface, p: DVec3, reach: f64) {
        self.found.clear();
        collect_within(surface, (&mut Traversal::START.clone(), usize::MAX), p, reach, &mut self.found);
        sort_by_distance(&mut self.found);
    }

    /// Find all triangles that share the nearest point of the surface, if it is within a reach [m] of a body point.
    /// Only triangles that [`opposes`] a normal `facing` count (zero for all); `known`, the nearest triangle of the last step,
    /// shortens the search.
    ///
    /// # Real time
    /// Costs the triangles that come near to the nearest distance.
    pub(crate) fn nearest_triangles(
        &mut self,
        surface: &mut DeformedSurface,
        (p, facing): (DVec3, DVec3),
        reach: f64,
        known: Option<u32>,
    ) {
        let coincident = coincidence(surface.body);
        let found = &mut self.found;
        found.clear();
        let counts = |one: &TriangleProjection| opposes(one.normal, facing);
        let first = known.map(|triangle| surface.project_on_triangle(triangle, p)).filter(counts);
        let first = first.map_or(f64::INFINITY, |one| one.distance + coincident);
        let least = core::cell::Cell::new(reach.min(first));
        surface.traverse(
            |_, _, centre, radius| (p - centre).length() - radius < least.get(),
            |surface, triangle| {
                // Most triangles are farther by their bounding box.
                let [a, b, c] = surface.corners(triangle);
                let in_box = p.clamp(a.min(b).min(c), a.max(b).max(c));
                if (p - in_box).length() > least.get() * (1.0 + ROUND_OFF) {
                    return;
                }
                let one = surface.project_on_triangle(triangle, p);
                if one.distance < least.get() && counts(&one) {
                    least.set(least.get().min(one.distance + coincident));
                    found.retain(|other| other.distance < least.get());
                    if found.len() < MAX_TRIANGLES {
                        found.push(one);
                    }
                }
            },
        );
        sort_by_distance(&mut self.found);
    }

    /// Projection onto the nearest triangle, if it is within a reach [m] of a body point.
    ///
    /// # Real time
    pub(crate) fn nearest(surface: &mut DeformedSurface, p: DVec3, reach: f64) -> Option<TriangleProjection> {
        let best: core::cell::Cell<Option<TriangleProjection>> = core::cell::Cell::new(None);
        let least = || best.get().map_or(reach, |found| found.distance.min(reach));
        surface.traverse(
            |_, _, centre, radius| (p - centre).length() - radius < least(),
            |surface, triangle| {
                let one = surface.project_on_triangle(triangle, p);
                if one.distance < least() {
                    best.set(Some(one));
                }
            },
        );
        best.get().filter(|found| found.distance < reach)
    }

    /// Whether a point is inside, by the sum of the normals of the nearest triangles that were found.
    pub(crate) fn is_inside(&self, body: &Body, p: DVec3) -> bool {
        let Some(nearest) = self.found.first() else { return false };
        let same = self.found.iter().filter(|f| (f.position - nearest.position).length() < coincidence(body));
        same.map(|f| f.normal).sum::<DVec3>().dot(p - nearest.position) < 0.0
    }

    /// Keep the local minima of the distance within a reach [m], one per face and at most `most`, the nearest first.
    pub(crate) fn keep_local_minima(&mut self, body: &Body, reach: f64, most: usize) {
        keep_local_minima(&mut self.found, body, reach, most);
    }
}

/// Collect the triangles within a reach [m] of a body point, resuming a traversal for so many spheres and triangles.
pub(super) fn collect_within(
    surface: &mut DeformedSurface,
    traversal: (&mut Traversal, usize),
    p: DVec3,
    reach: f64,
    found: &mut Vec<TriangleProjection>,
) {
    surface.resume_traversal(
        traversal,
        |_, _, centre, radius| (p - centre).length() - radius < reach,
        |surface, triangle| {
            let one = surface.project_on_triangle(triangle, p);
            if one.distance < reach {
                insert_bounded(found, one);
            }
        },
    );
}

/// Insert a projection; a full list drops its farthest.
fn insert_bounded(found: &mut Vec<TriangleProjection>, one: TriangleProjection) {
    if found.len() < MAX_TRIANGLES {
        found.push(one);
        return;
    }
    let farthest = found.iter_mut().max_by(|a, b| a.distance.total_cmp(&b.distance));
    if let Some(farthest) = farthest.filter(|farthest| one.distance < farthest.distance) {
        *farthest = one;
    }
}

/// Sort by distance, then by triangle.
pub(super) fn sort_by_distance(found: &mut [TriangleProjection]) {
    found.sort_unstable_by(|a, b| a.distance.total_cmp(&b.distance).then(a.triangle.cmp(&b.triangle)));
}

/// Local minima of sorted projections, see [`ProximityQuery::keep_local_minima`].
pub(super) fn keep_local_minima(found: &mut Vec<TriangleProjection>, body: &Body, reach: f64, most: usize) {
    found.retain(|found| found.distance < reach);
    let triangles = &body.recording.surface.triangles;
    let mut kept = 0;
    for at in 0..found.len() {
        if kept == most {
            break;
        }
        let one = found[at];
        if found[..kept].iter().any(|other| one.normal.dot(other.normal) > COLLISION.crease_cosine) {
            continue;
        }
        // The corner, edge or face that holds the nearest point.
        let corners = triangles[one.triangle as usize];
        let feature =
            || corners.iter().zip(one.weights).filter(|(_, w)| *w > ROUND_OFF).map(|(node, _)| node);
        let holds = |other: &TriangleProjection| {
            feature().all(|node| triangles[other.triangle as usize].contains(node))
        };
        // The list is sorted: a nearer triangle at the same feature, or one that shares the point, stands before.
        if !found[..at].iter().any(holds) {
            found.swap(kept, at);
            kept += 1;
        }
    }
    found.truncate(kept);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::collision::deformed_surface::SurfaceTime;
    use crate::collision::node_cache::NodePositionCache;
    use crate::recording::Recording;
    use crate::response::{ContactPoints, Footprint, Response, ResponseForm};
    use alloc::sync::Arc;

    #[test]
    fn no_triangle_within_reach_is_missed_under_any_deformation() {
        let bytes = include_bytes!("../../../../data/recordings/v1/free.palp");
        let recording = Arc::new(Recording::from_bytes(bytes).expect("a released recording"));
        let radius = 2.0 * recording.surface.mean_edge();
        let body = Body::new(recording.clone(), &[radius], None, &[]);
        let response = Response::new(&recording, ResponseForm::Modal, 1e-3).expect("a modal response");
        let (state, points) = (response.at_rest(&recording, 1), ContactPoints::new(1));
        let mut cache = NodePositionCache::new(&body);
        let mut query = ProximityQuery::new();
        let omegas = &recording.modes.angular_frequencies;
        let (mut found, mut full) = (0, 0);
        for case in 0..4000 {
            let angle = |k: f64| libm::sin(12.9 * f64::from(case) + 7.3 * k + 1.0);
            let reading = if case % 2 == 0 { Footprint::Point } else { Footprint::Patch(0) };
            // Deformations of some hundredths to twice the body's size, of low modes and of all.
            let fall = if case % 3 == 0 { 1.0 } else { 0.1 };
            let size = 0.1 * libm::exp(1.5 * angle(0.0));
            let mode = |(k, omega): (usize, &f64)| {
                size * angle(k as f64 + 1.0) * libm::exp(-fall * k as f64) * omegas[0] / omega * 0.3
            };
            let q: Vec<f64> = omegas.iter().enumerate().map(mode).collect();
            let p = DVec3::new(angle(0.3), angle(0.6), angle(0.9)) * 0.12;
            let reach = 0.05 * (1.0 + angle(0.2));
            let mut surface = DeformedSurface::new(
                &body,
                reading,
                &state,
                &points,
                &mut cache,
                SurfaceTime::Coordinates(&q),
            );
            query.triangles_within(&mut surface, p, reach);
            let mut all: Vec<u32> = (0..recording.surface.triangles.len() as u32)
                .filter(|&t| surface.project_on_triangle(t, p).distance < reach)
                .collect();
            full += usize::from(all.len() >= MAX_TRIANGLES);
            if all.len() < MAX_TRIANGLES {
                let mut got: Vec<u32> = query.found.iter().map(|one| one.triangle).collect();
                got.sort_unstable();
                all.sort_unstable();
                assert_eq!(got, all, "case {case}");
            }
            found += query.found.len();

            // Nor by other queries at the same moment.
            for other in 0..4 {
                let p = DVec3::new(angle(1.3), angle(1.6), angle(1.9)) * (0.03 * f64::from(other + 1));
                let least = (0..recording.surface.triangles.len() as u32)
                    .map(|t| surface.project_on_triangle(t, p).distance)
                    .fold(f64::INFINITY, f64::min);
                assert!(surface.may_be_within(p, least * 1.001 + 1e-12), "case {case}");
                let known = (other > 1).then_some(0);
                query.nearest_triangles(&mut surface, (p, DVec3::ZERO), f64::INFINITY, known);
                assert_eq!(query.found[0].distance, least, "case {case}");
                query.nearest_triangles(&mut surface, (p, DVec3::ZERO), least, known);
                assert!(query.found.is_empty(), "case {case}");
            }
        }
        assert!(found > 5000 && full < 200, "{found} {full}");
    }
}
