//! Broad phase: which objects can meet each other or a device in a step, and where.
//!
//! Sweep and prune (Baraff 1992, Cornell University) over the boxes about the objects' bounding spheres, along the axis on which their
//! centres spread most. Then a separating plane across the line between two centres: with upper bounds e_a and e_b of the
//! objects' support functions along it, they are apart when e_a + e_b is less than the distance of the centres.
//!
//! Equations: docs/theory.md (C19).

use super::context::{CollisionContext, CollisionScene};
use super::deformed_surface::{DeformedSurface, SurfaceTime, deformation_bound};
use super::level_of_detail::ObjectPair;
use super::parameters::COLLISION;
use crate::device::{DeviceParameters, DeviceState};
use crate::object::Object;
use crate::response::Footprint;
use crate::sleep::Sleepers;
use crate::spatial::Pose;
use alloc::vec;
use alloc::vec::Vec;
use glam::DVec3;

/// Sweep and prune over the objects; buffers are made once.
#[derive(Debug, Clone, Default)]
pub(crate) struct SweepAndPrune {
    /// Touchable objects, by the lower ends of their boxes along the axis of the last step.
    order: Vec<u32>,
    /// Lowest and highest corner of every object's box [m, world].
    boxes: Vec<[DVec3; 2]>,
    /// Axis of the step, and the width of the widest box along it [m].
    axis: usize,
    widest: f64,
}

impl SweepAndPrune {
    pub(super) fn new(objects: &[Object]) -> Self {
        let order = (0..objects.len() as u32).collect();
        Self { order, boxes: vec![[DVec3::ZERO; 2]; objects.len()], axis: 0, widest: 0.0 }
    }

    /// Set the boxes of the objects that are awake about spheres (centre, radius), and sort all.
    fn set(&mut self, sleepers: &Sleepers, sphere: impl Fn(usize) -> (DVec3, f64)) {
        for at in self.order.iter().map(|&at| at as usize).filter(|&at| sleepers.is_awake(at)) {
            self.boxes[at] = box_about(sphere(at));
        }
        self.axis = self.widest_axis();
        let Self { order, boxes, axis, .. } = self;
        let low = |at: u32| boxes[at as usize][0][*axis];
        order.sort_unstable_by(|a, b| low(*a).total_cmp(&low(*b)).then(a.cmp(b)));
        let width = |at: &u32| boxes[*at as usize][1][*axis] - low(*at);
        self.widest = order.iter().map(width).fold(0.0, f64::max);
    }

    /// Axis on which the boxes' centres have the largest variance.
    fn widest_axis(&self) -> usize {
        let centres = || self.order.iter().map(|&at| self.boxes[at as usize]).map(|[low, high]| low + high);
        let mean = centres().sum::<DVec3>() / self.order.len().max(1) as f64;
        let variance = centres().map(|centre| (centre - mean) * (centre - mean)).sum::<DVec3>();
        (0..3).fold(0, |best, axis| if variance[axis] > variance[best] { axis } else { best })
    }

    /// Pass all pairs of overlapping boxes to `found`, the lower number first, where both objects are awake.
    fn overlaps(&self, sleepers: &Sleepers, mut found: impl FnMut([usize; 2])) {
        let Self { order, boxes, axis, .. } = self;
        for (place, &a) in order.iter().enumerate().filter(|(_, a)| sleepers.is_awake(**a as usize)) {
            let own = boxes[a as usize];
            let low = |b: &&u32| boxes[**b as usize][0][*axis] <= own[1][*axis];
            for &b in order[place + 1..].iter().take_while(low) {
                if boxes_overlap(&own, &boxes[b as usize]) && sleepers.is_awake(b as usize) {
                    found([a.min(b) as usize, a.max(b) as usize]);
                }
            }
        }
    }

