//! Keys of a scene file. Keys of earlier versions are aliases.

use serde::de::value::{MapAccessDeserializer, SeqAccessDeserializer};
use serde::de::{Error, MapAccess, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use std::collections::BTreeMap;
use std::path::PathBuf;
use toml::Spanned;

/// Upper bound of lengths [m], velocities and accelerations.
pub(super) const LARGEST: f64 = 1e6;

/// Keys in an old spelling, which open but are not listed in errors.
pub(super) const RETIRED_KEYS: [&str; 5] = ["motion", "most_contact_points", "most_places", "which", "force"];

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SceneFile {
    pub step: Option<Spanned<f64>>,
    #[serde(default)]
    pub gravity: Gravity,
    #[serde(alias = "motion")]
    pub integrator: Option<Spanned<String>>,
    pub rigid_compliance: Option<bool>,
    #[serde(alias = "most_contact_points")]
    pub max_contact_points: Option<Spanned<i64>>,
    #[serde(alias = "most_places")]
    pub max_contact_samples: Option<Spanned<i64>>,
    pub solver_budget: Option<Spanned<i64>>,
    pub sleep_after: Option<Spanned<f64>>,
    #[serde(default)]
    pub object: Vec<ObjectEntry>,
    #[serde(default)]
    pub plane: Vec<Spanned<PlaneEntry>>,
    #[serde(default)]
    pub obstacle: Vec<Spanned<ObstacleEntry>>,
    #[serde(default)]
    pub device: Vec<DeviceEntry>,
    #[serde(default)]
    pub probe: Vec<ProbeEntry>,
    #[serde(default)]
    pub clamp: Vec<ClampEntry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ClampEntry {
    pub name: Spanned<String>,
    pub object: Spanned<String>,
    pub face: Option<Spanned<FaceEntry>>,
    #[serde(rename = "box")]
    pub region: Option<Spanned<RegionEntry>>,
    pub max_cells: Option<Spanned<i64>>,
    pub path: Option<PathEntry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FaceEntry {
    pub point: Spanned<Numbers<3>>,
    pub radius: Option<Spanned<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RegionEntry {
    pub min: Spanned<Numbers<3>>,
    pub max: Spanned<Numbers<3>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ProbeEntry {
    pub name: Spanned<String>,
    pub object: Spanned<String>,
    pub point: Spanned<Numbers<3>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ObjectEntry {
    pub name: Spanned<String>,
    pub recording: Spanned<PathBuf>,
    pub response: Option<Spanned<String>>,
    pub table: Option<Spanned<PathBuf>>,
    pub position: Option<Spanned<Numbers<3>>>,
    pub path: Option<PathEntry>,
    #[serde(default = "identity")]
    pub orientation: Numbers<4>,
    #[serde(default)]
    pub velocity: Numbers<3>,
    #[serde(default)]
    pub angular_velocity: Numbers<3>,
    pub start: Option<Spanned<String>>,
    pub friction: Option<Spanned<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PlaneEntry {
    pub name: Option<Spanned<String>>,
    pub point: Option<Spanned<Numbers<3>>>,
    pub normal: Spanned<Numbers<3>>,
    pub path: Option<PathEntry>,
    pub friction: Option<Spanned<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ObstacleEntry {
    pub name: Option<Spanned<String>>,
    pub sphere: Option<SphereEntry>,
    #[serde(rename = "box")]
    pub cuboid: Option<BoxEntry>,
    pub capsule: Option<CapsuleEntry>,
    pub mesh: Option<MeshEntry>,
    pub position: Option<Spanned<Numbers<3>>>,
    pub orientation: Option<Spanned<Numbers<4>>>,
    pub path: Option<PathEntry>,
    pub friction: Option<Spanned<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SphereEntry {
    pub radius: Spanned<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct BoxEntry {
    pub half_extents: Spanned<Numbers<3>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CapsuleEntry {
    pub radius: Spanned<f64>,
    pub half_length: Spanned<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MeshEntry {
    pub file: Spanned<PathBuf>,
    pub scale: Option<Spanned<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DeviceEntry {
    pub name: Spanned<String>,
    pub mode: Spanned<String>,
    pub attach: Option<Spanned<AttachEntry>>,
    pub path: Option<PathEntry>,
    pub linked: Option<Spanned<bool>>,
    pub pointer: Option<Spanned<bool>>,
    pub tip_radius: Option<Spanned<f64>>,
    pub patch_radius: Option<Spanned<f64>>,
    pub friction: Option<Spanned<f64>>,
    pub coupling: Option<Spanned<CouplingChoice>>,
    pub simulated: Option<SimulatedEntry>,
    pub driver: Option<Spanned<DriverEntry>>,
    pub mount: Option<Spanned<MountEntry>>,
    pub limits: Option<LimitEntries>,
}

/// Limits by name.
pub(super) type LimitEntries = Spanned<BTreeMap<String, Spanned<f64>>>;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DriverEntry {
    pub kind: Spanned<String>,
    /// Number or name.
    #[serde(alias = "which")]
    pub id: Option<Spanned<toml::Value>>,
    #[serde(alias = "force")]
    pub max_force: Option<Spanned<f64>>,
    pub armed: Option<bool>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MountEntry {
    #[serde(default)]
    pub position: Numbers<3>,
    pub orientation: Option<Spanned<Numbers<4>>>,
    pub scale: Option<Spanned<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SimulatedEntry {
    pub device: Spanned<String>,
    pub grip: Option<Spanned<String>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AttachEntry {
    pub object: Spanned<String>,
    pub point: Spanned<Numbers<3>>,
}

/// Virtual coupling: `"auto"`, or gains.
pub(super) enum CouplingChoice {
    Word(String),
    Gains(CouplingEntry),
}

impl<'de> Deserialize<'de> for CouplingChoice {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Choice;
        impl<'de> Visitor<'de> for Choice {
            type Value = CouplingChoice;

            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("{ stiffness = …, damping = … } or \"auto\"")
            }

            fn visit_str<E: Error>(self, word: &str) -> Result<Self::Value, E> {
                Ok(CouplingChoice::Word(word.into()))
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
                CouplingEntry::deserialize(MapAccessDeserializer::new(map)).map(CouplingChoice::Gains)
            }
        }
        deserializer.deserialize_any(Choice)
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CouplingEntry {
    pub stiffness: Spanned<f64>,
    pub damping: Option<Spanned<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PathEntry {
    pub file: Spanned<PathBuf>,
    #[serde(default)]
    pub repeat: bool,
}

/// Gravity: a vector, or a file with its course in time.
pub(super) enum Gravity {
    Constant(Numbers<3>),
    Changing(PathEntry),
}

impl Default for Gravity {
    fn default() -> Self {
        Self::Constant(Numbers::default())
    }
}

impl<'de> Deserialize<'de> for Gravity {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Choice;
        impl<'de> Visitor<'de> for Choice {
            type Value = Gravity;

            fn expecting(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
                f.write_str("[x, y, z] in m/s², or { file = \"…\" } with the columns t, x, y, z")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, numbers: A) -> Result<Self::Value, A::Error> {
                Numbers::deserialize(SeqAccessDeserializer::new(numbers)).map(Gravity::Constant)
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Self::Value, A::Error> {
                PathEntry::deserialize(MapAccessDeserializer::new(map)).map(Gravity::Changing)
            }
        }
        deserializer.deserialize_any(Choice)
    }
}

/// Array of finite numbers below [`LARGEST`].
#[derive(Clone, Copy)]
pub(super) struct Numbers<const N: usize>(pub [f64; N]);

impl<const N: usize> Default for Numbers<N> {
    fn default() -> Self {
        Self([0.0; N])
    }
}

impl<'de, const N: usize> Deserialize<'de> for Numbers<N> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let numbers: Vec<f64> = Vec::deserialize(deserializer)?;
        let array: [f64; N] = numbers.try_into().map_err(|numbers: Vec<f64>| {
            D::Error::custom(format!("{} numbers, expected {N}", numbers.len()))
        })?;
        if !array.iter().all(|number| number.abs() < LARGEST) {
            return Err(D::Error::custom(format!("{array:?}, expected finite numbers below {LARGEST:e}")));
        }
        Ok(Self(array))
    }
}

fn identity() -> Numbers<4> {
    Numbers([1.0, 0.0, 0.0, 0.0])
}
