//! Sleeping objects: those that have been still for a while are left out of the steps until something comes near.
//!
//! Objects fall asleep in groups that contacts and nearness connect, and a group wakes as a whole, as in engines for rigid bodies
//! (Bullet, PhysX, Rapier; MuJoCo's sleeping islands). So a sleeping object has no neighbour that is awake.
//!
//! Equations: docs/theory.md (C84).

use crate::bounded_vec::BoundedVec;
use crate::disjoint_sets::DisjointSets;
use alloc::vec;
use alloc::vec::Vec;

/// Group of an object that is awake.
const AWAKE: u32 = u32::MAX;

/// Which objects of a scene are asleep; buffers are made once.
#[derive(Debug, Clone)]
pub(crate) struct Sleepers {
    /// Lowest object of the group with which each object fell asleep.
    group: Vec<u32>,
    /// Objects that are awake, ascending.
    awake: BoundedVec<u32>,
    /// Steps in which each object has been still, with nothing near it.
    still_steps: Vec<u32>,
    /// Groups to be woken, by their lowest object, and whether there are any.
    is_waking: Vec<bool>,
    wakes: bool,
    /// Groups that objects could fall asleep in, and whether they are kept awake, by their lowest object.
    sets: DisjointSets,
    stays_awake: Vec<bool>,
}

impl Sleepers {
    /// Sleepers of a scene with so many objects, all awake.
    pub(crate) fn new(objects: usize) -> Self {
        let mut all = BoundedVec::new(objects);
        all.extend(0..objects as u32);
        Self {
            group: vec![AWAKE; objects],
            awake: all,
            still_steps: vec![0; objects],
            is_waking: vec![false; objects],
            wakes: false,
            sets: DisjointSets::new(objects),
            stays_awake: vec![false; objects],
        }
    }

    /// Objects that are awake, ascending.
    pub(crate) fn awake(&self) -> &[u32] {
        &self.awake
    }

    /// Indices of the objects that are awake, ascending.
    pub(crate) fn awake_indices(&self) -> impl Iterator<Item = usize> {
        self.awake.iter().map(|&at| at as usize)
    }

    pub(crate) fn is_awake(&self, object: usize) -> bool {
        self.group[object] == AWAKE
    }

    /// Whether any object is asleep.
    pub(crate) fn any(&self) -> bool {
        self.awake.len() < self.group.len()
    }

    /// Something is near an object, or acts on it: it is not still, and [`Self::wake`] wakes it with its group.
    pub(crate) fn disturb(&mut self, object: usize) {
        self.still_steps[object] = 0;
        if !self.is_awake(object) {
            (self.is_waking[self.group[object] as usize], self.wakes) = (true, true);
        }
    }

    /// Disturb all objects.
    pub(crate) fn disturb_all(&mut self) {
        (0..self.group.len()).for_each(|object| self.disturb(object));
    }

    /// Wake the groups that are disturbed, and pass their objects to `woken`. Gives whether there are any.
    ///
    /// # Real time
    /// Costs all objects, in a step in which any wake.
    pub(crate) fn wake(&mut self, mut woken: impl FnMut(usize)) -> bool {
        if !core::mem::take(&mut self.wakes) {
            return false;
        }
        for (at, group) in self.group.iter_mut().enumerate() {
            if *group != AWAKE && self.is_waking[*group as usize] {
                (*group, self.still_steps[at]) = (AWAKE, 0);
                self.awake.push(at as u32);
                woken(at);
            }
        }
        self.is_waking.fill(false);
        self.awake.sort_unstable();
        true
    }

    /// Count the steps for which an object has been still. Only a step in which its forces balance brings the count to `steps`. Gives the
    /// count.
    pub(crate) fn count(
        &mut self,
        object: usize,
        steps: u32,
        is_still: bool,
        is_balanced: impl FnOnce() -> bool,
    ) -> u32 {
        let count = &mut self.still_steps[object];
        let next = if is_still { count.saturating_add(1) } else { 0 };
        if next != steps || is_balanced() {
            *count = next;
        }
        *count
    }

    /// Begin groups of one object each.
    pub(crate) fn begin_groups(&mut self) {
        self.sets.separate(&self.awake);
        for &at in self.awake.iter() {
            self.stays_awake[at as usize] = false;
        }
    }

    /// Connect two objects that are awake.
    pub(crate) fn connect(&mut self, a: usize, b: usize) {
        self.sets.join(a, b);
    }

    /// Let groups fall asleep whose objects have all been still for a number of steps, and pass these to `asleep`.
    pub(crate) fn fall_asleep(&mut self, steps: u32, mut asleep: impl FnMut(usize)) {
        let Self { group, awake, still_steps, sets, stays_awake, .. } = self;
        for at in awake.iter().map(|&at| at as usize) {
            stays_awake[sets.root_of(at)] |= still_steps[at] < steps;
        }
        awake.retain(|&at| {
            let root = sets.root_of(at as usize);
            if !stays_awake[root] {
                group[at as usize] = root as u32;
                asleep(at as usize);
            }
            stays_awake[root]
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_still_object_falls_asleep_in_a_step_in_which_its_forces_balance() {
        let mut sleepers = Sleepers::new(1);
        let counts: Vec<u32> = (0..6).map(|step| sleepers.count(0, 3, true, || step == 4)).collect();
        assert_eq!(counts, [1, 2, 2, 2, 3, 4]);
        assert_eq!(sleepers.count(0, 3, false, || true), 0);
    }

    #[test]
    fn groups_fall_asleep_together_and_wake_together() {
        let mut sleepers = Sleepers::new(6);
        for step in 0..3 {
            (0..6).for_each(|at| _ = sleepers.count(at, 3, at != 5 || step == 2, || true));
        }
        let mut changed = Vec::new();
        sleepers.begin_groups();
        [(1, 3), (3, 4), (2, 5)].into_iter().for_each(|(a, b)| sleepers.connect(a, b));
        sleepers.fall_asleep(3, |at| changed.push(at));
        assert_eq!((&*changed, sleepers.awake()), (&[0, 1, 3, 4][..], &[2, 5][..]));

        changed.clear();
        sleepers.disturb(2);
        assert!(!sleepers.wake(|at| changed.push(at)));
        sleepers.disturb(4);
        assert!(sleepers.wake(|at| changed.push(at)));
        assert_eq!((&*changed, sleepers.awake()), (&[1, 3, 4][..], &[1, 2, 3, 4, 5][..]));
        assert!(!sleepers.is_awake(0) && sleepers.any());
    }
}
