//! Recording file `*.palp`: a safetensors container.
//!
//! Little-endian tensors with names, and one metadata entry `palpate`: JSON of [`Metadata`] and
//! a BLAKE3 hash over it and over every tensor (name, shape, bytes; names ascending). The reader
//! checks the hash, then every length, index and number, and allocates no more than the file's size.

use super::quantised::{QuantisedCompliance, shape_steps};
use super::residual::lower_triangle;
use super::sample_levels::LevelLists;
use super::{Embedding, GravityResponse, Metadata, ModalBasis, NearField, Recording, ResidualCompliance};
use crate::error::{Error, RecordingError};
use crate::surface::Surface;
use alloc::borrow::Cow;
use alloc::boxed::Box;
use alloc::format;
use alloc::string::{String, ToString};
use alloc::vec;
use alloc::vec::Vec;
use glam::DVec3;
use safetensors::tensor::TensorView;
use safetensors::{Dtype, SafeTensors, View};
use serde::{Deserialize, Serialize};
use serde_json::value::RawValue;

/// Version of the layout with mode shapes of 64 bits.
pub const FORMAT_VERSION: u32 = 1;

/// Version of the compact layout, with mode shapes of 16 bits in whole steps.
pub const COMPACT_FORMAT_VERSION: u32 = 2;

/// Versions of both layouts with an embedded surface.
pub const EMBEDDED_FORMAT_VERSIONS: [u32; 2] = [3, 4];

impl Metadata {
    /// Whether mode shapes are whole steps of 16 bits.
    pub fn is_compact(&self) -> bool {
        [COMPACT_FORMAT_VERSION, EMBEDDED_FORMAT_VERSIONS[1]].contains(&self.format_version)
    }
}

/// Metadata entry `palpate`. The metadata's text is kept verbatim, because the hash covers it.
#[derive(Serialize, Deserialize)]
struct Header {
    metadata: Box<RawValue>,
    content_hash: String,
}

/// Tensor to be written.
struct Tensor {
    dtype: Dtype,
    shape: Vec<usize>,
    bytes: Vec<u8>,
}

impl View for &Tensor {
    fn dtype(&self) -> Dtype {
        self.dtype
    }
    fn shape(&self) -> &[usize] {
        &self.shape
    }
    fn data(&self) -> Cow<'_, [u8]> {
        Cow::Borrowed(&self.bytes)
    }
    fn data_len(&self) -> usize {
        self.bytes.len()
    }
}

fn tensor_f64(shape: &[usize], values: impl Iterator<Item = f64>) -> Tensor {
    Tensor { dtype: Dtype::F64, shape: shape.to_vec(), bytes: values.flat_map(f64::to_le_bytes).collect() }
}

fn tensor_f32(shape: &[usize], values: &[f32]) -> Tensor {
    let bytes = values.iter().flat_map(|v| v.to_le_bytes()).collect();
    Tensor { dtype: Dtype::F32, shape: shape.to_vec(), bytes }
}

/// Tensor of whole steps.
fn tensor_i16(shape: &[usize], values: impl Iterator<Item = f64>) -> Tensor {
    let bytes = values.flat_map(|steps| (steps as i16).to_le_bytes()).collect();
    Tensor { dtype: Dtype::I16, shape: shape.to_vec(), bytes }
}

fn tensor_u32(shape: &[usize], values: impl Iterator<Item = u32>) -> Tensor {
    Tensor { dtype: Dtype::U32, shape: shape.to_vec(), bytes: values.flat_map(u32::to_le_bytes).collect() }
}

/// Hash over the metadata's JSON and every tensor, in the order of their names.
fn content_hash<'a>(
    metadata: &str,
    tensors: impl Iterator<Item = (&'a str, &'a [usize], &'a [u8])>,
) -> String {
    let mut sorted: Vec<_> = tensors.collect();
    sorted.sort_by_key(|(name, ..)| *name);
    let mut hasher = blake3::Hasher::new();
    hasher.update(metadata.as_bytes());
    for (name, shape, bytes) in sorted {
        hasher.update(name.as_bytes());
        for &extent in shape {
            hasher.update(&(extent as u64).to_le_bytes());
        }
        hasher.update(bytes);
    }
    hasher.finalize().to_hex().to_string()
}

