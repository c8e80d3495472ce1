//! glTF 2.0 files, in text (`.gltf`) and binary (`.glb`): the triangles of the scene, for surfaces.
//!
//! ```text
//! GLB      "glTF", 2, length       chunks: length, type, bytes; the first is JSON, the second the buffer
//! x_world = T_root · … · T_node · x      T = translation · rotation · scale, or a matrix
//! ```
//!
//! Lengths are metres, y is up. Every instance of a mesh is a part of the surface; a transform that mirrors turns its triangles. Points, lines,
//! materials and everything else of graphics is skipped.
//!
//! Reference: Khronos Group, glTF 2.0 Specification (2021), <https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html>.

mod document;

use crate::error::MeshError;
use crate::files::{Files, beside};
use crate::scan::{Encoding, Scanner, quoted};
use crate::surface_mesh::SurfaceMesh;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use document::{Accessor, Document, Node};
use glam::{DAffine3, DMat4, DQuat, DVec3};
use std::path::Path;

/// Types of the chunks of a GLB.
const JSON: u32 = 0x4E4F_534A;
const BIN: u32 = 0x004E_4942;

/// Types of components.
const U8: u32 = 5121;
const U16: u32 = 5123;
const U32: u32 = 5125;
const F32: u32 = 5126;

/// Most vertices of all instances for each byte of the file: few bytes can name a mesh very often.
const MOST_PER_BYTE: usize = 16;

/// Reads the bytes of a glTF file at `path`; also whether they are text or binary.
pub(crate) fn parse(
    files: Files,
    bytes: &[u8],
    path: &Path,
) -> Result<(SurfaceMesh, &'static str), MeshError> {
    let mut scan = Scanner::new(bytes, path);
    let is_binary = bytes.starts_with(b"glTF");
    if is_binary {
        scan.encoding = Encoding::LittleEndian;
    }
    let fail = |what: String| scan.error_at(0, what);
    let (json, bin) = if is_binary { chunks(bytes).map_err(fail)? } else { (bytes, None) };
    let document: Document = serde_json::from_slice(json).map_err(|error| {
        let what = format!("the JSON is no glTF document: {error}");
        if is_binary { scan.error_at(0, what) } else { at_line(bytes, path, error.line(), what) }
    })?;
    if !document.asset.version.starts_with("2.") {
        let version = quoted(document.asset.version.as_bytes());
        return Err(fail(format!("glTF version {version} cannot be read, only 2: export it anew")));
    }
    let packed = ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_mesh_quantization"];
    if let Some(name) = document.extensions_required.iter().find(|name| packed.contains(&name.as_str())) {
        return Err(fail(format!("the geometry is packed by {name}: export it without compression")));
    }
    let buffers = buffers(files, &document, bin, &scan, path)?;
    let size = bytes.len() + buffers.iter().map(Vec::len).sum::<usize>();
    let mut surface =
        Surface { document: &document, buffers, mesh: SurfaceMesh::default(), most: MOST_PER_BYTE * size };
    surface.add_scene().map_err(fail)?;
    if surface.mesh.triangles.is_empty() {
        return Err(fail("the scene has no triangles".into()));
    }
    Ok((surface.mesh, if is_binary { "binary" } else { "text" }))
}

/// Error at a line of the JSON.
fn at_line(bytes: &[u8], path: &Path, line: usize, what: String) -> MeshError {
    let starts =
        std::iter::once(0).chain((1..).zip(bytes).filter(|(_, byte)| **byte == b'\n').map(|(at, _)| at));
    let at = starts.take(line.max(1)).last().unwrap_or(0);
    Scanner::new(bytes, path).error_at(at, what)
}

/// JSON and buffer of a GLB.
fn chunks(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), String> {
    let word =
        |at: usize| bytes.get(at..).and_then(|rest| rest.first_chunk()).map(|four| u32::from_le_bytes(*four));
    if word(4) != Some(2) {
        return Err(format!("version of the GLB is {:?}, expected 2", word(4).unwrap_or_default()));
    }
    let (mut json, mut bin, mut at) = (None, None, 12);
    while let (Some(length), Some(kind)) = (word(at), word(at + 4)) {
        let end = (at + 8).checked_add(length as usize);
        let Some(chunk) = end.and_then(|end| bytes.get(at + 8..end)) else {
            return Err(format!("a chunk at byte {at} has {length} bytes, more than the file"));
        };
        match kind {
            JSON if json.is_none() => json = Some(chunk),
            BIN if bin.is_none() => bin = Some(chunk),
            _ => {}
        }
        at += 8 + chunk.len();
    }
    json.map(|json| (json, bin)).ok_or_else(|| "the GLB has no JSON".into())
}

