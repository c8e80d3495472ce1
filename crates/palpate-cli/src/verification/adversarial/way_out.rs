//! Whether a proxy can leave: rays against the deformed surfaces.

use glam::DVec3;
use palpate::{Collider, Model, State};
use std::f64::consts::TAU;

/// A way out leads out of every face that is touched, by this cosine at least.
const OUTWARD: f64 = 0.2;

/// Rays about the middle one, and how much wider than the tip they stand.
const RAYS: u32 = 8;
const WIDER: f64 = 1.05;

/// A body that is deformed by more than this share of its radius may be turned inside out, and has no sensible surface
/// (docs/contact.md, limits).
const INSIDE_OUT: f64 = 0.5;

/// Triangles of all objects as they are, in world coordinates; none when one of them may be turned inside out.
fn surfaces(model: &Model, state: &State) -> Option<Vec<[DVec3; 3]>> {
    let mut triangles = Vec::new();
    for (object, recording) in model.recordings().enumerate() {
        let surface = &recording.surface;
        let mut moved = vec![DVec3::ZERO; surface.positions.len()];
        state.surface_displacement(model, object, &mut moved);
        if moved.iter().any(|u| u.length() > INSIDE_OUT * surface.radius()) {
            return None;
        }
        let pose = state.output().objects[object].pose;
        let place = |node: u32| pose.world_from_body(surface.positions[node as usize] + moved[node as usize]);
        triangles.extend(surface.triangles.iter().map(|corners| corners.map(place)));
    }
    Some(triangles)
}

/// A direction in which nothing is before a device's proxy, and where that is [m].
pub fn way_out(model: &Model, state: &State, device: usize) -> Option<(DVec3, DVec3)> {
    let output = state.output();
    let proxy = output.devices[device].proxy;
    let touched = output.contacts.iter().filter(|contact| contact.against == Collider::Device(device));
    let normals: Vec<DVec3> = touched.map(|contact| contact.normal).collect();
    let triangles = surfaces(model, state)?;
    let away = output.objects.iter().map(|object| proxy - object.pose.position);
    let least = away.min_by(|a, b| a.length().total_cmp(&b.length())).unwrap_or_default();
    let radius = WIDER * model.parameters().devices[device].tip_radius.max(1e-4);
    let ways = [normals.iter().sum::<DVec3>(), least].map(DVec3::normalize_or_zero);
    ways.into_iter()
        .filter(|way| *way != DVec3::ZERO && normals.iter().all(|normal| normal.dot(*way) > OUTWARD))
        .find(|way| rays(proxy, *way, radius).all(|from| triangles.iter().all(|t| !hits(from, *way, t))))
        .map(|way| (way, proxy))
}

/// Where the rays begin: in the middle, and around it.
fn rays(middle: DVec3, way: DVec3, radius: f64) -> impl Iterator<Item = DVec3> {
    let (side, other) = way.any_orthonormal_pair();
    let around = (0..RAYS).map(move |ray| {
        let (sin, cos) = (TAU * f64::from(ray) / f64::from(RAYS)).sin_cos();
        middle + (side * cos + other * sin) * radius
    });
    std::iter::once(middle).chain(around)
}

/// Whether a ray meets a triangle: the three volumes that it spans with the edges have one sign, and the meeting lies ahead.
fn hits(from: DVec3, way: DVec3, triangle: &[DVec3; 3]) -> bool {
    let [a, b, c] = triangle.map(|corner| corner - from);
    let volumes = [a.cross(b).dot(way), b.cross(c).dot(way), c.cross(a).dot(way)];
    let normal = (b - a).cross(c - a);
    let through = volumes.iter().all(|v| *v >= 0.0) || volumes.iter().all(|v| *v <= 0.0);
    through && a.dot(normal) * way.dot(normal) >= 0.0
}
