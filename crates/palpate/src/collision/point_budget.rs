//! Budget of contact points: how many an object may use against each plane, obstacle or object that it touches.
//!
//! Each may use what the others leave, and at least an equal share. Where a level of detail needs more, a coarser one takes its
//! place: without room for all nodes, samples carry the force that dropped contacts would not.
//!
//! Equations: docs/theory.md (C90).

use alloc::vec::Vec;

/// Contact points of one object, but those of devices and clamps, which have their own.
#[derive(Debug, Clone)]
struct ObjectBudget {
    capacity: usize,
    /// Points that the partners ask for: in this step, or in the last one where a partner has not been searched yet.
    asked: usize,
    /// Planes, obstacles and objects that ask for points.
    partners: usize,
}

/// Budget of all objects.
#[derive(Debug, Clone)]
pub(super) struct PointBudget {
    of: Vec<ObjectBudget>,
}

impl PointBudget {
    /// Budget for the capacities of the objects.
    pub(super) fn new(capacities: impl Iterator<Item = usize>) -> Self {
        let budget = |capacity| ObjectBudget { capacity, asked: 0, partners: 0 };
        Self { of: capacities.map(budget).collect() }
    }

    /// Points that an object may use against a partner that asked for `before` in the last step: what the others leave, and at least its
    /// share, unless it only tries a finer level.
    pub(super) fn available(&self, object: usize, before: usize, is_trial: bool) -> usize {
        let own = &self.of[object];
        let left = own.capacity.saturating_sub(own.asked - before);
        let partners = own.partners + usize::from(before == 0);
        if is_trial { left } else { left.max(own.capacity / partners) }
    }

    /// Replace the points that a partner of an object asks for.
    pub(super) fn replace(&mut self, object: usize, before: usize, now: usize) {
        let own = &mut self.of[object];
        own.asked = own.asked - before + now;
        own.partners = own.partners - usize::from(before > 0) + usize::from(now > 0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_partner_may_use_what_others_leave_and_at_least_its_share() {
        let mut budget = PointBudget::new([100].into_iter());
        assert_eq!(budget.available(0, 0, false), 100, "the first one finds all");
        budget.replace(0, 0, 70);
        assert_eq!(budget.available(0, 70, false), 100);
        assert_eq!(budget.available(0, 0, false), 50, "half of them for the second");
        budget.replace(0, 0, 10);
        assert_eq!([70, 10].map(|before| budget.available(0, before, false)), [90, 50]);
        assert_eq!(budget.available(0, 0, false), 33, "a third for the third");
        assert_eq!(budget.available(0, 10, true), 30, "a trial takes nothing from others");
        budget.replace(0, 70, 20);
        assert_eq!(budget.available(0, 10, false), 80);
        budget.replace(0, 10, 0);
        assert_eq!(budget.available(0, 20, false), 100, "it has left");
    }

    #[test]
    fn the_one_that_asks_for_more_than_its_share_gives_way() {
        let mut budget = PointBudget::new([90].into_iter());
        [40, 40, 20].into_iter().for_each(|asked| budget.replace(0, 0, asked));
        assert_eq!([40, 20].map(|before| budget.available(0, before, false)), [30, 30]);
    }
}
