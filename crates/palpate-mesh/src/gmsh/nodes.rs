//! The section `$Nodes`: positions, and the numbers that elements call nodes by.

use glam::DVec3;

use super::sections::{Version, end_of_section};
use crate::error::MeshError;
use crate::numbering::Numbering;
use crate::scan::Number::{F64, I32, U64};
use crate::scan::{Number, Scanner};

/// The nodes of a file, in its order.
pub(super) struct Nodes {
    pub positions: Vec<DVec3>,
    /// Type of node numbers.
    number: Number,
    /// Numbers of the nodes; in a block of 4.1, they come before the positions.
    numbering: Numbering,
}

impl Nodes {
    pub fn read(scan: &mut Scanner, version: Version) -> Result<Self, MeshError> {
        match version {
            Version::V1 | Version::V2 => Self::read_v2(scan, version),
            Version::V40 | Version::V4 => Self::read_v4(scan, version),
        }
    }

    /// The position in the list of nodes of the node with this number.
    #[inline]
    pub fn find(&self, number: u64) -> Option<u32> {
        self.numbering.find(number)
    }

    /// A node number in an element.
    #[inline]
    pub fn read_number(&self, scan: &mut Scanner) -> Result<u64, MeshError> {
        scan.unsigned(self.number, "a node number")
    }

    fn new(number: Number, count: usize) -> Self {
        Self { positions: Vec::with_capacity(count), number, numbering: Numbering::new(count) }
    }

    /// Numbers the next node.
    fn add_number(&mut self, scan: &mut Scanner) -> Result<(), MeshError> {
        let number = self.read_number(scan)?;
        self.numbering.push(number, "node").map(drop).map_err(|what| scan.error(what))
    }

    fn add_position(&mut self, scan: &mut Scanner) -> Result<(), MeshError> {
        let mut coordinate = || scan.real(F64, "a coordinate");
        let position = DVec3::new(coordinate()?, coordinate()?, coordinate()?);
        self.positions.push(position);
        Ok(())
    }

    /// A count, then a row `number x y z` per node.
    fn read_v2(scan: &mut Scanner, version: Version) -> Result<Self, MeshError> {
        let row_bytes = if scan.is_text() { 8 } else { 28 };
        scan.skip_blank();
        let stated = scan.text_number("the number of nodes")?;
        let count = scan.count(stated, row_bytes, "nodes")?;
        scan.end_of_line()?;

        let mut nodes = Self::new(I32, count);
        for _ in 0..count {
            scan.start_of_row();
            nodes.add_number(scan)?;
            nodes.add_position(scan)?;
            scan.end_of_row()?;
        }
        end_of_section(scan, version.nodes(), &format!("after {count} nodes"))?;
        Ok(nodes)
    }

    /// Blocks, one per entity: the numbers of its nodes, then their positions; in 4.0 a row `number x y z` per node.
    fn read_v4(scan: &mut Scanner, version: Version) -> Result<Self, MeshError> {
        let is_4_0 = version == Version::V40;
        let row_bytes = if scan.is_text() { 8 } else { 28 };
        scan.start_of_row();
        let blocks = scan.unsigned(U64, "the number of node blocks")?;
        let stated = scan.unsigned(U64, "the number of nodes")?;
        let count = scan.count(stated, row_bytes, "nodes")?;
        if !is_4_0 {
            scan.unsigned(U64, "the smallest node number")?;
            scan.unsigned(U64, "the largest node number")?;
        }
        scan.end_of_row()?;

        let mut nodes = Self::new(if is_4_0 { I32 } else { U64 }, count);
        for _ in 0..blocks {
            scan.start_of_row();
            if is_4_0 {
                scan.integer(I32, "an entity tag")?;
            }
            let dimension = scan.integer(I32, "the dimension of a node block")?;
            if !(0..=3).contains(&dimension) {
                let message = format!("a node block has dimension {dimension}, expected 0 to 3");
                return scan.fail(message);
            }
            if !is_4_0 {
                scan.integer(I32, "an entity tag")?;
            }
            let parametric = scan.integer(I32, "0 or 1 for parametric coordinates")?;
            if !(0..=1).contains(&parametric) {
                let message = format!("the parametric flag is {parametric}, expected 0 or 1");
                return scan.fail(message);
            }
            let in_block = scan.unsigned(U64, "the number of nodes in the block")?;
            if in_block > (count - nodes.positions.len()) as u64 {
                let message = format!("the node blocks hold more than the {count} nodes stated");
                return scan.fail(message);
            }
            scan.end_of_row()?;

            for _ in 0..if is_4_0 { 0 } else { in_block } {
                scan.start_of_row();
                nodes.add_number(scan)?;
            }
            for _ in 0..in_block {
                scan.start_of_row();
                if is_4_0 {
                    nodes.add_number(scan)?;
                }
                nodes.add_position(scan)?;
                // A parametric node has as many parameters as its entity has dimensions.
                for _ in 0..parametric * dimension {
                    scan.real(F64, "a parametric coordinate")?;
                }
                scan.end_of_row()?;
            }
        }
        if nodes.positions.len() != count {
            let found = nodes.positions.len();
            let message = format!("the node blocks hold {found} nodes, and {count} are stated");
            return scan.fail(message);
        }
        end_of_section(scan, "Nodes", &format!("after {count} nodes"))?;
        Ok(nodes)
    }
}
