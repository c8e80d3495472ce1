//! Keys of a scene file. Keys of earlier versions are aliases.

use super::entries::{
    Entry, FromValue, Key, ReadResult, TomlValue, entries, refuse, whole_number, wrong_type,
};
use std::collections::BTreeMap;
use std::path::PathBuf;
use toml::Spanned;
use toml::de::DeValue;

/// Upper bound of lengths [m], velocities and accelerations.
pub(super) const LARGEST: f64 = 1e6;

entries! {
    SceneFile {
        step: Option<Spanned<f64>>,
        gravity: Option<Gravity>,
        integrator (alias = "motion"): Option<Spanned<String>>,
        rigid_compliance: Option<bool>,
        max_contact_points (alias = "most_contact_points"): Option<Spanned<i64>>,
        max_contact_samples (alias = "most_places"): Option<Spanned<i64>>,
        solver_budget: Option<Spanned<i64>>,
        sleep_after: Option<Spanned<f64>>,
        object: Vec<ObjectEntry>,
        plane: Vec<Spanned<PlaneEntry>>,
        obstacle: Vec<Spanned<ObstacleEntry>>,
        device: Vec<DeviceEntry>,
        probe: Vec<ProbeEntry>,
        clamp: Vec<ClampEntry>,
    }

    ClampEntry {
        name: Spanned<String>,
        object: Spanned<String>,
        face: Option<Spanned<FaceEntry>>,
        region = "box": Option<Spanned<RegionEntry>>,
        max_cells: Option<Spanned<i64>>,
        path: Option<PathEntry>,
    }

    FaceEntry {
        point: Spanned<Numbers<3>>,
        radius: Option<Spanned<f64>>,
    }

    RegionEntry {
        min: Spanned<Numbers<3>>,
        max: Spanned<Numbers<3>>,
    }

    ProbeEntry {
        name: Spanned<String>,
        object: Spanned<String>,
        point: Spanned<Numbers<3>>,
    }

    ObjectEntry {
        name: Spanned<String>,
        recording: Spanned<PathBuf>,
        response: Option<Spanned<String>>,
        table: Option<Spanned<PathBuf>>,
        position: Option<Spanned<Numbers<3>>>,
        path: Option<PathEntry>,
        orientation: Option<Numbers<4>>,
        velocity: Option<Numbers<3>>,
        angular_velocity: Option<Numbers<3>>,
        start: Option<Spanned<String>>,
        friction: Option<Spanned<f64>>,
    }

    PlaneEntry {
        name: Option<Spanned<String>>,
        point: Option<Spanned<Numbers<3>>>,
        normal: Spanned<Numbers<3>>,
        path: Option<PathEntry>,
        friction: Option<Spanned<f64>>,
    }

    ObstacleEntry {
        name: Option<Spanned<String>>,
        sphere: Option<SphereEntry>,
        cuboid = "box": Option<BoxEntry>,
        capsule: Option<CapsuleEntry>,
        mesh: Option<MeshEntry>,
        position: Option<Spanned<Numbers<3>>>,
        orientation: Option<Spanned<Numbers<4>>>,
        path: Option<PathEntry>,
        friction: Option<Spanned<f64>>,
    }

    SphereEntry {
        radius: Spanned<f64>,
    }

    BoxEntry {
        half_extents: Spanned<Numbers<3>>,
    }

    CapsuleEntry {
        radius: Spanned<f64>,
        half_length: Spanned<f64>,
    }

    MeshEntry {
        file: Spanned<PathBuf>,
        scale: Option<Spanned<f64>>,
    }

    DeviceEntry {
        name: Spanned<String>,
        mode: Spanned<String>,
        attach: Option<Spanned<AttachEntry>>,
        path: Option<PathEntry>,
        linked: Option<Spanned<bool>>,
        pointer: Option<Spanned<bool>>,
        tip_radius: Option<Spanned<f64>>,
        patch_radius: Option<Spanned<f64>>,
        friction: Option<Spanned<f64>>,
        coupling: Option<Spanned<CouplingChoice>>,
        simulated: Option<SimulatedEntry>,
        driver: Option<Spanned<DriverEntry>>,
        mount: Option<Spanned<MountEntry>>,
        limits: Option<LimitEntries>,
    }

    DriverEntry {
        kind: Spanned<String>,
        id (alias = "which"): Option<Spanned<DriverId>>,
        max_force (alias = "force"): Option<Spanned<f64>>,
        armed: Option<bool>,
    }

    MountEntry {
        position: Option<Numbers<3>>,
        orientation: Option<Spanned<Numbers<4>>>,
        scale: Option<Spanned<f64>>,
    }

    SimulatedEntry {
        device: Spanned<String>,
        grip: Option<Spanned<String>>,
    }

    AttachEntry {
        object: Spanned<String>,
        point: Spanned<Numbers<3>>,
    }

    CouplingEntry {
        stiffness: Spanned<f64>,
        damping: Option<Spanned<f64>>,
    }

    PathEntry {
        file: Spanned<PathBuf>,
        repeat: Option<bool>,
    }
}

/// Limits by name.
pub(super) type LimitEntries = Spanned<BTreeMap<String, Spanned<f64>>>;

/// Device of a driver: a number, a name, or what is neither.
pub(super) enum DriverId {
    Number(i64),
    Name(String),
    Neither,
}

impl FromValue for DriverId {
    fn from_value(value: &TomlValue) -> ReadResult<Self> {
        Ok(match value.get_ref() {
            DeValue::Integer(number) => whole_number(number).map_or(Self::Neither, Self::Number),
            DeValue::String(name) => Self::Name(name.to_string()),
            _ => Self::Neither,
        })
    }
}

/// Virtual coupling: `"auto"`, or gains.
pub(super) enum CouplingChoice {
    Word(String),
    Gains(CouplingEntry),
}

impl FromValue for CouplingChoice {
    fn from_value(value: &TomlValue) -> ReadResult<Self> {
        match value.get_ref() {
            DeValue::String(word) => Ok(Self::Word(word.to_string())),
            DeValue::Table(_) => CouplingEntry::from_value(value).map(Self::Gains),
            _ => wrong_type(value, "{ stiffness = …, damping = … } or \"auto\""),
        }
    }
}

/// Gravity: a vector, or a file with its course in time.
pub(super) enum Gravity {
    Constant(Numbers<3>),
    Changing(PathEntry),
}

impl FromValue for Gravity {
    fn from_value(value: &TomlValue) -> ReadResult<Self> {
        match value.get_ref() {
            DeValue::Array(_) => Numbers::from_value(value).map(Self::Constant),
            DeValue::Table(_) => PathEntry::from_value(value).map(Self::Changing),
            _ => wrong_type(value, "[x, y, z] in m/s², or { file = \"…\" } with the columns t, x, y, z"),
        }
    }
}

/// Array of finite numbers below [`LARGEST`].
#[derive(Clone, Copy)]
pub(super) struct Numbers<const N: usize>(pub [f64; N]);

impl<const N: usize> FromValue for Numbers<N> {
    fn from_value(value: &TomlValue) -> ReadResult<Self> {
        let numbers: Vec<f64> = Vec::from_value(value)?;
        let Ok(array) = <[f64; N]>::try_from(&numbers[..]) else {
            return refuse(value, format!("{} numbers, expected {N}", numbers.len()));
        };
        if !numbers.iter().all(|number| number.abs() < LARGEST) {
            return refuse(value, format!("{numbers:?}, expected finite numbers below {LARGEST:e}"));
        }
        Ok(Self(array))
    }
}
