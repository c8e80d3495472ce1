//! The messages of a log as JSON.

use super::record::{Picture, Record};
use glam::{DQuat, DVec3};
use palpate::{
    Collider, DeviceMode, EnergyLedger, Grasp, ObjectSnapshot, OscillatorState, Pose, SurfacePoint, Twist,
};
use serde::ser::SerializeMap;
use serde::{Deserialize, Serialize, Serializer};
use std::collections::HashMap;

/// The names of a scene's parts, in the model's order.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Names {
    /// Objects.
    pub objects: Vec<String>,
    /// Devices.
    pub devices: Vec<String>,
    /// Planes and obstacles.
    pub obstacles: Vec<String>,
}

#[derive(Serialize, Deserialize, Clone, Copy, Debug, PartialEq)]
pub(super) struct Xyz {
    x: f64,
    y: f64,
    z: f64,
}

#[derive(Serialize, Deserialize, Clone, Copy, Debug, PartialEq)]
struct Xyzw {
    x: f64,
    y: f64,
    z: f64,
    w: f64,
}

#[derive(Serialize, Deserialize, Clone, Copy, Debug, PartialEq)]
pub(super) struct Placement {
    position: Xyz,
    orientation: Xyzw,
}

impl From<DVec3> for Xyz {
    fn from(v: DVec3) -> Self {
        Self { x: v.x, y: v.y, z: v.z }
    }
}

impl From<Xyz> for DVec3 {
    fn from(v: Xyz) -> Self {
        Self::new(v.x, v.y, v.z)
    }
}

impl From<DQuat> for Xyzw {
    fn from(q: DQuat) -> Self {
        Self { x: q.x, y: q.y, z: q.z, w: q.w }
    }
}

impl From<Pose> for Placement {
    fn from(pose: Pose) -> Self {
        Self { position: pose.position.into(), orientation: pose.orientation.into() }
    }
}

impl From<Placement> for Pose {
    fn from(placement: Placement) -> Self {
        let Xyzw { x, y, z, w } = placement.orientation;
        Self { position: placement.position.into(), orientation: DQuat::from_xyzw(x, y, z, w) }
    }
}

#[derive(Serialize, Deserialize, Clone, Copy, Debug, PartialEq)]
pub(super) struct DeviceMessage {
    pub present: bool,
    pub position: Xyz,
    pub force: Xyz,
    pub proxy: Xyz,
    /// The point that it holds; none when it touches, and in logs of the first version.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub holds: Option<HoldMessage>,
}

#[derive(Serialize, Deserialize, Clone, Copy, Debug, PartialEq)]
pub(super) struct HoldMessage {
    object: usize,
    triangle: u32,
    weights: [f64; 3],
}

impl From<Grasp> for HoldMessage {
    fn from(Grasp { object, point }: Grasp) -> Self {
        Self { object, triangle: point.triangle, weights: point.weights }
    }
}

impl From<HoldMessage> for Grasp {
    fn from(HoldMessage { object, triangle, weights }: HoldMessage) -> Self {
        Self { object, point: SurfacePoint { triangle, weights } }
    }
}

#[derive(Serialize, Deserialize, Clone, Copy, Debug, PartialEq)]
pub(super) struct ObjectMessage {
    pub pose: Placement,
    pub velocity: Xyz,
    pub angular_velocity: Xyz,
}

/// How an object begins.
#[derive(Serialize, Deserialize, Clone, Debug, PartialEq)]
pub(super) struct StartMessage {
    #[serde(flatten)]
    object: ObjectMessage,
    angular_momentum: Xyz,
    /// q [m·√kg] and its rate of every mode.
    modes: Vec<[f64; 2]>,
}

impl From<&ObjectSnapshot> for StartMessage {
    fn from(motion: &ObjectSnapshot) -> Self {
        let object = ObjectMessage {
            pose: motion.pose.into(),
            velocity: motion.twist.linear.into(),
            angular_velocity: motion.twist.angular.into(),
        };
        let modes = motion.modes.iter().map(|mode| [mode.q, mode.v]).collect();
        Self { object, angular_momentum: motion.angular_momentum.into(), modes }
    }
}

impl From<StartMessage> for ObjectSnapshot {
    fn from(StartMessage { object, angular_momentum, modes }: StartMessage) -> Self {
        Self {
            pose: object.pose.into(),
            twist: Twist { linear: object.velocity.into(), angular: object.angular_velocity.into() },
            angular_momentum: angular_momentum.into(),
            modes: modes.into_iter().map(|[q, v]| OscillatorState { q, v }).collect(),
        }
    }
}

#[derive(Serialize, Deserialize, Clone, Copy, Debug, PartialEq)]
pub(super) struct EnergyMessage {
    pub kinetic: f64,
    pub elastic: f64,
    pub residual: f64,
    pub potential: f64,
    pub coupling: f64,
    pub input: f64,
    pub dissipated: f64,
    pub friction: f64,
    pub impact: f64,
}

impl From<&EnergyLedger> for EnergyMessage {
    fn from(e: &EnergyLedger) -> Self {
        Self {
            kinetic: e.kinetic,
            elastic: e.elastic,
            residual: e.residual,
            potential: e.potential,
            coupling: e.coupling,
            input: e.input,
            dissipated: e.dissipated,
            friction: e.friction,
            impact: e.impact,
        }
    }
}

