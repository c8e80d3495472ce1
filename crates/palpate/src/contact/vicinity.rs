//! The triangles around a point that moves little from step to step: remembered while they are all that can be near, and
//! found anew a part in each step before they are needed.

use super::search::{MOST_FOUND, Search, keep_minima, sort, take_near};
use super::sight::{Found, Sight};
use crate::response::Body;
use crate::surface::Walk;
use alloc::vec;
use alloc::vec::Vec;
use glam::DVec3;

/// What a vicinity is found with to spare, as a share of the mean edge, and of what is asked for. Where there are many
/// triangles only the nearest of each face are remembered, and another face may come up before long.
const SPARE_EDGE: f64 = 0.8;
const SPARE_OF_MANY: f64 = 0.15;
const SPARE_REACH: f64 = 0.25;

/// Of the steps in which it is used up finding it takes this share, and as many are left over: so many at least, or it is not
/// worth while, and at most. Spheres and triangles that are passed in a step at least.
const PARTS: f64 = 0.2;
const LEAST_PARTS: f64 = 3.0;
const MOST_PARTS: f64 = 8.0;
const LEAST_PART: usize = 24;

/// What is found within one step is so early, with this share of the spare left, if it is the only one, so that those of
/// several fingers don't fall into one step.
const EARLY: f64 = 0.4;

/// How much the speed of a step counts among those before.
const SHARE: f64 = 0.1;

/// Of more triangles than these it is remembered where the surface is nearest, on so many faces at most; from there so many
/// steps lead to where it is nearest now.
const MANY: usize = 48;
const MOST_SEEDS: usize = 8;
const DESCENT: usize = 64;

/// The triangles around a point, as they were at a moment: they are all that can be near while the point and the surface
/// have not gone farther than what they were found with to spare.
#[derive(Debug, Clone)]
struct Surroundings {
    /// The nearest first, with their distances then [m].
    triangles: Vec<(u32, f64)>,
    /// Of many, those where the surface was nearest, one of each face: the nearest are a few triangles from them.
    seeds: Vec<u32>,
    /// Where the point was [m, body], the modal coordinates, and the largest dent while they were found [m].
    point: DVec3,
    q: Vec<f64>,
    dent: [f64; 2],
    /// Within which they are all there [m]; 0 when nothing is known.
    reach: f64,
}

impl Surroundings {
    fn new(modes: usize) -> Self {
        Self {
            triangles: Vec::with_capacity(MOST_FOUND),
            seeds: Vec::with_capacity(MOST_SEEDS),
            point: DVec3::ZERO,
            q: vec![0.0; modes],
            dent: [0.0; 2],
            reach: 0.0,
        }
    }

    /// How far the point and the surface have gone relative to each other since then, at most [m].
    fn gone(&self, sight: &Sight, p: DVec3) -> f64 {
        let deformed = sight.body.way(&self.q[..sight.q.len()], sight.q);
        let dented = self.dent.map(|dent| libm::fabs(sight.most_dent() - dent));
        deformed + 2.0 * dented[0].max(dented[1]) + (p - self.point).length()
    }
}

/// What is around a point, from step to step.
#[derive(Debug, Clone)]
pub(crate) struct Vicinity {
    now: Surroundings,
    /// What is to take its place, with what was found of it so far, where the walk for it stands, and how many spheres and
    /// triangles that has passed and may pass in a step.
    next: Surroundings,
    found: Vec<Found>,
    walk: Walk,
    passed: usize,
    part: usize,
    /// How far the point and the surface had gone in the last step [m], if the same was known then, and go in one on
    /// average [m].
    gone: Option<f64>,
    speed: f64,
    many: usize,
}

impl Vicinity {
    pub(crate) fn new(modes: usize) -> Self {
        Self {
            now: Surroundings::new(modes),
            next: Surroundings::new(modes),
            found: Vec::with_capacity(MOST_FOUND),
            walk: Walk::OVER,
            passed: 0,
            part: LEAST_PART,
            gone: None,
            speed: 0.0,
            many: MANY,
        }
    }

