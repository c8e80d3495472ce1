//! VTK legacy files (`.vtk`) with an unstructured grid, text and binary.
//!
//! After a header come `POINTS`, `CELLS` (up to version 4.2 each cell with its size first, in 5.1
//! `OFFSETS` and `CONNECTIVITY`), `CELL_TYPES`, and arrays under `POINT_DATA` and `CELL_DATA`.
//!
//! Regions come from the first integer array with one component under `CELL_DATA` whose name is
//! in [`REGION_ARRAYS`]; without one there is one region, 0. Every integer array with one
//! component under `POINT_DATA` becomes a group of the array's name: the nodes where it is not
//! zero.
//!
//! Reference: VTK documentation, "VTK Legacy File Format",
//! <https://docs.vtk.org/en/latest/vtk_file_formats/vtk_legacy_file_format.html>.

#[cfg(test)]
#[path = "vtk_tests.rs"]
mod tests;

use std::path::Path;

use glam::DVec3;

use super::scan::{CURVED_REMARK, Encoding, Number, OtherSolids, Scan, quoted, regions};
use super::{Mesh, MeshError, NodeGroup};

/// Names of the cell arrays that tell regions apart; case does not matter.
pub const REGION_ARRAYS: [&str; 11] = [
    "material",
    "materials",
    "materialids",
    "region",
    "regions",
    "regionid",
    "gmsh:physical",
    "cellentityids",
    "medit:ref",
    "physical",
    "part",
];

/// Reads a legacy file of VTK.
///
/// # Errors
/// When the file cannot be opened, is damaged, or holds solid cells other than tetrahedra.
pub fn read(path: &Path) -> Result<Mesh, MeshError> {
    let bytes = std::fs::read(path).map_err(|source| MeshError::Read { path: path.to_path_buf(), source })?;
    parse(&bytes, path)
}

/// Reads the bytes of a legacy file; `path` is for messages.
pub(crate) fn parse(bytes: &[u8], path: &Path) -> Result<Mesh, MeshError> {
    let mut scan = Scan::new(bytes, path);
    read_header(&mut scan)?;
    let mut reader = Reader {
        scan,
        points: None,
        cells: None,
        tets: None,
        arrays_of: ArraysOf::File,
        labels: None,
        groups: Vec::new(),
        remarks: Vec::new(),
    };
    loop {
        let keyword = reader.keyword().to_ascii_uppercase();
        match keyword.as_slice() {
            b"POINTS" => reader.read_points()?,
            b"CELLS" => reader.read_cells()?,
            b"CELL_TYPES" => reader.read_cell_types()?,
            b"POINT_DATA" | b"CELL_DATA" => reader.start_arrays(&keyword)?,
            b"" => return reader.assemble(),
            attribute => reader.read_attribute(attribute)?,
        }
    }
}

/// Version, title, `ASCII` or `BINARY`, and `DATASET UNSTRUCTURED_GRID`.
fn read_header(scan: &mut Scan) -> Result<(), MeshError> {
    let first = scan.rest_of_line();
    if first.starts_with(b"<") {
        return scan.fail(
            "this looks like an XML file of VTK (.vtu), and only legacy files (.vtk) can be read: \
             save it as a legacy file",
        );
    }
    if !first.starts_with(b"# vtk DataFile Version") {
        let expected = "'# vtk DataFile Version', which a VTK mesh begins with";
        return Err(scan.unexpected(expected, first));
    }
    scan.rest_of_line();
    let encoding = scan.word();
    let is_binary = encoding.eq_ignore_ascii_case(b"BINARY");
    if !is_binary && !encoding.eq_ignore_ascii_case(b"ASCII") {
        return Err(scan.unexpected("ASCII or BINARY", encoding));
    }
    scan.expect_keyword("DATASET")?;
    scan.expect_keyword("UNSTRUCTURED_GRID")?;
    scan.end_of_line()?;
    if is_binary {
        scan.encoding = Encoding::BigEndian;
    }
    Ok(())
}

/// The points of all cells, and where each cell's end among them.
struct Cells {
    ends: Vec<usize>,
    points: Vec<u32>,
}

