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

mod arrays;
mod cells;
#[cfg(test)]
mod tests;

use std::path::Path;

use glam::DVec3;

use super::scan::{Encoding, Number, Scan, quoted, read_bytes, regions};
use super::{Mesh, MeshError, NodeGroup};
use cells::{Cells, Tets};

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
    parse(&read_bytes(path)?, path)
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