    /// Objects whose boxes overlap one, by the lower ends of theirs.
    fn overlapping(&self, own: [DVec3; 2]) -> impl Iterator<Item = u32> {
        let Self { order, boxes, axis, widest } = self;
        let low = move |at: u32| boxes[at as usize][0][*axis];
        let first = order.partition_point(|&at| low(at) < own[0][*axis] - widest);
        let along = order[first..].iter().copied().take_while(move |&at| low(at) <= own[1][*axis]);
        along.filter(move |&at| boxes_overlap(&own, &boxes[at as usize]))
    }

    /// Sleeping objects whose boxes overlap that of an object.
    fn sleeping_neighbours(&self, sleepers: &Sleepers, object: usize) -> impl Iterator<Item = usize> {
        let near = self.overlapping(self.boxes[object]).map(|at| at as usize);
        near.filter(|&at| !sleepers.is_awake(at))
    }
}

/// Sphere that holds a device's tip over the step.
fn tip_sphere(parameters: &DeviceParameters, device: &DeviceState) -> (DVec3, f64) {
    let travel = (device.proxy_under_force() - device.proxy).length();
    (device.proxy, parameters.tip_radius + travel)
}

/// Box about a sphere (centre, radius).
fn box_about((centre, radius): (DVec3, f64)) -> [DVec3; 2] {
    [centre - radius, centre + radius]
}

fn boxes_overlap([low_a, high_a]: &[DVec3; 2], [low_b, high_b]: &[DVec3; 2]) -> bool {
    low_a.cmple(*high_b).all() && low_b.cmple(*high_a).all()
}

/// Half-space of an object: points farther than `offset` [m] from its centre along a direction [world].
#[derive(Debug, Clone, Copy)]
pub(super) struct HalfSpace {
    pub(super) direction: DVec3,
    pub(super) offset: f64,
}