impl Recording {
    /// Bytes of the recording file; equal recordings give equal bytes.
    ///
    /// # Errors
    /// [`crate::RecordingError::Inconsistent`] for a recording that [`Self::validate`] refuses.
    pub fn to_bytes(&self) -> Result<Vec<u8>, Error> {
        self.validate()?;
        let (n, m) = (self.surface.positions.len(), self.modes.len());
        // Mode shapes, residual compliance and sag are those of the model's nodes.
        let model_nodes = self.model_nodes();
        let mut tensors = vec![
            (
                "surface.positions",
                tensor_f64(&[n, 3], self.surface.positions.iter().flat_map(|p| p.to_array())),
            ),
            (
                "surface.triangles",
                tensor_u32(
                    &[self.surface.triangles.len(), 3],
                    self.surface.triangles.iter().flatten().copied(),
                ),
            ),
            ("surface.source_nodes", tensor_u32(&[n], self.surface.source_nodes.iter().copied())),
            ("modes.angular_frequencies", tensor_f64(&[m], self.modes.angular_frequencies.iter().copied())),
            ("modes.damping_ratios", tensor_f64(&[m], self.modes.damping_ratios.iter().copied())),
        ];
        let shapes = self.model_mode_shapes();
        if self.metadata.is_compact() {
            let steps = shape_steps(shapes, m);
            let whole = shapes.iter().zip(steps.iter().cycle()).map(|(shape, step)| shape / step);
            tensors.push(("modes.mode_shapes", tensor_i16(&[3 * model_nodes, m], whole)));
            tensors.push(("modes.steps", tensor_f64(&[m], steps.iter().copied())));
        } else {
            tensors.push(("modes.mode_shapes", tensor_f64(&[3 * model_nodes, m], shapes.iter().copied())));
        }
        match &self.residual {
            ResidualCompliance::None => {}
            ResidualCompliance::Whole(blocks) => {
                let packed = lower_triangle(blocks);
                tensors.push(("residual.packed", tensor_f32(&[packed.len()], &packed)));
            }
            ResidualCompliance::Quantised(quantised) => {
                let bytes = quantised.compressed();
                tensors.push(("residual.scales", tensor_f32(&[3 * model_nodes], &quantised.scales)));
                let shape = [bytes.len()].to_vec();
                tensors.push(("residual.quantised", Tensor { dtype: Dtype::U8, shape, bytes }));
            }
            ResidualCompliance::NearField(near) => {
                tensors.push(("residual.radius", tensor_f64(&[1], [near.radius].into_iter())));
                tensors
                    .push(("residual.offsets", tensor_u32(&[model_nodes + 1], near.offsets.iter().copied())));
                tensors.push(("residual.nodes", tensor_u32(&[near.nodes.len()], near.nodes.iter().copied())));
                tensors.push(("residual.blocks", tensor_f32(&[near.nodes.len(), 3, 3], &near.blocks)));
            }
        }
        if let Some(gravity) = &self.gravity {
            tensors.push(("gravity.modal_forces", tensor_f64(&[3, m], gravity.modal_forces.iter().copied())));
            let embedding = self.embedding.as_ref();
            let displacements = embedding
                .map_or(&gravity.residual_displacements, |embedding| &embedding.residual_displacements);
            tensors.push((
                "gravity.residual_displacements",
                tensor_f64(&[3 * model_nodes, 3], displacements.iter().copied()),
            ));
        }
        if let Some(Embedding { mean_edge, offsets, nodes, weights, .. }) = &self.embedding {
            tensors.push(("embedding.mean_edge", tensor_f64(&[1], [*mean_edge].into_iter())));
            tensors.push(("embedding.offsets", tensor_u32(&[n + 1], offsets.iter().copied())));
            tensors.push(("embedding.nodes", tensor_u32(&[nodes.len()], nodes.iter().copied())));
            tensors.push(("embedding.weights", tensor_f32(&[nodes.len()], weights)));
        }
        if !self.sample_levels.is_empty() {
            let lists = LevelLists::new(&self.sample_levels);
            let (levels, triangles) = (lists.spacings.len(), lists.triangles.len() / 3);
            tensors.push(("samples.spacings", tensor_f64(&[levels], lists.spacings.into_iter())));
            tensors.push(("samples.offsets", tensor_u32(&[levels + 1], lists.offsets.into_iter())));
            tensors.push(("samples.nodes", tensor_u32(&[lists.nodes.len()], lists.nodes.into_iter())));
            tensors.push((
                "samples.triangle_offsets",
                tensor_u32(&[levels + 1], lists.triangle_offsets.into_iter()),
            ));
            tensors.push(("samples.triangles", tensor_u32(&[triangles, 3], lists.triangles.into_iter())));
        }
        let not_writable = |e: serde_json::Error| RecordingError::NotWritable {
            what: format!("metadata cannot be written: {e}"),
        };
        let json = |value: serde_json::Result<String>| value.map_err(not_writable);
        let metadata =
            RawValue::from_string(json(serde_json::to_string(&self.metadata))?).map_err(not_writable)?;
        let content_hash = content_hash(
            metadata.get(),
            tensors.iter().map(|(name, t)| (*name, t.shape.as_slice(), t.bytes.as_slice())),
        );
        let header = Header { metadata, content_hash };
        let header = [("palpate".to_string(), json(serde_json::to_string(&header))?)];
        let views = tensors.iter().map(|(name, tensor)| (*name, tensor));
        let bytes = safetensors::serialize(views, Some(header.into_iter().collect()));
        bytes.map_err(|e| RecordingError::NotWritable { what: format!("cannot be written: {e}") }.into())
    }

