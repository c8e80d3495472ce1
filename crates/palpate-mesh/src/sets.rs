//! Sets of numbers as decks give them: by name, in any spelling of its case, with a limit on their sizes together.

use crate::numbering::Numbering;
use crate::volume_mesh::NodeGroup;
use std::collections::HashMap;

/// Largest number of members of all sets of a file together: a few words can name sets of sets, or ranges, without end.
const MOST_MEMBERS: usize = 20_000_000;

/// Largest number of regions of a body: more materials than this have no sense, and each is a pass over its elements.
pub(crate) const MOST_REGIONS: usize = 10_000;

/// Named set of numbers of a file.
pub(crate) struct Set {
    pub name: String,
    /// With repeats, in the order of the file.
    pub members: Vec<u64>,
}

/// Sets of one kind, in the order of the file.
#[derive(Default)]
pub(crate) struct Sets {
    pub list: Vec<Set>,
    /// Positions by the name in lower case.
    by_name: HashMap<String, usize>,
    members: usize,
}

impl Sets {
    /// The set of this name; made if there is none.
    pub fn named(&mut self, name: &str) -> usize {
        *self.by_name.entry(name.to_ascii_lowercase()).or_insert_with(|| {
            self.list.push(Set { name: name.to_owned(), members: Vec::new() });
            self.list.len() - 1
        })
    }

    /// The set of this name.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.by_name.get(&name.to_ascii_lowercase()).copied()
    }

    /// Adds numbers from `first` to `last` by `step`; the reason if there are too many.
    pub fn extend(&mut self, set: usize, first: u64, last: u64, step: u64) -> Result<(), String> {
        let step = step.max(1);
        let count = last.checked_sub(first).map_or(0, |span| (span / step).saturating_add(1));
        self.reserve(usize::try_from(count).unwrap_or(usize::MAX))?;
        let numbers = (0..count).map(|at| first + at * step);
        self.list.get_mut(set).into_iter().for_each(|set| set.members.extend(numbers.clone()));
        Ok(())
    }

    /// Adds the members of another set.
    pub fn join(&mut self, set: usize, other: usize) -> Result<(), String> {
        let members = self.list.get(other).map(|set| set.members.clone()).unwrap_or_default();
        self.reserve(members.len())?;
        self.list.get_mut(set).into_iter().for_each(|set| set.members.extend(&members));
        Ok(())
    }

    fn reserve(&mut self, more: usize) -> Result<(), String> {
        self.members = self.members.saturating_add(more);
        if self.members > MOST_MEMBERS {
            return Err(format!("the sets have more than {MOST_MEMBERS} members together"));
        }
        Ok(())
    }

    /// Groups of nodes: `nodes` adds those of a member, and tells whether the file has it. With a warning about the others.
    pub fn groups(
        &self,
        kind: &str,
        mut nodes: impl FnMut(u64, &mut Vec<u32>) -> bool,
        warnings: &mut Vec<String>,
    ) -> Vec<NodeGroup> {
        let mut groups = Vec::new();
        for set in &self.list {
            let mut group = NodeGroup { name: set.name.clone(), nodes: Vec::new() };
            let unknown = set.members.iter().filter(|&&member| !nodes(member, &mut group.nodes)).count();
            group.nodes.sort_unstable();
            group.nodes.dedup();
            if unknown > 0 {
                warnings.push(format!("set '{}' names {unknown} {kind}s that are not in the file", set.name));
            }
            groups.push(group);
        }
        groups
    }
}

/// Nodes of all elements of a deck, by the number of the element.
#[derive(Default)]
pub(crate) struct Deck {
    pub numbering: Numbering,
    /// Nodes of the elements, one after another, and the end of each.
    nodes: Vec<u32>,
    ends: Vec<usize>,
}

impl Deck {
    /// For about this many elements.
    pub fn new(count: usize) -> Self {
        Self { numbering: Numbering::new(count), ..Self::default() }
    }

    /// Adds an element; its position, or the reason if that is impossible.
    pub fn push(&mut self, number: u64, nodes: &[u32]) -> Result<u32, String> {
        let element = self.numbering.push(number, "element")?;
        self.nodes.extend(nodes);
        self.ends.push(self.nodes.len());
        Ok(element)
    }

    /// Adds the nodes of an element to a group; whether there is such an element.
    pub fn add_nodes(&self, number: u64, group: &mut Vec<u32>) -> bool {
        let Some(element) = self.numbering.find(number).map(|element| element as usize) else { return false };
        let start = element.checked_sub(1).and_then(|before| self.ends.get(before)).copied().unwrap_or(0);
        let end = self.ends.get(element).copied().unwrap_or(start);
        group.extend(self.nodes.get(start..end).unwrap_or_default());
        true
    }
}
