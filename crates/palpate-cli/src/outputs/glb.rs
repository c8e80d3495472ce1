//! glTF 2.0 as one binary file (GLB): a text of JSON, and the numbers that it tells of.
//!
//! Numbers are written as they come into a file without a name beside the output; the text stands first in the whole file
//! and is known last. Reference: glTF 2.0 specification, chapters 3 (JSON) and 4 (GLB).

use crate::Failure;
use crate::whole_file::WholeFile;
use glam::DVec3;
use serde_json::{Value, json};
use std::fs::File;
use std::io::{BufWriter, Read, Seek, Write};
use std::path::{Path, PathBuf};

/// Numbers of a file's parts.
const VERTICES: usize = 0;
const INDICES: usize = 1;
const KEYS: usize = 2;

/// The specification's numbers for kinds of numbers and of their use.
const FLOAT: u32 = 5126;
const UNSIGNED_INT: u32 = 5125;
const VERTEX_ATTRIBUTES: u32 = 34962;
const TRIANGLE_CORNERS: u32 = 34963;

/// A file that is being written.
pub struct Glb {
    file: WholeFile,
    vertices: BufWriter<File>,
    vertex_bytes: u64,
    indices: Vec<u8>,
    keys: Vec<u8>,
    accessors: Vec<Value>,
    /// Everything of the JSON text but buffers and accessors.
    pub content: Content,
}

/// What the JSON text tells, in lists whose entries name one another by their places.
#[derive(Default)]
pub struct Content {
    /// Of the whole file: what was exported.
    pub extras: Value,
    /// The first is the root.
    pub nodes: Vec<Value>,
    /// Surfaces.
    pub meshes: Vec<Value>,
    /// Colours.
    pub materials: Vec<Value>,
    /// Movements.
    pub animations: Vec<Value>,
}

/// Refuse a length [bytes] that a GLB file can't state.
pub fn check_size(bytes: u64, path: &Path) -> Result<(), Failure> {
    if bytes <= u64::from(u32::MAX) {
        return Ok(());
    }
    Err(Failure(format!(
        "{} would have {:.1} GB, a GLB file has 4.29 GB at most: export fewer frames with --fps, or a part with --from and \
         --to",
        path.display(),
        1e-9 * bytes as f64
    )))
}

impl Glb {
    /// Begin.
    pub fn new(path: &Path, inputs: &[PathBuf]) -> Result<Self, Failure> {
        let inputs: Vec<&Path> = inputs.iter().map(PathBuf::as_path).collect();
        let file = WholeFile::create(path, &inputs)?;
        let folder = file.path().parent().filter(|folder| !folder.as_os_str().is_empty());
        let vertices = tempfile::tempfile_in(folder.unwrap_or(Path::new(".")))
            .map_err(|e| Failure::file("write", file.path(), &e))?;
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

    /// Add a vector per vertex; gives the accessor.
    pub fn vectors(&mut self, vectors: impl IntoIterator<Item = DVec3>) -> Result<usize, Failure> {
        let start = self.vertex_bytes;
        let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        for vector in vectors {
            let numbers = vector.to_array().map(|v| v as f32);
            low = std::array::from_fn(|axis| low[axis].min(numbers[axis]));
            high = std::array::from_fn(|axis| high[axis].max(numbers[axis]));
            for number in numbers {
                let written = self.vertices.write_all(&number.to_le_bytes());
                written.map_err(|e| Failure::file("write", self.file.path(), &e))?;
            }
            self.vertex_bytes += 12;
        }
        check_size(self.vertex_bytes, self.file.path())?;
        // As doubles they are the same numbers, to the last bit.
        Ok(self.accessor(json!({
            "bufferView": VERTICES, "byteOffset": start, "componentType": FLOAT, "type": "VEC3",
            "count": (self.vertex_bytes - start) / 12, "min": low.map(f64::from), "max": high.map(f64::from),
        })))
    }

    /// Add triangles; gives the accessor.
    pub fn triangles(&mut self, triangles: &[[u32; 3]]) -> usize {
        let start = self.indices.len();
        self.indices.extend(triangles.iter().flatten().flat_map(|n| n.to_le_bytes()));
        self.accessor(json!({
            "bufferView": INDICES, "byteOffset": start, "componentType": UNSIGNED_INT, "type": "SCALAR",
            "count": 3 * triangles.len(),
        }))
    }

    /// Add times of an animation [s], ascending; gives the accessor.
    pub fn times(&mut self, times: &[f64]) -> usize {
        let ends = |at: Option<&f64>| at.map_or(0.0, |t| f64::from(*t as f32));
        let (first, last) = (ends(times.first()), ends(times.last()));
        let accessor = self.values(times.iter().map(|t| *t as f32), "SCALAR", 1);
        self.accessors[accessor]["min"] = json!([first]);
        self.accessors[accessor]["max"] = json!([last]);
        accessor
    }

    /// Add what an animation sets at its times: `SCALAR`, `VEC3` or `VEC4`, of so many numbers; gives the accessor.
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

    /// Put the whole file together and let it take its name; gives that.
    pub fn finish(mut self) -> Result<PathBuf, Failure> {
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
        let mut text = serde_json::to_vec(&text).map_err(|e| Failure(format!("JSON: {e}")))?;
        // Parts begin at multiples of 4; ours are of 4-byte numbers, the text is filled up with blanks.
        text.resize(text.len().next_multiple_of(4), b' ');
        let whole = 12 + 8 + text.len() as u64 + 8 + binary;
        check_size(whole, self.file.path())?;
        let length = |bytes: u64| (bytes as u32).to_le_bytes();
        let head = [*b"glTF", 2_u32.to_le_bytes(), length(whole), length(text.len() as u64), *b"JSON"];
        self.file.write(&head.concat())?;
        self.file.write(&text)?;
        self.file.write(&[length(binary), *b"BIN\0"].concat())?;
        let failed = |e: std::io::Error| Failure::file("write", self.file.path(), &e);
        let mut numbers = self.vertices.into_inner().map_err(|e| failed(e.into_error()))?;
        numbers.rewind().map_err(failed)?;
        let mut block = vec![0; 1 << 20];
        loop {
            let read = numbers.read(&mut block).map_err(|e| Failure::file("write", self.file.path(), &e))?;
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
        // Lists that are there are not empty.
        if !animations.is_empty() {
            text["animations"] = Value::Array(animations);
        }
        text
    }
}

impl Content {
    /// Add a node below the root; gives its place.
    pub fn child(&mut self, node: Value) -> usize {
        self.nodes.push(node);
        let place = self.nodes.len() - 1;
        if let Some(children) = self.nodes[0]["children"].as_array_mut() {
            children.push(json!(place));
        }
        place
    }

    /// Add a mesh of one surface; gives its place.
    pub fn mesh(&mut self, mesh: Value) -> usize {
        self.meshes.push(mesh);
        self.meshes.len() - 1
    }

    /// Add a dull colour; gives its place.
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
    fn a_length_that_the_file_can_not_state_is_refused_with_what_to_do() {
        let path = Path::new("run.glb");
        assert_eq!(check_size(u64::from(u32::MAX), path), Ok(()));
        let refused = check_size(5_000_000_000, path).map_err(|failure| failure.0);
        assert_eq!(
            refused.err().as_deref(),
            Some(
                "run.glb would have 5.0 GB, a GLB file has 4.29 GB at most: export fewer frames with --fps, or a part \
                 with --from and --to"
            )
        );
    }
}
