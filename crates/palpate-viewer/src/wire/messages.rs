//! Messages as JSON.

use glam::{DQuat, DVec3};
use palpate::{Coupling, Model, ModelParameters, Pose, Recording, Shape, Support};
use palpate_haptics::Percentiles;
use serde::{Deserialize, Serialize};

/// A scene that can be opened.
#[derive(Debug, Clone, Serialize)]
pub struct SceneTitle {
    /// By which it is asked for.
    pub id: String,
    /// For people.
    pub title: String,
    /// A line for people: what there is to do.
    pub about: String,
}

/// A log that is shown.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct LogTitle {
    pub name: String,
}

/// What a page is told first.
#[derive(Debug, Clone, Serialize)]
#[serde(tag = "type", rename = "hello")]
pub(crate) struct Hello {
    pub protocol: u32,
    pub version: &'static str,
    pub kind: &'static str,
    pub scenes: Vec<SceneTitle>,
    pub logs: Vec<LogTitle>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub render: Option<RenderWish>,
}

/// Pictures that a page in a headless browser is to draw.
#[derive(Debug, Clone, Serialize)]
pub struct RenderWish {
    /// Which frames of the first log.
    pub frames: Vec<u64>,
    /// Pixels.
    pub width: u32,
    /// See `width`.
    pub height: u32,
    /// Where the camera is and what it looks at [m, world]; none is the usual view.
    pub camera: Option<CameraView>,
    /// What colours tell: `displacement`, `strain` or `plain`.
    pub colour: String,
    /// On a dark ground.
    pub dark: bool,
}

/// A camera.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct CameraView {
    /// Where it is [m, world].
    pub from: [f64; 3],
    /// What it looks at [m, world].
    pub to: [f64; 3],
}

/// A scene, as the page shows it.
#[derive(Debug, Clone, Serialize)]
pub struct SceneDescription {
    /// By which it was asked for, if it is one of those that can be.
    pub id: Option<String>,
    /// For people.
    pub title: String,
    /// See `title`.
    pub about: String,
    /// Step [s].
    pub step_s: f64,
    /// Gravity [m/s², world].
    pub gravity: [f64; 3],
    /// Its parts, in the model's order.
    pub objects: Vec<ObjectDescription>,
    /// See `objects`.
    pub obstacles: Vec<ObstacleDescription>,
    /// See `objects`.
    pub devices: Vec<DeviceDescription>,
    /// What the camera should see at first.
    pub view: View,
    /// Of a log.
    #[serde(flatten)]
    pub frames: Option<FrameTimes>,
}

/// The frames of a log.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct FrameTimes {
    /// Its number.
    pub log: usize,
    /// How many frames there are at the end.
    pub frames: u64,
    /// Time [s] between them.
    pub frame_s: f64,
}

/// An object of a scene.
#[derive(Debug, Clone, Serialize)]
pub struct ObjectDescription {
    /// Its name.
    pub name: String,
    /// Surface nodes.
    pub nodes: usize,
    /// Triangles.
    pub triangles: usize,
    /// Modes; none of an object that uses a table.
    pub modes: usize,
    /// Largest distance from the centre of mass [m].
    pub radius: f64,
    /// [kg]
    pub mass: f64,
    /// Whether nodes are fixed.
    pub fixed: bool,
    /// Of an object of one.
    pub material: Option<MaterialDescription>,
    /// Whether it can be recorded with another material.
    pub recordable: bool,
    /// What its recording says of its own error, for people.
    pub certificate: Vec<String>,
}

/// An isotropic material.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MaterialDescription {
    /// Young's modulus [Pa].
    pub young: f64,
    /// Poisson's ratio [1].
    pub poisson: f64,
    /// [kg/m³]
    pub density: f64,
}

/// A plane or an obstacle.
#[derive(Debug, Clone, Serialize)]
pub struct ObstacleDescription {
    /// Its name.
    pub name: String,
    /// What it looks like.
    pub shape: ShapeDescription,
    /// Where it is at the start: position, then x, y, z, w.
    pub pose: [f64; 7],
    /// Coulomb's coefficient [1].
    pub friction: f64,
}

/// The shape of an obstacle.
#[derive(Debug, Clone, Copy, Serialize)]
#[serde(rename_all = "lowercase")]
#[allow(missing_docs)]
pub enum ShapeDescription {
    Plane {},
    Sphere { radius: f64 },
    Box { half_extents: [f64; 3] },
    Capsule { radius: f64, half_length: f64 },
    Mesh {},
}

/// A device of a scene.
#[derive(Debug, Clone, Serialize)]
pub struct DeviceDescription {
    /// Its name.
    pub name: String,
    /// Whether a pointer of the page can be it.
    pub pointer: bool,
    /// [m]
    pub tip_radius: f64,
    /// [m]
    pub patch_radius: f64,
    /// Coulomb's coefficient [1].
    pub friction: f64,
    /// Between hand and proxy.
    pub coupling: Option<CouplingDescription>,
}

