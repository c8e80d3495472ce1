//! One mesh in every version and encoding of Gmsh files, written by the tests.

use crate::{Mesh, NodeGroup, Region};
use glam::DVec3;

/// Node numbers, far apart and in no order.
pub(super) const NUMBERS: [u64; 5] = [10, 3, 70_000, 4, 11];
pub(super) const POSITIONS: [[f64; 3]; 5] =
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.25, -2.5e-3, 1.0], [1.0, 1.0, 1.5]];
/// Type, dimension, entity, physical tag, and positions in [`NUMBERS`].
pub(super) const ELEMENTS: [(i32, i32, i32, i32, &[usize]); 5] = [
    (15, 0, 1, 5, &[0]),
    (1, 1, 1, 0, &[0, 1]),
    (2, 2, 1, -1, &[2, 0, 1]),
    (4, 3, 1, 7, &[0, 1, 2, 3]),
    (4, 3, 2, 3, &[1, 2, 3, 4]),
];

pub(super) fn group(name: &str, nodes: &[u32]) -> NodeGroup {
    NodeGroup { name: name.to_owned(), nodes: nodes.to_vec() }
}

pub(super) fn region(tag: i64, name: Option<&str>) -> Region {
    Region { tag, name: name.map(str::to_owned), material: None }
}

/// Content of all variants of the file.
pub(super) fn expected() -> Mesh {
    Mesh {
        nodes: POSITIONS.map(DVec3::from).to_vec(),
        tets: vec![[0, 1, 2, 3], [1, 2, 3, 4]],
        tet_regions: vec![1, 0],
        regions: vec![region(3, Some("hard")), region(7, Some("soft part"))],
        groups: vec![
            group("5", &[0]),
            group("grip", &[0, 1, 2]),
            group("hard", &[1, 2, 3, 4]),
            group("soft part", &[0, 1, 2, 3]),
        ],
        ..Mesh::default()
    }
}

#[derive(Clone, Copy, PartialEq)]
pub(super) enum Encoding {
    Text,
    Little,
    Big,
}
use Encoding::{Big, Little, Text};

/// Versions of the file.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Msh {
    V2,
    V40,
    V41,
}

pub(super) const VARIANTS: [(Msh, Encoding); 9] = [
    (Msh::V2, Text),
    (Msh::V2, Little),
    (Msh::V2, Big),
    (Msh::V40, Text),
    (Msh::V40, Little),
    (Msh::V40, Big),
    (Msh::V41, Text),
    (Msh::V41, Little),
    (Msh::V41, Big),
];

/// Writes rows of numbers as text or binary.
pub(super) struct Writer {
    encoding: Encoding,
    bytes: Vec<u8>,
}

impl Writer {
    fn text(&mut self, text: &str) {
        self.bytes.extend(text.bytes());
    }

    fn put(&mut self, as_text: String, mut little_endian: Vec<u8>) {
        match self.encoding {
            Text => self.text(&format!("{as_text} ")),
            Little => self.bytes.extend(little_endian),
            Big => {
                little_endian.reverse();
                self.bytes.extend(little_endian);
            }
        }
    }

    fn ints(&mut self, numbers: &[i32]) {
        for number in numbers {
            self.put(number.to_string(), number.to_le_bytes().to_vec());
        }
    }

    fn sizes(&mut self, numbers: &[u64]) {
        for number in numbers {
            self.put(number.to_string(), number.to_le_bytes().to_vec());
        }
    }

    fn reals(&mut self, numbers: &[f64]) {
        for number in numbers {
            self.put(number.to_string(), number.to_le_bytes().to_vec());
        }
    }

    fn end_row(&mut self) {
        if self.encoding == Text {
            self.text("\n");
        }
    }

    /// Writes the entities of version 4, with boxes of so many numbers by their dimension.
    fn entities(&mut self, box_size: impl Fn(usize) -> usize) {
        self.text("$Entities\n");
        self.sizes(&[1, 1, 1, 2]);
        self.end_row();
        let entities: [(_, _, &[i32]); 5] =
            [(0, 1, &[5]), (1, 1, &[]), (2, 1, &[-1]), (3, 1, &[7]), (3, 2, &[3])];
        for (dimension, tag, physical) in entities {
            self.ints(&[tag]);
            self.reals(&[0.5; 6][..box_size(dimension)]);
            self.sizes(&[physical.len() as u64]);
            self.ints(physical);
            if dimension > 0 {
                self.sizes(&[2]);
                self.ints(&[1, -1]);
            }
            self.end_row();
        }
    }

