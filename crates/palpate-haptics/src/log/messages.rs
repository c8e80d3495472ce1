//! Messages of a log, as JSON.

use super::records::{FrameRecord, StepRecord};
use crate::scene_names::SceneNames;
use glam::{DQuat, DVec3};
use palpate::{
    AppliedForce, Collider, DeviceMode, EnergyLedger, Grasp, ObjectSnapshot, OscillatorState, Pose,
    SurfacePoint, Twist,
};
use serde::ser::SerializeMap;
use serde::{Deserialize, Serialize, Serializer};
use std::collections::{BTreeMap, HashMap};

/// Topic of the steps.
pub(super) const STEP_TOPIC: &str = "/step";

/// Frame of a clamp [m, world], and reaction force [N] and torque [N·m] on it.
#[derive(Serialize, Deserialize, Clone, Copy, Debug, PartialEq)]
pub(super) struct ClampMessage {
    pub frame: PoseMessage,
    pub force: Xyz,
    pub torque: Xyz,
}

/// Vector.
#[derive(Serialize, Deserialize, Clone, Copy, Debug, PartialEq)]
pub(super) struct Xyz {
    x: f64,
    y: f64,
    z: f64,
}

/// Quaternion.
#[derive(Serialize, Deserialize, Clone, Copy, Debug, PartialEq)]
struct Xyzw {
    x: f64,
    y: f64,
    z: f64,
    w: f64,
}

