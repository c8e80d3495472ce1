//! Level of detail of an object against one collider: all surface nodes, or ever fewer contact samples.
//!
//! A level is coarsened as soon as too many samples come near; the next finer one is tried every now and then. Where nodes between
//! the samples penetrate, samples of finer levels, in the end nodes, are added (`narrow_phase/refinement`).
//!
//! Equations: docs/theory.md (C30).

use super::parameters::COLLISION;
use crate::surface::Traversal;

/// Upper limit of the steps until a finer level is tried.
const MAX_PATIENCE: u64 = 64 * COLLISION.refine_after_steps;

/// Level of detail of an object against one obstacle or object.
#[derive(Debug, Clone)]
pub(crate) struct LevelOfDetail {
    /// 0 for all nodes; higher is coarser.
    pub(super) level: usize,
    /// Step in which the level changed, or a finer one was tried.
    since: u64,
    /// Steps until the next finer level is tried: twice as many each time that one has not lasted as long.
    patience: u64,
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
            patience: COLLISION.refine_after_steps,
            is_trial: false,
            search: Traversal::FINISHED,
        }
    }
}

impl LevelOfDetail {
    /// Begin a step, with the next finer level if it is time to try it.
    pub(super) fn begin(&mut self, step: u64) {
        self.is_trial = self.level > 0 && step - self.since >= self.patience;
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
        let lasted = step - self.since >= self.patience;
        self.patience =
            if lasted { COLLISION.refine_after_steps } else { (2 * self.patience).min(MAX_PATIENCE) };
        (self.level, self.since, self.is_trial) = (self.level + 1, step, false);
    }
}
