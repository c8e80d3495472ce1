//! glTF surfaces: encodings, transforms, kinds of primitives, and what is refused.

use crate::body::{read, refusal, surface};
use glam::{DMat4, DQuat, DVec3};
use palpate_mesh::{SurfaceMesh, ball_mesh};

/// Vertices of a tetrahedron, and its triangles seen from outside.
const POINTS: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
const CORNERS: [u8; 12] = [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3];

fn buffer(points: &[[f32; 3]], corners: &[u8]) -> Vec<u8> {
    let mut bytes: Vec<u8> = points.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    bytes.extend(corners);
    bytes
}

/// Document of one mesh with these nodes; `buffer` is the entry of the buffer.
fn document(nodes: &str, buffer: &str, corners: usize, mode: u32) -> String {
    format!(
        r#"{{"asset": {{"version": "2.0"}}, "scene": 0, "scenes": [{{"nodes": [0]}}], "nodes": [{nodes}],
"meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0, "NORMAL": 7}}, "indices": 1, "mode": {mode}}},
  {{"attributes": {{"POSITION": 0}}, "mode": 1}}]}}],
"accessors": [{{"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"}},
  {{"bufferView": 0, "byteOffset": 48, "componentType": 5121, "count": {corners}, "type": "SCALAR"}}],
"bufferViews": [{{"buffer": 0, "byteLength": {}}}], "buffers": [{buffer}]}}"#,
        48 + corners
    )
}

fn glb(json: &str, bin: &[u8]) -> Vec<u8> {
    let mut json = json.as_bytes().to_vec();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut bin = bin.to_vec();
    bin.resize(bin.len().next_multiple_of(4), 0);
    let mut bytes = b"glTF\x02\0\0\0".to_vec();
    bytes.extend((28 + json.len() as u32 + bin.len() as u32).to_le_bytes());
    for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &bin)] {
        bytes.extend((chunk.len() as u32).to_le_bytes());
        bytes.extend(kind);
        bytes.extend(chunk);
    }
    bytes
}

