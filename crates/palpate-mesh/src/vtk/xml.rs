//! VTK's unstructured grids in XML (`.vtu`): text, base64 and appended arrays, compressed or not, in both byte orders.
//!
//! ```text
//! <VTKFile type byte_order header_type compressor>
//!   <UnstructuredGrid> <Piece> <Points> <Cells> <PointData> <CellData>
//!   <AppendedData>
//! ```
//!
//! Pieces are put one after another. Regions and groups are as in legacy files.
//!
//! Reference: VTK documentation, "XML File Formats", <https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html>.

use super::cell_types::{add_cell, ignored_cells};
use super::data_array::{Content, DataArray, Place};
use super::labels::{Labels, is_region_array};
use crate::elements::Elements;
use crate::error::MeshError;
use crate::scan::{Encoding, Number, quoted};
use crate::volume_mesh::VolumeFile;
use glam::DVec3;
use quick_xml::events::{BytesStart, Event};
use quick_xml::reader::Reader;
use std::path::Path;

/// A part of the grid, and its arrays.
#[derive(Default)]
struct Piece {
    points: u64,
    cells: u64,
    at: usize,
    positions: Vec<DataArray>,
    topology: Vec<DataArray>,
    /// Scalar arrays of points and of cells.
    point_data: Vec<DataArray>,
    cell_data: Vec<DataArray>,
}

/// Elements that hold arrays.
#[derive(Clone, Copy)]
enum Section {
    Points,
    Cells,
    PointData,
    CellData,
}

/// Reads the bytes of a VTU file; `path` is for messages.
pub(crate) fn parse(bytes: &[u8], path: &Path) -> Result<VolumeFile, MeshError> {
    let mut content = Content::new(bytes, path);
    let mut pieces = Vec::new();
    let version = read_structure(&mut content, &mut pieces)?;
    let appended = pieces.iter().flat_map(|piece: &Piece| {
        [&piece.positions, &piece.topology, &piece.point_data, &piece.cell_data].into_iter().flatten()
    });
    content.offsets.extend(appended.filter_map(|array| match array.place {
        Place::Appended(offset) => Some(offset),
        _ => None,
    }));
    content.offsets.sort_unstable();

    let (mut nodes, mut elements, mut labels) = (Vec::new(), Elements::default(), Labels::default());
    let mut cells = 0;
    for piece in &pieces {
        read_piece(&content, piece, &mut nodes, &mut elements, &mut cells, &mut labels)?;
    }
    let packed = if content.is_compressed { ", compressed" } else { "" };
    labels.warnings.extend(ignored_cells(&elements));
    let groups = std::mem::take(&mut labels.groups);
    let format = format!("VTU {version}{packed}");
    let mut file = elements.into_file(format, nodes, groups, |cell| labels.region(cell), |_| None);
    file.mesh.warnings.extend(labels.warnings);
    Ok(file)
}

/// Attribute of an element.
fn attribute(element: &BytesStart, name: &str) -> Option<String> {
    let mut attributes = element.attributes();
    let attributes = attributes.with_checks(false).filter_map(Result::ok);
    let mut found = attributes.filter(|attribute| attribute.key.as_ref() == name.as_bytes());
    found.next().map(|attribute| String::from_utf8_lossy(&attribute.value).into_owned())
}

/// Elements up to the appended data: encodings, pieces, and where arrays are. Gives the version of the format.
fn read_structure(content: &mut Content, pieces: &mut Vec<Piece>) -> Result<String, MeshError> {
    let bytes = content.bytes;
    let mut reader = Reader::from_reader(bytes);
    let (mut version, mut is_whole) = (String::new(), false);
    let mut section = None;
    // Text that follows belongs to this array.
    let mut open: Option<DataArray> = None;
    loop {
        let at = reader.buffer_position() as usize;
        let event = reader.read_event().map_err(|error| {
            content.error_at(reader.error_position() as usize, format!("the XML is damaged: {error}"))
        })?;
        let after = reader.buffer_position() as usize;
        match &event {
            Event::Start(element) | Event::Empty(element) => {
                let is_empty = matches!(event, Event::Empty(_));
                match element.name().as_ref() {
                    b"VTKFile" => version = read_file_element(content, element, at)?,
                    b"Piece" => pieces.push(read_piece_element(content, element, at)?),
                    b"Points" => section = Some(Section::Points),
                    b"Cells" => section = Some(Section::Cells),
                    b"PointData" => section = Some(Section::PointData),
                    b"CellData" => section = Some(Section::CellData),
                    b"DataArray" if section.is_some() => {
                        let array = read_array_element(content, element, at, after)?;
                        match (is_empty, array) {
                            (true, Some(array)) => keep(pieces, section, array),
                            (_, array) => open = array,
                        }
                    }
                    b"AppendedData" => {
                        content.appended = Some(read_appended_element(content, element, after)?);
                        is_whole = true;
                        break;
                    }
                    _ => {}
                }
            }
            Event::Text(_) => {
                if let Some(DataArray { place: Place::Text(text) | Place::Base64(text), .. }) = &mut open
                    && text.start == text.end
                {
                    *text = at..after;
                }
            }
            Event::End(element) => match element.name().as_ref() {
                b"DataArray" => open.take().into_iter().for_each(|array| keep(pieces, section, array)),
                b"Points" | b"Cells" | b"PointData" | b"CellData" => section = None,
                b"VTKFile" => is_whole = true,
                _ => {}
            },
            Event::Eof => break,
            _ => {}
        }
    }
    if !is_whole {
        return Err(content.error_at(bytes.len(), "the file ends before </VTKFile>"));
    }
    if pieces.is_empty() {
        return Err(content.error_at(bytes.len(), "the file has no <Piece>"));
    }
    Ok(version)
}

