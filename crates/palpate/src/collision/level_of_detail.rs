//! Levels of detail of objects against obstacles and each other: all surface nodes, or ever fewer contact samples.
//!
//! A level is coarsened as soon as too many samples come near; the next finer one is tried every now and then. Nodes between
//! the samples that penetrate are added (`narrow_phase/refinement`): where samples and added nodes are as many as all nodes
//! that are near, all nodes take their place, since the same contacts without overlapping patches are better conditioned.
//!
//! Equations: docs/theory.md (C30).

use super::parameters::COLLISION;
use super::point_budget::PointBudget;
use crate::bounded_vec::BoundedVec;
use crate::sleep::Sleepers;
use crate::surface::Traversal;
use alloc::vec;
use alloc::vec::Vec;

/// Upper limit of the steps until a finer level is tried.
const MAX_TRIAL_INTERVAL: u64 = 64 * COLLISION.refine_after_steps;

/// Pairs of objects near each other at a time whose levels are kept, per object.
const PAIRS_PER_OBJECT: usize = 16;

/// Level of detail of an object against one obstacle or object.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LevelOfDetail {
    /// 0 for all nodes; higher is coarser.
    pub(super) level: usize,
    /// Step in which the level changed, or a finer one was tried.
    since: u64,
    /// Steps until the next finer level is tried: twice as many each time that one has not lasted as long.
    trial_interval: u64,
    /// Whether the level is tried in this step.
    is_trial: bool,
    /// Number of contacts, added nodes among them, when all nodes were tried: as many may be near.
    replaced: usize,
}

impl Default for LevelOfDetail {
    fn default() -> Self {
        Self {
            level: 0,
            since: 0,
            trial_interval: COLLISION.refine_after_steps,
            is_trial: false,
            replaced: 0,
        }
    }
}

impl LevelOfDetail {
    /// Begin a step with so many contacts, with the next finer level if it is time to try it; `finest` is the finest of the body.
    pub(super) fn begin(&mut self, step: u64, contacts: usize, finest: usize) {
        self.level = self.level.max(finest);
        self.is_trial = self.level > finest && step - self.since >= self.trial_interval;
        if self.is_trial {
            (self.level, self.since) = (self.level - 1, step);
            self.replaced = if self.level == 0 { contacts } else { 0 };
        }
    }

    /// Upper limit of samples that may be near at this level, where a coarser one has room for `max`.
    pub(super) fn allowed(&self, max: usize) -> usize {
        let max = if self.is_trial { (COLLISION.refine_below * max as f64) as usize } else { max };
        max.max(self.replaced)
    }

    /// Go to the next coarser level, in a step in which too many samples are near.
    pub(super) fn coarsen(&mut self, step: u64) {
        let lasted = step - self.since >= self.trial_interval;
        self.trial_interval = if lasted {
            COLLISION.refine_after_steps
        } else {
            (2 * self.trial_interval).min(MAX_TRIAL_INTERVAL)
        };
        (self.level, self.since, self.is_trial, self.replaced) = (self.level + 1, step, false, 0);
    }
}

/// Level of detail against an obstacle.
#[derive(Debug, Clone)]
pub(crate) struct ObstacleLevel {
    pub(super) detail: LevelOfDetail,
    /// Search for nodes that penetrate, a part of it in each step.
    pub(super) search: Traversal,
    /// Contact points that it asks for.
    pub(super) points: usize,
}

/// Two objects with their levels of detail against each other.
#[derive(Debug, Clone)]
pub(super) struct ObjectPair {
    pub(super) objects: [usize; 2],
    pub(super) details: [LevelOfDetail; 2],
    /// Last step in which their bounding boxes overlapped, and whether they could have met in it.
    step: u64,
    pub(super) is_near: bool,
    /// Contact points that it asks for, of each object.
    pub(super) points: usize,
}

/// Levels of detail of a scene.
#[derive(Debug, Clone)]
pub(crate) struct Levels {
    /// Objects × obstacles.
    of_obstacles: Vec<ObstacleLevel>,
    obstacles: usize,
    /// Pairs of objects that are near each other, ascending.
    pairs: BoundedVec<ObjectPair>,
    budget: PointBudget,
}

impl Levels {
    /// Finest levels, of objects with so many contact points and of so many obstacles.
    pub(crate) fn new(points: impl ExactSizeIterator<Item = usize>, obstacles: usize) -> Self {
        let finest =
            ObstacleLevel { detail: LevelOfDetail::default(), search: Traversal::FINISHED, points: 0 };
        let objects = points.len();
        let room = PAIRS_PER_OBJECT.min(objects.saturating_sub(1)) * objects;
        Self {
            of_obstacles: vec![finest; objects * obstacles],
            obstacles,
            pairs: BoundedVec::new(room),
            budget: PointBudget::new(points),
        }
    }

    /// Level of an object against an obstacle.
    pub(super) fn against_obstacle(&mut self, object: usize, obstacle: usize) -> &mut ObstacleLevel {
        &mut self.of_obstacles[object * self.obstacles + obstacle]
    }

