//! Recording files whose content is changed and whose hash is right again: what gets past the hash, for tests of the checks behind it.

use safetensors::tensor::TensorView;
use safetensors::{Dtype, SafeTensors};
use serde_json::Value;

/// Content of a recording file, to be changed.
#[derive(Debug, Clone)]
pub struct EditableRecording {
    /// Metadata.
    pub metadata: Value,
    /// Tensors.
    pub tensors: Vec<EditableTensor>,
}

/// Tensor of a recording file.
#[derive(Debug, Clone)]
pub struct EditableTensor {
    /// Name in the file.
    pub name: String,
    /// Number type.
    pub dtype: Dtype,
    /// Extents.
    pub shape: Vec<usize>,
    /// Numbers, little-endian.
    pub bytes: Vec<u8>,
}

impl EditableRecording {
    /// Content of a file; none if it is no recording.
    pub fn new(file: &[u8]) -> Option<Self> {
        let (_, header) = SafeTensors::read_metadata(file).ok()?;
        let header: Value = serde_json::from_str(header.metadata().as_ref()?.get("palpate")?).ok()?;
        let tensors = SafeTensors::deserialize(file).ok()?;
        let tensor = |(name, view): (&str, TensorView)| EditableTensor {
            name: name.into(),
            dtype: view.dtype(),
            shape: view.shape().to_vec(),
            bytes: view.data().to_vec(),
        };
        let mut tensors: Vec<EditableTensor> = tensors.iter().map(tensor).collect();
        tensors.sort_by(|a, b| a.name.cmp(&b.name));
        Some(Self { metadata: header.get("metadata")?.clone(), tensors })
    }

    /// File with the right hash; none if extents and bytes of a tensor don't fit together.
    pub fn to_bytes(&self) -> Option<Vec<u8>> {
        let metadata = self.metadata.to_string();
        let mut hasher = blake3::Hasher::new();
        hasher.update(metadata.as_bytes());
        let mut views = Vec::new();
        for EditableTensor { name, dtype, shape, bytes } in &self.tensors {
            hasher.update(name.as_bytes());
            shape.iter().for_each(|&extent| {
                hasher.update(&(extent as u64).to_le_bytes());
            });
            hasher.update(bytes);
            views.push((name.as_str(), TensorView::new(*dtype, shape.clone(), bytes).ok()?));
        }
        let header =
            format!("{{\"metadata\":{metadata},\"content_hash\":\"{}\"}}", hasher.finalize().to_hex());
        let header = [("palpate".to_string(), header)];
        safetensors::serialize(views, Some(header.into_iter().collect())).ok()
    }

    /// Tensor of a name.
    ///
    /// # Panics
    /// If there is none.
    pub fn tensor(&mut self, name: &str) -> &mut EditableTensor {
        self.tensors.iter_mut().find(|tensor| tensor.name == name).expect("a tensor of this name")
    }
}

impl EditableTensor {
    /// Size of a number [bytes].
    pub fn width(&self) -> usize {
        match self.dtype {
            Dtype::F64 => 8,
            _ => 4,
        }
    }

    /// Number of numbers.
    pub fn len(&self) -> usize {
        self.bytes.len() / self.width()
    }

    /// Whether there are no numbers.
    pub fn is_empty(&self) -> bool {
        self.bytes.is_empty()
    }

    /// Set the number at an index, rounded to the number type.
    pub fn set(&mut self, at: usize, value: f64) {
        let width = self.width();
        let into = &mut self.bytes[width * at..width * (at + 1)];
        match self.dtype {
            Dtype::F64 => into.copy_from_slice(&value.to_le_bytes()),
            Dtype::F32 => into.copy_from_slice(&(value as f32).to_le_bytes()),
            _ => into.copy_from_slice(&(value as u32).to_le_bytes()),
        }
    }

    /// Resize to a number of entries along the first extent, with copies of the first bytes where it grows.
    pub fn resize(&mut self, entries: usize) {
        let entry = self.bytes.len() / self.shape[0].max(1);
        let old = self.bytes.clone();
        self.bytes = old.into_iter().cycle().take(entry * entries).collect();
        self.shape[0] = if self.bytes.is_empty() { 0 } else { entries };
    }
}
