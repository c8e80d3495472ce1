//! Finding what is near on the surface of an object.

use super::sight::{Found, Sight};
use crate::response::Body;
use crate::surface::Walk;
use alloc::vec::Vec;
use glam::DVec3;

/// Surface points that a search keeps at most; where a mesh is finer the nearest count.
pub(super) const MOST_FOUND: usize = 1024;

/// Places that are less than this [m] apart are one.
const SAME: f64 = 1e-9;

/// A distance that is larger by this is larger whatever was rounded.
const ROUNDED: f64 = 1.0 + 1e-9;

/// Places whose normals differ by less than this cosine are one: a facetted surface is one face.
pub(super) const ONE_FACE: f64 = 0.85;

/// Buffers of a search.
#[derive(Debug, Clone)]
pub(crate) struct Search {
    pub(crate) found: Vec<Found>,
    /// Whether a vicinity was found anew in this step.
    pub(super) renewed: bool,
}

impl Search {
    pub(crate) fn new() -> Self {
        Self { found: Vec::with_capacity(MOST_FOUND), renewed: false }
    }

    /// Begin a step.
    pub(crate) fn begin(&mut self) {
        self.renewed = false;
    }

    /// Find the triangles within a reach [m] of a body point.
    ///
    /// # Real time
    /// Costs the triangles within reach, and the logarithm of all.
    pub(crate) fn near(&mut self, sight: &mut Sight, p: DVec3, reach: f64) {
        self.found.clear();
        take_near(sight, (&mut Walk::BEGUN.clone(), usize::MAX), p, reach, &mut self.found);
        sort(&mut self.found);
    }

    /// Find the triangles that hold the nearest point of the surface, if it is within a reach [m] of a body point. One that
    /// was nearest a moment ago saves looking far. What faces the way that the point itself faces does not count; a point
    /// that faces no way meets all.
    ///
    /// # Real time
    /// Costs the triangles that come near to that.
    pub(crate) fn closest(
        &mut self,
        sight: &mut Sight,
        (p, facing): (DVec3, DVec3),
        reach: f64,
        known: Option<u32>,
    ) {
        let found = &mut self.found;
        found.clear();
        let meets = |one: &Found| one.normal.dot(facing) <= 0.0;
        let first = known.map(|triangle| sight.nearest_on(triangle, p)).filter(meets);
        let first = first.map_or(f64::INFINITY, |one| one.distance + SAME);
        let least = core::cell::Cell::new(reach.min(first));
        sight.walk(
            |_, _, centre, radius| (p - centre).length() - radius < least.get(),
            |sight, triangle, _| {
                // Most are farther by the box around them.
                let [a, b, c] = sight.corners(triangle);
                let in_box = p.clamp(a.min(b).min(c), a.max(b).max(c));
                if (p - in_box).length() > least.get() * ROUNDED {
                    return;
                }
                let one = sight.nearest_on(triangle, p);
                if one.distance < least.get() && meets(&one) {
                    least.set(least.get().min(one.distance + SAME));
                    found.retain(|other| other.distance < least.get());
                    if found.len() < MOST_FOUND {
                        found.push(one);
                    }
                }
            },
        );
        sort(&mut self.found);
    }

    /// The triangle that is nearest to a body point, if it is within a reach [m].
    ///
    /// # Real time
    pub(crate) fn nearest(sight: &mut Sight, p: DVec3, reach: f64) -> Option<Found> {
        let best: core::cell::Cell<Option<Found>> = core::cell::Cell::new(None);
        let least = || best.get().map_or(reach, |found| found.distance.min(reach));
        sight.walk(
            |_, _, centre, radius| (p - centre).length() - radius < least(),
            |sight, triangle, _| {
                let one = sight.nearest_on(triangle, p);
                if one.distance < least() {
                    best.set(Some(one));
                }
            },
        );
        best.get().filter(|found| found.distance < reach)
    }

    /// Whether a point is inside, by the directions of the nearest triangles that were found.
    pub(crate) fn is_inside(&self, p: DVec3) -> bool {
        let Some(nearest) = self.found.first() else { return false };
        let same = self.found.iter().filter(|f| (f.position - nearest.position).length() < SAME);
        same.map(|f| f.normal).sum::<DVec3>().dot(p - nearest.position) < 0.0
    }

    /// Keep what was found within a reach [m] where the surface is nearest to the point in its surroundings, once per
    /// face: at most `most`, the nearest first.
    pub(crate) fn keep_minima(&mut self, body: &Body, reach: f64, most: usize) {
        keep_minima(&mut self.found, body, reach, most);
    }
}

/// Take in the triangles within a reach [m] of a body point from where a walk stands, past so many spheres and triangles.
/// Gives how many they were.
pub(super) fn take_near(
    sight: &mut Sight,
    walk: (&mut Walk, usize),
    p: DVec3,
    reach: f64,
    found: &mut Vec<Found>,
) -> usize {
    sight.walk_on(
        walk,
        |_, _, centre, radius| (p - centre).length() - radius < reach,
        |sight, triangle, _| {
            let one = sight.nearest_on(triangle, p);
            if one.distance < reach {
                take_in(found, one);
            }
        },
    )
}

