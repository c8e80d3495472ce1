//! glTF 2.0 in one binary file (GLB): JSON, then the binary buffer that it describes.
//!
//! The JSON comes first in the file and is known last, so vertex data is buffered in an unnamed file beside the output.
//! Reference: glTF 2.0 specification, chapters 3 (JSON) and 4 (GLB).

use crate::atomic_file::AtomicFile;
use crate::error::ExportError;
use glam::DVec3;
use serde_json::{Value, json};
use std::fs::File;
use std::io::{BufWriter, Read, Seek, Write};
use std::path::{Path, PathBuf};

/// Indices of the buffer views.
const VERTICES: usize = 0;
const INDICES: usize = 1;
const KEYS: usize = 2;

/// Component types and buffer targets of the specification.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const VERTEX_ATTRIBUTES: u32 = 34962;
const TRIANGLE_CORNERS: u32 = 34963;

/// Writer of a GLB file.
pub struct Glb {
    file: AtomicFile,
    vertices: BufWriter<File>,
    vertex_bytes: u64,
    indices: Vec<u8>,
    keys: Vec<u8>,
    accessors: Vec<Value>,
    /// JSON content other than buffers and accessors.
    pub content: Content,
}

/// JSON content of the file; entries refer to one another by index.
#[derive(Default)]
pub struct Content {
    /// `asset.extras`.
    pub extras: Value,
    /// Nodes; the first is the root.
    pub nodes: Vec<Value>,
    /// Meshes.
    pub meshes: Vec<Value>,
    /// Materials.
    pub materials: Vec<Value>,
    /// Animations.
    pub animations: Vec<Value>,
}

/// Checks a file length [bytes] against the 32 bits of the format.
///
/// # Errors
/// [`ExportError::GlbTooLarge`].
pub fn check_glb_size(bytes: u64, path: &Path) -> Result<(), ExportError> {
    if bytes <= u64::from(u32::MAX) {
        return Ok(());
    }
    Err(ExportError::GlbTooLarge { path: path.to_path_buf(), bytes })
}

impl Glb {
    /// Creates the file.
    ///
    /// # Errors
    /// As [`AtomicFile::create`].
    pub fn new(path: &Path, inputs: &[PathBuf]) -> Result<Self, ExportError> {
        let inputs: Vec<&Path> = inputs.iter().map(PathBuf::as_path).collect();
        let file = AtomicFile::create(path, &inputs)?;
        let folder = file.path().parent().filter(|folder| !folder.as_os_str().is_empty());
        let vertices = tempfile::tempfile_in(folder.unwrap_or(Path::new(".")))
            .map_err(|e| ExportError::io("write", file.path(), e))?;
        Ok(Self {
            file,
            vertices: BufWriter::new(vertices),
            vertex_bytes: 0,
            indices: Vec::new(),
            keys: Vec::new(),
            accessors: Vec::new(),
            content: Content::default(),
        })
    }

    /// Adds a vector per vertex; returns the accessor.
    ///
    /// # Errors
    /// When the system refuses, or the file becomes too large.
    pub fn vectors(&mut self, vectors: impl IntoIterator<Item = DVec3>) -> Result<usize, ExportError> {
        let start = self.vertex_bytes;
        let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        for vector in vectors {
            let numbers = vector.to_array().map(|v| v as f32);
            low = std::array::from_fn(|axis| low[axis].min(numbers[axis]));
            high = std::array::from_fn(|axis| high[axis].max(numbers[axis]));
            for number in numbers {
                let written = self.vertices.write_all(&number.to_le_bytes());
                written.map_err(|e| ExportError::io("write", self.file.path(), e))?;
            }
            self.vertex_bytes += 12;
        }
        check_glb_size(self.vertex_bytes, self.file.path())?;
        // The conversion to f64 is exact.
        Ok(self.accessor(json!({
            "bufferView": VERTICES, "byteOffset": start, "componentType": FLOAT, "type": "VEC3",
            "count": (self.vertex_bytes - start) / 12, "min": low.map(f64::from), "max": high.map(f64::from),
        })))
    }

    /// Adds triangles; returns the accessor.
    pub fn triangles(&mut self, triangles: &[[u32; 3]]) -> usize {
        let start = self.indices.len();
        self.indices.extend(triangles.iter().flatten().flat_map(|n| n.to_le_bytes()));
        self.accessor(json!({
            "bufferView": INDICES, "byteOffset": start, "componentType": UNSIGNED_INT, "type": "SCALAR",
            "count": 3 * triangles.len(),
        }))
    }

    /// Adds key times of an animation, ascending [s]; returns the accessor.
    pub fn times(&mut self, times: &[f64]) -> usize {
        let ends = |at: Option<&f64>| at.map_or(0.0, |t| f64::from(*t as f32));
        let (first, last) = (ends(times.first()), ends(times.last()));
        let accessor = self.values(times.iter().map(|t| *t as f32), "SCALAR", 1);
        self.accessors[accessor]["min"] = json!([first]);
        self.accessors[accessor]["max"] = json!([last]);
        accessor
    }

