//! VTK legacy files (`.vtk`) with an unstructured grid, text and binary.
//!
//! After a header come `POINTS`, `CELLS` (up to version 4.2 each cell with its size first, in 5.1
//! `OFFSETS` and `CONNECTIVITY`), `CELL_TYPES`, and arrays under `POINT_DATA` and `CELL_DATA`.
//!
//! Regions come from the first integer array with one component under `CELL_DATA` whose name is
//! in `REGION_ARRAYS`; without one there is one region, 0. Every integer array with one
//! component under `POINT_DATA` becomes a group of the array's name: the nodes where it is not
//! zero.
//!
//! Reference: VTK documentation, "VTK Legacy File Format",
//! <https://docs.vtk.org/en/latest/vtk_file_formats/vtk_legacy_file_format.html>.

mod arrays;
mod cells;
mod reader;
#[cfg(test)]
mod tests;

use std::path::Path;

use self::reader::{ArraysOf, Reader};
use super::error::MeshError;
use super::scan::{Encoding, Scanner, read_bytes};
use super::volume_mesh::Mesh;

/// Reads a VTK legacy file (`.vtk`) with an unstructured grid, text or binary.
///
/// An integer cell array such as `material` gives regions, integer point arrays give node groups.
///
/// # Errors
/// [`MeshError::Read`] or [`MeshError::Format`] when the file cannot be opened, is damaged, or holds solid cells other
/// than tetrahedra.
pub fn read_vtk(path: &Path) -> Result<Mesh, MeshError> {
    parse(&read_bytes(path)?, path)
}

/// Reads the bytes of a legacy file; `path` is for messages.
pub(crate) fn parse(bytes: &[u8], path: &Path) -> Result<Mesh, MeshError> {
    let mut scan = Scanner::new(bytes, path);
    read_header(&mut scan)?;
    let mut reader = Reader {
        scan,
        points: None,
        cells: None,
        tets: None,
        arrays_of: ArraysOf::File,
        labels: None,
        groups: Vec::new(),
        warnings: Vec::new(),
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
fn read_header(scan: &mut Scanner) -> Result<(), MeshError> {
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
