//! Level of detail of an object against one collider: all surface nodes, or ever fewer contact samples.
//!
//! A level is coarsened as soon as too many samples come near; the next finer one is tried every now and then. Nodes between
//! the samples that penetrate are added (`narrow_phase/refinement`).
//!
//! Equations: docs/theory.md (C30).

use super::parameters::COLLISION;
use crate::surface::Traversal;

/// Upper limit of the steps until a finer level is tried.
const MAX_TRIAL_INTERVAL: u64 = 64 * COLLISION.refine_after_steps;

/// Level of detail of an object against one obstacle or object.
#[derive(Debug, Clone)]
pub(crate) struct LevelOfDetail {
    /// 0 for all nodes; higher is coarser.
    pub(super) level: usize,
    /// Step in which the level changed, or a finer one was tried.
    since: u64,
    /// Steps until the next finer level is tried: twice as many each time that one has not lasted as long.
    trial_interval: u64,
    /// Whether the level is tried in this step.
    is_trial: bool,
    /// Search for nodes that penetrate, a part of it in each step.
    pub(super) search: Traversal,
}

impl Default for LevelOfDetail {
    fn default() -> Self {
        Self {
            level: 0,
            since: 0,
            trial_interval: COLLISION.refine_after_steps,
            is_trial: false,
            search: Traversal::FINISHED,
        }
    }
}

impl LevelOfDetail {
    /// Begin a step, with the next finer level if it is time to try it.
    pub(super) fn begin(&mut self, step: u64) {
        self.is_trial = self.level > 0 && step - self.since >= self.trial_interval;
        if self.is_trial {
            (self.level, self.since) = (self.level - 1, step);
        }
    }

    /// Upper limit of samples that may be near at this level, where a coarser one has room for `max`.
    pub(super) fn allowed(&self, max: usize) -> usize {
        if self.is_trial { (COLLISION.refine_below * max as f64) as usize } else { max }
    }

    /// Go to the next coarser level, in a step in which too many samples are near.
    pub(super) fn coarsen(&mut self, step: u64) {
        let lasted = step - self.since >= self.trial_interval;
        self.trial_interval = if lasted {
            COLLISION.refine_after_steps
        } else {
            (2 * self.trial_interval).min(MAX_TRIAL_INTERVAL)
        };
        (self.level, self.since, self.is_trial) = (self.level + 1, step, false);
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
            detail.begin(step);
            if detail.is_trial {
                assert!(detail.allowed(100) < 100);
                tried.push(step);
                detail.coarsen(step);
            }
        }
        tried
    }

    #[test]
    fn a_finer_level_is_tried_half_as_often_each_time_that_it_does_not_last() {
        assert_eq!(trials(800), [50, 150, 350, 750]);
    }
}
