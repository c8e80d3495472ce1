//! Islands: objects that contacts connect, with their contacts. Each is solved by itself.
//!
//! Equations: docs/theory.md (C41), (C43).

use crate::collision::{Contact, OtherSide};
use crate::device::DeviceState;
use alloc::vec;
use alloc::vec::Vec;

/// Islands of a step; buffers are made once.
#[derive(Debug, Clone)]
pub(super) struct Islands {
    /// Lowest object of each object's island.
    root: Vec<u32>,
    bodies: Groups,
    contacts: Groups,
}

impl Islands {
    /// Islands of so many objects and contacts.
    pub(super) fn new(objects: usize, contacts: usize) -> Self {
        Self {
            root: vec![0; objects],
            bodies: Groups::new(objects, objects),
            contacts: Groups::new(objects, contacts),
        }
    }

    /// Connect objects that touch each other, or that one elastic coupling pulls at.
    ///
    /// # Real time
    /// Costs the objects and the contacts.
    pub(super) fn find(&mut self, contacts: &[Contact], devices: &[DeviceState]) {
        for (at, root) in self.root.iter_mut().enumerate() {
            *root = at as u32;
        }
        for (at, contact) in contacts.iter().enumerate() {
            match contact.other {
                OtherSide::Object { number, .. } => self.join(contact.object(), number),
                OtherSide::Device(device) if devices[device].compliance > 0.0 => {
                    let is_same = |c: &&Contact| c.other == contact.other;
                    if let Some(earlier) = contacts[..at].iter().find(is_same) {
                        self.join(contact.object(), earlier.object());
                    }
                }
                _ => {}
            }
        }
        // A root is lower than its children: it is final before they ask for it.
        for object in 0..self.root.len() {
            self.root[object] = self.root[self.root[object] as usize];
        }
        let Self { root, bodies, contacts: groups } = self;
        bodies.collect(root.len(), |object| root[object] as usize);
        groups.collect(contacts.len(), |contact| root[contacts[contact].object()] as usize);
    }

    /// Union by the lowest object, with path halving (Tarjan & van Leeuwen 1984, J. ACM 31, 245).
    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root_of(a), self.root_of(b));
        self.root[a.max(b)] = a.min(b) as u32;
    }

    fn root_of(&mut self, mut object: usize) -> usize {
        while self.root[object] as usize != object {
            let parent = self.root[object] as usize;
            self.root[object] = self.root[parent];
            object = parent;
        }
        object
    }

    pub(super) fn is_root(&self, object: usize) -> bool {
        self.root[object] as usize == object
    }

    /// Objects and contacts of the island with this lowest object, ascending.
    pub(super) fn members(&self, root: usize) -> (&[u32], &[u32]) {
        (self.bodies.of(root), self.contacts.of(root))
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

    /// Collect so many items by their groups: a counting sort.
    fn collect(&mut self, items: usize, group_of: impl Fn(usize) -> usize) {
        self.ends.fill(0);
        (0..items).for_each(|item| self.ends[group_of(item)] += 1);
        let mut first = 0;
        for end in &mut self.ends {
            first += core::mem::replace(end, first);
        }
        self.items.clear();
        self.items.resize(items, 0);
        for item in 0..items {
            let end = &mut self.ends[group_of(item)];
            self.items[*end as usize] = item as u32;
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
    fn chains_of_joins_have_their_lowest_object_as_root() {
        let mut islands = Islands::new(9, 0);
        islands.root.iter_mut().enumerate().for_each(|(at, root)| *root = at as u32);
        for (a, b) in [(8, 7), (7, 5), (2, 4), (4, 8), (3, 6), (6, 1), (1, 3)] {
            islands.join(a, b);
        }
        let roots: Vec<usize> = (0..9).map(|object| islands.root_of(object)).collect();
        assert_eq!(roots, [0, 1, 2, 1, 2, 2, 1, 2, 2]);
    }

    #[test]
    fn groups_hold_their_items_in_order() {
        let mut groups = Groups::new(4, 8);
        for of in [vec![2, 0, 2, 3, 0, 2], vec![1, 1], vec![]] {
            groups.collect(of.len(), |item| of[item]);
            for group in 0..4 {
                let expected: Vec<u32> =
                    (0..of.len()).filter(|&item| of[item] == group).map(|item| item as u32).collect();
                assert_eq!(groups.of(group), expected);
            }
        }
    }
}
