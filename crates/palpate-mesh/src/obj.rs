//! Wavefront OBJ files (`.obj`): vertices and faces, for surfaces.
//!
//! Faces with more than three corners become a triangle fan from their first. Other statements than `v` and `f` are skipped:
//! objects and groups of a file make one surface.
//!
//! Reference: Wavefront, Object Files, version 3.0 (Appendix B1 of the Advanced Visualizer manual).

use super::error::MeshError;
use super::scan::{Scanner, quoted};
use super::surface_mesh::SurfaceMesh;
use glam::DVec3;
use std::path::Path;

/// Reads the bytes of an OBJ file; `path` is for messages.
pub(crate) fn parse(bytes: &[u8], path: &Path) -> Result<SurfaceMesh, MeshError> {
    let mut scan = Scanner::new(bytes, path);
    let mut mesh = SurfaceMesh::default();
    // The highest vertex number in a face, and its position; a face may come before its vertices.
    let mut highest = (0, 0);
    loop {
        match scan.word() {
            b"" => break,
            b"v" => {
                let mut coordinate = || scan.text_number("a coordinate");
                mesh.positions.push(DVec3::new(coordinate()?, coordinate()?, coordinate()?));
            }
            b"f" => {
                let corners = read_face(&mut scan, mesh.positions.len(), &mut highest)?;
                mesh.push_polygon(&corners);
            }
            _ => {}
        }
        scan.rest_of_line();
    }
    let (number, position) = highest;
    if number as usize > mesh.positions.len() {
        let count = mesh.positions.len();
        return Err(
            scan.error_at(position, format!("the face names vertex {number}, and the file has {count}"))
        );
    }
    if mesh.triangles.is_empty() {
        return scan.fail("the file has no faces");
    }
    Ok(mesh)
}

/// The corners of a face, counted from 0, up to the end of the line.
fn read_face(scan: &mut Scanner, vertices: usize, highest: &mut (u32, usize)) -> Result<Vec<u32>, MeshError> {
    let mut corners = Vec::new();
    let face = scan.token_start();
    while !scan.is_end_of_line() {
        let word = scan.word_in_line();
        if word.starts_with(b"#") {
            break;
        }
        if word == b"\\" {
            // The face continues in the next line.
            scan.rest_of_line();
            continue;
        }
        // vertex/texture/normal
        let first = word.split(|&byte| byte == b'/').next().unwrap_or_default();
        let number = std::str::from_utf8(first).ok().and_then(|text| text.parse::<i64>().ok());
        let number = match number {
            Some(number) if number > 0 => u32::try_from(number).ok(),
            // Counted back from the last.
            Some(number) if number < 0 => u32::try_from(vertices as i64 + 1 + number).ok().filter(|n| *n > 0),
            _ => None,
        };
        let Some(number) = number else {
            return scan.fail(format!("expected a vertex of the face, found {}", quoted(word)));
        };
        if number > highest.0 {
            *highest = (number, scan.token_start());
        }
        corners.push(number - 1);
    }
    if corners.len() < 3 {
        return Err(
            scan.error_at(face, format!("the face has {} corners, expected three or more", corners.len()))
        );
    }
    Ok(corners)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::scan::tests::XorShift;

    const TETRAHEDRON: &str = "# four corners\no thing\nv 0 0 0\nv 1 0 0 1.0\nv 0 1 0\nvn 0 0 1\nf 1/1/1 3//1 2\n\
                               v 0 0 1\nf 1 2 -1\nf 2 3 \\\n 4\nf -4 4 3 # the last\n";

    fn message(text: &str) -> String {
        parse(text.as_bytes(), Path::new("a.obj")).err().map(|error| error.to_string()).unwrap_or_default()
    }

    #[test]
    fn faces_are_read_in_all_spellings() {
        let mesh = parse(TETRAHEDRON.as_bytes(), Path::new("a.obj")).unwrap();
        assert_eq!(mesh.positions, [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z]);
        assert_eq!(mesh.triangles, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]);
        assert!((mesh.volume() - 1.0 / 6.0).abs() < 1e-15);
        let square = parse(b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n", Path::new("a.obj")).unwrap();
        assert_eq!(square.triangles, [[0, 1, 2], [0, 2, 3]]);
    }

    #[test]
    fn what_is_wrong_is_named_with_its_line() {
        assert_eq!(message("v 0 0 0\n"), "a.obj: line 1: the file has no faces");
        assert_eq!(message("v 0 0 x\n"), "a.obj: line 1: expected a coordinate, found 'x'");
        assert_eq!(message("v 0 0\n"), "a.obj: line 1: expected a coordinate, found the end of the line");
        assert_eq!(
            message("v 0 0 0\nf 1 1\n"),
            "a.obj: line 2: the face has 2 corners, expected three or more"
        );
        for word in ["0", "-2", "a"] {
            let error = format!("a.obj: line 2: expected a vertex of the face, found '{word}'");
            assert_eq!(message(&format!("v 0 0 0\nf 1 1 {word}\n")), error);
        }
        assert_eq!(
            message("v 0 0 0\nf 1 2 1\n"),
            "a.obj: line 2: the face names vertex 2, and the file has 1"
        );
    }

    #[test]
    fn damaged_files_do_not_panic() {
        let mut random = XorShift(11);
        for _ in 0..2000 {
            let _ = parse(&random.damage(TETRAHEDRON.as_bytes()), Path::new("a.obj"));
        }
    }
}
