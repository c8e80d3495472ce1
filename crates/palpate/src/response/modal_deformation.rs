//! Deformation of an object in modal form, kept apart from its state: what draws a surface later needs.

use super::modal::ModalState;
use super::{Footprint, SpringForce};
use alloc::vec::Vec;
use glam::DVec3;

/// Data that determine the displacement of an object in modal form; buffers are made once.
#[derive(Debug)]
pub(crate) struct ModalDeformation {
    pub(super) q: Vec<f64>,
    /// Forces on model nodes [N, body].
    pub(super) loaded: Vec<(u32, DVec3)>,
    /// Forces on patches.
    pub(super) patches: Vec<SpringForce>,
}

impl Clone for ModalDeformation {
    /// Clone of equal capacity: later copies into it do not allocate.
    fn clone(&self) -> Self {
        let mut loaded = Vec::with_capacity(self.loaded.capacity());
        loaded.extend_from_slice(&self.loaded);
        let mut patches = Vec::with_capacity(self.patches.capacity());
        patches.extend_from_slice(&self.patches);
        Self { q: self.q.clone(), loaded, patches }
    }
}

impl ModalDeformation {
    pub(super) fn new(state: &ModalState) -> Self {
        let mut new = Self {
            q: state.q.clone(),
            loaded: Vec::with_capacity(state.nodal.capacity()),
            patches: Vec::with_capacity(state.spring_forces.capacity()),
        };
        new.copy_from(state);
        new
    }

    /// Modal coordinates q [m·√kg].
    pub(super) fn coordinates(&self) -> &[f64] {
        &self.q
    }

    /// Copy the present data of the same object.
    ///
    /// # Real time
    pub(super) fn copy_from(&mut self, state: &ModalState) {
        self.q.copy_from_slice(&state.q);
        self.loaded.clear();
        self.loaded.extend_from_slice(state.nodal.loaded());
        self.patches.clear();
        let patches =
            state.spring_forces.iter().filter(|applied| applied.location.footprint != Footprint::Point);
        self.patches.extend(patches.copied());
    }
}
