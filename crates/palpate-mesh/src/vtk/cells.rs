//! Cells of a VTK legacy file: which points they have, and of what type they are.

use super::cell_types::add_cell;
use super::reader::{Cells, Reader};
use crate::elements::Elements;
use crate::error::MeshError;
use crate::scan::Number;

impl Reader<'_> {
    pub(super) fn read_cells(&mut self) -> Result<(), MeshError> {
        let Some(points) = &self.points else {
            return self.scan.fail("CELLS comes before POINTS");
        };
        let point_count = points.len();
        if self.cells.is_some() {
            return self.scan.fail("CELLS is in the file twice");
        }
        let rows = self.scan.text_number("the number of cells")?;
        let size = self.scan.text_number("the size of the cells")?;
        self.scan.end_of_line()?;
        self.scan.start_of_row();
        let cells = if self.scan.peek().eq_ignore_ascii_case(b"OFFSETS") {
            self.read_offsets_and_connectivity(rows, size, point_count)
        } else {
            self.read_sized_cells(rows, size, point_count)
        };
        self.cells = Some(cells?);
        Ok(())
    }

    /// Each cell as the number of its points, then the points; `size` counts all these numbers.
    fn read_sized_cells(&mut self, rows: u64, size: u64, point_count: usize) -> Result<Cells, MeshError> {
        let bytes_each = self.least_bytes(Number::I32);
        let rows = self.scan.count(rows, bytes_each, "cells")?;
        let size = self.scan.count(size, bytes_each, "numbers in cells")?;
        let mut ends = Vec::with_capacity(rows);
        let mut points = Vec::with_capacity(size.saturating_sub(rows));
        for row in 0..rows {
            let cell_size = self.integer(Number::I32, "the number of points of a cell")?;
            let left = size.saturating_sub(points.len() + row + 1);
            if !(0..=left as i64).contains(&cell_size) {
                return self.scan.fail(format!(
                    "a cell has {cell_size} points, and CELLS leaves it {left} of {size} numbers"
                ));
            }
            for _ in 0..cell_size {
                points.push(self.point(Number::I32, point_count)?);
            }
            ends.push(points.len());
        }
        let found = rows + points.len();
        if found != size {
            let message = format!("the cells take {found} numbers, and CELLS states {size}");
            return self.scan.fail(message);
        }
        Ok(Cells { ends, points })
    }

    /// Start of each cell's points, then the points of all cells (5.1).
    fn read_offsets_and_connectivity(
        &mut self,
        rows: u64,
        size: u64,
        point_count: usize,
    ) -> Result<Cells, MeshError> {
        self.scan.expect_keyword("OFFSETS")?;
        let number = self.number_type()?;
        let rows = self.scan.count(rows, self.least_bytes(number), "offsets")?;
        self.scan.end_of_line()?;
        let mut starts = Vec::with_capacity(rows);
        let mut before = 0;
        for row in 0..rows {
            let offset = self.integer(number, "an offset")?;
            if offset < before || (row == 0 && offset != 0) {
                let message = format!("offset {offset} after {before}: expected to rise from 0");
                return self.scan.fail(message);
            }
            starts.push(offset as usize);
            before = offset;
        }
        if before as u64 != size {
            let message = format!("the last offset is {before}, and CELLS states {size} points");
            return self.scan.fail(message);
        }

        self.scan.expect_keyword("CONNECTIVITY")?;
        let number = self.number_type()?;
        let size = self.scan.count(size, self.least_bytes(number), "points of cells")?;
        self.scan.end_of_line()?;
        let mut points = Vec::with_capacity(size);
        for _ in 0..size {
            points.push(self.point(number, point_count)?);
        }
        let ends = starts.split_off(rows.min(1));
        Ok(Cells { ends, points })
    }

    /// A point of a cell.
    fn point(&mut self, number: Number, point_count: usize) -> Result<u32, MeshError> {
        let point = self.integer(number, "a point of a cell")?;
        match u32::try_from(point) {
            Ok(point) if (point as usize) < point_count => Ok(point),
            _ => self.scan.fail(format!("a cell has point {point}, and the file has {point_count} points")),
        }
    }

    pub(super) fn read_cell_types(&mut self) -> Result<(), MeshError> {
        let Some(cells) = &self.cells else {
            return self.scan.fail("CELL_TYPES comes before CELLS");
        };
        if self.elements.is_some() {
            return self.scan.fail("CELL_TYPES is in the file twice");
        }
        let scan = &mut self.scan;
        let stated: usize = scan.text_number("the number of cell types")?;
        let count = cells.ends.len();
        if stated != count {
            return scan.fail(format!("{stated} cell types are stated for {count} cells"));
        }
        scan.end_of_line()?;

        let mut elements = Elements::default();
        let mut start = 0;
        for (cell, &end) in cells.ends.iter().enumerate() {
            scan.start_of_row();
            let number = scan.integer(Number::I32, "a cell type")?;
            let points = cells.points.get(start..end).unwrap_or_default();
            start = end;
            add_cell(&mut elements, number, cell, points).or_else(|what| scan.fail(what))?;
        }
        self.elements = Some(elements);
        Ok(())
    }
}