/// A tetrahedron of side 1 at a corner, under two nodes.
pub fn tetrahedron() -> Vec<u8> {
    let nodes = r#"{"children": [1], "scale": [2, 2, 2]}, {"mesh": 0, "translation": [0, 0, 1]}"#;
    glb(&document(nodes, r#"{"byteLength": 60}"#, 12, 4), &buffer(&POINTS, &CORNERS))
}

fn one(nodes: &str) -> SurfaceMesh {
    let bytes = glb(&document(nodes, r#"{"byteLength": 60}"#, 12, 4), &buffer(&POINTS, &CORNERS));
    surface("a.glb", bytes).mesh
}

#[test]
fn every_encoding_gives_the_same_surface() {
    let bin = buffer(&POINTS, &CORNERS);
    let expected = one(r#"{"mesh": 0}"#);
    assert_eq!((expected.positions.len(), expected.triangles.len()), (4, 4));
    assert!((expected.volume() - 1.0 / 6.0).abs() < 1e-15);
    // The buffer in the document, and in a file below.
    let mut text = String::new();
    for three in bin.chunks(3) {
        let n = three.iter().fold(0_u32, |n, byte| n << 8 | u32::from(*byte));
        let letters = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
        (0..4).rev().for_each(|k| text.push(letters[(n >> (6 * k) & 63) as usize] as char));
    }
    let inside = document(
        r#"{"mesh": 0}"#,
        &format!(r#"{{"uri": "data:application/octet-stream;base64,{text}"}}"#),
        12,
        4,
    );
    let file = surface("a.gltf", inside.into_bytes());
    assert_eq!((file.format.as_str(), &file.mesh), ("glTF 2.0, text", &expected));
    let beside = document(r#"{"mesh": 0}"#, r#"{"uri": "parts/the%20data.bin"}"#, 12, 4);
    let found = read([("a.gltf", beside.into_bytes()), ("parts/the data.bin", bin)]).expect("a surface");
    let palpate_mesh::MeshFile::Surface(found) = found else { panic!("solids") };
    assert_eq!(found.mesh, expected);
}

#[test]
fn transforms_of_nodes_are_applied_from_the_root_on() {
    // A child turned about z within a parent that is scaled and moved: by glam's matrices.
    let (half, parent) = (0.5_f64.sqrt(), DVec3::new(1.0, 2.0, 3.0));
    let nodes = format!(
        r#"{{"children": [1], "translation": [1, 2, 3], "scale": [2, 2, 2]}}, {{"mesh": 0, "rotation": [0, 0, {half}, {half}], "translation": [0, 0, 1]}}"#
    );
    let found = one(&nodes);
    let world = DMat4::from_translation(parent)
        * DMat4::from_scale(DVec3::splat(2.0))
        * DMat4::from_translation(DVec3::Z)
        * DMat4::from_quat(DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2));
    for (found, point) in found.positions.iter().zip(POINTS) {
        let exact = world.transform_point3(DVec3::from(point.map(f64::from)));
        assert!((*found - exact).length() < 1e-15, "{found} {exact}");
    }
    assert!((found.volume() - 8.0 / 6.0).abs() < 1e-14);
    // By hand: (1, 0, 0) turns to (0, 1, 0), goes up by 1, doubles and moves.
    assert!((found.positions[1] - DVec3::new(1.0, 4.0, 5.0)).length() < 1e-15);
    // A mirror turns the triangles, so that they face outwards.
    let mirrored = one(r#"{"mesh": 0, "matrix": [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 3, 0, 0, 0, 0, 1]}"#);
    assert!((mirrored.volume() - 0.5).abs() < 1e-15);
}

#[test]
fn strips_and_fans_are_triangles() {
    let strip = [0, 1, 2, 3, 0, 1];
    let of = |corners: &[u8], mode: u32| {
        let json = document(r#"{"mesh": 0}"#, r#"{"byteLength": 60}"#, corners.len(), mode);
        surface("a.glb", glb(&json, &buffer(&POINTS, corners))).mesh.triangles
    };
    assert_eq!(of(&strip, 5), [[0, 1, 2], [2, 1, 3], [2, 3, 0], [0, 3, 1]]);
    assert_eq!(of(&[0, 1, 2, 3, 1], 6), [[0, 1, 2], [0, 2, 3], [0, 3, 1]]);
}

#[test]
fn a_ball_is_filled() {
    let ball = SurfaceMesh::from_boundary(ball_mesh(0.05, 6).expect("a ball")).expect("a surface");
    let bin: Vec<u8> = ball
        .positions
        .iter()
        .flat_map(|p| p.to_array())
        .flat_map(|x| (x as f32).to_le_bytes())
        .chain(ball.triangles.iter().flatten().flat_map(|node| (*node as u16).to_le_bytes()))
        .collect();
    let json = format!(
        r#"{{"asset": {{"version": "2.0"}}, "nodes": [{{"mesh": 0}}], "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}, "indices": 1}}]}}],
"accessors": [{{"bufferView": 0, "componentType": 5126, "count": {}, "type": "VEC3"}}, {{"bufferView": 1, "componentType": 5123, "count": {}, "type": "SCALAR"}}],
"bufferViews": [{{"buffer": 0, "byteLength": {at}}}, {{"buffer": 0, "byteOffset": {at}, "byteLength": {}}}], "buffers": [{{}}]}}"#,
        ball.positions.len(),
        3 * ball.triangles.len(),
        6 * ball.triangles.len(),
        at = 12 * ball.positions.len()
    );
    let found = surface("ball.glb", glb(&json, &bin)).mesh;
    assert_eq!(found.triangles, ball.triangles);
    assert!((found.volume() / ball.volume() - 1.0).abs() < 1e-6);
}

#[test]
fn what_is_wrong_is_named() {
    let bin = buffer(&POINTS, &CORNERS);
    let good = document(r#"{"mesh": 0}"#, r#"{"byteLength": 60}"#, 12, 4);
    for (from, to, expected) in [
        (
            r#""version": "2.0""#,
            r#""version": "1.0""#,
            "glTF version '1.0' cannot be read, only 2: export it anew",
        ),
        ("\"count\": 12", "\"count\": 13", "accessor 1 reaches beyond its buffer"),
        ("\"count\": 4", "\"count\": 3", "accessor 1 names a vertex beyond the 3 of its mesh"),
        ("\"count\": 4", "\"count\": 18446744073709551615", "accessor 0 reaches beyond its buffer"),
        ("\"nodes\": [0]", "\"nodes\": [0, 0]", "node 0 has two parents"),
        (r#"{"mesh": 0}"#, r#"{"mesh": 0, "children": [0]}"#, "node 0 has two parents"),
        (r#"{"mesh": 0}"#, r#"{"mesh": 4}"#, "mesh 4 does not exist"),
        (
            r#"{"mesh": 0}"#,
            r#"{"mesh": 0, "skin": 0}"#,
            "node 0 is posed by a skeleton: apply the pose, and export it without",
        ),
        (r#"{"mesh": 0}"#, "{}", "the scene has no triangles"),
        (
            r#""scene": 0"#,
            r#""extensionsRequired": ["KHR_draco_mesh_compression"]"#,
            "the geometry is packed by KHR_draco_mesh_compression: export it without compression",
        ),
    ] {
        assert!(good.contains(from), "{from}");
        let error = refusal([("a.glb", glb(&good.replacen(from, to, 1), &bin))]);
        assert_eq!(error, format!("a.glb: byte 0: {expected}"));
    }
    let outside = document(r#"{"mesh": 0}"#, r#"{"uri": "../secret.bin"}"#, 12, 4).into_bytes();
    let error = refusal([("a.gltf", outside), ("../secret.bin", bin)]);
    assert_eq!(
        error,
        "a.gltf: line 1: buffer 0 is '../secret.bin', expected a file beside this one or below"
    );
    assert!(
        refusal([("a.json", b"{\n\"a\": 1}\n".to_vec())])
            .starts_with("a.json: line 2: the JSON is no glTF document: missing field `asset`")
    );
}