/// Tetrahedra, and which cell each of them is.
#[derive(Default)]
struct Tets {
    corners: Vec<[u32; 4]>,
    cells: Vec<usize>,
}

/// What the arrays that follow belong to, and how many tuples they have.
#[derive(Clone, Copy)]
enum ArraysOf {
    File,
    Points(usize),
    Cells(usize),
}

struct Reader<'a> {
    scan: Scan<'a>,
    points: Option<Vec<DVec3>>,
    cells: Option<Cells>,
    tets: Option<Tets>,
    arrays_of: ArraysOf,
    /// The region of each cell.
    labels: Option<Vec<i64>>,
    groups: Vec<NodeGroup>,
    remarks: Vec<String>,
}

impl<'a> Reader<'a> {
    /// The next word that is not in a `METADATA` block, which ends with a blank line.
    fn keyword(&mut self) -> &'a [u8] {
        loop {
            let word = self.scan.word();
            if !word.eq_ignore_ascii_case(b"METADATA") {
                return word;
            }
            self.scan.rest_of_line();
            while !self.scan.rest_of_line().is_empty() {}
        }
    }

    fn read_points(&mut self) -> Result<(), MeshError> {
        if self.points.is_some() {
            return self.scan.fail("POINTS is in the file twice");
        }
        let stated = self.scan.text_number("the number of points")?;
        let number = self.number_type()?;
        let count = self.scan.count(stated, 3 * self.least_bytes(number), "points")?;
        self.scan.end_of_line()?;
        if u32::try_from(count).is_err() {
            return self.scan.fail(format!("{count} points are more than can be numbered"));
        }
        let mut points = Vec::with_capacity(count);
        for _ in 0..count {
            let mut coordinate = || {
                self.scan.start_of_row();
                self.scan.real(number, "a coordinate")
            };
            points.push(DVec3::new(coordinate()?, coordinate()?, coordinate()?));
        }
        self.points = Some(points);
        Ok(())
    }

    fn read_cells(&mut self) -> Result<(), MeshError> {
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

    /// Where each cell's points begin, then the points of all cells (5.1).
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

    fn read_cell_types(&mut self) -> Result<(), MeshError> {
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
        other_solids.none(scan)?;
        if curved {
            self.remarks.push(CURVED_REMARK.to_owned());
        }
        if flat_cells > 0 {
            let remark = format!("cells of dimension 0 to 2 are ignored: {flat_cells}");
            self.remarks.push(remark);
        }
        self.tets = Some(tets);
        Ok(())
    }

    /// `POINT_DATA` or `CELL_DATA`.
    fn start_arrays(&mut self, keyword: &[u8]) -> Result<(), MeshError> {
        let points = self.points.as_ref().map(Vec::len);
        let cells = self.cells.as_ref().map(|cells| cells.ends.len());
        let (of, tuples, arrays_of) = match (keyword, points, cells) {
            (b"POINT_DATA", Some(points), _) => ("points", points, ArraysOf::Points(points)),
            (b"CELL_DATA", _, Some(cells)) => ("cells", cells, ArraysOf::Cells(cells)),
            _ => {
                return self.scan.fail("data comes before the points or cells it is of");
            }
        };
        let stated: usize = self.scan.text_number("the number of tuples")?;
        if stated != tuples {
            let message = format!("data of {stated} {of} is stated, and there are {tuples}");
            return self.scan.fail(message);
        }
        self.arrays_of = arrays_of;
        Ok(())
    }

    /// One array, or the several of a `FIELD`.
    fn read_attribute(&mut self, keyword: &[u8]) -> Result<(), MeshError> {
        let fixed_components = match keyword {
            b"FIELD" | b"SCALARS" | b"TEXTURE_COORDINATES" | b"COLOR_SCALARS" => 0,
            b"GLOBAL_IDS" | b"PEDIGREE_IDS" | b"EDGE_FLAGS" => 1,
            b"VECTORS" | b"NORMALS" => 3,
            b"LOOKUP_TABLE" => 4,
            b"TENSORS6" => 6,
            b"TENSORS" => 9,
            other => return Err(self.scan.unexpected("a keyword such as POINT_DATA", other)),
        };
        let tuples = match self.arrays_of {
            ArraysOf::Points(count) | ArraysOf::Cells(count) => count as u64,
            ArraysOf::File if matches!(keyword, b"FIELD" | b"LOOKUP_TABLE") => 0,
            ArraysOf::File => {
                return self.scan.fail("an array comes before POINT_DATA and CELL_DATA");
            }
        };
        let name = self.scan.word_in_line();
        if keyword == b"FIELD" {
            let arrays: u64 = self.scan.text_number("the number of arrays")?;
            for _ in 0..arrays {
                self.read_field_array()?;
            }
            return Ok(());
        }

        let (number, components, tuples) = match keyword {
            b"SCALARS" => {
                let number = self.number_type()?;
                let components = if self.scan.is_end_of_line() {
                    1
                } else {
                    self.scan.text_number("the number of components")?
                };
                (number, components, tuples)
            }
            b"TEXTURE_COORDINATES" => {
                let components = self.scan.text_number("the number of components")?;
                (self.number_type()?, components, tuples)
            }
            b"COLOR_SCALARS" | b"LOOKUP_TABLE" => {
                let stated = self.scan.text_number("the number of colours")?;
                let number = if self.scan.is_text() { Number::F32 } else { Number::U8 };
                match keyword {
                    b"LOOKUP_TABLE" => (number, fixed_components, stated),
                    _ => (number, stated, tuples),
                }
            }
            _ => (self.number_type()?, fixed_components, tuples),
        };
        self.scan.end_of_line()?;
        if keyword == b"SCALARS" {
            self.scan.start_of_row();
            if self.scan.peek().eq_ignore_ascii_case(b"LOOKUP_TABLE") {
                self.scan.rest_of_line();
            }
        }
        let values = self.read_numbers(number, components, tuples)?;
        if keyword == b"SCALARS" && components == 1 {
            self.keep(name, number, values);
        }
        Ok(())
    }

    /// A row `name components tuples type`, then the numbers.
    fn read_field_array(&mut self) -> Result<(), MeshError> {
        let name = self.keyword();
        if name == b"NULL_ARRAY" {
            return Ok(());
        }
        let components: u64 = self.scan.text_number("the number of components")?;
        let tuples = self.scan.text_number("the number of tuples")?;
        match self.arrays_of {
            ArraysOf::Points(expected) | ArraysOf::Cells(expected) if tuples != expected as u64 => {
                let name = quoted(name);
                let message = format!("array {name} has {tuples} tuples, expected {expected}");
                return self.scan.fail(message);
            }
            _ => {}
        }
        if self.scan.is_text() && self.scan.skip_word_in_line("string") {
            // A line for each.
            let strings = components.saturating_mul(tuples);
            let strings = self.scan.count(strings, 1, "strings")?;
            self.scan.end_of_line()?;
            for _ in 0..strings {
                self.scan.rest_of_line();
            }
            return Ok(());
        }
        let number = self.number_type()?;
        self.scan.end_of_line()?;
        let values = self.read_numbers(number, components, tuples)?;
        if components == 1 {
            self.keep(name, number, values);
        }
        Ok(())
    }

    /// Keeps the values of an array, if they are a group or the regions.
    fn keep(&mut self, name: &[u8], number: Number, values: Vec<i64>) {
        let name = decoded(name);
        let is_region_array = REGION_ARRAYS.iter().any(|n| name.eq_ignore_ascii_case(n));
        match self.arrays_of {
            ArraysOf::Points(_) if number.is_integer() => {
                let in_group = (0..).zip(values).filter(|&(_, value)| value != 0);
                let nodes = in_group.map(|(node, _)| node).collect();
                self.groups.push(NodeGroup { name, nodes });
            }
            ArraysOf::Cells(_) if is_region_array && !number.is_integer() => {
                let remark = format!("cell array '{name}' is ignored: its type is no integer");
                self.remarks.push(remark);
            }
            ArraysOf::Cells(_) if is_region_array && self.labels.is_none() => {
                self.labels = Some(values);
            }
            _ => {}
        }
    }

    /// The numbers of an array; empty for one that is not of integers.
    fn read_numbers(&mut self, number: Number, components: u64, tuples: u64) -> Result<Vec<i64>, MeshError> {
        let count = components.saturating_mul(tuples);
        let count = self.scan.count(count, self.least_bytes(number), "numbers")?;
        if !number.is_integer() {
            for _ in 0..count {
                self.scan.start_of_row();
                self.scan.real(number, "a number")?;
            }
            return Ok(Vec::new());
        }
        let mut values = Vec::with_capacity(count);
        for _ in 0..count {
            values.push(self.integer(number, "a whole number")?);
        }
        Ok(values)
    }

    /// A whole number; in a text file it may be on a later line.
    fn integer(&mut self, number: Number, expected: &str) -> Result<i64, MeshError> {
        self.scan.start_of_row();
        self.scan.integer(number, expected)
    }

    /// How few bytes such a number takes.
    fn least_bytes(&self, number: Number) -> usize {
        if self.scan.is_text() { 2 } else { number.bytes() }
    }

    /// The name of a number type.
    fn number_type(&mut self) -> Result<Number, MeshError> {
        let name = self.scan.word_in_line();
        Ok(match name.to_ascii_lowercase().as_slice() {
            b"bit" if self.scan.is_text() => Number::U8,
            b"char" | b"signed_char" | b"vtktypeint8" => Number::I8,
            b"unsigned_char" | b"vtktypeuint8" => Number::U8,
            b"short" | b"vtktypeint16" => Number::I16,
            b"unsigned_short" | b"vtktypeuint16" => Number::U16,
            // In legacy files vtkIdType is a C int.
            b"int" | b"vtkidtype" | b"vtktypeint32" => Number::I32,
            b"unsigned_int" | b"vtktypeuint32" => Number::U32,
            b"long" | b"long_long" | b"vtktypeint64" => Number::I64,
            b"unsigned_long" | b"unsigned_long_long" | b"vtktypeuint64" => Number::U64,
            b"float" => Number::F32,
            b"double" => Number::F64,
            b"bit" | b"string" | b"utf8_string" | b"variant" => {
                let name = quoted(name);
                let message = format!("arrays of type {name} cannot be read: save as ASCII");
                return self.scan.fail(message);
            }
            _ => return Err(self.scan.unexpected("a number type such as double", name)),
        })
    }

    /// The mesh, at the end of the file.
    fn assemble(self) -> Result<Mesh, MeshError> {
        let (nodes, tets) = match (self.points, self.tets) {
            (Some(points), Some(tets)) => (points, tets),
            (None, _) => return self.scan.fail("the file has no POINTS"),
            (_, None) => return self.scan.fail("the file has no CELL_TYPES"),
        };
        let labels = self.labels.unwrap_or_default();
        let label = |&cell: &usize| labels.get(cell).copied().unwrap_or(0);
        let tet_tags: Vec<i64> = tets.cells.iter().map(label).collect();
        let (regions, tet_regions) = regions(&tet_tags, |_| None);
        Ok(Mesh {
            nodes,
            tets: tets.corners,
            tet_regions,
            regions,
            groups: self.groups,
            remarks: self.remarks,
        })
    }
}

/// What matters of a cell's shape.
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

/// A name as written by VTK, with `%20` for a space.
fn decoded(name: &[u8]) -> String {
    let mut bytes = Vec::with_capacity(name.len());
    let mut rest = name;
    while let Some((&byte, after)) = rest.split_first() {
        let digits = after.get(..2).filter(|_| byte == b'%');
        let digits = digits.and_then(|digits| std::str::from_utf8(digits).ok());
        let escaped = digits.and_then(|digits| u8::from_str_radix(digits, 16).ok());
        bytes.push(escaped.unwrap_or(byte));
        rest = match escaped {
            Some(_) => after.get(2..).unwrap_or_default(),
            None => after,
        };
    }
    String::from_utf8_lossy(&bytes).into_owned()
}