    /// Contact points that an object may use against an obstacle in a step that has begun.
    pub(super) fn points_against_obstacle(&self, object: usize, obstacle: usize) -> usize {
        let ObstacleLevel { detail, points, .. } = &self.of_obstacles[object * self.obstacles + obstacle];
        self.budget.available(object, *points, detail.is_trial)
    }

    /// Keep how many contact points an object asks for against an obstacle.
    pub(super) fn ask_against_obstacle(&mut self, object: usize, obstacle: usize, points: usize) {
        let known = &mut self.of_obstacles[object * self.obstacles + obstacle].points;
        self.budget.replace(object, core::mem::replace(known, points), points);
    }

    /// Contact points that each of two objects may use against the other in a step that has begun.
    pub(super) fn points_of_pair(&self, pair: &ObjectPair) -> usize {
        let is_trial = pair.details.iter().any(|detail| detail.is_trial);
        let [a, b] = pair.objects.map(|object| self.budget.available(object, pair.points, is_trial));
        a.min(b)
    }

    /// Two objects that are near each other in a step: at the finest levels, unless they were near in the last step, or have slept since then; what they have
    /// slept through is no reason to try finer levels at once.
    pub(super) fn of_pair(&self, objects: [usize; 2], step: u64) -> ObjectPair {
        let known = self.pairs.binary_search_by(|pair| pair.objects.cmp(&objects));
        let mut details = known.map_or([LevelOfDetail::default(); 2], |at| self.pairs[at].details);
        if known.is_ok_and(|at| self.pairs[at].step + 1 < step) {
            details.iter_mut().for_each(|detail| detail.since = step);
        }
        let points = known.map_or(0, |at| self.pairs[at].points);
        ObjectPair { objects, details, step, is_near: false, points }
    }

    /// Keep the levels of two objects, and how many contact points they ask for. Without room the next step begins with the finest.
    pub(super) fn keep_pair(&mut self, pair: ObjectPair) {
        let before = match self.pairs.binary_search_by(|known| known.objects.cmp(&pair.objects)) {
            Ok(at) => core::mem::replace(&mut self.pairs[at], pair.clone()).points,
            Err(_) if self.pairs.is_full() => return,
            Err(at) => {
                self.pairs.insert(at, pair.clone());
                0
            }
        };
        pair.objects.into_iter().for_each(|object| self.budget.replace(object, before, pair.points));
    }

    /// Forget the pairs that were not near in a step, but those of sleeping objects.
    pub(super) fn forget_pairs(&mut self, step: u64, sleepers: &Sleepers) {
        let Self { pairs, budget, .. } = self;
        pairs.retain(|pair| {
            let is_kept = pair.step == step || pair.objects.iter().all(|&at| !sleepers.is_awake(at));
            if !is_kept {
                pair.objects.into_iter().for_each(|object| budget.replace(object, pair.points, 0));
            }
            is_kept
        });
    }

    /// Keep the levels of an object against obstacles in the step in which it wakes, as those of pairs are.
    pub(crate) fn keep_for_now(&mut self, object: usize, step: u64) {
        let of_object = &mut self.of_obstacles[object * self.obstacles..][..self.obstacles];
        of_object.iter_mut().for_each(|level| level.detail.since = step);
    }

    /// Pairs that could have met in a step.
    pub(crate) fn near_pairs(&self, step: u64) -> impl Iterator<Item = [usize; 2]> {
        let pairs = self.pairs.iter().filter(move |pair| pair.step == step && pair.is_near);
        pairs.map(|pair| pair.objects)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::vec::Vec;

    /// Steps, of so many, in which a finer level is tried, and given up at once.
    fn trials(steps: u64) -> Vec<u64> {
        let (mut detail, mut tried) = (LevelOfDetail { level: 2, ..LevelOfDetail::default() }, Vec::new());
        for step in 1..=steps {
            detail.begin(step, 0, 0);
            if detail.is_trial {
                assert!(detail.allowed(100) < 100);
                tried.push(step);
                detail.coarsen(step);
            }
        }
        tried
    }

    #[test]
    fn all_nodes_take_the_place_of_as_many_contacts() {
        let mut detail = LevelOfDetail { level: 1, ..LevelOfDetail::default() };
        detail.begin(COLLISION.refine_after_steps, 121, 0);
        assert_eq!((detail.level, detail.allowed(48)), (0, 121));
        detail.begin(COLLISION.refine_after_steps + 1, 121, 0);
        assert_eq!(detail.allowed(48), 121, "they stay");
        detail.coarsen(COLLISION.refine_after_steps + 2);
        assert_eq!(detail.allowed(48), 48);
    }

    #[test]
    fn a_coarser_level_is_tried_with_few_samples_only() {
        let mut detail = LevelOfDetail { level: 2, ..LevelOfDetail::default() };
        detail.begin(COLLISION.refine_after_steps, 121, 0);
        assert_eq!(detail.level, 1);
        assert!(detail.allowed(48) < 48);
    }

    #[test]
    fn a_finer_level_is_tried_half_as_often_each_time_that_it_does_not_last() {
        assert_eq!(trials(800), [50, 150, 350, 750]);
    }
}
