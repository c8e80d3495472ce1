//! Description of a scene for the page.

use glam::{DQuat, DVec3};
use palpate::{
    Coupling, DeviceParameters, Material, Model, ModelParameters, Obstacle, Pose, Recording, Shape, State,
    Support,
};
use serde::{Deserialize, Serialize};

/// Description of a scene.
#[derive(Debug, Clone, Serialize)]
pub struct SceneDescription {
    /// Id, if the provider lists the scene.
    pub id: Option<String>,
    /// Title.
    pub title: String,
    /// One line of description.
    pub about: String,
    /// Time step [s].
    pub step_s: f64,
    /// Gravity [m/s², world].
    pub gravity: [f64; 3],
    /// Objects, in the order of the model.
    pub objects: Vec<ObjectDescription>,
    /// Obstacles, in the order of the model.
    pub obstacles: Vec<ObstacleDescription>,
    /// Devices, in the order of the model.
    pub devices: Vec<DeviceDescription>,
    /// Warnings for the author of the scene.
    pub warnings: Vec<String>,
    /// Region that the camera shows at first.
    pub view: View,
    /// Settings of the scene as it was opened, of a live scene: what a page has changed since then is not among them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub own: Option<OwnSettings>,
    /// Frames, of a log.
    #[serde(flatten)]
    pub frames: Option<FrameTimes>,
}

/// Settings of a scene that pages change.
#[derive(Debug, Clone, Serialize)]
pub struct OwnSettings {
    /// Time step [s].
    pub step_s: f64,
    /// Gravity [m/s², world].
    pub gravity: [f64; 3],
    /// Obstacles, with their friction.
    pub obstacles: Vec<ObstacleDescription>,
    /// Devices, with their friction and virtual coupling.
    pub devices: Vec<DeviceDescription>,
    /// Material of each object; none for several.
    pub materials: Vec<Option<MaterialDescription>>,
}

/// Frames of a log.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct FrameTimes {
    /// Index of the log.
    pub log: usize,
    /// Number of frames of the complete log.
    pub frames: u64,
    /// Time between frames [s].
    pub frame_interval_s: f64,
}

/// Object of a scene.
#[derive(Debug, Clone, Serialize)]
pub struct ObjectDescription {
    /// Name.
    pub name: String,
    /// Number of surface nodes.
    pub nodes: usize,
    /// Number of surface triangles.
    pub triangles: usize,
    /// Number of modes; 0 for an object with a recorded table.
    pub modes: usize,
    /// Largest distance from the centre of mass [m].
    pub radius: f64,
    /// Mass [kg].
    pub mass: f64,
    /// Whether some nodes are fixed.
    pub fixed: bool,
    /// Material, of an object of one material.
    pub material: Option<MaterialDescription>,
    /// Materials of all regions; the look of the surface is that of the first.
    pub materials: Vec<MaterialDescription>,
    /// Whether it can be recorded with another material.
    pub recordable: bool,
    /// Certificate of the recording: one text line per error bound.
    pub certificate: Vec<String>,
}

/// Isotropic material.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct MaterialDescription {
    /// Young's modulus [Pa].
    pub young: f64,
    /// Poisson's ratio [1].
    pub poisson: f64,
    /// Density [kg/m³].
    pub density: f64,
}

/// Obstacle of a scene.
#[derive(Debug, Clone, Serialize)]
pub struct ObstacleDescription {
    /// Name.
    pub name: String,
    /// Shape.
    pub shape: ShapeDescription,
    /// Initial pose: position [m], orientation x, y, z, w.
    pub pose: [f64; 7],
    /// Coulomb friction coefficient [1].
    pub friction: f64,
}

/// Shape of an obstacle.
#[derive(Debug, Clone, Copy, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ShapeDescription {
    /// Half-space below the y axis of its pose.
    Plane {},
    /// Ball.
    Sphere {
        /// Radius [m].
        radius: f64,
    },
    /// Box.
    Box {
        /// Half the side lengths [m].
        half_extents: [f64; 3],
    },
    /// Capsule about the y axis.
    Capsule {
        /// Radius [m].
        radius: f64,
        /// Half the length of the axis between the centres of the caps [m].
        half_length: f64,
    },
    /// Closed mesh, whose surface is fetched by itself.
    Mesh {},
}

