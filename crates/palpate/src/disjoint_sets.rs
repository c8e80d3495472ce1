//! Disjoint sets: union by the lowest member, with path halving (Tarjan & van Leeuwen 1984, J. ACM 31, 245).

use alloc::vec;
use alloc::vec::Vec;

/// Sets of numbers; the buffer is made once.
#[derive(Debug, Clone)]
pub(crate) struct DisjointSets {
    /// A lower member of each one's set, or itself: the root.
    parent: Vec<u32>,
}

impl DisjointSets {
    /// Room for numbers below a limit.
    pub(crate) fn new(limit: usize) -> Self {
        Self { parent: vec![0; limit] }
    }

    /// Begin with a set of its own for each of some numbers.
    pub(crate) fn separate(&mut self, numbers: &[u32]) {
        numbers.iter().for_each(|&number| self.parent[number as usize] = number);
    }

    /// Join the sets of two numbers.
    pub(crate) fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root_of(a), self.root_of(b));
        self.parent[a.max(b)] = a.min(b) as u32;
    }

    /// Lowest member of a number's set.
    pub(crate) fn root_of(&mut self, mut number: usize) -> usize {
        while self.parent[number] as usize != number {
            let parent = self.parent[number] as usize;
            self.parent[number] = self.parent[parent];
            number = parent;
        }
        number
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chains_of_joins_have_their_lowest_member_as_root() {
        let mut sets = DisjointSets::new(9);
        sets.separate(&[0, 1, 2, 3, 4, 5, 6, 7, 8]);
        for (a, b) in [(8, 7), (7, 5), (2, 4), (4, 8), (3, 6), (6, 1), (1, 3)] {
            sets.join(a, b);
        }
        let roots: Vec<usize> = (0..9).map(|number| sets.root_of(number)).collect();
        assert_eq!(roots, [0, 1, 2, 1, 2, 2, 1, 2, 2]);
    }
}
