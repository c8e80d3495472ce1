//! How coarsely an object meets an obstacle or another object: how many of its nodes stand for its surface.

/// After so many steps with less than this part of the places that are allowed, finer ones are tried.
const FEW_PLACES: usize = 6;
const FINER_AFTER: u64 = 50;

/// Which places of an object stand for its surface against one other thing.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Level {
    /// 0 for all nodes.
    pub(super) number: usize,
    /// The step in which many of them were near the last time.
    since: u64,
}

impl Level {
    /// The next one, in a step in which too many places were near.
    pub(super) fn coarser(self, step: u64) -> Self {
        Self { number: self.number + 1, since: step }
    }

    /// For the next step, when so many places of so many that are allowed were near.
    pub(super) fn after(self, found: usize, most: usize, step: u64) -> Self {
        if found >= most / FEW_PLACES {
            Self { since: step, ..self }
        } else if self.number > 0 && step - self.since >= FINER_AFTER {
            // So few for so long that there is room for those that they stand for.
            Self { number: self.number - 1, since: step }
        } else {
            self
        }
    }
}
