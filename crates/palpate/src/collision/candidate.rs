//! Contact candidates: what the narrow phase has found in a step.

use super::contact::{ContactId, ContactLaw};
use crate::bounded_vec::BoundedVec;
use crate::response::ContactLocation;
use glam::DVec3;

/// A contact that a step should have.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ContactCandidate {
    pub(crate) id: ContactId,
    /// Contact location on the object.
    pub(crate) location: ContactLocation,
    pub(crate) other: CandidateSide,
    pub(crate) law: ContactLaw,
    /// Unit normal, out of the object [world].
    pub(crate) normal: DVec3,
    /// Distance that the two sides keep along the normal [m].
    pub(crate) distance: f64,
}

/// The other side of a candidate.
#[derive(Debug, Clone, Copy)]
pub(crate) enum CandidateSide {
    /// Proxy of a device.
    Device(usize),
    /// Point of an obstacle at the start and at the end of the step [m, world].
    Obstacle { number: usize, start: DVec3, end: DVec3 },
    /// Point of a clamp's frame at the start and at the end of the step [m, world].
    Clamp { number: usize, start: DVec3, end: DVec3 },
    /// Location on another object.
    Object { number: usize, location: ContactLocation },
}

/// The candidates of a step; the buffer is made once.
#[derive(Debug, Clone)]
pub(crate) struct CandidateList {
    pub(crate) list: BoundedVec<ContactCandidate>,
    /// Number of candidates without room in the buffer.
    pub(crate) dropped: u32,
}

/// State of a list, to return to.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Mark {
    pub(crate) len: usize,
    dropped: u32,
}

impl CandidateList {
    pub(crate) fn new(capacity: usize) -> Self {
        Self { list: BoundedVec::new(capacity), dropped: 0 }
    }

    pub(crate) fn clear(&mut self) {
        self.list.clear();
        self.dropped = 0;
    }

    pub(crate) fn push(&mut self, candidate: ContactCandidate) {
        if self.list.is_full() {
            self.dropped += 1;
        } else {
            self.list.push(candidate);
        }
    }

    pub(crate) fn mark(&self) -> Mark {
        Mark { len: self.list.len(), dropped: self.dropped }
    }

    /// Number of candidates pushed since a mark, those without room among them.
    pub(crate) fn since(&self, mark: Mark) -> usize {
        self.list.len() - mark.len + (self.dropped - mark.dropped) as usize
    }

    /// Remove what was pushed since a mark.
    pub(crate) fn rewind(&mut self, mark: Mark) {
        self.list.truncate(mark.len);
        self.dropped = mark.dropped;
    }
}
