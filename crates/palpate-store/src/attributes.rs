//! What a store says about itself, and what it holds beside the table.

use glam::DVec3;
use palpate::{Metadata, Sampling, Surface};
use serde::{Deserialize, Serialize};

/// How numbers are stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Number {
    /// Single precision: 7 digits.
    F32,
    /// Double precision: 16 digits.
    F64,
}

/// How columns are packed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Compression {
    /// Zstandard after byte shuffling (Blosc): the smaller store.
    Zstd,
    /// None: the columns lie in the file as they are used, so that a run maps them without unpacking.
    None,
}

/// Version of the store's layout.
pub const STORE_VERSION: u32 = 1;

/// The attributes of the group.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TableAttributes {
    /// [`STORE_VERSION`].
    pub store_version: u32,
    /// Step [s].
    pub step_s: f64,
    /// `end` or `mean`, see [`Sampling`].
    pub sampling: String,
    /// How it was computed: `closed-form` or `transient`, and how finely.
    pub method: String,
    /// Touchable degrees of freedom per shard.
    pub columns_per_shard: u64,
    /// How columns are packed.
    pub compression: Compression,
    /// Hold convention, units, material, damping, mass, mesh and its hash, where it came from.
    #[serde(flatten)]
    pub recording: Metadata,
}

/// All of a store but the numbers of the table.
#[derive(Debug, Clone, PartialEq)]
pub struct TableContent {
    /// Its attributes.
    pub attributes: TableAttributes,
    /// Number format of the table.
    pub number: Number,
    /// Samples T.
    pub samples: usize,
    /// 3·node + axis, nodes as in the input mesh.
    pub touchable_dofs: Vec<u32>,
    /// Numbered alike.
    pub observed_dofs: Vec<u32>,
    /// Rest position [m, body frame] of every observed node, in the order of `observed_dofs`.
    pub observed_positions: Vec<DVec3>,
    /// The body's surface.
    pub surface: Surface,
    /// For a body with fixed nodes: (axis·T + sample)·observed + dof [s²].
    pub gravity: Option<Vec<f64>>,
}

impl Number {
    /// Size of one number [bytes].
    pub fn bytes(self) -> usize {
        match self {
            Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::F32 => "f32",
            Self::F64 => "f64",
        }
    }
}

impl TableAttributes {
    /// What a sample is.
    pub fn sampling(&self) -> Option<Sampling> {
        match self.sampling.as_str() {
            "end" => Some(Sampling::End),
            "mean" => Some(Sampling::Mean),
            _ => None,
        }
    }

    /// The attribute for a sampling.
    pub fn sampling_text(sampling: Sampling) -> String {
        match sampling {
            Sampling::End => "end".into(),
            Sampling::Mean => "mean".into(),
        }
    }
}

impl TableContent {
    /// Bytes of the whole table before compression.
    pub fn raw_bytes(&self) -> u64 {
        (self.touchable_dofs.len() * self.column_length() * self.number.bytes()) as u64
    }

    /// Numbers in one column.
    pub fn column_length(&self) -> usize {
        self.samples * self.observed_dofs.len()
    }

    /// Where two tables that should be one differ, in words.
    pub(crate) fn difference(&self, other: &Self) -> Option<String> {
        let (a, b) = (&self.attributes, &other.attributes);
        let said = |what: &str, here: &dyn std::fmt::Display, wanted: &dyn std::fmt::Display| {
            Some(format!("{what} is {here} there, and {wanted} is asked for"))
        };
        let materials = |m: &Metadata| serde_json::to_string(&(&m.materials, &m.damping)).unwrap_or_default();
        match () {
            () if a.recording.provenance.mesh_hash != b.recording.provenance.mesh_hash => {
                said("the mesh", &named_mesh(a), &named_mesh(b))
            }
            () if materials(&a.recording) != materials(&b.recording) => {
                said("the material", &materials(&a.recording), &materials(&b.recording))
            }
            () if a.recording.mesh != b.recording.mesh => {
                said("the order of the elements or the number of fixed nodes", &"another", &"this one")
            }
            () if a.step_s != b.step_s => said("the step [s]", &a.step_s, &b.step_s),
            () if self.samples != other.samples => {
                said("the number of samples", &self.samples, &other.samples)
            }
            () if a.sampling != b.sampling => said("the sampling", &a.sampling, &b.sampling),
            () if a.method != b.method => said("the method", &a.method, &b.method),
            () if self.number != other.number => {
                said("the number format", &self.number.name(), &other.number.name())
            }
            () if self.touchable_dofs != other.touchable_dofs => said(
                "the choice of touchable degrees of freedom",
                &format!("one of {}", self.touchable_dofs.len()),
                &format!("one of {}", other.touchable_dofs.len()),
            ),
            () if self.observed_dofs != other.observed_dofs => said(
                "the choice of observed degrees of freedom",
                &format!("one of {}", self.observed_dofs.len()),
                &format!("one of {}", other.observed_dofs.len()),
            ),
            () => None,
        }
    }
}

fn named_mesh(attributes: &TableAttributes) -> String {
    let from = &attributes.recording.provenance;
    format!("{} ({}…)", from.source, from.mesh_hash.get(..8).unwrap_or(&from.mesh_hash))
}
