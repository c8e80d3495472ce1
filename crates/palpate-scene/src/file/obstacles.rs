//! `[[plane]]` and `[[obstacle]]`: rigid bodies that objects collide with.

use super::keys::{LARGEST, MeshEntry, Numbers, ObstacleEntry, PlaneEntry};
use super::source::{Quantity, Source};
use crate::error::{SceneError, SceneErrorKind};
#[cfg(feature = "native")]
use crate::mesh_source;
use crate::scene::SceneObstacle;
use crate::warning::{Warning, WarningKind};
use glam::DVec3;
use palpate::{Obstacle, ObstacleMesh, Pose, Shape};
use palpate_haptics::{Columns, unit_quaternion};
use std::sync::Arc;
use toml::Spanned;

/// Plane; without a name it is called by its number.
pub(super) fn read_plane(
    source: &Source,
    entry: &Spanned<PlaneEntry>,
    number: usize,
) -> Result<(Obstacle, SceneObstacle), SceneError> {
    let plane = entry.get_ref();
    let given = plane.normal.get_ref().0;
    let Some(normal) = DVec3::from_array(given).try_normalize() else {
        let message = format!("normal is {given:?}, expected a vector that is not zero");
        return source.fail(plane.normal.span(), SceneErrorKind::OutOfRange, "normal", message);
    };
    let friction = source.friction(plane.friction.as_ref())?;
    let name = name_or(plane.name.as_ref(), "plane", number);
    let (start, path) = match (&plane.point, &plane.path) {
        (Some(point), None) => {
            (Pose { position: DVec3::from_array(point.get_ref().0), ..Pose::IDENTITY }, None)
        }
        (None, Some(path)) => (Pose::IDENTITY, Some(source.motion_path(path, Columns::Pose)?)),
        (Some(point), Some(_)) => {
            let message = "the point is in the path: leave one of the two out";
            return source.fail(point.span(), SceneErrorKind::Conflict, "point", message);
        }
        (None, None) => {
            let message = format!(
                "the plane {name:?} needs a point on it, point = [x, y, z], or path = {{ file = \"…\" }} if it moves"
            );
            return source.fail(entry.span(), SceneErrorKind::Missing, "point", message);
        }
    };
    let placed = SceneObstacle { name, path, start };
    Ok((Obstacle { shape: Shape::Plane { normal }, pose: placed.pose_at(0.0), friction }, placed))
}

/// Obstacle; without a name it is called by its number.
pub(super) fn read_obstacle(
    source: &Source,
    entry: &Spanned<ObstacleEntry>,
    number: usize,
    warnings: &mut Vec<Warning>,
) -> Result<(Obstacle, SceneObstacle), SceneError> {
    let obstacle = entry.get_ref();
    let name = name_or(obstacle.name.as_ref(), "obstacle", number);
    let shape = read_shape(source, entry, &name, warnings)?;
    let friction = source.friction(obstacle.friction.as_ref())?;
    if let (Some(position), Some(_)) = (&obstacle.position, &obstacle.path) {
        let message = "the position is in the path: leave one of the two out";
        return source.fail(position.span(), SceneErrorKind::Conflict, "position", message);
    }
    let mut start = Pose::IDENTITY;
    if let Some(position) = &obstacle.position {
        start.position = DVec3::from_array(position.get_ref().0);
    }
    if let Some(given) = &obstacle.orientation {
        let [w, x, y, z] = given.get_ref().0;
        start.orientation = unit_quaternion(w, x, y, z)
            .or_else(|what| source.fail(given.span(), SceneErrorKind::OutOfRange, "orientation", what))?;
    }
    let mut path = None;
    if let Some(entry) = &obstacle.path {
        let read = source.motion_path(entry, Columns::Pose)?;
        if let (Some(orientation), true) = (&obstacle.orientation, read.has_orientations()) {
            let message = "the orientation is in the path: leave one of the two out";
            return source.fail(orientation.span(), SceneErrorKind::Conflict, "orientation", message);
        }
        path = Some(read);
    }
    let placed = SceneObstacle { name, path, start };
    Ok((Obstacle { shape, pose: placed.pose_at(0.0), friction }, placed))
}