    /// Find the triangles within a reach [m] of a body point, or some more; of many only the nearest of each face.
    ///
    /// # Real time
    /// Costs few triangles; where the point or the surface is fast, or comes anew, those within reach.
    pub(crate) fn find(&mut self, search: &mut Search, sight: &mut Sight, p: DVec3, reach: f64) {
        let gone = self.now.gone(sight, p);
        let spare = self.now.reach - reach;
        let left = spare - gone;
        if let Some(before) = self.gone.replace(gone) {
            self.speed += SHARE * ((gone - before).max(0.0) - self.speed);
        }
        let parts = PARTS * spare / self.speed;
        let soon = self.walk.is_over() && parts < LEAST_PARTS && left < EARLY * spare && !search.renewed;
        if left <= 0.0 || self.now.reach == 0.0 || soon {
            search.renewed = true;
            self.begin(sight, p, reach);
            self.walk_on(sight, usize::MAX);
            self.finish(sight.body);
            search.found.clone_from(&self.found);
            return;
        }
        let parts = parts.min(MOST_PARTS);
        if self.walk.is_over() && parts >= LEAST_PARTS && left < self.speed * 2.0 * parts {
            self.part = LEAST_PART.max((self.passed as f64 / parts) as usize + 1);
            self.begin(sight, p, reach);
        }
        let found = &mut search.found;
        found.clear();
        if self.now.seeds.is_empty() {
            let can = self.now.triangles.iter().take_while(|(_, distance)| *distance < reach + gone);
            found.extend(can.map(|&(triangle, _)| sight.nearest_on(triangle, p)));
        } else {
            found.extend(self.now.seeds.iter().map(|&seed| descend(sight, seed, p)));
        }
        sort(found);
    }

    /// Lend the modal coordinates of the moment at which what will be needed is being found, if it is.
    pub(crate) fn lend_moment(&mut self) -> Option<Vec<f64>> {
        (!self.walk.is_over()).then(|| core::mem::take(&mut self.next.q))
    }

    /// Go on finding what will be needed, on the surface as it was at that moment, but for the dents of now.
    ///
    /// # Real time
    /// Costs a part of what finding it costs.
    pub(crate) fn grow(&mut self, sight: &mut Sight) {
        self.walk_on(sight, self.part);
    }

    /// Take back what was lent; if all is found by now it takes its place.
    pub(crate) fn take_back(&mut self, moment: Vec<f64>, body: &Body) {
        self.next.q = moment;
        if self.walk.is_over() {
            self.finish(body);
        }
    }

    fn begin(&mut self, sight: &Sight, p: DVec3, reach: f64) {
        let spare = if self.now.seeds.is_empty() { SPARE_EDGE } else { SPARE_OF_MANY };
        let next = &mut self.next;
        next.q[..sight.q.len()].copy_from_slice(sight.q);
        (next.point, next.dent) = (p, [sight.most_dent(); 2]);
        next.reach = reach + spare * sight.body.edge + SPARE_REACH * reach;
        (self.walk, self.passed) = (Walk::BEGUN, 0);
        self.found.clear();
    }

    /// Go on with the walk, in a sight of the moment when it began.
    fn walk_on(&mut self, sight: &mut Sight, most: usize) {
        let Self { next, found, walk, .. } = self;
        let (p, reach, dent) = (next.point, next.reach, sight.most_dent());
        next.dent = [next.dent[0].min(dent), next.dent[1].max(dent)];
        self.passed += take_near(sight, (walk, most), p, reach, found);
    }

    /// All is found: let it take its place.
    fn finish(&mut self, body: &Body) {
        let Self { now, next, found, .. } = self;
        sort(found);
        next.triangles.clear();
        next.triangles.extend(found.iter().map(|found| (found.triangle, found.distance)));
        // Where there was no room for all, nothing is known beyond the farthest.
        if let (MOST_FOUND, Some(farthest)) = (found.len(), found.last()) {
            next.reach = farthest.distance;
        }
        next.seeds.clear();
        if next.triangles.len() > self.many {
            keep_minima(found, body, f64::INFINITY, MOST_SEEDS);
            next.seeds.extend(found.iter().map(|found| found.triangle));
        }
        core::mem::swap(now, next);
        self.gone = None;
    }
}

