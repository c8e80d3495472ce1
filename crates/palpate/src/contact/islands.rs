//! Islands: objects that contacts connect, with their contacts. Each is solved by itself.
//!
//! Equations: docs/theory.md (C41), (C43).

use crate::collision::{Contact, OtherSide};
use crate::device::DeviceState;
use crate::disjoint_sets::DisjointSets;
use alloc::vec;
use alloc::vec::Vec;

/// Islands of a step; buffers are made once.
#[derive(Debug, Clone)]
pub(super) struct Islands {
    sets: DisjointSets,
    bodies: Groups,
    contacts: Groups,
}

impl Islands {
    /// Islands of so many objects and contacts.
    pub(super) fn new(objects: usize, contacts: usize) -> Self {
        Self {
            sets: DisjointSets::new(objects),
            bodies: Groups::new(objects, objects),
            contacts: Groups::new(objects, contacts),
        }
    }

    /// Connect those of some objects that touch each other, or that one elastic coupling pulls at.
    ///
    /// # Real time
    /// Costs the objects and the contacts.
    pub(super) fn find(&mut self, objects: &[u32], contacts: &[Contact], devices: &[DeviceState]) {
        let Self { sets, bodies, contacts: groups } = self;
        sets.separate(objects);
        for (at, contact) in contacts.iter().enumerate() {
            match contact.other {
                OtherSide::Object { number, .. } => sets.join(contact.object(), number),
                OtherSide::Device(device) if devices[device].compliance > 0.0 => {
                    let is_same = |c: &&Contact| c.other == contact.other;
                    if let Some(earlier) = contacts[..at].iter().find(is_same) {
                        sets.join(contact.object(), earlier.object());
                    }
                }
                _ => {}
            }
        }
        bodies.collect(objects.iter().copied(), |object| sets.root_of(object as usize));
        let of = |contact: u32| sets.root_of(contacts[contact as usize].object());
        groups.collect(0..contacts.len() as u32, of);
    }

    /// Whether an object is the lowest of its island.
    pub(super) fn is_root(&mut self, object: u32) -> bool {
        self.sets.root_of(object as usize) == object as usize
    }

    /// Objects and contacts of the island with this lowest object, ascending.
    pub(super) fn members(&self, root: u32) -> (&[u32], &[u32]) {
        (self.bodies.of(root as usize), self.contacts.of(root as usize))
    }
}

/// Items by group, each group ascending.
#[derive(Debug, Clone)]
struct Groups {
    /// End of every group among the items.
    ends: Vec<u32>,
    items: Vec<u32>,
}

impl Groups {
    fn new(groups: usize, items: usize) -> Self {
        Self { ends: vec![0; groups], items: Vec::with_capacity(items) }
    }

    /// Collect items by their groups: a counting sort.
    fn collect(&mut self, items: impl Iterator<Item = u32> + Clone, mut group_of: impl FnMut(u32) -> usize) {
        self.ends.fill(0);
        let mut count = 0;
        for item in items.clone() {
            self.ends[group_of(item)] += 1;
            count += 1;
        }
        let mut first = 0;
        for end in &mut self.ends {
            first += core::mem::replace(end, first);
        }
        self.items.clear();
        self.items.resize(count, 0);
        for item in items {
            let end = &mut self.ends[group_of(item)];
            self.items[*end as usize] = item;
            *end += 1;
        }
    }

    fn of(&self, group: usize) -> &[u32] {
        let first = if group == 0 { 0 } else { self.ends[group - 1] };
        &self.items[first as usize..self.ends[group] as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_hold_their_items_in_order() {
        let mut groups = Groups::new(4, 8);
        for of in [vec![2, 0, 2, 3, 0, 2], vec![1, 1], vec![]] {
            groups.collect(0..of.len() as u32, |item| of[item as usize]);
            for group in 0..4 {
                let expected: Vec<u32> =
                    (0..of.len()).filter(|&item| of[item] == group).map(|item| item as u32).collect();
                assert_eq!(groups.of(group), expected);
            }
        }
    }
}
