//! The section `$Elements`: solids, and the nodes of every physical group's elements.

use std::collections::HashMap;

use super::element_types::element_type;
use super::labels::{Labels, Members};
use super::nodes::Nodes;
use super::sections::{Version, end_of_section};
use crate::elements::{Elements, Shape};
use crate::error::MeshError;
use crate::scan::Number::{I32, U64};
use crate::scan::Scanner;

/// The section with the elements.
#[derive(Default)]
pub(super) struct ElementSection {
    pub elements: Elements,
    /// The physical volume of each solid, in the order of the file; 0 for none.
    pub tags: Vec<i64>,
    pub members: Members,
    /// Blocks of entities that `$Entities` does not list (4.1).
    pub unlisted_blocks: usize,
    /// Tetrahedra that stood in the file again, under another physical volume (2.2).
    pub repeats: usize,
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

impl ElementSection {
    pub fn read(
        scan: &mut Scanner,
        version: Version,
        nodes: &Nodes,
        labels: &Labels,
    ) -> Result<Self, MeshError> {
        let mut section = Self::default();
        let count = match version {
            Version::V1 => section.read_v1(scan, nodes)?,
            Version::V2 => section.read_v2(scan, nodes)?,
            Version::V40 | Version::V4 => section.read_v4(scan, version, nodes, labels)?,
        };
        end_of_section(scan, version.elements(), &format!("after {count} elements"))?;
        if version == Version::V2 {
            section.drop_repeats();
        }
        Ok(section)
    }

    /// A count, then a row `number type physical elementary node-count nodes…` per element.
    fn read_v1(&mut self, scan: &mut Scanner, nodes: &Nodes) -> Result<usize, MeshError> {
        scan.skip_blank();
        let stated = scan.text_number("the number of elements")?;
        let count = scan.count(stated, 8, "elements")?;
        scan.end_of_line()?;
        for _ in 0..count {
            scan.skip_blank();
            scan.unsigned(I32, "an element number")?;
            let (shape, node_count) = read_type(scan)?;
            let tag = scan.integer(I32, "a physical region")?.saturating_abs();
            scan.integer(I32, "an elementary region")?;
            let stated = scan.unsigned(I32, "the number of nodes")?;
            if stated != node_count as u64 {
                let name = shape.name();
                return scan.fail(format!("{name} of this type have {node_count} nodes, found {stated}"));
            }
            self.read_element(
                scan,
                nodes,
                &Block { shape, node_count, entity: tag, tag, in_groups: tag != 0 },
            )?;
        }
        Ok(count)
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
    fn read_v4(
        &mut self,
        scan: &mut Scanner,
        version: Version,
        nodes: &Nodes,
        labels: &Labels,
    ) -> Result<usize, MeshError> {
        let is_4_0 = version == Version::V40;
        let number = if is_4_0 { I32 } else { U64 };
        let number_bytes = if scan.is_text() { 2 } else { number.bytes() };
        scan.start_of_row();
        let blocks = scan.unsigned(U64, "the number of element blocks")?;
        let stated = scan.unsigned(U64, "the number of elements")?;
        let count = scan.count(stated, 2 * number_bytes, "elements")?;
        if !is_4_0 {
            scan.unsigned(U64, "the smallest element number")?;
            scan.unsigned(U64, "the largest element number")?;
        }
        scan.end_of_row()?;

        let mut seen = 0;
        for _ in 0..blocks {
            scan.start_of_row();
            let mut next = |what| scan.integer(I32, what);
            let (dimension, entity) = if is_4_0 {
                let entity = next("an entity tag")?;
                (next("the dimension of an element block")?, entity)
            } else {
                (next("the dimension of an element block")?, next("an entity tag")?)
            };
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
                self.elements.reserve(in_block);
            }
            scan.end_of_row()?;

            let key = (shape.dimension(), entity);
            let tags = labels.physical_tags(version, &key);
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
                scan.unsigned(number, "an element number")?;
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

        if block.shape.dimension() == 3 {
            // Gmsh has the node of edge 23 before that of 13.
            if let (Shape::Tetrahedron, [.., before, last]) = (block.shape, &mut self.row[..])
                && block.node_count == 10
            {
                std::mem::swap(before, last);
            }
            self.elements.add(block.shape, &self.row, self.tags.len() as u32);
            self.tags.push(block.tag);
        } else {
            self.elements.count(block.shape);
        }
        if block.in_groups {
            let key = (block.shape.dimension(), block.entity);
            self.members.entry(key).or_default().extend(&self.row);
        }
        Ok(())
    }

    /// In 2.2 an element of several physical groups is written once for each: keeps the first.
    fn drop_repeats(&mut self) {
        let first = self.tags.first();
        if self.tags.iter().all(|tag| Some(tag) == first) {
            return;
        }
        let before = self.elements.len();
        let mut first_tags: HashMap<Vec<u32>, i64> = HashMap::with_capacity(before);
        let tags = &self.tags;
        self.elements.retain(|corners, solid| {
            let tag = tags.get(solid as usize).copied().unwrap_or(0);
            *first_tags.entry(corners.to_vec()).or_insert(tag) == tag
        });
        self.repeats = before - self.elements.len();
    }
}

fn read_type(scan: &mut Scanner) -> Result<(Shape, usize), MeshError> {
    let number = scan.integer(I32, "an element type")?;
    element_type(number).ok_or_else(|| scan.error(format!("unknown element type {number}")))
}