impl CollisionContext<'_> {
    /// Set and sort the boxes of all objects.
    ///
    /// # Real time
    /// Costs the objects, times the logarithm of their number where they change places.
    pub(crate) fn begin_broad_phase(&mut self) {
        let mut sweep = core::mem::take(&mut self.caches.sweep);
        sweep.set(self.sleepers, |at| self.bounding_sphere(at));
        self.caches.sweep = sweep;
    }

    /// Mark the objects that could be moved by what comes near: devices that touch, obstacles that move, and, where they are asleep,
    /// objects that are awake.
    ///
    /// # Real time
    /// Costs the devices, the obstacles and the objects that are awake, with their neighbours.
    pub(crate) fn mark_disturbed(&mut self, devices: &[DeviceState], (before, after): (&[Pose], &[Pose])) {
        let CollisionScene { devices: parameters, obstacles, .. } = self.scene;
        let touching = parameters.iter().zip(devices).filter(|(_, device)| device.active);
        let tips = touching.map(|(parameters, device)| tip_sphere(parameters, device));
        let moving =
            obstacles.iter().zip(before.iter().zip(after)).filter(|(_, (before, after))| before != after);
        let obstacles = moving.map(|(obstacle, (before, after))| {
            let radius = obstacle.shape.radius();
            let motion = if radius.is_finite() { before.motion_bound(after, radius) } else { 0.0 };
            (before.position, radius + motion)
        });
        let disturbed = &mut self.workspace.disturbed;
        for near in tips.chain(obstacles).map(box_about) {
            self.caches.sweep.overlapping(near).for_each(|at| disturbed[at as usize] = true);
        }
        if !self.sleepers.any() {
            return;
        }
        let sweep = core::mem::take(&mut self.caches.sweep);
        for awake in sweep.order.iter().map(|&at| at as usize).filter(|&at| self.sleepers.is_awake(at)) {
            for asleep in sweep.sleeping_neighbours(self.sleepers, awake) {
                let pair = self.levels.of_pair([awake.min(asleep), awake.max(asleep)], self.step);
                if !self.workspace.disturbed[asleep] && self.overlap(&pair).is_some() {
                    self.workspace.disturbed[asleep] = true;
                }
            }
        }
        self.caches.sweep = sweep;
    }

    /// Find the contacts of all pairs of objects.
    ///
    /// # Real time
    /// Costs the objects, the pairs whose boxes overlap along an axis, and the nodes that are near another object.
    pub(crate) fn find_pair_contacts(&mut self) {
        let sweep = core::mem::take(&mut self.caches.sweep);
        sweep.overlaps(self.sleepers, |objects| self.find_contacts_of_pair(objects));
        self.caches.sweep = sweep;
        self.levels.forget_pairs(self.step, self.sleepers);
    }

    /// Objects that a device's tip can meet in the step, ascending; they stay in `near_objects` of the workspace.
    pub(crate) fn find_near_objects(&mut self, number: usize, device: &DeviceState) {
        let own = box_about(tip_sphere(&self.scene.devices[number], device));
        let near_objects = &mut self.workspace.near_objects;
        near_objects.clear();
        near_objects
            .extend(self.caches.sweep.overlapping(own).filter(|&at| self.sleepers.is_awake(at as usize)));
        near_objects.sort_unstable();
    }

    /// Sphere that holds an object over the step, at all levels of detail, with its share of the slack of [`Self::overlap`].
    fn bounding_sphere(&self, at: usize) -> (DVec3, f64) {
        let (own, object) = (&self.states[at], &self.scene.objects[at]);
        let body = &object.body;
        let bound = deformation_bound(body, Footprint::Point, &own.response, own.response.coordinates());
        let displacement = (0..=body.coarsest_surface_level())
            .map(|level| body.bounds(body.footprint_at_level(level)).max_displacement(&bound))
            .fold(0.0, f64::max);
        let slack = body.max_height + COLLISION.margin * body.edge + self.motion(at);
        (own.rigid.pose.position, object.radius + displacement + slack)
    }

    /// Bound of an object's motion over the step without contact force [m].
    fn motion(&self, at: usize) -> f64 {
        let (own, radius) = (&self.states[at], self.scene.objects[at].radius);
        own.rigid.pose.motion_bound(&own.free.end.pose, radius) + own.surface_motion
    }

    /// Half-spaces of two objects within which they can meet in the step; none when a plane separates them.
    pub(super) fn overlap(&mut self, pair: &ObjectPair) -> Option<[HalfSpace; 2]> {
        let [a, b] = pair.objects;
        let objects = self.scene.objects;
        let edge = objects[a].body.edge.max(objects[b].body.edge);
        let heights = objects[a].body.max_height + objects[b].body.max_height;
        let slack = heights + COLLISION.margin * edge + self.motion(a) + self.motion(b);
        let between = self.states[b].rigid.pose.position - self.states[a].rigid.pose.position;
        let Some(along) = between.try_normalize() else {
            return Some([HalfSpace { direction: DVec3::X, offset: f64::NEG_INFINITY }; 2]);
        };
        let room = between.length() - slack;
        // The bounds by elastic energy are often enough.
        let extent = [0, 1]
            .map(|side| objects[pair.objects[side]].radius + self.surface_of(pair, side).max_displacement());
        if extent[0] + extent[1] < room {
            return None;
        }
        // A plane between them costs less than both support functions.
        let middle = room * extent[0] / (extent[0] + extent[1]);
        let mut end_a = self.support((pair, 0), along, middle);
        let end_b = self.support((pair, 1), -along, room - end_a);
        if end_a + end_b > room && end_a <= middle {
            end_a = self.support((pair, 0), along, room - end_b);
        }
        let [of_a, of_b] = [(along, room - end_b), (-along, room - end_a)];
        let half_spaces = [of_a, of_b].map(|(direction, offset)| HalfSpace { direction, offset });
        (end_a + end_b > room).then_some(half_spaces)
    }

    /// Upper bound of the support function of one of two objects along a direction [m, world], or `least` if that is larger.
    fn support(&mut self, (pair, side): (&ObjectPair, usize), direction: DVec3, least: f64) -> f64 {
        let orientation = self.states[pair.objects[side]].rigid.pose.orientation;
        self.surface_of(pair, side).support(orientation.inverse() * direction, least)
    }

    /// Footprint with which one of two objects is read against the other.
    pub(super) fn footprint_of(&self, pair: &ObjectPair, side: usize) -> Footprint {
        self.scene.objects[pair.objects[side]].body.footprint_at_level(pair.details[side].level)
    }

    /// Surface of one of two objects as it is read against the other, at the start of the step.
    fn surface_of(&mut self, pair: &ObjectPair, side: usize) -> DeformedSurface<'_> {
        let (at, footprint) = (pair.objects[side], self.footprint_of(pair, side));
        let (own, body) = (&self.states[at], &self.scene.objects[at].body);
        let positions = &mut self.workspace.positions[at];
        let moment = SurfaceTime::StepStart(self.step);
        let mut surface =
            DeformedSurface::new(body, footprint, &own.response, &own.points, positions, moment);
        surface.localise_residual(&own.response, self.step);
        surface
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sweep_and_prune_finds_the_overlaps_of_all_pairs() {
        let wave = |p: f64, k: usize| libm::sin(p * k as f64 + p);
        for (count, spread) in
            [(1, [1.0, 1.0, 1.0]), (40, [3.0, 0.1, 1.0]), (60, [0.2, 4.0, 2.0]), (60, [0.0; 3])]
        {
            let sphere = |k: usize| {
                let centre = DVec3::new(wave(1.3, k), wave(2.1, k), wave(0.7, k)) * DVec3::from_array(spread);
                (centre, 0.2 + 0.15 * wave(3.3, k))
            };
            let order = (0..count as u32).collect();
            let boxes = vec![[DVec3::ZERO; 2]; count];
            let mut sweep = SweepAndPrune { order, boxes, ..SweepAndPrune::default() };
            let mut sleepers = Sleepers::new(count);
            sweep.set(&sleepers, sphere);
            let mut found = Vec::new();
            sweep.overlaps(&sleepers, |pair| found.push(pair));
            found.sort_unstable();
            let overlaps = |&[a, b]: &[usize; 2]| {
                let ((p, r), (q, s)) = (sphere(a), sphere(b));
                (p - q).abs().max_element() <= r + s
            };
            let all = (0..count).flat_map(|a| (a + 1..count).map(move |b| [a, b]));
            assert_eq!(found, all.filter(overlaps).collect::<Vec<_>>());
            let probe = (DVec3::new(0.4, 0.1, -0.3), 0.3);
            let mut near: Vec<u32> = sweep.overlapping(box_about(probe)).collect();
            near.sort_unstable();
            let is_near = |&k: &u32| {
                let (centre, radius) = sphere(k as usize);
                (centre - probe.0).abs().max_element() <= radius + probe.1
            };
            assert_eq!(near, (0..count as u32).filter(is_near).collect::<Vec<_>>());

            // Pairs of one that is awake with one that sleeps.
            let is_still = |at: usize| at % 3 != 1;
            (0..count).for_each(|at| _ = sleepers.count(at, 1, is_still(at), || true));
            sleepers.begin_groups();
            sleepers.fall_asleep(1, |_| {});
            let mut mixed: Vec<[usize; 2]> = Vec::new();
            for awake in (0..count).filter(|&at| !is_still(at)) {
                let pair = |asleep: usize| [awake.min(asleep), awake.max(asleep)];
                mixed.extend(sweep.sleeping_neighbours(&sleepers, awake).map(pair));
            }
            mixed.sort_unstable();
            let all = (0..count).flat_map(|a| (a + 1..count).map(move |b| [a, b]));
            let expected = all.filter(overlaps).filter(|&[a, b]| is_still(a) != is_still(b));
            assert_eq!(mixed, expected.collect::<Vec<_>>());
        }
    }
}