/// `<VTKFile>`: kind of grid, byte order, sizes and compression; gives the version.
fn read_file_element(content: &mut Content, element: &BytesStart, at: usize) -> Result<String, MeshError> {
    let fail = |message: String| Err(content.error_at(at, message));
    match attribute(element, "type").unwrap_or_default().as_str() {
        "UnstructuredGrid" => {}
        "PolyData" => {
            return fail(
                "this is a VTK surface (PolyData), expected UnstructuredGrid: a body needs tetrahedra, which gmsh, TetGen or \
                 fTetWild make of a surface; ParaView saves it as .stl or .ply for an obstacle"
                    .into(),
            );
        }
        kind if kind.starts_with('P') || kind.starts_with("vtkMultiBlock") => {
            return fail(format!(
                "this file only names others ({kind}), expected UnstructuredGrid: open it in ParaView and save one .vtu"
            ));
        }
        kind => {
            return fail(format!(
                "expected type UnstructuredGrid, found {}: ParaView's filter Tetrahedralize makes an unstructured grid of it",
                quoted(kind.as_bytes())
            ));
        }
    }
    let byte_order = match attribute(element, "byte_order").as_deref() {
        None | Some("LittleEndian") => Encoding::LittleEndian,
        Some("BigEndian") => Encoding::BigEndian,
        Some(other) => {
            return fail(format!(
                "byte_order is {}, expected LittleEndian or BigEndian",
                quoted(other.as_bytes())
            ));
        }
    };
    let header = match attribute(element, "header_type").as_deref() {
        None | Some("UInt32") => Number::U32,
        Some("UInt64") => Number::U64,
        Some(other) => {
            return fail(format!("header_type is {}, expected UInt32 or UInt64", quoted(other.as_bytes())));
        }
    };
    let is_compressed = match attribute(element, "compressor").as_deref() {
        None | Some("") => false,
        Some("vtkZLibDataCompressor") => true,
        Some(other) => {
            return fail(format!(
                "compressor is {}, expected vtkZLibDataCompressor: save with zlib or without compression",
                quoted(other.as_bytes())
            ));
        }
    };
    (content.byte_order, content.header, content.is_compressed) = (byte_order, header, is_compressed);
    Ok(attribute(element, "version").unwrap_or_default())
}

fn read_piece_element(content: &Content, element: &BytesStart, at: usize) -> Result<Piece, MeshError> {
    let count = |name: &str| {
        let text = attribute(element, name).unwrap_or_default();
        text.trim().parse().map_err(|_| {
            let found = quoted(text.as_bytes());
            content.error_at(at, format!("{name} of <Piece> is {found}, expected a number"))
        })
    };
    Ok(Piece { points: count("NumberOfPoints")?, cells: count("NumberOfCells")?, at, ..Piece::default() })
}

/// `<DataArray>`; none for arrays that are skipped: of strings, and of several components but points.
fn read_array_element(
    content: &Content,
    element: &BytesStart,
    at: usize,
    after: usize,
) -> Result<Option<DataArray>, MeshError> {
    let fail = |message: String| Err(content.error_at(at, message));
    let name = attribute(element, "Name").unwrap_or_default();
    let number = match attribute(element, "type").unwrap_or_default().as_str() {
        "Int8" => Number::I8,
        "UInt8" => Number::U8,
        "Int16" => Number::I16,
        "UInt16" => Number::U16,
        "Int32" => Number::I32,
        "UInt32" => Number::U32,
        "Int64" => Number::I64,
        "UInt64" => Number::U64,
        "Float32" => Number::F32,
        "Float64" => Number::F64,
        "String" => return Ok(None),
        other => return fail(format!("expected a type such as Float64, found {}", quoted(other.as_bytes()))),
    };
    let place = match attribute(element, "format").unwrap_or_default().as_str() {
        "ascii" | "" => Place::Text(after..after),
        "binary" => Place::Base64(after..after),
        "appended" => {
            let offset = attribute(element, "offset").unwrap_or_default();
            match offset.trim().parse() {
                Ok(offset) => Place::Appended(offset),
                Err(_) => return fail(format!("offset is {}, expected a number", quoted(offset.as_bytes()))),
            }
        }
        other => {
            return fail(format!(
                "format is {}, expected ascii, binary or appended",
                quoted(other.as_bytes())
            ));
        }
    };
    // Of several components are points alone.
    let components = attribute(element, "NumberOfComponents").unwrap_or_default();
    let name =
        if matches!(components.trim(), "" | "0" | "1") || name == "Points" { name } else { name + "[]" };
    Ok(Some(DataArray { name, number, at, place }))
}

