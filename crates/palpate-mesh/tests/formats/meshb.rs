//! Binary MEDIT files: all versions in both byte orders against the text.

use crate::body::{body, refusal, tag, volume};
use crate::decks::medit;
use palpate_mesh::Mesh;

/// Numbers of a version and byte order.
struct Writer {
    version: i32,
    is_big: bool,
    bytes: Vec<u8>,
}

impl Writer {
    fn put(&mut self, mut little: Vec<u8>) {
        if self.is_big {
            little.reverse();
        }
        self.bytes.extend(little);
    }

    fn word(&mut self, number: i32) {
        self.put(number.to_le_bytes().to_vec());
    }

    fn integer(&mut self, number: i64) {
        if self.version == 4 { self.put(number.to_le_bytes().to_vec()) } else { self.word(number as i32) }
    }

    fn real(&mut self, number: f64) {
        if self.version == 1 {
            self.put((number as f32).to_le_bytes().to_vec());
        } else {
            self.put(number.to_le_bytes().to_vec());
        }
    }

    /// A keyword with the place after its content.
    fn section(&mut self, keyword: i32, content: impl Fn(&mut Self)) {
        let mut inner = Self { version: self.version, is_big: self.is_big, bytes: Vec::new() };
        content(&mut inner);
        let place_bytes = if self.version <= 2 { 4 } else { 8 };
        let next = self.bytes.len() + 4 + place_bytes + inner.bytes.len();
        self.word(keyword);
        if self.version <= 2 {
            self.word(next as i32)
        } else {
            self.put((next as i64).to_le_bytes().to_vec())
        }
        self.bytes.extend(inner.bytes);
    }
}

/// The file of [`medit`] in binary: group `low` is the reference of vertices there.
pub fn meshb(mesh: &Mesh, version: i32, is_big: bool) -> Vec<u8> {
    let mut w = Writer { version, is_big, bytes: Vec::new() };
    w.word(1);
    w.word(version);
    w.section(3, |w| w.word(3));
    // A keyword that is not read.
    w.section(20, |w| w.integer(7));
    w.section(4, |w| {
        w.integer(mesh.nodes.len() as i64);
        for (number, node) in (0..).zip(&mesh.nodes) {
            node.to_array().into_iter().for_each(|x| w.real(x));
            w.integer(i64::from(mesh.groups[0].nodes.contains(&number)));
        }
    });
    w.section(8, |w| {
        w.integer(mesh.tets.len() as i64);
        for (number, tet) in mesh.tets.iter().enumerate() {
            tet.iter().for_each(|&node| w.integer(i64::from(node) + 1));
            w.integer(tag(mesh, number));
        }
    });
    w.word(54);
    if version <= 2 {
        w.word(0)
    } else {
        w.put(vec![0; 8])
    }
    w.bytes
}

#[test]
fn every_version_and_byte_order_gives_the_mesh_of_the_text() {
    let expected = volume([("a.mesh", medit(&body()).into_bytes())]).mesh;
    for version in 1..=4 {
        for is_big in [false, true] {
            let file = volume([("a.meshb", meshb(&body(), version, is_big))]);
            assert_eq!(file.format, format!("MEDIT {version}, binary"));
            assert_eq!((&file.mesh.tets, &file.mesh.tet_regions), (&expected.tets, &expected.tet_regions));
            assert_eq!(file.mesh.regions, expected.regions);
            assert_eq!(file.mesh.groups[0].nodes, body().groups[0].nodes);
            let rounding = if version == 1 { 1e-8 } else { 0.0 };
            let near = |(a, b): (&glam::DVec3, &glam::DVec3)| (*a - *b).length() <= rounding;
            assert!(file.mesh.nodes.iter().zip(&expected.nodes).all(near));
        }
    }
}

#[test]
fn places_that_lead_back_and_counts_that_are_too_large_are_refused() {
    let good = meshb(&body(), 2, false);
    let mut back = good.clone();
    back[12..16].copy_from_slice(&8_i32.to_le_bytes());
    assert_eq!(refusal([("a.meshb", back)]), "a.meshb: byte 16: the next keyword is said to be at byte 8");
    // Version, dimension (12 bytes), one keyword (12), and the header of the vertices.
    let mut many = good.clone();
    many[40..44].copy_from_slice(&i32::MAX.to_le_bytes());
    assert!(
        refusal([("a.meshb", many)]).contains("the file states 2147483647 vertices, more than its remaining")
    );
    for end in 8..good.len() {
        // Cut at the end mark all has been read.
        let cut = crate::body::read([("a.meshb", good[..end].to_vec())]);
        assert!(cut.is_err() || end >= good.len() - 8, "{end}");
    }
}
