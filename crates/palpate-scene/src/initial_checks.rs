//! Checks of a scene's initial state: penetration of objects, obstacles and tips, and [numbers in another unit](crate::unit_check).

use crate::scene::Scene;
use crate::unit_check::check_units;
use crate::warning::{Warning, WarningKind};
use glam::DVec3;
use palpate::{DeviceMode, ModelObject, ObstacleMesh, Pose, Recording, Shape, Support, Surface};
use std::collections::HashMap;
use std::sync::Arc;

/// Penetration that gets a warning, as a share of the object's diagonal.
const PENETRATION: f64 = 1e-3;

/// Depth of the points inside an object that find overlap where surfaces coincide, in mean edges.
const INNER: f64 = 0.1;

/// Object at the start.
struct Placed<'a> {
    name: &'a str,
    recording: &'a Arc<Recording>,
    pose: Pose,
    /// Its surface as a solid, if it is closed.
    solid: Option<Arc<ObstacleMesh>>,
    /// Bounding radius about the centre of mass [m].
    radius: f64,
}

/// Deepest point of an object in a solid.
struct Penetration {
    depth: f64,
    /// Direction out of the solid [world].
    out: DVec3,
    /// Whether all points are inside.
    whole: bool,
}

/// Warnings about the start of a scene. Costs a distance query for each surface node whose object is near another one.
pub(crate) fn check_start(scene: &Scene, objects: &[ModelObject]) -> Vec<Warning> {
    let placed = place(scene, objects);
    let mut warnings = check_units(scene, objects);
    for (at, object) in placed.iter().enumerate() {
        for (obstacle, parameters) in scene.obstacles.iter().zip(&scene.model.parameters().obstacles) {
            warnings.extend(in_obstacle(object, &obstacle.name, &parameters.shape, obstacle.pose_at(0.0)));
        }
        warnings.extend(placed[at + 1..].iter().filter_map(|other| overlap(object, other)));
        for device in scene.devices.iter().filter(|device| device.mode == DeviceMode::Touch) {
            if let Some(path) = &device.path {
                let (centre, radius) = (path.at(0.0).position, device.parameters.tip_radius);
                warnings.extend(tip_inside(&device.name, centre, radius, object));
            }
        }
    }
    let devices = scene.devices.iter().filter_map(|device| Some((&*device.name, device.motion()?)));
    let obstacles =
        scene.obstacles.iter().filter_map(|obstacle| Some((&*obstacle.name, obstacle.path.as_ref()?)));
    let bases = scene.object_names.iter().zip(&scene.bases);
    let bases = bases.filter_map(|(name, path)| Some((&**name, path.as_ref()?)));
    let clamps = scene.clamps.iter().filter_map(|clamp| Some((&*clamp.name, clamp.path.as_ref()?)));
    let paths = devices.chain(obstacles).chain(bases).chain(clamps);
    warnings.extend(paths.filter_map(|(name, path)| scene.object_bounds.far_path(name, path)));
    warnings
}

fn place<'a>(scene: &'a Scene, objects: &'a [ModelObject]) -> Vec<Placed<'a>> {
    let mut solids: HashMap<*const Recording, Option<Arc<ObstacleMesh>>> = HashMap::new();
    let pairs = objects.iter().zip(&scene.object_names);
    let place = pairs.map(|(ModelObject { recording, start, .. }, name)| {
        let Surface { positions, triangles, .. } = &recording.surface;
        let solid = || ObstacleMesh::new(positions.clone(), triangles.clone()).ok().map(Arc::new);
        let solid = solids.entry(Arc::as_ptr(recording)).or_insert_with(solid).clone();
        Placed { name, recording, pose: start.pose, solid, radius: recording.surface.radius() }
    });
    place.collect()
}

impl Placed<'_> {
    /// Penetration that gets a warning [m].
    fn allowed(&self) -> f64 {
        PENETRATION * self.recording.surface.diagonal()
    }

    /// Points inside the object near its surface [m, world].
    fn inner_points(&self) -> impl Iterator<Item = DVec3> + '_ {
        let Surface { positions, triangles, .. } = &self.recording.surface;
        let depth = INNER * self.recording.surface.mean_edge();
        triangles.iter().map(move |corners| {
            let [a, b, c] = corners.map(|node| positions[node as usize]);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            self.pose.world_from_body((a + b + c) / 3.0 - depth * normal)
        })
    }

    fn nodes(&self) -> impl Iterator<Item = DVec3> + '_ {
        self.recording.surface.positions.iter().map(|x| self.pose.world_from_body(*x))
    }
}

