//! `[[clamp]]`: faces that are held, and moved by rigid frames.

use super::keys::{ClampEntry, FaceEntry, RegionEntry};
use super::places::{named_object, surface_point};
use super::source::{Quantity, Source};
use crate::error::{SceneError, SceneErrorKind};
use crate::scene::SceneClamp;
use glam::DVec3;
use palpate::{Clamp, ModelObject, Pose, Surface, SurfacePoint};
use palpate_haptics::Columns;
use std::collections::HashMap;
use std::ops::RangeInclusive;

/// Range of the cells of a clamp.
const CELLS: RangeInclusive<i64> = 1..=256;

/// Cosine of the angle between triangles at which a face ends: 37°, a crease.
const CREASE: f64 = 0.8;

/// Clamp of the model, and its path.
pub(super) fn read_clamp(
    source: &Source,
    entry: &ClampEntry,
    objects: &[ModelObject],
    object_names: &[String],
) -> Result<(Clamp, SceneClamp), SceneError> {
    let (name, wanted) = (entry.name.get_ref(), entry.object.get_ref());
    let number = named_object(source, &entry.object, object_names)?;
    let object = &objects[number];
    let surface = &object.recording.surface;
    let (triangles, span) = match (&entry.face, &entry.region) {
        (Some(face), None) => {
            let FaceEntry { point, radius } = face.get_ref();
            let at = surface_point(source, (&entry.object, point), objects, object_names)?.point;
            let length = Quantity::length("radius");
            let radius = radius.as_ref().map(|radius| source.positive(radius, length)).transpose()?;
            (face_around(surface, &at, radius.unwrap_or(f64::INFINITY)), face.span())
        }
        (None, Some(region)) => {
            let RegionEntry { min, max } = region.get_ref();
            let [low, high] = [min, max].map(|corner| DVec3::from_array(corner.get_ref().0));
            let is_in = |node: &u32| {
                let x = surface.positions[*node as usize];
                x.cmpge(low).all() && x.cmple(high).all()
            };
            let all = 0..surface.triangles.len() as u32;
            (all.filter(|t| surface.triangles[*t as usize].iter().all(is_in)).collect(), region.span())
        }
        _ => {
            let message = "a clamp needs one of face = { point = [x, y, z] }, the face around a point, and box = { min = [x, y, z], \
                           max = [x, y, z] }, all triangles in a box";
            return source.fail(entry.name.span(), SceneErrorKind::Missing, "face", message);
        }
    };
    if triangles.is_empty() {
        let message =
            format!("there is no whole triangle of {wanted:?} in it; it is given in the body frame [m]");
        return source.fail(span, SceneErrorKind::Grasp, "clamp", message);
    }
    let is_fixed = |&triangle: &u32| {
        let corner = |at: usize| {
            let weights = [0, 1, 2].map(|k| f64::from(u8::from(k == at)));
            SurfacePoint { triangle, weights }
        };
        (0..3).any(|at| !object.recording.is_movable(&corner(at)))
    };
    if triangles.iter().any(is_fixed) {
        let message = format!("the clamp {name:?} holds fixed nodes of {wanted:?}: leave them out");
        return source.fail(span, SceneErrorKind::Grasp, "clamp", message);
    }
    let path = entry.path.as_ref().map(|path| source.motion_path(path, Columns::Pose)).transpose()?;
    // Without a path the frame is at the middle of the part.
    let middle = object.start.pose.world_from_body(centroid(surface, &triangles));
    let start = path.as_ref().map_or(Pose { position: middle, ..Pose::IDENTITY }, |path| path.at(0.0));
    let mut clamp = Clamp::new(number, triangles, start);
    if let Some(given) = &entry.max_cells {
        if !CELLS.contains(given.get_ref()) {
            let (least, most) = (CELLS.start(), CELLS.end());
            let message = format!("max_cells is {}, expected {least} to {most}", given.get_ref());
            return source.fail(given.span(), SceneErrorKind::OutOfRange, "max_cells", message);
        }
        clamp.max_cells = *given.get_ref() as usize;
    }
    Ok((clamp, SceneClamp { name: name.clone(), object: number, path, start }))
}

/// Triangles that are connected with a point over edges without a crease, with all corners within a radius [m].
fn face_around(surface: &Surface, at: &SurfacePoint, radius: f64) -> Vec<u32> {
    let centre = surface.rest_position(at);
    let corners = |t: u32| surface.triangles[t as usize].map(|node| surface.positions[node as usize]);
    let normal = |t: u32| {
        let [a, b, c] = corners(t);
        (b - a).cross(c - a).normalize_or_zero()
    };
    let mut across: HashMap<(u32, u32), Vec<u32>> = HashMap::new();
    for (t, nodes) in surface.triangles.iter().enumerate() {
        for k in 0..3 {
            let (a, b) = (nodes[k], nodes[(k + 1) % 3]);
            across.entry((a.min(b), a.max(b))).or_default().push(t as u32);
        }
    }
    let is_near = |t: u32| corners(t).into_iter().all(|x| (x - centre).length() <= radius);
    let mut seen = vec![false; surface.triangles.len()];
    let (mut found, mut queue) = (Vec::new(), vec![at.triangle]);
    seen[at.triangle as usize] = true;
    while let Some(t) = queue.pop() {
        // The first triangle may reach out of the radius; what is beyond it does not count.
        if is_near(t) {
            found.push(t);
        } else if t != at.triangle {
            continue;
        }
        let nodes = surface.triangles[t as usize];
        for k in 0..3 {
            let (a, b) = (nodes[k], nodes[(k + 1) % 3]);
            for &next in &across[&(a.min(b), a.max(b))] {
                if !seen[next as usize] && normal(next).dot(normal(t)) > CREASE {
                    seen[next as usize] = true;
                    queue.push(next);
                }
            }
        }
    }
    found.sort_unstable();
    found
}

/// Centroid of triangles [m, body].
fn centroid(surface: &Surface, triangles: &[u32]) -> DVec3 {
    let (mut sum, mut total) = (DVec3::ZERO, 0.0);
    for &t in triangles {
        let [a, b, c] = surface.triangles[t as usize].map(|node| surface.positions[node as usize]);
        let area = (b - a).cross(c - a).length();
        sum += (a + b + c) * (area / 3.0);
        total += area;
    }
    sum / total
}