/// Given name, or the kind with its number: plane, plane2, plane3.
pub(super) fn name_or(given: Option<&Spanned<String>>, kind: &str, number: usize) -> String {
    match (given, number) {
        (Some(name), _) => name.get_ref().clone(),
        (None, 0) => kind.to_string(),
        (None, number) => format!("{kind}{}", number + 1),
    }
}

fn read_shape(
    source: &Source,
    entry: &Spanned<ObstacleEntry>,
    name: &str,
    warnings: &mut Vec<Warning>,
) -> Result<Shape, SceneError> {
    let obstacle = entry.get_ref();
    let length = |key, number| source.positive(number, Quantity::length(key));
    match (&obstacle.sphere, &obstacle.cuboid, &obstacle.capsule, &obstacle.mesh) {
        (Some(sphere), None, None, None) => Ok(Shape::Sphere { radius: length("radius", &sphere.radius)? }),
        (None, Some(cuboid), None, None) => {
            let Numbers(given) = *cuboid.half_extents.get_ref();
            if given.iter().any(|half| *half <= 0.0) {
                return source.fail(
                    cuboid.half_extents.span(),
                    SceneErrorKind::OutOfRange,
                    "half_extents",
                    format!("half_extents are {given:?} m, expected three numbers above 0"),
                );
            }
            Ok(Shape::Box { half_extents: DVec3::from_array(given) })
        }
        (None, None, Some(capsule), None) => {
            let radius = length("radius", &capsule.radius)?;
            Ok(Shape::Capsule { radius, half_length: length("half_length", &capsule.half_length)? })
        }
        (None, None, None, Some(mesh)) => {
            read_mesh(source, mesh, name, warnings).map(|mesh| Shape::Mesh(Arc::new(mesh)))
        }
        _ => source.fail(
            entry.span(),
            SceneErrorKind::Missing,
            "obstacle",
            format!("the obstacle {name:?} needs one shape: sphere, box, capsule or mesh"),
        ),
    }
}

#[cfg(feature = "native")]
fn read_mesh(
    source: &Source,
    entry: &MeshEntry,
    name: &str,
    warnings: &mut Vec<Warning>,
) -> Result<ObstacleMesh, SceneError> {
    let span = entry.file.span();
    let path = source.stored_path(entry.file.get_ref());
    let scale = Quantity { key: "scale", unit: "", below: LARGEST };
    let scale = entry.scale.as_ref().map_or(Ok(1.0), |number| source.positive(number, scale))?;
    let mut mesh = mesh_source::read_surface(&path)
        .or_else(|error| source.fail(span.clone(), SceneErrorKind::Mesh, "mesh", error))?;
    mesh.positions.iter_mut().for_each(|position| *position *= scale);
    if mesh.volume() < 0.0 {
        let message = format!(
            "the triangles of obstacle {name:?} face inwards ({}): they are turned over",
            path.display()
        );
        warnings.push(Warning::new(WarningKind::TurnedMesh, name, message));
        mesh.flip_orientation();
    }
    ObstacleMesh::new(mesh.positions, mesh.triangles).or_else(|error| {
        source.fail(span, SceneErrorKind::Mesh, "mesh", format!("{}: {error}", path.display()))
    })
}

/// Refusal of a mesh where there are no readers of meshes.
#[cfg(not(feature = "native"))]
fn read_mesh(
    source: &Source,
    entry: &MeshEntry,
    name: &str,
    _: &mut Vec<Warning>,
) -> Result<ObstacleMesh, SceneError> {
    let message =
        format!("obstacle {name:?}: meshes of obstacles are not read here; use a sphere, box or capsule");
    source.fail(entry.file.span(), SceneErrorKind::Mesh, "mesh", message)
}