/// Bytes of all buffers: of the GLB, in the document, or in files beside it.
fn buffers(
    files: Files,
    document: &Document,
    bin: Option<&[u8]>,
    scan: &Scanner,
    path: &Path,
) -> Result<Vec<Vec<u8>>, MeshError> {
    let mut buffers = Vec::with_capacity(document.buffers.len());
    for (number, buffer) in document.buffers.iter().enumerate() {
        buffers.push(match (&buffer.uri, bin) {
            (None, Some(bin)) if number == 0 => bin.to_vec(),
            (None, _) => return Err(scan.error_at(0, format!("buffer {number} has no data"))),
            (Some(uri), _) => match uri.strip_prefix("data:").and_then(|data| data.split_once(";base64,")) {
                Some((_, data)) => STANDARD
                    .decode(data)
                    .map_err(|error| scan.error_at(0, format!("buffer {number} is no base64: {error}")))?,
                None => {
                    let name = uri.replace("%20", " ");
                    let Some(companion) = beside(path, name.as_bytes()) else {
                        let name = quoted(uri.as_bytes());
                        let what =
                            format!("buffer {number} is {name}, expected a file beside this one or below");
                        return Err(scan.error_at(0, what));
                    };
                    files.read_companion(path, &companion)?
                }
            },
        });
    }
    Ok(buffers)
}

/// Surface on its way.
struct Surface<'a> {
    document: &'a Document,
    buffers: Vec<Vec<u8>>,
    mesh: SurfaceMesh,
    /// Most vertices and triangles.
    most: usize,
}