/// A virtual coupling.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CouplingDescription {
    /// [N/m]
    pub stiffness: f64,
    /// [N·s/m]
    #[serde(default)]
    pub damping: f64,
}

/// A ball that the camera should see.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct View {
    /// [m, world]
    pub center: [f64; 3],
    /// [m]
    pub radius: f64,
}

impl From<Coupling> for CouplingDescription {
    fn from(Coupling { stiffness, damping }: Coupling) -> Self {
        Self { stiffness, damping }
    }
}

impl ObjectDescription {
    /// Of a recording.
    pub fn new(name: &str, recording: &Recording, certificate: Vec<String>, recordable: bool) -> Self {
        let metadata = &recording.metadata;
        let material = match metadata.materials.as_slice() {
            [one] => Some(MaterialDescription {
                young: one.young_pa,
                poisson: one.poisson,
                density: one.density_kg_m3,
            }),
            _ => None,
        };
        let surface = &recording.surface;
        Self {
            name: name.into(),
            nodes: surface.positions.len(),
            triangles: surface.triangles.len(),
            modes: recording.modes.len(),
            radius: surface.radius(),
            mass: recording.mass(),
            fixed: metadata.support == Support::Fixed,
            recordable: recordable && material.is_some(),
            material,
            certificate,
        }
    }
}

/// Where an obstacle is shown: a plane's normal is the y axis of its pose.
pub(crate) fn shown_pose(shape: &Shape, pose: &Pose) -> Pose {
    match shape {
        Shape::Plane { normal } => {
            let turn = DQuat::from_rotation_arc(DVec3::Y, *normal);
            Pose { position: pose.position, orientation: (pose.orientation * turn).normalize() }
        }
        _ => *pose,
    }
}

impl SceneDescription {
    /// Of a model; names in its order, with the pointers among its devices.
    pub fn new(
        (id, title, about): (Option<String>, String, String),
        model: &Model,
        objects: Vec<ObjectDescription>,
        obstacles: &[String],
        devices: &[(String, bool)],
    ) -> Self {
        let ModelParameters { step_s, gravity, obstacles: shapes, devices: parameters, .. } =
            model.parameters();
        let obstacle = |(name, obstacle): (&String, &palpate::Obstacle)| {
            let Pose { position: p, orientation: q } = shown_pose(&obstacle.shape, &obstacle.pose);
            ObstacleDescription {
                name: name.clone(),
                shape: match &obstacle.shape {
                    Shape::Plane { .. } => ShapeDescription::Plane {},
                    Shape::Sphere { radius } => ShapeDescription::Sphere { radius: *radius },
                    Shape::Box { half_extents } => {
                        ShapeDescription::Box { half_extents: half_extents.to_array() }
                    }
                    Shape::Capsule { radius, half_length } => {
                        ShapeDescription::Capsule { radius: *radius, half_length: *half_length }
                    }
                    Shape::Mesh(_) => ShapeDescription::Mesh {},
                },
                pose: [p.x, p.y, p.z, q.x, q.y, q.z, q.w],
                friction: obstacle.friction,
            }
        };
        let device =
            |((name, pointer), device): (&(String, bool), &palpate::DeviceParameters)| DeviceDescription {
                name: name.clone(),
                pointer: *pointer,
                tip_radius: device.tip_radius,
                patch_radius: device.patch_radius,
                friction: device.friction,
                coupling: device.coupling.map(CouplingDescription::from),
            };
        Self {
            id,
            title,
            about,
            step_s: *step_s,
            gravity: gravity.to_array(),
            objects,
            obstacles: obstacles.iter().zip(shapes).map(obstacle).collect(),
            devices: devices.iter().zip(parameters).map(device).collect(),
            view: view(model),
            frames: None,
        }
    }
}

/// The ball about the objects at the start, the obstacles that are not endless, and where objects come to lie on planes.
fn view(model: &Model) -> View {
    let state = palpate::State::new(model);
    let objects = state.output().objects.iter().zip(model.recordings());
    let mut balls: Vec<(DVec3, f64)> =
        objects.map(|(object, recording)| (object.pose.position, recording.surface.radius())).collect();
    let objects = balls.len();
    let biggest = balls.iter().map(|ball| ball.1).fold(0.0, f64::max);
    for obstacle in &model.parameters().obstacles {
        let radius = match &obstacle.shape {
            Shape::Plane { normal } => {
                let normal = obstacle.pose.orientation * *normal;
                let fallen = balls[..objects].iter().map(|&(center, radius)| {
                    let height = normal.dot(center - obstacle.pose.position) - radius;
                    (center - normal * height, radius, height)
                });
                // A plane far away is out of the picture.
                let near = fallen.filter(|(_, _, height)| (0.0..6.0 * biggest).contains(height));
                let near: Vec<(DVec3, f64)> = near.map(|(center, radius, _)| (center, radius)).collect();
                balls.extend(near);
                continue;
            }
            Shape::Sphere { radius } => *radius,
            Shape::Box { half_extents } => half_extents.length(),
            Shape::Capsule { radius, half_length } => radius + half_length,
            Shape::Mesh(mesh) => mesh.surface().radius(),
        };
        // A ground as large as a room is no reason to look from far away.
        if radius < 4.0 * biggest {
            balls.push((obstacle.pose.position, radius));
        }
    }
    let low = balls.iter().map(|(c, r)| *c - *r).fold(DVec3::INFINITY, DVec3::min);
    let high = balls.iter().map(|(c, r)| *c + *r).fold(DVec3::NEG_INFINITY, DVec3::max);
    let center = 0.5 * (low + high);
    let radius = balls.iter().map(|(c, r)| (*c - center).length() + r).fold(0.0, f64::max);
    View { center: center.to_array(), radius }
}

