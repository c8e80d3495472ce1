//! The section `$Nodes`: positions, and the numbers that elements call nodes by.

use std::collections::HashMap;

use glam::DVec3;

use super::sections::{Version, end_of_section};
use crate::mesh::error::MeshError;
use crate::mesh::scan::Number::{F64, I32, U64};
use crate::mesh::scan::{Number, Scanner};

/// Entry of [`Nodes::by_number`] without a node.
const NONE: u32 = u32::MAX;

/// The nodes of a file, in its order.
pub(super) struct Nodes {
    pub positions: Vec<DVec3>,
    /// Type of node numbers.
    number: Number,
    /// Number of nodes that have a number already; in a 4.1 block, numbers come before positions.
    numbered: u32,
    /// Positions of the nodes whose numbers are below `dense_below`.
    by_number: Vec<u32>,
    dense_below: u64,
    /// The others: numbers may be sparse.
    by_large_number: HashMap<u64, u32>,
}

impl Nodes {
    pub fn read(scan: &mut Scanner, version: Version) -> Result<Self, MeshError> {
        match version {
            Version::V2 => Self::read_v2(scan),
            Version::V4 => Self::read_v4(scan),
        }
    }

    /// The position in the list of nodes of the node with this number.
    #[inline]
    pub fn find(&self, number: u64) -> Option<u32> {
        if number < self.dense_below {
            let found = self.by_number.get(number as usize).copied();
            found.filter(|&node| node != NONE)
        } else {
            self.by_large_number.get(&number).copied()
        }
    }

    /// A node number in an element.
    #[inline]
    pub fn read_number(&self, scan: &mut Scanner) -> Result<u64, MeshError> {
        scan.unsigned(self.number, "a node number")
    }

    fn new(number: Number, count: usize) -> Self {
        Self {
            positions: Vec::with_capacity(count),
            number,
            numbered: 0,
            by_number: Vec::new(),
            dense_below: 8 * count as u64 + 1024,
            by_large_number: HashMap::new(),
        }
    }

    /// Numbers the next node.
    fn add_number(&mut self, scan: &mut Scanner) -> Result<(), MeshError> {
        let number = self.read_number(scan)?;
        let node = self.numbered;
        if node == NONE {
            return scan.fail(format!("more than {NONE} nodes cannot be read"));
        }
        self.numbered += 1;
        let before = if number < self.dense_below {
            let index = number as usize;
            if index >= self.by_number.len() {
                self.by_number.resize(index + 1, NONE);
            }
            match self.by_number.get_mut(index) {
                Some(slot) => std::mem::replace(slot, node),
                None => NONE,
            }
        } else {
            let before = self.by_large_number.insert(number, node);
            before.unwrap_or(NONE)
        };
        if before == NONE {
            return Ok(());
        }
        Err(scan.error(format!("node {number} is in the file twice")))
    }

    fn add_position(&mut self, scan: &mut Scanner) -> Result<(), MeshError> {
        let mut coordinate = || scan.real(F64, "a coordinate");
        let position = DVec3::new(coordinate()?, coordinate()?, coordinate()?);
        self.positions.push(position);
        Ok(())
    }

    /// A count, then a row `number x y z` per node.
    fn read_v2(scan: &mut Scanner) -> Result<Self, MeshError> {
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
        end_of_section(scan, "Nodes", &format!("after {count} nodes"))?;
        Ok(nodes)
    }

    /// Blocks, one per entity: the numbers of its nodes, then their positions.
    fn read_v4(scan: &mut Scanner) -> Result<Self, MeshError> {
        let row_bytes = if scan.is_text() { 8 } else { 32 };
        scan.start_of_row();
        let blocks = scan.unsigned(U64, "the number of node blocks")?;
        let stated = scan.unsigned(U64, "the number of nodes")?;
        let count = scan.count(stated, row_bytes, "nodes")?;
        scan.unsigned(U64, "the smallest node number")?;
        scan.unsigned(U64, "the largest node number")?;
        scan.end_of_row()?;

        let mut nodes = Self::new(U64, count);
        for _ in 0..blocks {
            scan.start_of_row();
            let dimension = scan.integer(I32, "the dimension of a node block")?;
            if !(0..=3).contains(&dimension) {
                let message = format!("a node block has dimension {dimension}, expected 0 to 3");
                return scan.fail(message);
            }
            scan.integer(I32, "an entity tag")?;
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

            for _ in 0..in_block {
                scan.start_of_row();
                nodes.add_number(scan)?;
            }
            for _ in 0..in_block {
                scan.start_of_row();
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
