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
}

impl Islands {
    pub(super) fn new(objects: usize) -> Self {
        Self { root: vec![0; objects] }
    }

    /// Connect objects that touch each other, or that one elastic coupling pulls at.
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
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root[a], self.root[b]);
        self.root.iter_mut().filter(|root| **root == a.max(b)).for_each(|root| *root = a.min(b));
    }

    pub(super) fn is_root(&self, object: usize) -> bool {
        self.root[object] as usize == object
    }

    /// Write objects and contacts of the island with this lowest object.
    pub(super) fn members(
        &self,
        root: usize,
        contacts: &[Contact],
        bodies: &mut Vec<u32>,
        members: &mut Vec<u32>,
    ) {
        let is_of = |object: usize| self.root[object] as usize == root;
        bodies.clear();
        bodies.extend((root as u32..self.root.len() as u32).filter(|&o| is_of(o as usize)));
        members.clear();
        let contact_of = |c: &u32| is_of(contacts[*c as usize].object());
        members.extend((0..contacts.len() as u32).filter(contact_of));
    }
}