/// Deepest of points [m, world] in a solid shape at a pose.
fn deepest(points: impl Iterator<Item = DVec3>, shape: &Shape, pose: Pose) -> Penetration {
    let mut deepest = Penetration { depth: 0.0, out: DVec3::ZERO, whole: true };
    for point in points {
        match shape.signed_distance(pose.body_from_world(point), 0.0) {
            Some((distance, gradient)) if distance < 0.0 => {
                if -distance > deepest.depth {
                    (deepest.depth, deepest.out) = (-distance, pose.orientation * gradient);
                }
            }
            _ => deepest.whole = false,
        }
    }
    deepest
}

fn in_obstacle(object: &Placed, name: &str, shape: &Shape, pose: Pose) -> Option<Warning> {
    let centre = shape.signed_distance(pose.body_from_world(object.pose.position), object.radius);
    if centre.is_none_or(|(distance, _)| distance > object.radius) {
        return None;
    }
    let Penetration { depth, out, whole } = deepest(object.nodes(), shape, pose);
    if depth > object.allowed() {
        let wholly = if whole { ", wholly" } else { "" };
        let then = match object.recording.metadata.support {
            Support::Fixed => "its fixed nodes stay there, without force",
            _ => "contact lets it out, without velocity, within a tenth of a second",
        };
        let message = format!(
            "the object {:?} begins {} inside {name:?}{wholly}: {then}; move it by as much along {}",
            object.name,
            millimetres(depth),
            direction(out)
        );
        return Some(Warning::new(WarningKind::BeginsInside, object.name, message));
    }
    // An obstacle that lies within the object has no node of the object inside.
    let solid = Shape::Mesh(object.solid.clone()?);
    let (distance, _) = match shape {
        Shape::Plane { .. } => return None,
        _ => solid.signed_distance(object.pose.body_from_world(pose.position), 0.0)?,
    };
    (distance < -object.allowed()).then(|| {
        let message = format!(
            "the obstacle {name:?} begins inside the object {:?}, its centre {} deep: no node of the \
             object is near its surface; move one of them",
            object.name,
            millimetres(-distance)
        );
        Warning::new(WarningKind::BeginsInside, object.name, message)
    })
}

fn overlap(a: &Placed, b: &Placed) -> Option<Warning> {
    if (a.pose.position - b.pose.position).length() > a.radius + b.radius {
        return None;
    }
    let depth_in = |a: &Placed, b: &Placed| {
        let solid = Shape::Mesh(b.solid.clone()?);
        let points = a.nodes().chain(a.inner_points()).chain([a.pose.position]);
        // Distances are looked for within the other's bounding box only.
        let (low, high) = b.recording.surface.extent();
        let within = |point: &DVec3| {
            let x = b.pose.body_from_world(*point);
            x.cmpge(low).all() && x.cmple(high).all()
        };
        Some(deepest(points.filter(within), &solid, b.pose).depth)
    };
    let depth = [depth_in(a, b), depth_in(b, a)].into_iter().flatten().fold(0.0, f64::max);
    (depth > a.allowed().min(b.allowed())).then(|| {
        let message = format!(
            "the objects {:?} and {:?} overlap by {} at the start: contact lets out what is less than half a mesh edge \
             deep; move one of them",
            a.name,
            b.name,
            millimetres(depth)
        );
        Warning::new(WarningKind::Overlap, a.name, message)
    })
}

fn tip_inside(name: &str, centre: DVec3, radius: f64, object: &Placed) -> Option<Warning> {
    let solid = Shape::Mesh(object.solid.clone()?);
    let (distance, _) = solid.signed_distance(object.pose.body_from_world(centre), radius)?;
    (radius - distance > object.allowed()).then(|| {
        let whose = format!("the object {:?}", object.name);
        begins_inside(name, radius - distance, &whose, "begin its path outside")
    })
}

/// Warning about a tip that begins inside an object, by a depth [m].
pub(crate) fn begins_inside(name: &str, depth: f64, object: &str, instead: &str) -> Warning {
    let message = format!(
        "the tip of {name:?} begins {} inside {object}: it starts on the surface, from where it presses its way to the hand \
         within a tenth of a second; {instead}",
        millimetres(depth)
    );
    Warning::new(WarningKind::BeginsInside, name, message)
}

fn millimetres(length: f64) -> String {
    format!("{:.2} mm", 1000.0 * length)
}

fn direction(v: DVec3) -> String {
    // Adding 0 turns −0 into 0.
    let v = v + DVec3::ZERO;
    format!("({:.2}, {:.2}, {:.2})", v.x, v.y, v.z)
}
