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
mod cell_types;
mod cells;
mod data_array;
mod labels;
mod reader;
#[cfg(test)]
mod tests;
mod xml;

use std::path::Path;

use self::labels::Labels;
use self::reader::{ArraysOf, Reader};
use crate::error::MeshError;
use crate::scan::{Encoding, Scanner, quoted};
use crate::volume_mesh::VolumeFile;

pub(crate) use self::xml::parse as parse_xml;

/// Reads the bytes of a legacy file; `path` is for messages.
pub(crate) fn parse(bytes: &[u8], path: &Path) -> Result<VolumeFile, MeshError> {
    let mut scan = Scanner::new(bytes, path);
    let version = read_header(&mut scan)?;
    let mut reader = Reader {
        scan,
        points: None,
        cells: None,
        elements: None,
        arrays_of: ArraysOf::File,
        labels: Labels::default(),
        version,
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

/// Version, title, `ASCII` or `BINARY`, and `DATASET UNSTRUCTURED_GRID`; gives the version.
fn read_header(scan: &mut Scanner) -> Result<String, MeshError> {
    let first = scan.rest_of_line();
    // Some programs write no blank after the #.
    let text = first.strip_prefix(b"#").unwrap_or_default().trim_ascii_start();
    let Some(version) = text.strip_prefix(b"vtk DataFile Version") else {
        let expected = "'# vtk DataFile Version', which a VTK mesh begins with";
        return Err(scan.unexpected(expected, first));
    };
    scan.rest_of_line();
    let encoding = scan.word();
    let is_binary = encoding.eq_ignore_ascii_case(b"BINARY");
    if !is_binary && !encoding.eq_ignore_ascii_case(b"ASCII") {
        return Err(scan.unexpected("ASCII or BINARY", encoding));
    }
    scan.expect_keyword("DATASET")?;
    let dataset = scan.word();
    if dataset.eq_ignore_ascii_case(b"POLYDATA") {
        return scan.fail(
            "this is a VTK surface (POLYDATA), expected UNSTRUCTURED_GRID: a body needs tetrahedra, which gmsh, TetGen or \
             fTetWild make of a surface; ParaView saves it as .stl or .ply for an obstacle",
        );
    }
    if !dataset.eq_ignore_ascii_case(b"UNSTRUCTURED_GRID") {
        return scan.fail(format!(
            "expected UNSTRUCTURED_GRID, found {}: ParaView's filter Tetrahedralize makes an unstructured grid of it",
            quoted(dataset)
        ));
    }
    scan.end_of_line()?;
    if is_binary {
        scan.encoding = Encoding::BigEndian;
    }
    Ok(String::from_utf8_lossy(version.trim_ascii()).into_owned())
}
