//! The section `$Elements`: tetrahedra, and the nodes of every physical group's elements.

use std::collections::HashMap;

use super::element_types::{Shape, element_type};
use super::labels::{Labels, Members};
use super::nodes::Nodes;
use super::sections::{Version, end_of_section};
use crate::mesh::error::MeshError;
use crate::mesh::scan::Number::{I32, U64};
use crate::mesh::scan::{OtherSolids, Scanner};

/// The elements of a file.
#[derive(Default)]
pub(super) struct Elements {
    pub tets: Vec<[u32; 4]>,
    /// The physical volume of each tetrahedron; 0 for none.
    pub tet_tags: Vec<i64>,
    pub members: Members,
    /// Whether there are tetrahedra with more than four nodes.
    pub curved: bool,
    /// Blocks of entities that `$Entities` does not list (4.1).
    pub unlisted_blocks: usize,
    /// Tetrahedra that stood in the file again, under another physical volume (2.2).
    pub repeats: usize,
    other_solids: OtherSolids,
    /// The nodes of the element being read.
    row: Vec<u32>,
}

/// Common properties of the elements of a block.
struct Block {
    shape: Shape,
    node_count: usize,
    entity: i64,
    /// The physical volume of its tetrahedra.
    tag: i64,
    in_groups: bool,
}

impl Elements {
    pub fn read(
        scan: &mut Scanner,
        version: Version,
        nodes: &Nodes,
        labels: &Labels,
    ) -> Result<Self, MeshError> {
        let mut elements = Self::default();
        let count = match version {
            Version::V2 => elements.read_v2(scan, nodes)?,
            Version::V4 => elements.read_v4(scan, nodes, labels)?,
        };
        end_of_section(scan, "Elements", &format!("after {count} elements"))?;
        elements.other_solids.refuse(scan)?;
        if version == Version::V2 {
            elements.drop_repeats();
        }
        Ok(elements)
    }

    /// A count, then a row `number type tag-count tags… nodes…` per element. A binary file says
    /// `type element-count tag-count` once for a run of elements.
    fn read_v2(&mut self, scan: &mut Scanner, nodes: &Nodes) -> Result<usize, MeshError> {
        let row_bytes = if scan.is_text() { 8 } else { 8 + 4 };
        scan.skip_blank();
        let stated = scan.text_number("the number of elements")?;
        let count = scan.count(stated, row_bytes, "elements")?;
        scan.end_of_line()?;

        let mut seen = 0;
        while seen < count {
            scan.start_of_row();
            if scan.is_text() {
                scan.unsigned(I32, "an element number")?;
            }
            let (shape, node_count) = read_type(scan)?;
            let run =
                if scan.is_text() { 1 } else { scan.unsigned(I32, "the number of elements that follow")? };
            if run > (count - seen) as u64 {
                let message = format!("more elements follow than the {count} stated");
                return scan.fail(message);
            }
            let tag_count = scan.unsigned(I32, "the number of tags")?;
            for _ in 0..run {
                if !scan.is_text() {
                    scan.unsigned(I32, "an element number")?;
                }
                let mut physical = 0;
                for position in 0..tag_count {
                    let tag = scan.integer(I32, "a tag")?;
                    if position == 0 {
                        physical = tag.saturating_abs();
                    }
                }
                let block =
                    Block { shape, node_count, entity: physical, tag: physical, in_groups: physical != 0 };
                self.read_element(scan, nodes, &block)?;
            }
            seen += run as usize;
        }
        Ok(count)
    }