/// Where the surface is nearest to a body point in the surroundings of a triangle: over its edges and corners while that
/// leads nearer.
fn descend(sight: &mut Sight, triangle: u32, p: DVec3) -> Found {
    let mut best = sight.nearest_on(triangle, p);
    let body = sight.body;
    for _ in 0..DESCENT {
        let corners = body.recording.surface.triangles[best.triangle as usize];
        let mut on = corners.iter().zip(best.weights).filter(|(_, w)| *w > 1e-9).map(|(node, _)| *node);
        let before = best;
        let mut look = |sight: &mut Sight, triangle: u32| {
            let one = sight.nearest_on(triangle, p);
            if one.distance < best.distance {
                best = one;
            }
        };
        match (on.next(), on.next(), on.next()) {
            (Some(a), Some(b), None) => {
                if let Some(over) = body.across(before.triangle, a, b) {
                    look(sight, over);
                }
            }
            (Some(corner), None, None) => {
                body.around(corner as usize).iter().for_each(|&other| look(sight, other));
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
    use crate::contact::{ContactPoints, NodeCache};
    use crate::recording::Recording;
    use crate::response::{Reading, Response, ResponseForm};
    use alloc::sync::Arc;

    /// How an angle of a case's own goes: slow and fast, small and large.
    fn wave(case: u32, k: f64) -> f64 {
        libm::sin(12.9 * f64::from(case) + 7.3 * k + 1.0)
    }

    /// A point goes about a body that deforms; gives how often there were all triangles to be found, only some, and of the
    /// latter how often the nearest was there, and how often all were found within one step, and in parts.
    fn follow(reading_of: impl Fn(&Body) -> Reading, many: usize, speed: f64) -> [u32; 5] {
        let bytes = include_bytes!("../../../../data/recordings/v1/free.palp");
        let recording = Arc::new(Recording::from_bytes(bytes).expect("a released recording"));
        let body = Body::new(recording.clone(), &[2.0 * recording.surface.mean_edge()], usize::MAX);
        let reading = reading_of(&body);
        let response = Response::new(&recording, ResponseForm::Modal, 1e-3).expect("a modal response");
        let (state, points) = (response.at_rest(recording.surface.positions.len(), 1), ContactPoints::new(1));
        let (mut cache, mut search) = (NodeCache::new(&body), Search::new());
        let omegas = &recording.modes.angular_frequencies;
        let mut counts = [0; 5];
        for case in 0..40 {
            let mut vicinity = Vicinity::new(omegas.len());
            vicinity.many = many;
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
                let mut sight = Sight::new(&body, reading, &state, &points, &mut cache, Err(&q));
                counts[3] += u32::from(vicinity.now.reach - reach - vicinity.now.gone(&sight, p) <= 0.0);
                vicinity.find(&mut search, &mut sight, p, reach);
                let distances = (0..recording.surface.triangles.len() as u32)
                    .map(|triangle| sight.nearest_on(triangle, p).distance)
                    .filter(|distance| *distance < reach);
                if vicinity.now.seeds.is_empty() {
                    let near = search.found.iter().filter(|one| one.distance < reach).count();
                    assert_eq!(near, distances.count(), "case {case} step {step}");
                    counts[0] += 1;
                } else {
                    // Of many the nearest, or one that was as near as that when they were found.
                    let least = distances.fold(f64::INFINITY, f64::min);
                    let off = search.found[0].distance.min(reach) - least.min(reach);
                    assert!(
                        off <= 2.0 * vicinity.now.gone(&sight, p) + 1e-12,
                        "case {case} step {step}: {off}"
                    );
                    (counts[1], counts[2]) = (counts[1] + 1, counts[2] + u32::from(off < 1e-9));
                }
                if let Some(moment) = vicinity.lend_moment() {
                    let mut sight = Sight::new(&body, reading, &state, &points, &mut cache, Err(&moment));
                    vicinity.grow(&mut sight);
                    vicinity.take_back(moment, &body);
                    counts[4] += u32::from(vicinity.walk.is_over());
                }
            }
        }
        counts
    }

    #[test]
    fn nothing_near_is_missed_while_it_is_found_in_parts() {
        for reading in [Reading::Point, Reading::Patch(0)] {
            let [all, some, ..] = follow(|_| reading, usize::MAX, 1e-2);
            assert_eq!((all, some), (8000, 0));
            let [_, some, nearest, ..] = follow(|_| reading, 4, 1e-2);
            assert!(some > 3000 && 100 * nearest > 99 * some, "{nearest} of {some}");
        }
    }

    #[test]
    fn what_moves_slowly_is_never_found_within_one_step() {
        for speed in [1e-4, 3e-4] {
            let [.., at_once, in_parts] = follow(|body| body.level(0), MANY, speed);
            // But for the first.
            assert_eq!(at_once, 40, "{speed}");
            assert!(in_parts >= 40, "{speed}: {in_parts}");
        }
    }
}
