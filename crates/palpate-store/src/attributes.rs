//! Attributes of a store, and its content beside the table.

use crate::error::TableDifference;
use glam::DVec3;
use palpate::{Metadata, Sampling, Surface};
use serde::{Deserialize, Serialize};

/// Number format of a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Number {
    /// Single precision: 7 digits.
    F32,
    /// Double precision: 16 digits.
    F64,
}

/// Compression of the columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Compression {
    /// Zstandard after byte shuffling (Blosc): the smaller store.
    Zstd,
    /// None: a run reads the columns as they lie.
    None,
}

/// Version of the layout of stores.
pub const STORE_VERSION: u32 = 1;

/// Size of a checksum, CRC-32C [bytes].
pub(crate) const CHECKSUM: u64 = 4;

/// Attributes of the group: how the table was recorded.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TableAttributes {
    /// Version of the layout, [`STORE_VERSION`].
    pub store_version: u32,
    /// Step [s].
    pub step_s: f64,
    /// Sampling, `end` or `mean`, see [`Sampling`].
    pub sampling: String,
    /// Method of computation: `closed-form` or `transient`, with its resolution.
    pub method: String,
    /// Touchable degrees of freedom per shard.
    pub columns_per_shard: u64,
    /// Compression of the columns.
    pub compression: Compression,
    /// Hold convention, units, material, damping, mass, mesh and its hash, source.
    #[serde(flatten)]
    pub recording: Metadata,
}

/// Content of a store without the numbers of the table.
#[derive(Debug, Clone, PartialEq)]
pub struct TableContent {
    /// Attributes of the group.
    pub attributes: TableAttributes,
    /// Number format of the table.
    pub number: Number,
    /// Number of samples T.
    pub samples: usize,
    /// Touchable degrees of freedom, 3·node + axis, nodes numbered as in the input mesh.
    pub touchable_dofs: Vec<u32>,
    /// Observed degrees of freedom, numbered alike.
    pub observed_dofs: Vec<u32>,
    /// Rest position [m, body frame] of every observed node, in the order of `observed_dofs`.
    pub observed_positions: Vec<DVec3>,
    /// Surface of the body.
    pub surface: Surface,
    /// Response to a unit acceleration of a body with fixed nodes [s²], (axis·T + sample)·observed + dof.
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

    /// Name in options and messages.
    pub fn name(self) -> &'static str {
        match self {
            Self::F32 => "f32",
            Self::F64 => "f64",
        }
    }
}

impl TableAttributes {
    /// Sampling; none if the attribute is unknown.
    pub fn sampling(&self) -> Option<Sampling> {
        match self.sampling.as_str() {
            "end" => Some(Sampling::End),
            "mean" => Some(Sampling::Mean),
            _ => None,
        }
    }

    /// Attribute text of a sampling.
    pub fn sampling_text(sampling: Sampling) -> String {
        match sampling {
            Sampling::End => "end".into(),
            Sampling::Mean => "mean".into(),
        }
    }
}

impl TableContent {
    /// Size of the table before compression [bytes].
    pub fn raw_bytes(&self) -> u64 {
        (self.touchable_dofs.len() * self.column_length() * self.number.bytes()) as u64
    }

    /// Length of a column: samples × observed degrees of freedom.
    pub fn column_length(&self) -> usize {
        self.samples * self.observed_dofs.len()
    }

    /// First difference to a requested table.
    pub(crate) fn difference(&self, requested: &Self) -> Option<TableDifference> {
        let (a, b) = (&self.attributes, &requested.attributes);
        let differs = |property, stored: &dyn std::fmt::Display, requested: &dyn std::fmt::Display| {
            Some(TableDifference { property, stored: stored.to_string(), requested: requested.to_string() })
        };
        let materials = |m: &Metadata| serde_json::to_string(&(&m.materials, &m.damping)).unwrap_or_default();
        let dofs = |dofs: &[u32]| format!("one of {}", dofs.len());
        match () {
            () if a.recording.provenance.mesh_hash != b.recording.provenance.mesh_hash => {
                differs("the mesh", &named_mesh(a), &named_mesh(b))
            }
            () if materials(&a.recording) != materials(&b.recording) => {
                differs("the material", &materials(&a.recording), &materials(&b.recording))
            }
            () if a.recording.mesh != b.recording.mesh => {
                differs("the order of the elements or the number of fixed nodes", &"another", &"this one")
            }
            () if a.step_s != b.step_s => differs("the step [s]", &a.step_s, &b.step_s),
            () if self.samples != requested.samples => {
                differs("the number of samples", &self.samples, &requested.samples)
            }
            () if a.sampling != b.sampling => differs("the sampling", &a.sampling, &b.sampling),
            () if a.method != b.method => differs("the method", &a.method, &b.method),
            () if self.number != requested.number => {
                differs("the number format", &self.number.name(), &requested.number.name())
            }
            () if self.touchable_dofs != requested.touchable_dofs => differs(
                "the choice of touchable degrees of freedom",
                &dofs(&self.touchable_dofs),
                &dofs(&requested.touchable_dofs),
            ),
            () if self.observed_dofs != requested.observed_dofs => differs(
                "the choice of observed degrees of freedom",
                &dofs(&self.observed_dofs),
                &dofs(&requested.observed_dofs),
            ),
            () => None,
        }
    }
}

/// Name and hash of the mesh, for messages.
fn named_mesh(attributes: &TableAttributes) -> String {
    let from = &attributes.recording.provenance;
    format!("{} ({}…)", from.source, from.mesh_hash.get(..8).unwrap_or(&from.mesh_hash))
}