    /// Recording from the bytes of its file.
    ///
    /// # Errors
    /// [`crate::RecordingError`] with its kind for a file that is no recording, of a newer version, truncated, damaged or
    /// inconsistent.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, Error> {
        let container = |e: safetensors::SafeTensorError| RecordingError::Container { reason: e.to_string() };
        let (_, raw_header) = SafeTensors::read_metadata(bytes).map_err(container)?;
        let json = raw_header.metadata().as_ref().and_then(|entries| entries.get("palpate"));
        let Some(json) = json else {
            return Err(RecordingError::NotARecording.into());
        };
        let header: Header = parse(json)?;
        let VersionOnly { format_version } = parse(header.metadata.get())?;
        let supported = EMBEDDED_FORMAT_VERSIONS[1];
        if !(FORMAT_VERSION..=supported).contains(&format_version) {
            let found = format_version;
            return Err(RecordingError::UnsupportedVersion { found, supported }.into());
        }
        let file = SafeTensors::deserialize(bytes).map_err(container)?;
        let views: Vec<_> = file.iter().collect();
        check_shapes(&views)?;
        let hash =
            content_hash(header.metadata.get(), views.iter().map(|(name, v)| (*name, v.shape(), v.data())));
        if hash != header.content_hash {
            return Err(RecordingError::HashMismatch.into());
        }
        let recording = Self::from_tensors(parse(header.metadata.get())?, &Tensors(&file))?;
        recording.validate()?;
        Ok(recording)
    }

    fn from_tensors(metadata: Metadata, tensors: &Tensors) -> Result<Self, RecordingError> {
        let surface = Surface {
            positions: tensors.f64("surface.positions")?.chunks_exact(3).map(DVec3::from_slice).collect(),
            triangles: tensors
                .u32("surface.triangles")?
                .chunks_exact(3)
                .map(|t| [t[0], t[1], t[2]])
                .collect(),
            source_nodes: tensors.u32("surface.source_nodes")?,
        };
        let modes = ModalBasis {
            angular_frequencies: tensors.f64("modes.angular_frequencies")?,
            damping_ratios: tensors.f64("modes.damping_ratios")?,
            mode_shapes: if metadata.is_compact() {
                let steps = tensors.f64("modes.steps")?;
                let shapes = tensors.i16("modes.mode_shapes")?.zip(steps.iter().cycle());
                shapes.map(|(whole, step)| f64::from(whole) * step).collect()
            } else {
                tensors.f64("modes.mode_shapes")?
            },
        };
        let is_embedded = EMBEDDED_FORMAT_VERSIONS.contains(&metadata.format_version);
        let model_nodes =
            if is_embedded { tensors.rows("modes.mode_shapes")? / 3 } else { surface.positions.len() };
        let residual = if tensors.has("residual.packed") {
            ResidualCompliance::from_lower_triangle(model_nodes, &tensors.f32("residual.packed")?)?
        } else if tensors.has("residual.quantised") {
            let scales = tensors.f32("residual.scales")?;
            let compressed = tensors.bytes("residual.quantised", Dtype::U8)?;
            ResidualCompliance::Quantised(QuantisedCompliance::from_compressed(scales, compressed)?)
        } else if tensors.has("residual.blocks") {
            ResidualCompliance::NearField(NearField {
                radius: tensors.f64("residual.radius")?.first().copied().unwrap_or(f64::NAN),
                offsets: tensors.u32("residual.offsets")?,
                nodes: tensors.u32("residual.nodes")?,
                blocks: tensors.f32("residual.blocks")?,
            })
        } else {
            ResidualCompliance::None
        };
        let gravity = if tensors.has("gravity.modal_forces") {
            Some(GravityResponse {
                modal_forces: tensors.f64("gravity.modal_forces")?,
                residual_displacements: tensors.f64("gravity.residual_displacements")?,
            })
        } else {
            None
        };
        // Older files hold no levels.
        let sample_levels = if tensors.has("samples.spacings") {
            let lists = LevelLists {
                spacings: tensors.f64("samples.spacings")?,
                offsets: tensors.u32("samples.offsets")?,
                nodes: tensors.u32("samples.nodes")?,
                triangle_offsets: tensors.u32("samples.triangle_offsets")?,
                triangles: tensors.u32("samples.triangles")?,
            };
            lists.levels()?
        } else {
            Vec::new()
        };
        let mut recording =
            Self { metadata, surface, modes, residual, gravity, sample_levels, embedding: None };
        if is_embedded {
            let embedding = Embedding {
                model_nodes,
                mean_edge: tensors.f64("embedding.mean_edge")?.first().copied().unwrap_or(f64::NAN),
                offsets: tensors.u32("embedding.offsets")?,
                nodes: tensors.u32("embedding.nodes")?,
                weights: tensors.f32("embedding.weights")?,
                ..Embedding::default()
            };
            recording.embed(embedding)?;
        }
        Ok(recording)
    }
}