    /// Adds key values of an animation: `SCALAR`, `VEC3` or `VEC4`, of `components` numbers; returns the accessor.
    pub fn values(&mut self, values: impl Iterator<Item = f32>, kind: &str, components: usize) -> usize {
        let start = self.keys.len();
        self.keys.extend(values.flat_map(|v| v.to_le_bytes()));
        let count = (self.keys.len() - start) / (4 * components);
        self.accessor(json!({
            "bufferView": KEYS, "byteOffset": start, "componentType": FLOAT, "type": kind, "count": count,
        }))
    }

    fn accessor(&mut self, accessor: Value) -> usize {
        self.accessors.push(accessor);
        self.accessors.len() - 1
    }

    /// Assembles the file and renames it to its final path; returns it.
    ///
    /// # Errors
    /// When the system refuses, or the file is too large.
    pub fn finish(mut self) -> Result<PathBuf, ExportError> {
        let [vertices, indices, keys] =
            [self.vertex_bytes, self.indices.len() as u64, self.keys.len() as u64];
        let mut views = vec![
            json!({ "buffer": 0, "byteOffset": 0, "byteLength": vertices, "byteStride": 12, "target": VERTEX_ATTRIBUTES }),
            json!({ "buffer": 0, "byteOffset": vertices, "byteLength": indices, "target": TRIANGLE_CORNERS }),
        ];
        if keys > 0 {
            views.push(json!({ "buffer": 0, "byteOffset": vertices + indices, "byteLength": keys }));
        }
        let binary = vertices + indices + keys;
        let text = self.text(&views, binary);
        let mut text = serde_json::to_vec(&text)?;
        // Chunks are aligned to 4 bytes; JSON is padded with blanks.
        text.resize(text.len().next_multiple_of(4), b' ');
        let whole = 12 + 8 + text.len() as u64 + 8 + binary;
        check_glb_size(whole, self.file.path())?;
        let length = |bytes: u64| (bytes as u32).to_le_bytes();
        let head = [*b"glTF", 2_u32.to_le_bytes(), length(whole), length(text.len() as u64), *b"JSON"];
        self.file.write(&head.concat())?;
        self.file.write(&text)?;
        self.file.write(&[length(binary), *b"BIN\0"].concat())?;
        let failed = |e: std::io::Error| ExportError::io("write", self.file.path(), e);
        let mut numbers = self.vertices.into_inner().map_err(|e| failed(e.into_error()))?;
        numbers.rewind().map_err(failed)?;
        let mut block = vec![0; 1 << 20];
        loop {
            let read = numbers.read(&mut block).map_err(|e| ExportError::io("write", self.file.path(), e))?;
            if read == 0 {
                break;
            }
            self.file.write(&block[..read])?;
        }
        self.file.write(&self.indices)?;
        self.file.write(&self.keys)?;
        self.file.finish()
    }

    fn text(&mut self, views: &[Value], binary: u64) -> Value {
        let Content { extras, nodes, meshes, materials, animations } = std::mem::take(&mut self.content);
        let generator = format!("palpate {}", env!("CARGO_PKG_VERSION"));
        let mut text = json!({
            "asset": { "version": "2.0", "generator": generator, "extras": extras },
            "scene": 0,
            "scenes": [{ "nodes": [0] }],
            "nodes": nodes,
            "meshes": meshes,
            "materials": materials,
            "buffers": [{ "byteLength": binary }],
            "bufferViews": views,
            "accessors": std::mem::take(&mut self.accessors),
        });
        // Empty lists are not allowed.
        if !animations.is_empty() {
            text["animations"] = Value::Array(animations);
        }
        text
    }
}

impl Content {
    /// Adds a child of the root; returns its index.
    pub fn child(&mut self, node: Value) -> usize {
        self.nodes.push(node);
        let index = self.nodes.len() - 1;
        if let Some(children) = self.nodes[0]["children"].as_array_mut() {
            children.push(json!(index));
        }
        index
    }

    /// Adds a mesh; returns its index.
    pub fn mesh(&mut self, mesh: Value) -> usize {
        self.meshes.push(mesh);
        self.meshes.len() - 1
    }

    /// Adds a matte material; returns its index.
    pub fn material(&mut self, name: &str, colour: [f32; 3], two_sided: bool) -> usize {
        let [r, g, b] = colour.map(f64::from);
        self.materials.push(json!({
            "name": name,
            "pbrMetallicRoughness": {
                "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.7,
            },
            "doubleSided": two_sided,
        }));
        self.materials.len() - 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_length_beyond_32_bits_is_refused() {
        let path = Path::new("run.glb");
        assert!(check_glb_size(u64::from(u32::MAX), path).is_ok());
        let refused = check_glb_size(5_000_000_000, path).map_err(|error| error.to_string());
        assert_eq!(
            refused.err().as_deref(),
            Some("run.glb would have 5.0 GB, a GLB file has 4.29 GB at most")
        );
    }
}