/// How the force process keeps its time [µs].
#[derive(Debug, Clone, Copy, Serialize)]
pub(crate) struct ProcessTiming {
    pub compute_us: Spread,
    pub late_us: Spread,
    pub overruns: u64,
    pub own_overruns: u64,
    /// Whether the system granted a real-time priority.
    pub priority: bool,
}

/// Percentiles.
#[derive(Debug, Clone, Copy, Serialize)]
pub(crate) struct Spread {
    p50: f64,
    p99: f64,
    p999: f64,
    max: f64,
}

impl From<Percentiles> for Spread {
    fn from(Percentiles { p50, p99, p999, max }: Percentiles) -> Self {
        Self { p50, p99, p999, max }
    }
}

/// What is told twice a second.
#[derive(Debug, Clone, Copy, Serialize)]
pub(crate) struct Status {
    pub generation: u32,
    pub paused: bool,
    pub slowness: u32,
    pub steps: u64,
    pub viewers: usize,
    pub force_process: ProcessTiming,
}

/// Messages to pages.
#[derive(Debug, Clone, Serialize)]
#[serde(tag = "type", rename_all = "lowercase")]
pub(crate) enum Answer<'a> {
    Scene {
        generation: u32,
        #[serde(flatten)]
        scene: &'a SceneDescription,
    },
    Status(Status),
    Granted {
        pointer: u64,
        device: Option<usize>,
    },
    Progress {
        job: &'a str,
        what: &'a str,
        share: Option<f64>,
        done: bool,
    },
    Error {
        text: &'a str,
    },
}

impl Answer<'_> {
    pub fn text(&self) -> String {
        serde_json::to_string(self).unwrap_or_default()
    }
}

/// Where a pointer is.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PointerAt {
    pub pointer: u64,
    pub position: [f64; 3],
}

/// Rules of a scene that can be changed while it runs; those that are none stay.
#[derive(Debug, Clone, Copy, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rules {
    /// [m/s², world]
    pub gravity: Option<[f64; 3]>,
    /// [s]
    pub step: Option<f64>,
    /// Coulomb's coefficient of everything [1].
    pub friction: Option<f64>,
    /// Of the pointers.
    pub coupling: Option<CouplingDescription>,
}

/// Messages from a page.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(tag = "type", rename_all = "lowercase", deny_unknown_fields)]
pub(crate) enum Asked {
    Press {
        pointer: u64,
        mode: Doing,
        position: [f64; 3],
        object: Option<usize>,
        triangle: Option<u32>,
        weights: Option<[f64; 3]>,
    },
    Move {
        pointers: Vec<PointerAt>,
    },
    Release {
        pointer: u64,
    },
    Pause {
        paused: bool,
    },
    Step,
    Slow {
        slowness: u32,
    },
    Reset,
    Open {
        scene: String,
    },
    Set(Rules),
    Material {
        object: usize,
        young: f64,
        poisson: f64,
        density: f64,
    },
    Stream {
        form: StreamForm,
        every: u32,
    },
}

/// What a pointer does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Doing {
    Touch,
    Hold,
}

/// How a page wants its pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum StreamForm {
    Modal,
    Vertices,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_of_the_page_are_read_and_others_are_refused() {
        let read = |text: &str| serde_json::from_str::<Asked>(text).map_err(|error| error.to_string());
        assert_eq!(
            read(r#"{"type":"move","pointers":[{"pointer":7,"position":[0,1,2]}]}"#),
            Ok(Asked::Move { pointers: vec![PointerAt { pointer: 7, position: [0.0, 1.0, 2.0] }] })
        );
        let set = read(r#"{"type":"set","coupling":{"stiffness":200,"damping":0.5}}"#).expect("rules");
        let Asked::Set(rules) = set else { panic!("{set:?}") };
        assert_eq!((rules.coupling.map(|coupling| coupling.stiffness), rules.step), (Some(200.0), None));
        for wrong in [
            r#"{"type":"fly"}"#,
            r#"{"type":"pause"}"#,
            r#"{"type":"pause","paused":true,"and":1}"#,
            r#"{"type":"press","pointer":-1,"mode":"touch","position":[0,0,0]}"#,
            r#"{"type":"move","pointers":[{"pointer":7,"position":[0,1]}]}"#,
            "[]",
            "",
        ] {
            assert!(read(wrong).is_err(), "{wrong}");
        }
    }
}