impl Surface<'_> {
    /// Adds the nodes of the scene: the stated one, or the first; without scenes, all nodes that are no children.
    fn add_scene(&mut self) -> Result<(), String> {
        let document = self.document;
        let roots = match document.scenes.get(document.scene.unwrap_or(0)) {
            Some(scene) => scene.nodes.clone(),
            None if document.scene.is_some() => return Err("the scene that is stated does not exist".into()),
            None => {
                let is_child =
                    |node: &usize| document.nodes.iter().any(|parent| parent.children.contains(node));
                (0..document.nodes.len()).filter(|node| !is_child(node)).collect()
            }
        };
        let mut is_visited = vec![false; document.nodes.len()];
        let mut open: Vec<(usize, DAffine3)> =
            roots.into_iter().rev().map(|node| (node, DAffine3::IDENTITY)).collect();
        while let Some((number, parent)) = open.pop() {
            let Some(node) = document.nodes.get(number) else {
                return Err(format!("node {number} does not exist"));
            };
            if std::mem::replace(&mut is_visited[number], true) {
                return Err(format!("node {number} has two parents"));
            }
            let world = parent * transform(node);
            if let Some(mesh) = node.mesh {
                if node.skin.is_some() {
                    return Err(format!(
                        "node {number} is posed by a skeleton: apply the pose, and export it without"
                    ));
                }
                self.add_mesh(mesh, world)?;
            }
            open.extend(node.children.iter().rev().map(|&child| (child, world)));
        }
        Ok(())
    }

    fn add_mesh(&mut self, number: usize, world: DAffine3) -> Result<(), String> {
        let Some(mesh) = self.document.meshes.get(number) else {
            return Err(format!("mesh {number} does not exist"));
        };
        for primitive in &mesh.primitives {
            let mode = primitive.mode.unwrap_or(4);
            let (Some(position), 4..=6) = (primitive.attributes.position, mode) else { continue };
            let first = self.mesh.positions.len();
            let vertices = self.positions(position, world)?;
            let corners: Vec<u32> = match primitive.indices {
                Some(indices) => self.indices(indices, vertices)?,
                None => (0..vertices as u32).collect(),
            };
            let mirrors = world.matrix3.determinant() < 0.0;
            let mut add = |[a, b, c]: [u32; 3]| {
                let corners = if mirrors { [a, c, b] } else { [a, b, c] };
                self.mesh.triangles.push(corners.map(|corner| first as u32 + corner));
            };
            match mode {
                4 => corners.chunks_exact(3).for_each(|c| add([c[0], c[1], c[2]])),
                5 => corners.windows(3).enumerate().for_each(|(at, c)| {
                    add(if at % 2 == 0 { [c[0], c[1], c[2]] } else { [c[1], c[0], c[2]] });
                }),
                _ => corners
                    .get(1..)
                    .unwrap_or_default()
                    .windows(2)
                    .for_each(|c| add([corners[0], c[0], c[1]])),
            }
            if self.mesh.positions.len().max(self.mesh.triangles.len()) > self.most {
                return Err("instances of meshes make far more triangles than the file has bytes".into());
            }
        }
        Ok(())
    }

    /// Adds the positions of an accessor; returns their number.
    fn positions(&mut self, number: usize, world: DAffine3) -> Result<usize, String> {
        let (accessor, bytes, stride) = self.elements(number, "VEC3", &[(F32, 12)])?;
        let component = |start: usize| {
            let four = bytes.get(start..).and_then(|rest| rest.first_chunk());
            four.map_or(f64::NAN, |four| f32::from_le_bytes(*four).into())
        };
        let position = |at: usize| {
            let start = at * stride;
            world.transform_point3(DVec3::new(component(start), component(start + 4), component(start + 8)))
        };
        let positions: Vec<DVec3> = (0..accessor.count as usize).map(position).collect();
        let count = positions.len();
        self.mesh.positions.extend(positions);
        Ok(count)
    }

    /// Corners of an accessor, all below the number of vertices.
    fn indices(&self, number: usize, vertices: usize) -> Result<Vec<u32>, String> {
        let (accessor, bytes, stride) = self.elements(number, "SCALAR", &[(U8, 1), (U16, 2), (U32, 4)])?;
        let mut corners = Vec::with_capacity(accessor.count as usize);
        for at in 0..accessor.count as usize {
            let rest = bytes.get(at * stride..).unwrap_or_default();
            let index = match accessor.component_type {
                U8 => rest.first().map(|byte| u32::from(*byte)),
                U16 => rest.first_chunk().map(|two| u16::from_le_bytes(*two).into()),
                _ => rest.first_chunk().map(|four| u32::from_le_bytes(*four)),
            };
            match index {
                Some(index) if (index as usize) < vertices => corners.push(index),
                _ => {
                    return Err(format!(
                        "accessor {number} names a vertex beyond the {vertices} of its mesh"
                    ));
                }
            }
        }
        Ok(corners)
    }

    /// An accessor of a shape and one of some types with their sizes, its bytes, and the step between its elements.
    fn elements(
        &self,
        number: usize,
        shape: &str,
        types: &[(u32, usize)],
    ) -> Result<(&Accessor, Vec<u8>, usize), String> {
        let fail = |what: &str| Err(format!("accessor {number} {what}"));
        let Some(accessor) = self.document.accessors.get(number) else { return fail("does not exist") };
        if accessor.sparse.is_some() {
            return fail("is sparse, which is not read: export it without");
        }
        let size = types.iter().find(|(kind, _)| *kind == accessor.component_type).map(|(_, size)| *size);
        let Some(size) = size.filter(|_| accessor.shape == shape) else {
            return fail(&format!(
                "is of type {} of {}, expected {shape} of {types:?}",
                accessor.shape, accessor.component_type
            ));
        };
        let view = accessor.buffer_view.and_then(|view| self.document.buffer_views.get(view));
        let Some(view) = view else { return fail("has no buffer view") };
        let within = || {
            let begin = usize::try_from(view.byte_offset).ok()?;
            let end = begin.checked_add(usize::try_from(view.byte_length).ok()?)?;
            let bytes = self
                .buffers
                .get(view.buffer)?
                .get(begin..end)?
                .get(usize::try_from(accessor.byte_offset).ok()?..)?;
            let stride = view.byte_stride.map_or(Some(size), |stride| usize::try_from(stride).ok())?;
            let count = usize::try_from(accessor.count).ok()?;
            // The last element need not be followed by the rest of its step.
            let needed =
                count.checked_sub(1).map_or(Some(0), |last| last.checked_mul(stride)?.checked_add(size))?;
            (stride >= size && needed <= bytes.len()).then(|| (bytes[..needed].to_vec(), stride))
        };
        match within() {
            Some((bytes, stride)) => Ok((accessor, bytes, stride)),
            None => fail("reaches beyond its buffer"),
        }
    }
}

/// Transform of a node.
fn transform(node: &Node) -> DAffine3 {
    if let Some(matrix) = &node.matrix {
        return DAffine3::from_mat4(DMat4::from_cols_array(matrix));
    }
    let scale = node.scale.map_or(DVec3::ONE, DVec3::from);
    let rotation = node.rotation.map_or(DQuat::IDENTITY, |q| DQuat::from_array(q).normalize());
    DAffine3::from_scale_rotation_translation(
        scale,
        rotation,
        node.translation.map_or(DVec3::ZERO, DVec3::from),
    )
}