/// Take in what was found; where there is no room the nearest stay.
fn take_in(found: &mut Vec<Found>, one: Found) {
    if found.len() < MOST_FOUND {
        found.push(one);
        return;
    }
    let farthest = found.iter_mut().max_by(|a, b| a.distance.total_cmp(&b.distance));
    if let Some(farthest) = farthest.filter(|farthest| one.distance < farthest.distance) {
        *farthest = one;
    }
}

/// The nearest first.
pub(super) fn sort(found: &mut [Found]) {
    found.sort_unstable_by(|a, b| a.distance.total_cmp(&b.distance).then(a.triangle.cmp(&b.triangle)));
}

/// See [`Search::keep_minima`].
pub(super) fn keep_minima(found: &mut Vec<Found>, body: &Body, reach: f64, most: usize) {
    found.retain(|found| found.distance < reach);
    let triangles = &body.recording.surface.triangles;
    let mut kept = 0;
    for at in 0..found.len() {
        if kept == most {
            break;
        }
        let one = found[at];
        if found[..kept].iter().any(|other| one.normal.dot(other.normal) > ONE_FACE) {
            continue;
        }
        // The corner, edge or face that holds the point.
        let corners = triangles[one.triangle as usize];
        let feature = || corners.iter().zip(one.weights).filter(|(_, w)| *w > 1e-9).map(|(node, _)| node);
        let holds = |other: &Found| feature().all(|node| triangles[other.triangle as usize].contains(node));
        // Sorted: a triangle at the feature that is nearer stands before, and so does one that shares the point.
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
    use crate::contact::{ContactPoints, NodeCache};
    use crate::recording::Recording;
    use crate::response::{Reading, Response, ResponseForm};
    use alloc::sync::Arc;

    #[test]
    fn nothing_that_is_near_is_missed_however_the_body_deforms() {
        let bytes = include_bytes!("../../../../data/recordings/v1/free.palp");
        let recording = Arc::new(Recording::from_bytes(bytes).expect("a released recording"));
        let radius = 2.0 * recording.surface.mean_edge();
        let body = Body::new(recording.clone(), &[radius], usize::MAX);
        let response = Response::new(&recording, ResponseForm::Modal, 1e-3).expect("a modal response");
        let (state, points) = (response.at_rest(recording.surface.positions.len(), 1), ContactPoints::new(1));
        let mut cache = NodeCache::new(&body);
        let mut search = Search::new();
        let omegas = &recording.modes.angular_frequencies;
        let (mut found, mut full) = (0, 0);
        for case in 0..4000 {
            let angle = |k: f64| libm::sin(12.9 * f64::from(case) + 7.3 * k + 1.0);
            let reading = if case % 2 == 0 { Reading::Point } else { Reading::Patch(0) };
            // Deformations of some hundredths to twice the body's size, of low modes and of all.
            let fall = if case % 3 == 0 { 1.0 } else { 0.1 };
            let size = 0.1 * libm::exp(1.5 * angle(0.0));
            let mode = |(k, omega): (usize, &f64)| {
                size * angle(k as f64 + 1.0) * libm::exp(-fall * k as f64) * omegas[0] / omega * 0.3
            };
            let q: Vec<f64> = omegas.iter().enumerate().map(mode).collect();
            let p = DVec3::new(angle(0.3), angle(0.6), angle(0.9)) * 0.12;
            let reach = 0.05 * (1.0 + angle(0.2));
            let mut sight = Sight::new(&body, reading, &state, &points, &mut cache, Err(&q));
            search.near(&mut sight, p, reach);
            let mut all: Vec<u32> = (0..recording.surface.triangles.len() as u32)
                .filter(|&t| sight.nearest_on(t, p).distance < reach)
                .collect();
            full += usize::from(all.len() >= MOST_FOUND);
            if all.len() < MOST_FOUND {
                let mut got: Vec<u32> = search.found.iter().map(|one| one.triangle).collect();
                got.sort_unstable();
                all.sort_unstable();
                assert_eq!(got, all, "case {case}");
            }
            found += search.found.len();

            // What the searches before have found out about spheres loses nothing.
            for other in 0..4 {
                let p = DVec3::new(angle(1.3), angle(1.6), angle(1.9)) * (0.03 * f64::from(other + 1));
                let least = (0..recording.surface.triangles.len() as u32)
                    .map(|t| sight.nearest_on(t, p).distance)
                    .fold(f64::INFINITY, f64::min);
                assert!(sight.may_reach(p, least * 1.001 + 1e-12), "case {case}");
                let known = (other > 1).then_some(0);
                search.closest(&mut sight, (p, DVec3::ZERO), f64::INFINITY, known);
                assert_eq!(search.found[0].distance, least, "case {case}");
                search.closest(&mut sight, (p, DVec3::ZERO), least, known);
                assert!(search.found.is_empty(), "case {case}");
            }
        }
        assert!(found > 5000 && full < 200, "{found} {full}");
    }
}