/// Pose [m, world].
#[derive(Serialize, Deserialize, Clone, Copy, Debug, PartialEq)]
pub(super) struct PoseMessage {
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

impl From<Pose> for PoseMessage {
    fn from(pose: Pose) -> Self {
        Self { position: pose.position.into(), orientation: pose.orientation.into() }
    }
}

impl From<PoseMessage> for Pose {
    fn from(placement: PoseMessage) -> Self {
        let Xyzw { x, y, z, w } = placement.orientation;
        Self { position: placement.position.into(), orientation: DQuat::from_xyzw(x, y, z, w) }
    }
}

/// Input and output of a device: position [m], force on the hand [N] and proxy [m], all in world axes.
#[derive(Serialize, Deserialize, Clone, Copy, Debug, PartialEq)]
pub(super) struct DeviceMessage {
    /// Whether the device is active.
    pub present: bool,
    /// Whether it is silent for now.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub suspended: bool,
    pub position: Xyz,
    pub force: Xyz,
    pub proxy: Xyz,
    /// Held point; `None` for a device that touches, and in logs of the first form.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub holds: Option<HeldPointMessage>,
    /// Prescribed force; `None` in other modes, and in logs before version 0.4.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exerts: Option<AppliedForceMessage>,
}

/// Prescribed force [N, world] and the point that it acts on.
#[derive(Serialize, Deserialize, Clone, Copy, Debug, PartialEq)]
pub(super) struct AppliedForceMessage {
    on: HeldPointMessage,
    force: Xyz,
}

impl From<AppliedForce> for AppliedForceMessage {
    fn from(AppliedForce { grasp, force }: AppliedForce) -> Self {
        Self { on: grasp.into(), force: force.into() }
    }
}

impl From<AppliedForceMessage> for AppliedForce {
    fn from(AppliedForceMessage { on, force }: AppliedForceMessage) -> Self {
        Self { grasp: on.into(), force: force.into() }
    }
}

/// Held point: object, triangle of its surface, barycentric weights.
#[derive(Serialize, Deserialize, Clone, Copy, Debug, PartialEq)]
pub(super) struct HeldPointMessage {
    object: usize,
    triangle: u32,
    weights: [f64; 3],
}

impl From<Grasp> for HeldPointMessage {
    fn from(Grasp { object, point }: Grasp) -> Self {
        Self { object, triangle: point.triangle, weights: point.weights }
    }
}

impl From<HeldPointMessage> for Grasp {
    fn from(HeldPointMessage { object, triangle, weights }: HeldPointMessage) -> Self {
        Self { object, point: SurfacePoint { triangle, weights } }
    }
}

/// Motion of an object [m, m/s, rad/s, world].
#[derive(Serialize, Deserialize, Clone, Copy, Debug, PartialEq)]
pub(super) struct ObjectMessage {
    pub pose: PoseMessage,
    pub velocity: Xyz,
    pub angular_velocity: Xyz,
    /// Largest penetration of its contacts [m]; older logs lack it.
    #[serde(default)]
    pub penetration_m: f64,
}

/// Initial state of an object.
#[derive(Serialize, Deserialize, Clone, Debug, PartialEq)]
pub(super) struct StartMessage {
    #[serde(flatten)]
    object: ObjectMessage,
    angular_momentum: Xyz,
    /// Modal coordinate q [m·√kg] and its rate, of every mode.
    modes: Vec<[f64; 2]>,
}

impl From<&ObjectSnapshot> for StartMessage {
    fn from(motion: &ObjectSnapshot) -> Self {
        let object = ObjectMessage {
            pose: motion.pose.into(),
            velocity: motion.twist.linear.into(),
            angular_velocity: motion.twist.angular.into(),
            penetration_m: 0.0,
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

/// Energy ledger of the scene [J].
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

/// Status of the step: residual of the solver [m], unsolved islands, dropped contacts, rejected inputs.
#[derive(Serialize, Deserialize, Clone, Copy, Debug, PartialEq)]
pub(super) struct StatusMessage {
    pub residual_m: f64,
    pub unsolved: u32,
    pub dropped: u32,
    pub rejected: u32,
}

/// Timing of the cycle: tick of the clock, lateness [µs], compute time [µs].
#[derive(Serialize, Deserialize, Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct TimingMessage {
    pub tick: u64,
    pub late_us: f64,
    pub compute_us: f64,
}

/// Message `/step`, for reading.
#[derive(Deserialize, Debug)]
pub(super) struct StepMessage {
    pub step: u64,
    pub devices: HashMap<String, DeviceMessage>,
    pub obstacles: HashMap<String, PoseMessage>,
    /// Clamps; logs before version 0.4 have none.
    #[serde(default)]
    pub clamps: HashMap<String, ClampMessage>,
    /// Positions that bases go to [m, world], by the names of their objects.
    #[serde(default)]
    pub bases: HashMap<String, Xyz>,
    /// Gravity [m/s², world], where it changes in time.
    #[serde(default)]
    pub gravity: Option<Xyz>,
    pub objects: HashMap<String, ObjectMessage>,
    pub energy: EnergyMessage,
    /// Zero in a log without times.
    #[serde(default)]
    pub timing: TimingMessage,
}

/// Message `/step`, for writing.
pub(super) struct StepMessageOf<'a>(pub &'a StepRecord, pub &'a SceneNames);

/// Map from names to entries, in the order of the names.
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

impl Serialize for StepMessageOf<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Self(record, names) = self;
        let device = |at: usize| {
            let (input, output) = (&record.input.devices[at], &record.devices[at]);
            DeviceMessage {
                present: input.mode.is_active(),
                suspended: input.mode == DeviceMode::Suspended,
                position: input.position.into(),
                force: output.force_on_hand.into(),
                proxy: output.proxy.into(),
                holds: match input.mode {
                    DeviceMode::Held(grasp) => Some(grasp.into()),
                    _ => None,
                },
                exerts: match input.mode {
                    DeviceMode::Force(applied) => Some(applied.into()),
                    _ => None,
                },
            }
        };
        let object = |at: usize| {
            let output = &record.objects[at];
            ObjectMessage {
                pose: output.pose.into(),
                velocity: output.twist.linear.into(),
                angular_velocity: output.twist.angular.into(),
                penetration_m: output.penetration_m,
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
            late_us: microseconds(record.lateness),
            compute_us: microseconds(record.compute),
        };
        let optional = usize::from(record.input.gravity.is_some()) + usize::from(!names.clamps.is_empty());
        let bases: Vec<usize> =
            (0..record.input.bases.len()).filter(|at| record.input.bases[*at].is_some()).collect();
        let optional = optional + usize::from(!bases.is_empty());
        let mut map = serializer.serialize_map(Some(7 + optional))?;
        map.serialize_entry("step", &record.step)?;
        map.serialize_entry("devices", &Named(&names.devices, device))?;
        let obstacle = |at: usize| PoseMessage::from(record.input.obstacles[at]);
        map.serialize_entry("obstacles", &Named(&names.obstacles, obstacle))?;
        if !names.clamps.is_empty() {
            let clamp = |at: usize| ClampMessage {
                frame: record.input.clamps[at].into(),
                force: record.clamps[at].force.into(),
                torque: record.clamps[at].torque.into(),
            };
            map.serialize_entry("clamps", &Named(&names.clamps, clamp))?;
        }
        if !bases.is_empty() {
            let moving = bases.iter().filter_map(|&at| Some((&names.objects[at], record.input.bases[at]?)));
            let message: BTreeMap<&String, Xyz> =
                moving.map(|(name, position)| (name, position.into())).collect();
            map.serialize_entry("bases", &message)?;
        }
        if let Some(gravity) = record.input.gravity {
            map.serialize_entry("gravity", &Xyz::from(gravity))?;
        }
        map.serialize_entry("objects", &Named(&names.objects, object))?;
        map.serialize_entry("energy", &EnergyMessage::from(&record.energy))?;
        map.serialize_entry("status", &status)?;
        map.serialize_entry("timing", &timing)?;
        map.end()
    }
}

/// Contact of message `/contacts`: point [m], normal out of the object, force on the object [N], gap [m], slip speed [m/s].
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

/// Message `/contacts`.
pub(super) fn contacts<'a>(
    frame: &FrameRecord,
    names: &'a SceneNames,
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
    HashMap::from([("contacts", frame.contacts.iter().map(one).collect())])
}

/// Message `/modes`.
pub(super) struct ModesMessage<'a>(pub &'a FrameRecord, pub &'a SceneNames);

impl Serialize for ModesMessage<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Named(&self.1.objects, |at: usize| &self.0.modes[at]).serialize(serializer)
    }
}

/// Message `/tf`: `foxglove.FrameTransforms`.
pub(super) fn transforms(frame: &FrameRecord, names: &SceneNames, nanoseconds: u64) -> serde_json::Value {
    let stamp =
        serde_json::json!({ "sec": nanoseconds / 1_000_000_000, "nsec": nanoseconds % 1_000_000_000 });
    let objects = names.objects.iter().zip(frame.objects.iter().copied());
    let obstacles = names.obstacles.iter().zip(frame.obstacles.iter().copied());
    let one = |(name, pose): (&String, Pose)| {
        let PoseMessage { position, orientation } = pose.into();
        serde_json::json!({
            "timestamp": stamp, "parent_frame_id": "world", "child_frame_id": name,
            "translation": position, "rotation": orientation,
        })
    };
    serde_json::json!({ "transforms": objects.chain(obstacles).map(one).collect::<Vec<_>>() })
}
