//! Numbers that a file calls its nodes or elements by, which may be sparse.

use std::collections::HashMap;

/// Entry of [`Numbering::dense`] without an item.
const NONE: u32 = u32::MAX;

/// Positions in a list, by the numbers that a file gives.
#[derive(Debug, Default)]
pub(crate) struct Numbering {
    count: u32,
    /// Positions of the numbers below `dense_below`.
    dense: Vec<u32>,
    dense_below: u64,
    /// The others.
    sparse: HashMap<u64, u32>,
}

impl Numbering {
    /// For about this many items.
    pub fn new(count: usize) -> Self {
        Self { dense_below: 8 * count as u64 + 1024, ..Self::default() }
    }

    /// Number of items that have a number.
    pub fn len(&self) -> usize {
        self.count as usize
    }

    /// Gives the next item this number; the reason if that is impossible. `kind` is a singular.
    pub fn push(&mut self, number: u64, kind: &str) -> Result<u32, String> {
        let item = self.count;
        if item == NONE {
            return Err(format!("more than {NONE} {kind}s cannot be read"));
        }
        let before = if number < self.dense_below {
            let index = number as usize;
            if index >= self.dense.len() {
                self.dense.resize(index + 1, NONE);
            }
            self.dense.get_mut(index).map_or(NONE, |slot| std::mem::replace(slot, item))
        } else {
            self.sparse.insert(number, item).unwrap_or(NONE)
        };
        if before != NONE {
            return Err(format!("{kind} {number} is in the file twice"));
        }
        self.count += 1;
        Ok(item)
    }

    /// Position of the item with this number.
    #[inline]
    pub fn find(&self, number: u64) -> Option<u32> {
        if number < self.dense_below {
            self.dense.get(number as usize).copied().filter(|&item| item != NONE)
        } else {
            self.sparse.get(&number).copied()
        }
    }
}
