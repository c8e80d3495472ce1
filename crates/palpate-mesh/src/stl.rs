//! STL files (`.stl`), text and binary, for surfaces.
//!
//! An STL file is a list of triangles with the positions of their corners; [`SurfaceMesh::weld`] joins them. The normals
//! in the file are skipped: the order of the corners gives the orientation.
//!
//! Reference: 3D Systems, StereoLithography Interface Specification (1989).

use super::error::MeshError;
use super::scan::{Encoding, Number, Scanner};
use super::surface_mesh::SurfaceMesh;
use glam::DVec3;
use std::path::Path;

/// A binary file's title, its count, and each of its triangles [bytes].
const TITLE: usize = 80;
const COUNT: usize = 4;
const TRIANGLE: usize = 50;

/// Reads the bytes of an STL file, and tells its encoding; `path` is for messages.
pub(crate) fn parse(bytes: &[u8], path: &Path) -> Result<(SurfaceMesh, &'static str), MeshError> {
    let mut scan = Scanner::new(bytes, path);
    let mut mesh = SurfaceMesh::default();
    // The title of a binary file may begin with the word of a text file, so the length decides.
    let stated =
        bytes.get(TITLE..).and_then(|rest| rest.first_chunk::<COUNT>()).map(|b| u32::from_le_bytes(*b));
    let length = stated.map(|count| (TITLE + COUNT) as u64 + TRIANGLE as u64 * u64::from(count));
    let is_text = scan.peek().eq_ignore_ascii_case(b"solid");
    let encoding = match (stated, length) {
        (Some(count), Some(length)) if length == bytes.len() as u64 => {
            read_binary(&mut scan, count, &mut mesh)?;
            "binary"
        }
        _ if is_text => {
            read_text(&mut scan, &mut mesh)?;
            "text"
        }
        (Some(count), Some(length)) => {
            return scan.fail(format!(
                "this is no STL file: a text begins with 'solid', and a binary file with {count} triangles has {length} \
                 bytes, not {}",
                bytes.len()
            ));
        }
        _ => {
            return scan.fail("this is no STL file: a text begins with 'solid', and a binary file is longer");
        }
    };
    if mesh.triangles.is_empty() {
        return scan.fail("the file has no triangles");
    }
    Ok((mesh, encoding))
}

fn read_binary(scan: &mut Scanner, count: u32, mesh: &mut SurfaceMesh) -> Result<(), MeshError> {
    scan.encoding = Encoding::LittleEndian;
    scan.go_to(TITLE + COUNT);
    for _ in 0..count {
        let mut number = || scan.real(Number::F32, "a coordinate");
        let mut corner = || Ok::<_, MeshError>(DVec3::new(number()?, number()?, number()?));
        let [_normal, a, b, c] = [corner()?, corner()?, corner()?, corner()?];
        push(mesh, [a, b, c]);
        scan.binary::<2>("an attribute")?;
    }
    Ok(())
}

fn read_text(scan: &mut Scanner, mesh: &mut SurfaceMesh) -> Result<(), MeshError> {
    let mut is_open = false;
    loop {
        let word = scan.word();
        match word.to_ascii_lowercase().as_slice() {
            b"solid" if !is_open => is_open = true,
            b"endsolid" if is_open => is_open = false,
            b"facet" if is_open => {
                scan.rest_of_line();
                scan.expect_keyword("outer")?;
                scan.expect_keyword("loop")?;
                let mut corners = [DVec3::ZERO; 3];
                for corner in &mut corners {
                    scan.expect_keyword("vertex")?;
                    let mut number = || scan.text_number("a coordinate");
                    *corner = DVec3::new(number()?, number()?, number()?);
                }
                scan.expect_keyword("endloop")?;
                scan.expect_keyword("endfacet")?;
                push(mesh, corners);
                continue;
            }
            b"" if !is_open => return Ok(()),
            _ => return Err(scan.unexpected(if is_open { "facet or endsolid" } else { "solid" }, word)),
        }
        // Names.
        scan.rest_of_line();
    }
}

fn push(mesh: &mut SurfaceMesh, corners: [DVec3; 3]) {
    let first = mesh.positions.len() as u32;
    mesh.positions.extend(corners);
    mesh.triangles.push([first, first + 1, first + 2]);
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::scan::tests::XorShift;

    const CORNERS: [DVec3; 4] = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
    const FACES: [[usize; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];

    fn text() -> Vec<u8> {
        let mut text = String::from("solid a thing\n");
        for face in FACES {
            text += "facet normal 0 0 nan\n outer loop\n";
            for corner in face {
                let DVec3 { x, y, z } = CORNERS[corner];
                text += &format!("  vertex {x:e} {y} {z}\n");
            }
            text += " endloop\nENDFACET\n";
        }
        (text + "endsolid a thing\n").into_bytes()
    }

    fn binary() -> Vec<u8> {
        let mut bytes = b"solid, though binary".to_vec();
        bytes.resize(TITLE, b' ');
        bytes.extend(4_u32.to_le_bytes());
        for face in FACES {
            bytes.extend([0; 12]);
            for corner in face {
                bytes.extend(CORNERS[corner].to_array().into_iter().flat_map(|x| (x as f32).to_le_bytes()));
            }
            bytes.extend([0; 2]);
        }
        bytes
    }

    fn message(bytes: &[u8]) -> String {
        parse(bytes, Path::new("a.stl")).err().map(|error| error.to_string()).unwrap_or_default()
    }

    #[test]
    fn both_kinds_give_the_same_closed_surface_when_welded() {
        for bytes in [text(), binary()] {
            let (mut mesh, _) = parse(&bytes, Path::new("a.stl")).unwrap();
            assert_eq!((mesh.positions.len(), mesh.triangles.len()), (12, 4));
            mesh.weld();
            assert_eq!((mesh.positions.len(), mesh.triangles.len()), (4, 4));
            assert!((mesh.volume() - 1.0 / 6.0).abs() < 1e-15);
        }
    }

    #[test]
    fn errors_name_what_is_wrong_and_its_position() {
        let changed = |old: &str, new: &str| {
            message(String::from_utf8(text()).unwrap().replacen(old, new, 1).as_bytes())
        };
        assert_eq!(changed("vertex 0e0", "vertex a"), "a.stl: line 4: expected a coordinate, found 'a'");
        assert_eq!(changed("outer", "inner"), "a.stl: line 3: expected outer, found 'inner'");
        assert_eq!(
            changed("endsolid a thing\n", ""),
            "a.stl: line 29: expected facet or endsolid, found the end of the file"
        );
        assert_eq!(message(b"solid\nendsolid\n"), "a.stl: line 2: the file has no triangles");
        assert_eq!(
            message(b"ply\n"),
            "a.stl: line 1: this is no STL file: a text begins with 'solid', and a binary file is longer"
        );
        let mut short = binary();
        short[0] = b'-';
        short.pop();
        assert_eq!(
            message(&short),
            "a.stl: line 1: this is no STL file: a text begins with 'solid', and a binary file with 4 triangles has 284 \
             bytes, not 283"
        );
    }

    #[test]
    fn damaged_files_do_not_panic() {
        let mut random = XorShift(12);
        for bytes in [text(), binary()] {
            for _ in 0..1000 {
                let _ = parse(&random.damage(&bytes), Path::new("a.stl"));
            }
        }
    }
}
