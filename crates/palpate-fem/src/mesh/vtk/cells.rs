//! Cells of a VTK legacy file: which points they have, and which of them are tetrahedra.

use super::reader::{Cells, Reader, Tets};
use crate::mesh::error::MeshError;
use crate::mesh::scan::{CURVED_WARNING, Number, OtherSolids};

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
        if self.tets.is_some() {
            return self.scan.fail("CELL_TYPES is in the file twice");
        }
        let scan = &mut self.scan;
        let stated: usize = scan.text_number("the number of cell types")?;
        let count = cells.ends.len();
        if stated != count {
            return scan.fail(format!("{stated} cell types are stated for {count} cells"));
        }
        scan.end_of_line()?;

        let mut tets = Tets::default();
        let mut other_solids = OtherSolids::default();
        let (mut flat_cells, mut curved, mut start) = (0_usize, false, 0);
        for (cell, &end) in cells.ends.iter().enumerate() {
            scan.start_of_row();
            let number = scan.integer(Number::I32, "a cell type")?;
            let Some((shape, size)) = cell_type(number) else {
                return scan.fail(format!("unknown cell type {number}"));
            };
            let points = cells.points.get(start..end).unwrap_or_default();
            start = end;
            if size.is_some_and(|size| size != points.len()) {
                let count = points.len();
                return scan.fail(format!("cell {cell} has type {number} and {count} points"));
            }
            match (shape, points.first_chunk()) {
                (Shape::Tetrahedron, Some(&corners)) => {
                    tets.corners.push(corners);
                    tets.cells.push(cell);
                    curved |= points.len() > 4;
                }
                (Shape::Tetrahedron, None) => other_solids.add(scan, "tetrahedra with under 4 points"),
                (Shape::Flat, _) => flat_cells += 1,
                (Shape::Solid(name), _) => other_solids.add(scan, name),
            }
        }
        other_solids.refuse(scan)?;
        if curved {
            self.warnings.push(CURVED_WARNING.to_owned());
        }
        if flat_cells > 0 {
            let warning = format!("cells of dimension 0 to 2 are ignored: {flat_cells}");
            self.warnings.push(warning);
        }
        self.tets = Some(tets);
        Ok(())
    }
}

/// Shape of a cell.
#[derive(Clone, Copy)]
enum Shape {
    /// A point, line or face.
    Flat,
    Tetrahedron,
    /// Any other solid, by its plural.
    Solid(&'static str),
}

/// The shape of a cell type (`vtkCellType.h`), and how many points it has, where that is fixed.
#[rustfmt::skip]
fn cell_type(number: i64) -> Option<(Shape, Option<usize>)> {
    use Shape::{Flat, Solid, Tetrahedron};
    Some(match number {
        1 => (Flat, Some(1)), 3 => (Flat, Some(2)), 5 | 21 => (Flat, Some(3)),
        8 | 9 => (Flat, Some(4)), 22 => (Flat, Some(6)), 23 => (Flat, Some(8)),
        0 | 2 | 4 | 6 | 7 | 28 | 30 | 34..=36 | 60..=63 | 68..=70 | 75..=77 => (Flat, None),
        10 => (Tetrahedron, Some(4)), 24 => (Tetrahedron, Some(10)),
        64 | 71 | 78 => (Tetrahedron, None),
        11 => (Solid("voxels"), None),
        12 | 25 | 29 | 33 | 67 | 72 | 79 => (Solid("hexahedra"), None),
        13 | 15 | 16 | 26 | 31 | 32 | 65 | 73 | 80 => (Solid("prisms"), None),
        14 | 27 | 37 | 66 | 74 | 81 => (Solid("pyramids"), None),
        41 | 42 => (Solid("polyhedra"), None),
        _ => return None,
    })
}