    fn start(encoding: Encoding, version: &str) -> Self {
        let mut writer = Self { encoding, bytes: Vec::new() };
        let file_type = i32::from(encoding != Text);
        writer.text(&format!("$MeshFormat\n{version} {file_type} 8\n"));
        if encoding != Text {
            writer.ints(&[1]);
            writer.text("\n");
        }
        writer.text("$EndMeshFormat\n$Comments\n$Nodes of what\n$EndComments\n");
        writer.text("$PhysicalNames\n3\n2 1 \"grip\"\n3 3 \"hard\"\n3 7 \"soft part\"\n");
        writer.text("$EndPhysicalNames\n");
        writer
    }
}

/// The file in one of its variants.
pub(super) fn file(version: Msh, encoding: Encoding) -> Vec<u8> {
    match version {
        Msh::V2 => file_v2(encoding),
        Msh::V40 => file_v40(encoding),
        Msh::V41 => file_v4(encoding),
    }
}

/// Numbers of 32 bits, tags before dimensions, boxes of points too, and nodes with their numbers.
pub(super) fn file_v40(encoding: Encoding) -> Vec<u8> {
    let mut w = Writer::start(encoding, "4");
    w.entities(|_| 6);
    w.text("\n$EndEntities\n$Nodes\n");
    w.sizes(&[3, 5]);
    w.end_row();
    for (dimension, parametric, nodes) in [(3, 0, 0..2), (1, 0, 2..2), (2, 1, 2..5)] {
        w.ints(&[1, dimension, parametric]);
        w.sizes(&[nodes.len() as u64]);
        w.end_row();
        for node in nodes {
            w.ints(&[NUMBERS[node] as i32]);
            w.reals(&POSITIONS[node]);
            for _ in 0..parametric * dimension {
                w.reals(&[0.125]);
            }
            w.end_row();
        }
    }
    w.text("\n$EndNodes\n$Elements\n");
    w.sizes(&[5, 5]);
    w.end_row();
    for (number, (kind, dimension, entity, _, nodes)) in (1..).zip(ELEMENTS) {
        w.ints(&[entity, dimension, kind]);
        w.sizes(&[1]);
        w.end_row();
        w.ints(&[number]);
        nodes.iter().for_each(|&node| w.ints(&[NUMBERS[node] as i32]));
        w.end_row();
    }
    w.text("\n$EndElements\n$NodeData\n1 2 3 $EndNode\n$EndNodeData\n");
    w.bytes
}

pub(super) fn file_v2(encoding: Encoding) -> Vec<u8> {
    let mut w = Writer::start(encoding, "2.2");
    w.text("$Nodes\n5\n");
    for (number, position) in NUMBERS.iter().zip(POSITIONS) {
        w.ints(&[*number as i32]);
        w.reals(&position);
        w.end_row();
    }
    w.text("\n$EndNodes\n$Elements\n5\n");
    for (number, (kind, _, entity, physical, nodes)) in (1..).zip(ELEMENTS) {
        if encoding == Text {
            w.ints(&[number, kind, 2, physical, entity]);
        } else {
            w.ints(&[kind, 1, 2, number, physical, entity]);
        }
        for &node in nodes {
            w.ints(&[NUMBERS[node] as i32]);
        }
        w.end_row();
    }
    w.text("\n$EndElements\n$NodeData\n1 2 3 $EndNode\n$EndNodeData\n");
    w.bytes
}

pub(super) fn file_v4(encoding: Encoding) -> Vec<u8> {
    let mut w = Writer::start(encoding, "4.1");
    w.entities(|dimension| if dimension == 0 { 3 } else { 6 });
    w.text("\n$EndEntities\n$Nodes\n");
    w.sizes(&[3, 5, 3, 70_000]);
    w.end_row();
    // The block in the middle is empty, the last is parametric.
    for (dimension, parametric, nodes) in [(3, 0, 0..2), (1, 0, 2..2), (2, 1, 2..5)] {
        w.ints(&[dimension, 1, parametric]);
        w.sizes(&[nodes.len() as u64]);
        w.end_row();
        for node in nodes.clone() {
            w.sizes(&[NUMBERS[node]]);
            w.end_row();
        }
        for node in nodes {
            w.reals(&POSITIONS[node]);
            for _ in 0..parametric * dimension {
                w.reals(&[0.125]);
            }
            w.end_row();
        }
    }
    w.text("\n$EndNodes\n$Elements\n");
    w.sizes(&[5, 5, 1, 5]);
    w.end_row();
    for (number, (kind, dimension, entity, _, nodes)) in (1..).zip(ELEMENTS) {
        w.ints(&[dimension, entity, kind]);
        w.sizes(&[1]);
        w.end_row();
        w.sizes(&[number]);
        nodes.iter().for_each(|&node| w.sizes(&[NUMBERS[node]]));
        w.end_row();
    }
    w.text("\n$EndElements\n$NodeData\n1 2 3 $EndNode\n$EndNodeData\n");
    w.bytes
}
