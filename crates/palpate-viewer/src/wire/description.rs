//! What a page is told of a scene.

use glam::{DQuat, DVec3};
use palpate::{
    Coupling, DeviceParameters, Model, ModelParameters, Obstacle, Pose, Recording, Shape, State, Support,
};
use serde::{Deserialize, Serialize};

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
        let obstacle = |(name, obstacle): (&String, &Obstacle)| {
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
        let device = |((name, pointer), device): (&(String, bool), &DeviceParameters)| DeviceDescription {
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
    let state = State::new(model);
    let objects = state.output().objects.iter().zip(model.recordings());
    let mut balls: Vec<(DVec3, f64)> =
        objects.map(|(object, recording)| (object.pose.position, recording.surface.radius())).collect();
    let objects = balls.len();
    let biggest = balls.iter().map(|ball| ball.1).fold(0.0, f64::max);
    for obstacle in &model.parameters().obstacles {
        if let Shape::Plane { normal } = &obstacle.shape {
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
        let radius = obstacle.shape.radius();
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
