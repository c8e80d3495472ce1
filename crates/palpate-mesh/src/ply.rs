//! PLY files (`.ply`), text and binary in both byte orders, for surfaces.
//!
//! A header lists elements, their numbers and their properties; the properties `x`, `y` and `z` of `vertex` and the list
//! `vertex_indices` of `face` are read, all others skipped. Polygons become a fan from their first corner.
//!
//! Reference: G. Turk, The PLY Polygon File Format (1994).

use crate::error::MeshError;
use crate::scan::{Encoding, Number, Scanner};
use crate::surface_mesh::SurfaceMesh;
use glam::DVec3;
use std::path::Path;

/// Property of an element: a number, or a list of them with the type of its length.
struct Property {
    name: Vec<u8>,
    number: Number,
    length: Option<Number>,
}

/// Element of the header.
struct Element {
    name: Vec<u8>,
    stated: u64,
    properties: Vec<Property>,
}

/// Reads the bytes of a PLY file, and tells its encoding; `path` is for messages.
pub(crate) fn parse(bytes: &[u8], path: &Path) -> Result<(SurfaceMesh, &'static str), MeshError> {
    let mut scan = Scanner::new(bytes, path);
    let (encoding, name) = read_format(&mut scan)?;
    let elements = read_elements(&mut scan)?;
    scan.encoding = encoding;
    let mut mesh = SurfaceMesh::default();
    for element in &elements {
        read_element(&mut scan, element, &mut mesh)?;
    }
    if mesh.triangles.is_empty() {
        return scan.fail("the file has no faces");
    }
    Ok((mesh, name))
}

fn read_format(scan: &mut Scanner) -> Result<(Encoding, &'static str), MeshError> {
    scan.expect_word("ply", "ply, which a PLY file begins with")?;
    loop {
        match scan.word() {
            b"format" => break,
            b"comment" | b"obj_info" => drop(scan.rest_of_line()),
            other => return Err(scan.unexpected("format", other)),
        }
    }
    let encoding = match scan.word_in_line() {
        b"ascii" => (Encoding::Text, "text"),
        b"binary_little_endian" => (Encoding::LittleEndian, "binary"),
        b"binary_big_endian" => (Encoding::BigEndian, "binary, big-endian"),
        other => return Err(scan.unexpected("ascii, binary_little_endian or binary_big_endian", other)),
    };
    scan.rest_of_line();
    Ok(encoding)
}

fn read_elements(scan: &mut Scanner) -> Result<Vec<Element>, MeshError> {
    let mut elements: Vec<Element> = Vec::new();
    loop {
        match scan.word() {
            b"comment" | b"obj_info" => drop(scan.rest_of_line()),
            b"element" => {
                let name = scan.word_in_line().to_vec();
                let stated = scan.text_number("the number of elements")?;
                elements.push(Element { name, stated, properties: Vec::new() });
            }
            b"property" => {
                let is_list = scan.skip_word_in_line("list");
                let length = if is_list { Some(read_type(scan)?) } else { None };
                let number = read_type(scan)?;
                let name = scan.word_in_line().to_vec();
                let Some(element) = elements.last_mut() else {
                    return scan.fail("a property comes before an element");
                };
                element.properties.push(Property { name, number, length });
            }
            b"end_header" => {
                // A single line end: binary data begins behind it.
                scan.rest_of_line();
                return Ok(elements);
            }
            other => return Err(scan.unexpected("element, property or end_header", other)),
        }
    }
}

fn read_type(scan: &mut Scanner) -> Result<Number, MeshError> {
    Ok(match scan.word_in_line() {
        b"char" | b"int8" => Number::I8,
        b"uchar" | b"uint8" => Number::U8,
        b"short" | b"int16" => Number::I16,
        b"ushort" | b"uint16" => Number::U16,
        b"int" | b"int32" => Number::I32,
        b"uint" | b"uint32" => Number::U32,
        b"float" | b"float32" => Number::F32,
        b"double" | b"float64" => Number::F64,
        other => return Err(scan.unexpected("a type such as float", other)),
    })
}

fn read_element(scan: &mut Scanner, element: &Element, mesh: &mut SurfaceMesh) -> Result<(), MeshError> {
    let least = |number: Number| if scan.is_text() { 2 } else { number.bytes() };
    let bytes_each: usize =
        element.properties.iter().map(|property| least(property.length.unwrap_or(property.number))).sum();
    if bytes_each == 0 {
        return Ok(());
    }
    let name = String::from_utf8_lossy(&element.name).into_owned();
    let count = scan.count(element.stated, bytes_each, &format!("elements '{name}'"))?;
    let is_vertex = element.name == b"vertex";
    let is_face = element.name == b"face";
    let mut polygon = Vec::new();
    for _ in 0..count {
        let mut position = DVec3::ZERO;
        for property in &element.properties {
            if let Some(length) = property.length {
                scan.start_of_row();
                let stated = scan.unsigned(length, "the length of a list")?;
                let length = scan.count(stated, least_bytes(scan, property.number), "numbers of a list")?;
                let is_polygon =
                    is_face && matches!(property.name.as_slice(), b"vertex_indices" | b"vertex_index");
                polygon.clear();
                for _ in 0..length {
                    scan.start_of_row();
                    if is_polygon {
                        polygon.push(read_corner(scan, property.number, mesh)?);
                    } else {
                        scan.real(property.number, "a number of a list")?;
                    }
                }
                mesh.push_polygon(&polygon);
                continue;
            }
            scan.start_of_row();
            let value = scan.real(property.number, "a property")?;
            match property.name.as_slice() {
                b"x" => position.x = value,
                b"y" => position.y = value,
                b"z" => position.z = value,
                _ => {}
            }
        }
        if is_vertex {
            mesh.positions.push(position);
        }
    }
    Ok(())
}

fn least_bytes(scan: &Scanner, number: Number) -> usize {
    if scan.is_text() { 2 } else { number.bytes() }
}

fn read_corner(scan: &mut Scanner, number: Number, mesh: &SurfaceMesh) -> Result<u32, MeshError> {
    let corner = scan.unsigned(number, "a corner of a face")?;
    mesh.known_vertex(corner).ok_or_else(|| {
        let count = mesh.positions.len();
        scan.error(format!("a face has vertex {corner}, and the file has {count}"))
    })
}
