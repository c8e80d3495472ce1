//! Level of detail of an object against one collider: all surface nodes, or ever fewer contact samples.
//!
//! A level is coarsened as soon as too many samples come near, and refined with hysteresis.
//!
//! Equations: docs/theory.md (C30).

use super::parameters::COLLISION;

/// Level of detail of an object against one obstacle or object.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct LevelOfDetail {
    /// 0 for all nodes; higher is coarser.
    pub(super) level: usize,
    /// Last step in which many samples were near, or the level changed.
    since: u64,
}

impl LevelOfDetail {
    /// Next coarser level, in a step in which too many samples were near.
    pub(super) fn coarser(self, step: u64) -> Self {
        Self { level: self.level + 1, since: step }
    }

    /// Level for the next step, after one in which `found` samples of at most `max` were near.
    pub(super) fn after(self, found: usize, max: usize, step: u64) -> Self {
        if found as f64 >= COLLISION.refine_below * max as f64 {
            Self { since: step, ..self }
        } else if self.level > 0 && step - self.since >= COLLISION.refine_after_steps {
            Self { level: self.level - 1, since: step }
        } else {
            self
        }
    }
}
