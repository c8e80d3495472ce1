//! Vector with a bound: it never grows beyond the capacity that it was made with, and a clone has the same.

use alloc::vec::Vec;
use core::ops::{Deref, DerefMut};

/// Vector that a step fills up to its bound, without allocation. A clone of a plain `Vec` has room for its elements only.
#[derive(Debug)]
pub(crate) struct BoundedVec<T> {
    list: Vec<T>,
    bound: usize,
}

impl<T> BoundedVec<T> {
    pub(crate) fn new(bound: usize) -> Self {
        Self { list: Vec::with_capacity(bound), bound }
    }

    /// Whether it has no room left.
    pub(crate) fn is_full(&self) -> bool {
        self.list.len() >= self.bound
    }
}

impl<T: Clone> Clone for BoundedVec<T> {
    fn clone(&self) -> Self {
        let mut clone = Self::new(self.bound);
        clone.list.extend_from_slice(&self.list);
        clone
    }
}

impl<T> Deref for BoundedVec<T> {
    type Target = Vec<T>;

    fn deref(&self) -> &Vec<T> {
        &self.list
    }
}

impl<T> DerefMut for BoundedVec<T> {
    fn deref_mut(&mut self) -> &mut Vec<T> {
        &mut self.list
    }
}