    /// Blocks, one per entity and element type: a row `number nodes…` per element.
    fn read_v4(&mut self, scan: &mut Scanner, nodes: &Nodes, labels: &Labels) -> Result<usize, MeshError> {
        let number_bytes = if scan.is_text() { 2 } else { 8 };
        scan.start_of_row();
        let blocks = scan.unsigned(U64, "the number of element blocks")?;
        let stated = scan.unsigned(U64, "the number of elements")?;
        let count = scan.count(stated, 2 * number_bytes, "elements")?;
        scan.unsigned(U64, "the smallest element number")?;
        scan.unsigned(U64, "the largest element number")?;
        scan.end_of_row()?;

        let mut seen = 0;
        for _ in 0..blocks {
            scan.start_of_row();
            let dimension = scan.integer(I32, "the dimension of an element block")?;
            let entity = scan.integer(I32, "an entity tag")?;
            let (shape, node_count) = read_type(scan)?;
            if dimension != i64::from(shape.dimension()) {
                let message = format!("{} in a block of dimension {dimension}", shape.name());
                return scan.fail(message);
            }
            let in_block = scan.unsigned(U64, "the number of elements in the block")?;
            if in_block > (count - seen) as u64 {
                let message = format!("the blocks hold more than the {count} elements stated");
                return scan.fail(message);
            }
            let row_bytes = (1 + node_count) * number_bytes;
            let in_block = scan.count(in_block, row_bytes, "elements")?;
            if shape == Shape::Tetrahedron {
                self.tets.reserve(in_block);
                self.tet_tags.reserve(in_block);
            }
            scan.end_of_row()?;

            let key = (shape.dimension(), entity);
            let tags = labels.physical_tags(Version::V4, &key);
            self.unlisted_blocks += usize::from(labels.omits(&key));
            let block = Block {
                shape,
                node_count,
                entity,
                tag: tags.first().copied().unwrap_or(0),
                in_groups: !tags.is_empty(),
            };
            for _ in 0..in_block {
                scan.start_of_row();
                scan.unsigned(U64, "an element number")?;
                self.read_element(scan, nodes, &block)?;
            }
            seen += in_block;
        }
        if seen != count {
            let message = format!("the blocks hold {seen} elements, and {count} are stated");
            return scan.fail(message);
        }
        Ok(count)
    }

    /// The nodes of one element, to the end of its row.
    fn read_element(&mut self, scan: &mut Scanner, nodes: &Nodes, block: &Block) -> Result<(), MeshError> {
        self.row.clear();
        for _ in 0..block.node_count {
            let number = nodes.read_number(scan)?;
            let Some(node) = nodes.find(number) else {
                let message = format!("an element has node {number}, which is not in the file");
                return scan.fail(message);
            };
            self.row.push(node);
        }
        scan.end_of_row()?;

        if block.shape == Shape::Tetrahedron {
            if let Some(&corners) = self.row.first_chunk() {
                self.tets.push(corners);
                self.tet_tags.push(block.tag);
            }
            self.curved |= block.node_count > 4;
        } else if block.shape.dimension() == 3 {
            self.other_solids.add(scan, block.shape.name());
        }
        if block.in_groups {
            let key = (block.shape.dimension(), block.entity);
            self.members.entry(key).or_default().extend(&self.row);
        }
        Ok(())
    }

    /// In 2.2 an element of several physical groups is written once for each: keeps the first.
    fn drop_repeats(&mut self) {
        let first = self.tet_tags.first();
        if self.tet_tags.iter().all(|tag| Some(tag) == first) {
            return;
        }
        let mut first_tags: HashMap<[u32; 4], i64> = HashMap::with_capacity(self.tets.len());
        let mut kept_tags = Vec::with_capacity(self.tet_tags.len());
        let mut tags = self.tet_tags.iter().copied();
        self.tets.retain(|&corners| {
            let tag = tags.next().unwrap_or(0);
            let is_first = *first_tags.entry(corners).or_insert(tag) == tag;
            if is_first {
                kept_tags.push(tag);
            }
            is_first
        });
        self.repeats = self.tet_tags.len() - kept_tags.len();
        self.tet_tags = kept_tags;
    }
}

fn read_type(scan: &mut Scanner) -> Result<(Shape, usize), MeshError> {
    let number = scan.integer(I32, "an element type")?;
    element_type(number).ok_or_else(|| scan.error(format!("unknown element type {number}")))
}