impl From<&EnergyMessage> for EnergyLedger {
    fn from(e: &EnergyMessage) -> Self {
        Self {
            kinetic: e.kinetic,
            elastic: e.elastic,
            residual: e.residual,
            potential: e.potential,
            coupling: e.coupling,
            input: e.input,
            dissipated: e.dissipated,
            friction: e.friction,
            impact: e.impact,
            defect: 0.0,
        }
    }
}

#[derive(Serialize, Deserialize, Clone, Copy, Debug, PartialEq)]
pub(super) struct StatusMessage {
    pub residual_m: f64,
    pub unsolved: u32,
    pub dropped: u32,
    pub rejected: u32,
}

#[derive(Serialize, Deserialize, Clone, Copy, Debug, PartialEq)]
pub(super) struct TimingMessage {
    pub tick: u64,
    pub late_us: f64,
    pub compute_us: f64,
}

/// `/step` as it is read.
#[derive(Deserialize, Debug)]
pub(super) struct StepMessage {
    pub step: u64,
    pub devices: HashMap<String, DeviceMessage>,
    pub obstacles: HashMap<String, Placement>,
    pub objects: HashMap<String, ObjectMessage>,
    pub energy: EnergyMessage,
}

/// `/step` as it is written.
pub(super) struct StepOf<'a>(pub &'a Record, pub &'a Names);

/// Entries by their names.
struct Named<'a, F>(&'a [String], F);

impl<T: Serialize, F: Fn(usize) -> T> Serialize for Named<'_, F> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.0.len()))?;
        for (at, name) in self.0.iter().enumerate() {
            map.serialize_entry(name, &(self.1)(at))?;
        }
        map.end()
    }
}

impl Serialize for StepOf<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Self(record, names) = self;
        let device = |at: usize| {
            let (input, output) = (&record.input.devices[at], &record.devices[at]);
            DeviceMessage {
                present: input.mode != DeviceMode::Inactive,
                position: input.position.into(),
                force: output.force_on_hand.into(),
                proxy: output.proxy.into(),
                holds: match input.mode {
                    DeviceMode::Held(grasp) => Some(grasp.into()),
                    DeviceMode::Inactive | DeviceMode::Touch => None,
                },
            }
        };
        let object = |at: usize| {
            let output = &record.objects[at];
            ObjectMessage {
                pose: output.pose.into(),
                velocity: output.twist.linear.into(),
                angular_velocity: output.twist.angular.into(),
            }
        };
        let status = StatusMessage {
            residual_m: record.status.solver_residual_m,
            unsolved: record.status.unsolved_islands,
            dropped: record.status.dropped_contacts,
            rejected: record.status.rejected_inputs,
        };
        let microseconds = |time: std::time::Duration| time.as_nanos() as f64 * 1e-3;
        let timing = TimingMessage {
            tick: record.tick,
            late_us: microseconds(record.late),
            compute_us: microseconds(record.took),
        };
        let mut map = serializer.serialize_map(Some(7))?;
        map.serialize_entry("step", &record.step)?;
        map.serialize_entry("devices", &Named(&names.devices, device))?;
        let obstacle = |at: usize| Placement::from(record.input.obstacles[at]);
        map.serialize_entry("obstacles", &Named(&names.obstacles, obstacle))?;
        map.serialize_entry("objects", &Named(&names.objects, object))?;
        map.serialize_entry("energy", &EnergyMessage::from(&record.energy))?;
        map.serialize_entry("status", &status)?;
        map.serialize_entry("timing", &timing)?;
        map.end()
    }
}

/// `/contacts`.
#[derive(Serialize)]
pub(super) struct ContactMessage<'a> {
    object: &'a str,
    against: &'a str,
    point: Xyz,
    normal: Xyz,
    force: Xyz,
    gap: f64,
    slip_speed: f64,
}

pub(super) fn contacts<'a>(
    picture: &Picture,
    names: &'a Names,
) -> HashMap<&'static str, Vec<ContactMessage<'a>>> {
    let name = |list: &'a [String], at: usize| list.get(at).map_or("", String::as_str);
    let one = |contact: &palpate::ContactOutput| ContactMessage {
        object: name(&names.objects, contact.object),
        against: match contact.against {
            Collider::Device(at) => name(&names.devices, at),
            Collider::Obstacle(at) => name(&names.obstacles, at),
            Collider::Object(at) => name(&names.objects, at),
        },
        point: contact.point.into(),
        normal: contact.normal.into(),
        force: contact.force.into(),
        gap: contact.gap,
        slip_speed: contact.slip_speed,
    };
    HashMap::from([("contacts", picture.contacts.iter().map(one).collect())])
}

/// `/modes`.
pub(super) struct ModesOf<'a>(pub &'a Picture, pub &'a Names);

impl Serialize for ModesOf<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Named(&self.1.objects, |at: usize| &self.0.modes[at]).serialize(serializer)
    }
}

/// `/tf`: foxglove.FrameTransforms.
pub(super) fn transforms(picture: &Picture, names: &Names, nanoseconds: u64) -> serde_json::Value {
    let stamp =
        serde_json::json!({ "sec": nanoseconds / 1_000_000_000, "nsec": nanoseconds % 1_000_000_000 });
    let objects = names.objects.iter().zip(picture.objects.iter().copied());
    let obstacles = names.obstacles.iter().zip(picture.obstacles.iter().copied());
    let one = |(name, pose): (&String, Pose)| {
        let Placement { position, orientation } = pose.into();
        serde_json::json!({
            "timestamp": stamp, "parent_frame_id": "world", "child_frame_id": name,
            "translation": position, "rotation": orientation,
        })
    };
    serde_json::json!({ "transforms": objects.chain(obstacles).map(one).collect::<Vec<_>>() })
}