/// Check that the extents of the tensors fit together; their numbers are checked afterwards.
fn check_shapes(views: &[(&str, TensorView<'_>)]) -> Result<(), RecordingError> {
    let extents = |name: &str| views.iter().find(|(other, _)| *other == name).map(|(_, view)| view.shape());
    let count = |name: &str| extents(name).and_then(|shape| shape.first()).copied().unwrap_or(0);
    let (nodes, modes) = (count("surface.positions"), count("modes.angular_frequencies"));
    let is_embedded = extents("embedding.offsets").is_some();
    let model_nodes = if is_embedded { count("modes.mode_shapes") / 3 } else { nodes };
    for (name, view) in views {
        let (blocks, levels) = (count("residual.nodes"), count("samples.spacings"));
        let expected: &[usize] = match *name {
            "surface.positions" => &[nodes, 3],
            "surface.triangles" => &[count("surface.triangles"), 3],
            "surface.source_nodes" => &[nodes],
            "modes.angular_frequencies" | "modes.damping_ratios" | "modes.steps" => &[modes],
            "modes.mode_shapes" => &[model_nodes.saturating_mul(3), modes],
            "residual.scales" => &[model_nodes.saturating_mul(3)],
            "residual.radius" | "embedding.mean_edge" => &[1],
            "residual.offsets" => &[model_nodes.saturating_add(1)],
            "residual.nodes" => &[blocks],
            "residual.blocks" => &[blocks, 3, 3],
            "gravity.modal_forces" => &[3, modes],
            "gravity.residual_displacements" => &[model_nodes.saturating_mul(3), 3],
            "embedding.offsets" => &[nodes.saturating_add(1)],
            "embedding.nodes" | "embedding.weights" => &[count("embedding.nodes")],
            "samples.spacings" => &[levels],
            "samples.offsets" | "samples.triangle_offsets" => &[levels.saturating_add(1)],
            "samples.nodes" => &[count("samples.nodes")],
            "samples.triangles" => &[count("samples.triangles"), 3],
            _ => continue,
        };
        if view.shape() != expected {
            let (found, expected) = (view.shape().to_vec(), expected.to_vec());
            return Err(RecordingError::WrongShape { name: name.to_string(), found, expected });
        }
    }
    Ok(())
}

#[derive(Deserialize)]
struct VersionOnly {
    format_version: u32,
}

fn parse<'a, T: Deserialize<'a>>(json: &'a str) -> Result<T, RecordingError> {
    serde_json::from_str(json).map_err(|e| RecordingError::Metadata { reason: e.to_string() })
}

/// Tensors of a file, with checks of their types.
struct Tensors<'a>(&'a SafeTensors<'a>);

impl Tensors<'_> {
    fn has(&self, name: &str) -> bool {
        self.0.tensor(name).is_ok()
    }

    /// First extent of a tensor.
    fn rows(&self, name: &str) -> Result<usize, RecordingError> {
        let tensor = self.0.tensor(name);
        let tensor = tensor.map_err(|_| RecordingError::MissingTensor { name: name.to_string() })?;
        Ok(tensor.shape().first().copied().unwrap_or(0))
    }

    fn bytes(&self, name: &str, dtype: Dtype) -> Result<&[u8], RecordingError> {
        let missing = |_| RecordingError::MissingTensor { name: name.to_string() };
        let tensor = self.0.tensor(name).map_err(missing)?;
        if tensor.dtype() != dtype {
            let (found, expected) = (format!("{:?}", tensor.dtype()), format!("{dtype:?}"));
            return Err(RecordingError::WrongType { name: name.to_string(), found, expected });
        }
        Ok(tensor.data())
    }

    fn f64(&self, name: &str) -> Result<Vec<f64>, RecordingError> {
        let bytes = self.bytes(name, Dtype::F64)?;
        Ok(bytes.as_chunks::<8>().0.iter().map(|b| f64::from_le_bytes(*b)).collect())
    }

    fn f32(&self, name: &str) -> Result<Vec<f32>, RecordingError> {
        let bytes = self.bytes(name, Dtype::F32)?;
        Ok(bytes.as_chunks::<4>().0.iter().map(|b| f32::from_le_bytes(*b)).collect())
    }

    fn i16(&self, name: &str) -> Result<impl Iterator<Item = i16>, RecordingError> {
        let bytes = self.bytes(name, Dtype::I16)?;
        Ok(bytes.as_chunks::<2>().0.iter().map(|b| i16::from_le_bytes(*b)))
    }

    fn u32(&self, name: &str) -> Result<Vec<u32>, RecordingError> {
        let bytes = self.bytes(name, Dtype::U32)?;
        Ok(bytes.as_chunks::<4>().0.iter().map(|b| u32::from_le_bytes(*b)).collect())
    }
}
