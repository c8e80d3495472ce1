//! GLB files, read as the specification has them.

use glam::{DQuat, DVec3};
use serde_json::Value;

/// A file: its text, and the numbers that it tells of.
pub struct Glb {
    /// The JSON text.
    pub json: Value,
    numbers: Vec<u8>,
}

impl Glb {
    /// Read a file of two chunks, whose lengths must be those that it states.
    pub fn parse(bytes: &[u8]) -> Self {
        let number = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("4 bytes")) as usize;
        assert_eq!((&bytes[..4], number(4), number(8)), (&b"glTF"[..], 2, bytes.len()));
        let text = number(12);
        assert_eq!((&bytes[16..20], text % 4), (&b"JSON"[..], 0));
        let json = serde_json::from_slice(&bytes[20..20 + text]).expect("JSON");
        let numbers = &bytes[28 + text..];
        assert_eq!((number(20 + text), &bytes[24 + text..28 + text]), (numbers.len(), &b"BIN\0"[..]));
        Self { json, numbers: numbers.to_vec() }
    }

    /// A node by its name.
    pub fn node(&self, name: &str) -> (usize, &Value) {
        let nodes = self.json["nodes"].as_array().expect("nodes");
        let found = nodes.iter().enumerate().find(|(_, node)| node["name"] == name);
        found.unwrap_or_else(|| panic!("no node {name}"))
    }

    /// The primitive of a node's mesh.
    pub fn primitive(&self, name: &str) -> &Value {
        let mesh = self.node(name).1["mesh"].as_u64().expect("a mesh") as usize;
        &self.json["meshes"][mesh]["primitives"][0]
    }

    fn bytes(&self, accessor: &Value, components: usize) -> Vec<[u8; 4]> {
        let entry = &self.json["accessors"][accessor.as_u64().expect("an accessor") as usize];
        let number = |value: &Value| value.as_u64().expect("a number") as usize;
        let view = &self.json["bufferViews"][number(&entry["bufferView"])];
        let start = number(&view["byteOffset"]) + number(&entry["byteOffset"]);
        let length = 4 * components * number(&entry["count"]);
        assert!(number(&entry["byteOffset"]) + length <= number(&view["byteLength"]));
        let own = &self.numbers[start..start + length];
        own.chunks_exact(4).map(|four| four.try_into().expect("4 bytes")).collect()
    }

    /// Whole numbers.
    pub fn indices(&self, accessor: &Value) -> Vec<u32> {
        self.bytes(accessor, 1).into_iter().map(u32::from_le_bytes).collect()
    }

    /// Numbers, so many per entry.
    pub fn floats(&self, accessor: &Value, components: usize) -> Vec<f64> {
        let numbers = self.bytes(accessor, components).into_iter();
        numbers.map(|four| f64::from(f32::from_le_bytes(four))).collect()
    }

    /// Vectors; those of vertices must lie within the bounds that are stated.
    pub fn vectors(&self, accessor: &Value) -> Vec<DVec3> {
        let vectors: Vec<DVec3> = self.floats(accessor, 3).chunks_exact(3).map(DVec3::from_slice).collect();
        let entry = &self.json["accessors"][accessor.as_u64().expect("an accessor") as usize];
        if let (Some(min), Some(max)) = (entry["min"].as_array(), entry["max"].as_array()) {
            for axis in 0..3 {
                let along = vectors.iter().map(|v| v[axis]);
                let (low, high) = along.fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(x), b.max(x)));
                assert_eq!((min[axis].as_f64(), max[axis].as_f64()), (Some(low), Some(high)));
            }
        }
        vectors
    }

    /// A vector or a turn of a node.
    pub fn property<const N: usize>(&self, node: &str, name: &str) -> [f64; N] {
        let numbers = self.node(node).1[name].as_array().expect("an array");
        std::array::from_fn(|at| numbers[at].as_f64().expect("a number"))
    }

    /// Times and values of the first animation's channel, if there is one.
    pub fn channel(&self, node: &str, path: &str, components: usize) -> Option<(Vec<f64>, Vec<f64>)> {
        let animation = &self.json["animations"][0];
        let (node, _) = self.node(node);
        let mut channels = animation["channels"].as_array()?.iter();
        let channel = channels.find(|c| c["target"]["node"] == node && c["target"]["path"] == path)?;
        let sampler = &animation["samplers"][channel["sampler"].as_u64()? as usize];
        assert_eq!(sampler["interpolation"], "LINEAR");
        Some((self.floats(&sampler["input"], 1), self.floats(&sampler["output"], components)))
    }

    /// Where a node is at a frame, below the root.
    pub fn place(&self, node: &str, frame: usize) -> (DVec3, DQuat) {
        let position = match self.channel(node, "translation", 3) {
            Some((_, values)) => DVec3::from_slice(&values[3 * frame..]),
            None => DVec3::from_array(self.property(node, "translation")),
        };
        let turn = match self.channel(node, "rotation", 4) {
            Some((_, values)) => DQuat::from_slice(&values[4 * frame..]),
            None => DQuat::from_array(self.property(node, "rotation")),
        };
        (position, turn)
    }

    /// Vertices of a node's mesh, in its own frame, with weights of its targets.
    pub fn vertices(&self, node: &str, attribute: &str, weights: &[f64]) -> Vec<DVec3> {
        let primitive = self.primitive(node);
        let mut vertices = self.vectors(&primitive["attributes"][attribute]);
        let targets = primitive["targets"].as_array().map_or(&[][..], Vec::as_slice);
        assert_eq!(targets.len(), weights.len());
        for (target, weight) in targets.iter().zip(weights).filter(|(_, weight)| **weight != 0.0) {
            for (vertex, moved) in vertices.iter_mut().zip(self.vectors(&target[attribute])) {
                *vertex += *weight * moved;
            }
        }
        vertices
    }
}
