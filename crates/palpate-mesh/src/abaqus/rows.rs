//! Rows below the keywords.

use super::Reader;
use crate::elements::Shape;
use crate::error::MeshError;
use crate::rows::{Rows, Words};
use crate::sets::Sets;
use glam::DVec3;

/// Keyword that rows belong to.
pub(super) enum Section {
    Skipped,
    Instance,
    Nodes(Option<usize>),
    /// Shape and number of nodes of a solid, and the set of the elements.
    Elements(Option<(Shape, usize)>, Option<usize>),
    /// Set, and whether rows are ranges.
    NodeSet(usize, bool),
    ElementSet(usize, bool),
    Elastic,
    Density,
}

/// Element whose nodes are being read.
#[derive(Default)]
pub(super) struct Solid {
    number: Option<u64>,
    nodes: Vec<u32>,
}

impl Reader<'_> {
    pub(super) fn row<'a>(&mut self, rows: &Rows<'a>, row: &'a [u8]) -> Result<(), MeshError> {
        let words = Words(row);
        match self.section {
            Section::Skipped => {}
            Section::Instance => self.instance(rows, words)?,
            Section::Nodes(set) => self.node(rows, words, set)?,
            Section::Elements(kind, set) => self.element(rows, row, kind, set)?,
            Section::NodeSet(set, is_range) => extend(&mut self.node_sets, rows, words, set, is_range)?,
            Section::ElementSet(set, is_range) => extend(&mut self.element_sets, rows, words, set, is_range)?,
            Section::Elastic => {
                let mut words = words;
                let young = rows.number(&mut words, "Young's modulus")?;
                let poisson = rows.number(&mut words, "Poisson's ratio")?;
                self.materials
                    .last_mut()
                    .into_iter()
                    .for_each(|m| m.young_and_poisson = Some([young, poisson]));
                self.section = Section::Skipped;
            }
            Section::Density => {
                let mut words = words;
                let density = rows.number(&mut words, "a density")?;
                self.materials.last_mut().into_iter().for_each(|material| material.density = Some(density));
                self.section = Section::Skipped;
            }
        }
        Ok(())
    }

    /// Translation or rotation of an instance.
    fn instance<'a>(&mut self, rows: &Rows<'a>, words: Words<'a>) -> Result<(), MeshError> {
        let mut is_moved = false;
        for word in words {
            is_moved |= rows.parse::<f64>(word, "a translation or rotation of the instance")? != 0.0;
        }
        if is_moved {
            self.warnings.push(
                "the instance is moved or turned in its assembly: the mesh stays in the frame of its part"
                    .into(),
            );
        }
        Ok(())
    }

    fn node<'a>(
        &mut self,
        rows: &Rows<'a>,
        mut words: Words<'a>,
        set: Option<usize>,
    ) -> Result<(), MeshError> {
        let number: u64 = rows.number(&mut words, "the number of a node")?;
        self.nodes.push(number, "node").or_else(|what| rows.scan.fail(what))?;
        let mut coordinate = || rows.number(&mut words, "a coordinate");
        self.positions.push(DVec3::new(coordinate()?, coordinate()?, coordinate()?));
        match set {
            Some(set) => self.node_sets.extend(set, number, number, 1).or_else(|what| rows.scan.fail(what)),
            None => Ok(()),
        }
    }

    /// A row of an element; its nodes go on in the next row while there are too few, and behind a comma.
    fn element<'a>(
        &mut self,
        rows: &Rows<'a>,
        row: &'a [u8],
        kind: Option<(Shape, usize)>,
        set: Option<usize>,
    ) -> Result<(), MeshError> {
        for word in Words(row) {
            let number: u64 = rows.parse(word, "the number of an element or of its nodes")?;
            if self.open.number.is_none() {
                self.open.number = Some(number);
            } else if let Some(node) = self.nodes.find(number) {
                self.open.nodes.push(node);
            } else if kind.is_some() {
                return rows
                    .scan
                    .fail(format!("an element has node {number}, which is not in the file before it"));
            }
        }
        let is_whole = match kind {
            Some((_, size)) => self.open.nodes.len() >= size,
            None => !row.ends_with(b","),
        };
        if !is_whole {
            return Ok(());
        }
        let Some(number) = self.open.number.take() else { return Ok(()) };
        let nodes = std::mem::take(&mut self.open.nodes);
        let element = self.deck.push(number, &nodes).or_else(|what| rows.scan.fail(what))?;
        match kind {
            Some((shape, size)) if nodes.len() == size => drop(self.elements.add(shape, &nodes, element)),
            Some((shape, size)) => {
                let (name, found) = (shape.name(), nodes.len());
                return rows.scan.fail(format!("{name} of this type have {size} nodes, found {found}"));
            }
            None => self.elements.count(Shape::OtherFlat),
        }
        match set {
            Some(set) => {
                self.element_sets.extend(set, number, number, 1).or_else(|what| rows.scan.fail(what))
            }
            None => Ok(()),
        }
    }

    /// Refuses an element whose nodes have not all come.
    pub(super) fn end_element(&mut self, rows: &Rows) -> Result<(), MeshError> {
        match (self.open.number, &self.section) {
            (Some(number), Section::Elements(Some((_, size)), _)) => {
                let found = self.open.nodes.len();
                rows.scan.fail(format!("element {number} has {found} nodes, expected {size}"))
            }
            _ => {
                self.open = Solid::default();
                Ok(())
            }
        }
    }
}

/// Members of a set: numbers and names of sets, or a range.
fn extend<'a>(
    sets: &mut Sets,
    rows: &Rows<'a>,
    mut words: Words<'a>,
    set: usize,
    is_range: bool,
) -> Result<(), MeshError> {
    if is_range {
        let first = rows.number(&mut words, "the first member of a range")?;
        let last = rows.number(&mut words, "the last member of a range")?;
        let step = words.next().map_or(Ok(1), |word| rows.parse(word, "the step of a range"))?;
        return sets.extend(set, first, last, step).or_else(|what| rows.scan.fail(what));
    }
    for word in words {
        let text = String::from_utf8_lossy(word);
        let added = match (text.parse(), sets.find(&text)) {
            (Ok(number), _) => sets.extend(set, number, number, 1),
            (Err(_), Some(other)) => sets.join(set, other),
            (Err(_), None) => {
                return rows.parse::<u64>(word, "a number, or the name of a set before this one").map(drop);
            }
        };
        added.or_else(|what| rows.scan.fail(what))?;
    }
    Ok(())
}
