//! PLY and OFF, and surfaces by their content; STL and OBJ have their own tests.

use crate::body::{refusal, surface};
use glam::DVec3;
use palpate_mesh::SurfaceMesh;

const CORNERS: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.25]];
const FACES: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];

/// The tetrahedron as PLY; in text with `None`.
pub fn ply(is_big_endian: Option<bool>) -> Vec<u8> {
    let kind = match is_big_endian {
        None => "ascii",
        Some(false) => "binary_little_endian",
        Some(true) => "binary_big_endian",
    };
    let mut bytes = format!(
        "ply\nformat {kind} 1.0\ncomment by hand\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n\
         element face 4\nproperty list uchar int vertex_indices\nproperty float quality\nend_header\n"
    )
    .into_bytes();
    let ordered = |little: [u8; 4]| {
        let mut bytes = little;
        if is_big_endian == Some(true) {
            bytes.reverse();
        }
        bytes
    };
    if is_big_endian.is_none() {
        CORNERS.iter().for_each(|[x, y, z]| bytes.extend(format!("{x} {y} {z} 255\n").bytes()));
        FACES.iter().for_each(|[a, b, c]| bytes.extend(format!("3 {a} {b} {c} 0.5\n").bytes()));
        return bytes;
    }
    for corner in CORNERS {
        corner.iter().for_each(|x| bytes.extend(ordered(x.to_le_bytes())));
        bytes.push(255);
    }
    for face in FACES {
        bytes.push(3);
        face.iter().for_each(|node| bytes.extend(ordered(node.to_le_bytes())));
        bytes.extend(ordered(0.5_f32.to_le_bytes()));
    }
    bytes
}

pub fn off() -> Vec<u8> {
    let mut text = "# by hand\nCOFF\n4 4 6\n".to_owned();
    CORNERS.iter().for_each(|[x, y, z]| text += &format!("{x} {y} {z} 1 0 0 1\n"));
    FACES.iter().for_each(|[a, b, c]| text += &format!("3 {a} {b} {c} # one\n"));
    text.into_bytes()
}

fn expected() -> SurfaceMesh {
    let positions = CORNERS.map(|corner| DVec3::from_array(corner.map(f64::from))).to_vec();
    SurfaceMesh { positions, triangles: FACES.to_vec() }
}

#[test]
fn ply_and_off_are_read_under_any_name() {
    for (bytes, format) in [
        (ply(None), "PLY, text"),
        (ply(Some(false)), "PLY, binary"),
        (ply(Some(true)), "PLY, binary, big-endian"),
        (off(), "OFF"),
    ] {
        let file = surface("thing.stl", bytes);
        assert_eq!((file.format.as_str(), file.mesh), (format, expected()));
    }
    let one_line = String::from_utf8(off()).expect("text").replace("COFF\n", "OFF ");
    assert_eq!(surface("a.off", one_line.into_bytes()).mesh, expected());
    let square = "OFF\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";
    assert_eq!(surface("a.off", square.into()).mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
}

#[test]
fn errors_name_what_is_wrong_and_its_place() {
    let text = String::from_utf8(ply(None)).expect("text");
    for (from, to, expected) in [
        ("3 1 2 3", "3 1 2 4", "line 19: a face has vertex 4, and the file has 4"),
        ("3 1 2 3", "3 1 2 -3", "line 19: expected a corner of a face, found -3"),
        (
            "vertex 4",
            "vertex 1152921504606846976",
            "line 12: the file states 1152921504606846976 elements 'vertex', more than its remaining 91 bytes can hold",
        ),
        ("float x", "half x", "line 5: expected a type such as float, found 'half'"),
        (
            "format ascii",
            "format zip",
            "line 2: expected ascii, binary_little_endian or binary_big_endian, found 'zip'",
        ),
        ("1 0 0 255", "1 red 0 255", "line 14: expected a property, found 'red'"),
        (
            "3 0 2 1",
            "99 0 2 1",
            "line 17: the file states 99 numbers of a list, more than its remaining 47 bytes can hold",
        ),
    ] {
        let changed = text.replacen(from, to, 1);
        assert_ne!(changed, text);
        assert_eq!(refusal([("a.ply", changed.into_bytes())]), format!("a.ply: {expected}"));
    }
    let mut cut = ply(Some(true));
    cut.pop();
    let length = cut.len();
    assert_eq!(
        refusal([("a.ply", cut)]),
        format!("a.ply: byte {}: expected a property, found the end of the file", length - 3)
    );
    let text = String::from_utf8(off()).expect("text");
    for (from, to, expected) in [
        ("3 1 2 3", "3 1 2 4", "line 10: a face has vertex 4, and the file has 4"),
        ("4 4 6", "4 5 6", "line 11: expected a face, found the end of the file"),
        (
            "4 4 6",
            "99999 4 6",
            "line 3: the file states 99999 vertices, more than its remaining 115 bytes can hold",
        ),
        ("COFF", "OFF BINARY", "line 2: binary OFF files cannot be read: save as text, or as .stl or .ply"),
    ] {
        let changed = text.replacen(from, to, 1);
        assert_ne!(changed, text);
        assert_eq!(refusal([("a.off", changed.into_bytes())]), format!("a.off: {expected}"));
    }
}