/// Device of a scene.
#[derive(Debug, Clone, Serialize)]
pub struct DeviceDescription {
    /// Name.
    pub name: String,
    /// Whether a pointer of a page can claim it.
    pub pointer: bool,
    /// Tip radius [m].
    pub tip_radius: f64,
    /// Contact patch radius [m].
    pub patch_radius: f64,
    /// Coulomb friction coefficient [1].
    pub friction: f64,
    /// Virtual coupling between interface point and proxy.
    pub coupling: Option<CouplingDescription>,
}

/// Virtual coupling.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CouplingDescription {
    /// Stiffness [N/m].
    pub stiffness: f64,
    /// Damping [N·s/m].
    #[serde(default)]
    pub damping: f64,
}

/// Sphere that the camera shows.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct View {
    /// Centre [m, world].
    pub center: [f64; 3],
    /// Radius [m].
    pub radius: f64,
}

impl From<Coupling> for CouplingDescription {
    fn from(Coupling { stiffness, damping }: Coupling) -> Self {
        Self { stiffness, damping }
    }
}

impl ObjectDescription {
    /// Description of a recorded object.
    pub fn new(name: &str, recording: &Recording, certificate: Vec<String>, recordable: bool) -> Self {
        let metadata = &recording.metadata;
        let describe = |one: &Material| MaterialDescription {
            young: one.young_pa,
            poisson: one.poisson,
            density: one.density_kg_m3,
        };
        let materials: Vec<MaterialDescription> = metadata.materials.iter().map(describe).collect();
        let material = if let [one] = materials[..] { Some(one) } else { None };
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
            materials,
            certificate,
        }
    }
}

/// Display pose of an obstacle; the normal of a plane is the y axis of its pose.
pub(crate) fn display_pose(shape: &Shape, pose: &Pose) -> Pose {
    match shape {
        Shape::Plane { normal } => {
            let turn = DQuat::from_rotation_arc(DVec3::Y, *normal);
            Pose { position: pose.position, orientation: (pose.orientation * turn).normalize() }
        }
        _ => *pose,
    }
}

impl SceneDescription {
    /// Description of a model: id, title and text; obstacle names; device names with whether pointers can claim them.
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
            let Pose { position: p, orientation: q } = display_pose(&obstacle.shape, &obstacle.pose);
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
            warnings: Vec::new(),
            view: view(model),
            own: None,
            frames: None,
        }
    }
}

impl OwnSettings {
    /// Present settings of a scene.
    pub fn of(scene: &SceneDescription) -> Self {
        Self {
            step_s: scene.step_s,
            gravity: scene.gravity,
            obstacles: scene.obstacles.clone(),
            devices: scene.devices.clone(),
            materials: scene.objects.iter().map(|object| object.material).collect(),
        }
    }
}

/// Bounding sphere of the objects at the start, of the bounded obstacles, and of the objects after a fall onto planes.
fn view(model: &Model) -> View {
    let state = State::new(model);
    let objects = state.output().objects.iter().zip(model.recordings());
    let mut spheres: Vec<(DVec3, f64)> =
        objects.map(|(object, recording)| (object.pose.position, recording.surface.radius())).collect();
    let objects = spheres.len();
    let largest = spheres.iter().map(|sphere| sphere.1).fold(0.0, f64::max);
    for obstacle in &model.parameters().obstacles {
        if let Shape::Plane { normal } = &obstacle.shape {
            let normal = obstacle.pose.orientation * *normal;
            let fallen = spheres[..objects].iter().map(|&(center, radius)| {
                let height = normal.dot(center - obstacle.pose.position) - radius;
                (center - normal * height, radius, height)
            });
            // Planes far away are not included.
            let near = fallen.filter(|(_, _, height)| (0.0..6.0 * largest).contains(height));
            let near: Vec<(DVec3, f64)> = near.map(|(center, radius, _)| (center, radius)).collect();
            spheres.extend(near);
            continue;
        }
        let radius = obstacle.shape.radius();
        // Neither are obstacles much larger than the objects.
        if radius < 4.0 * largest {
            spheres.push((obstacle.pose.position, radius));
        }
    }
    let low = spheres.iter().map(|(c, r)| *c - *r).fold(DVec3::INFINITY, DVec3::min);
    let high = spheres.iter().map(|(c, r)| *c + *r).fold(DVec3::NEG_INFINITY, DVec3::max);
    let center = 0.5 * (low + high);
    let radius = spheres.iter().map(|(c, r)| (*c - center).length() + r).fold(0.0, f64::max);
    View { center: center.to_array(), radius }
}