/// `<AppendedData>`: begin of the data, and whether it is in base64.
fn read_appended_element(
    content: &Content,
    element: &BytesStart,
    after: usize,
) -> Result<(usize, bool), MeshError> {
    let is_base64 = match attribute(element, "encoding").unwrap_or_default().as_str() {
        "raw" => false,
        "base64" | "" => true,
        other => {
            let found = quoted(other.as_bytes());
            return Err(content.error_at(after, format!("encoding is {found}, expected raw or base64")));
        }
    };
    let rest = content.bytes.get(after..).unwrap_or_default();
    let blank = rest.iter().take_while(|byte| byte.is_ascii_whitespace()).count();
    match rest.get(blank) {
        Some(b'_') => Ok((after + blank + 1, is_base64)),
        _ => Err(content.error_at(after, "appended data begins with '_', which is not there")),
    }
}

/// Keeps an array where it is used.
fn keep(pieces: &mut [Piece], section: Option<Section>, array: DataArray) {
    let (Some(piece), Some(section)) = (pieces.last_mut(), section) else { return };
    match section {
        Section::Points => &mut piece.positions,
        Section::Cells => &mut piece.topology,
        Section::PointData => &mut piece.point_data,
        Section::CellData => &mut piece.cell_data,
    }
    .push(array);
}

fn read_piece(
    content: &Content,
    piece: &Piece,
    nodes: &mut Vec<DVec3>,
    elements: &mut Elements,
    cells: &mut usize,
    labels: &mut Labels,
) -> Result<(), MeshError> {
    let missing = |what: &str| content.error_at(piece.at, format!("the piece has no {what}"));
    let first_node = nodes.len();
    if first_node as u64 + piece.points > u64::from(u32::MAX) {
        return Err(
            content.error_at(piece.at, format!("{} points are more than can be numbered", piece.points))
        );
    }
    let Some(positions) = piece.positions.first() else { return Err(missing("<Points>")) };
    let coordinates = content.numbers(positions, Some(3 * piece.points), |scan, number| {
        scan.start_of_row();
        scan.real(number, "a coordinate")
    })?;
    nodes.extend(coordinates.chunks_exact(3).map(|point| DVec3::new(point[0], point[1], point[2])));

    let array =
        |name: &str| piece.topology.iter().find(|array| array.name == name).ok_or_else(|| missing(name));
    let integers = |array: &DataArray, expected: Option<u64>, what: &str| {
        content.numbers(array, expected, |scan, number| {
            scan.start_of_row();
            scan.integer(number, what)
        })
    };
    let ends_array = array("offsets")?;
    let ends = integers(ends_array, Some(piece.cells), "an offset")?;
    let types_array = array("types")?;
    let types = integers(types_array, Some(piece.cells), "a cell type")?;
    let points_array = array("connectivity")?;
    let points = integers(points_array, None, "a point of a cell")?;

    let mut start = 0;
    let mut corners = Vec::new();
    for (&end, &kind) in ends.iter().zip(&types) {
        let row = usize::try_from(end).ok().and_then(|end| points.get(start..end));
        let Some(row) = row else {
            let message = format!("has {end} after {start}: expected to rise, up to {}", points.len());
            return Err(content.error(ends_array, &message));
        };
        start += row.len();
        corners.clear();
        for &point in row {
            if point < 0 || point as u64 >= piece.points {
                let message = format!("has point {point}, and the piece has {} points", piece.points);
                return Err(content.error(points_array, &message));
            }
            corners.push(first_node as u32 + point as u32);
        }
        add_cell(elements, kind, *cells, &corners).map_err(|what| content.error_at(types_array.at, what))?;
        *cells += 1;
    }
    read_labels(content, piece, first_node as u32, *cells, labels)
}

/// Regions and groups; `cells` is the number of cells up to this piece.
fn read_labels(
    content: &Content,
    piece: &Piece,
    first_node: u32,
    cells: usize,
    labels: &mut Labels,
) -> Result<(), MeshError> {
    let integers = |array: &DataArray, expected: u64| {
        content.numbers(array, Some(expected), |scan, number| {
            scan.start_of_row();
            scan.integer(number, "a whole number")
        })
    };
    for array in
        piece.point_data.iter().filter(|array| array.number.is_integer() && !array.name.ends_with("[]"))
    {
        let values = integers(array, piece.points)?;
        labels.keep_points(array.name.clone(), &values, first_node);
    }
    let mut is_known = false;
    for array in piece.cell_data.iter().filter(|array| is_region_array(&array.name)) {
        if !array.number.is_integer() {
            labels.refuse_fractions(&array.name);
        } else if !is_known {
            let values = integers(array, piece.cells)?;
            let regions = labels.regions.get_or_insert_default();
            // Cells of pieces without the array are in region 0.
            regions.resize(cells - values.len(), 0);
            regions.extend(values);
            is_known = true;
        }
    }
    Ok(())
}
