//! OFF files (`.off`), for surfaces: counts, a row per vertex, a row per face.
//!
//! ```text
//! OFF   vertices faces edges
//! x y z            colours, normals and textures behind are skipped
//! n i1 … in        polygons become a fan from their first corner
//! ```
//!
//! Reference: Geomview manual, OFF files, <http://www.geomview.org/docs/html/OFF.html>.

use crate::error::MeshError;
use crate::rows::{Rows, Words};
use crate::surface_mesh::SurfaceMesh;
use glam::DVec3;
use std::path::Path;

/// Headers of files in three dimensions; the letters are for textures, colours and normals.
const HEADERS: &[&[u8]] = &[b"OFF", b"STOFF", b"COFF", b"NOFF", b"CNOFF", b"STCOFF", b"STNOFF", b"STCNOFF"];

/// Whether a file that begins with this word is an OFF file.
pub(crate) fn is_header(word: &[u8]) -> bool {
    HEADERS.iter().any(|header| word.eq_ignore_ascii_case(header))
}

/// Reads the bytes of an OFF file; `path` is for messages.
pub(crate) fn parse(bytes: &[u8], path: &Path) -> Result<SurfaceMesh, MeshError> {
    let mut rows = Rows::new(bytes, path, "#");
    let mut words = rows.words("OFF")?;
    if !words.next().is_some_and(is_header) {
        return rows.scan.fail("expected OFF, which an OFF file begins with");
    }
    if words.clone().next().is_some_and(|word| word == b"BINARY") {
        return rows.scan.fail("binary OFF files cannot be read: save as text, or as .stl or .ply");
    }
    if words.clone().next().is_none() {
        words = rows.words("the number of vertices")?;
    }
    let vertices = rows.number(&mut words, "the number of vertices")?;
    let faces = rows.number(&mut words, "the number of faces")?;
    let vertices = rows.scan.count(vertices, 6, "vertices")?;
    let mut mesh = SurfaceMesh::default();
    mesh.positions.reserve(vertices);
    for _ in 0..vertices {
        let mut words = rows.words("a vertex")?;
        let mut coordinate = || rows.number(&mut words, "a coordinate");
        mesh.positions.push(DVec3::new(coordinate()?, coordinate()?, coordinate()?));
    }
    for _ in 0..rows.scan.count(faces, 2, "faces")? {
        let mut words = rows.words("a face")?;
        read_face(&rows, &mut words, &mut mesh)?;
    }
    if mesh.triangles.is_empty() {
        return rows.scan.fail("the file has no faces");
    }
    Ok(mesh)
}

fn read_face<'a>(rows: &Rows<'a>, words: &mut Words<'a>, mesh: &mut SurfaceMesh) -> Result<(), MeshError> {
    let corners: u64 = rows.number(words, "the number of corners of a face")?;
    let mut fan = Vec::new();
    for _ in 0..corners {
        let corner: u64 = rows.number(words, "a corner of a face")?;
        fan.push(mesh.known_vertex(corner).ok_or_else(|| {
            let count = mesh.positions.len();
            rows.scan.error(format!("a face has vertex {corner}, and the file has {count}"))
        })?);
    }
    mesh.push_polygon(&fan);
    Ok(())
}
