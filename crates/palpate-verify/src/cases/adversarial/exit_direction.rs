//! A direction in which a proxy leaves the body freely: rays against the deformed surfaces.

use glam::DVec3;
use palpate::{Collider, Model, State};
use std::f64::consts::TAU;

/// Least cosine between the direction and the normal of every touched face.
const OUTWARD: f64 = 0.2;

/// Rays around the central one.
const RAYS: u32 = 8;

/// Radius of their circle, in tip radii: a little wider than the tip.
const WIDER: f64 = 1.05;

/// Displacement, as a share of the body's radius, beyond which the surface may be inverted and says nothing (docs/contact.md, limits).
const INVERTED: f64 = 0.5;

/// Deformed triangles of all objects in world coordinates [m]; `None` when a surface may be inverted.
fn surfaces(model: &Model, state: &State) -> Option<Vec<[DVec3; 3]>> {
    let mut triangles = Vec::new();
    for (object, recording) in model.recordings().enumerate() {
        let surface = &recording.surface;
        let mut moved = vec![DVec3::ZERO; surface.positions.len()];
        state.surface_displacement(model, object, &mut moved);
        if moved.iter().any(|u| u.length() > INVERTED * surface.radius()) {
            return None;
        }
        let pose = state.output().objects[object].pose;
        let place = |node: u32| pose.world_from_body(surface.positions[node as usize] + moved[node as usize]);
        triangles.extend(surface.triangles.iter().map(|corners| corners.map(place)));
    }
    Some(triangles)
}

/// A direction in which nothing is in front of a device's proxy, the proxy, and the offset of the interface point from the device [m].
pub fn exit_direction(model: &Model, state: &State, device: usize) -> Option<[DVec3; 3]> {
    let output = state.output();
    let proxy = output.devices[device].proxy;
    let touched = output.contacts.iter().filter(|contact| contact.against == Collider::Device(device));
    let normals: Vec<DVec3> = touched.map(|contact| contact.normal).collect();
    let triangles = surfaces(model, state)?;
    let away = output.objects.iter().map(|object| proxy - object.pose.position);
    let nearest = away.min_by(|a, b| a.length().total_cmp(&b.length())).unwrap_or_default();
    let radius = WIDER * model.parameters().devices[device].tip_radius.max(1e-4);
    let directions = [normals.iter().sum::<DVec3>(), nearest].map(DVec3::normalize_or_zero);
    directions
        .into_iter()
        .filter(|direction| {
            *direction != DVec3::ZERO && normals.iter().all(|normal| normal.dot(*direction) > OUTWARD)
        })
        .find(|direction| {
            ray_origins(proxy, *direction, radius)
                .all(|from| triangles.iter().all(|t| !intersects(from, *direction, t)))
        })
        .map(|direction| [direction, proxy, output.devices[device].offset[1]])
}

/// Origins of the rays: the centre, and a circle around it [m].
fn ray_origins(middle: DVec3, direction: DVec3, radius: f64) -> impl Iterator<Item = DVec3> {
    let (side, other) = direction.any_orthonormal_pair();
    let around = (0..RAYS).map(move |ray| {
        let (sin, cos) = (TAU * f64::from(ray) / f64::from(RAYS)).sin_cos();
        middle + (side * cos + other * sin) * radius
    });
    std::iter::once(middle).chain(around)
}

/// Whether a ray meets a triangle: its volumes with the three edges have one sign, and the intersection lies ahead.
fn intersects(from: DVec3, direction: DVec3, triangle: &[DVec3; 3]) -> bool {
    let [a, b, c] = triangle.map(|corner| corner - from);
    let volumes = [a.cross(b).dot(direction), b.cross(c).dot(direction), c.cross(a).dot(direction)];
    let normal = (b - a).cross(c - a);
    let through = volumes.iter().all(|v| *v >= 0.0) || volumes.iter().all(|v| *v <= 0.0);
    through && a.dot(normal) * direction.dot(normal) >= 0.0
}
