//! Where a tip stands on a facetted surface: the point whose *smooth* normal goes through the tip.
//!
//! The nearest point of a facetted surface jumps: from face to face where it is hollow, and its normal where it is
//! not. So normals are interpolated between the nodes, and the place x is such that
//!
//! ```text
//! p = x + d·n(x)/|n(x)|,        n(x) = Σ wᵢ·nᵢ
//! ```
//!
//! (Phong projection; Kobbelt et al. 1998, Proc. SIGGRAPH, 105), which moves continuously with p. A node's normal is
//! the mean of the triangles around it, on its side of a crease: over a crease the tip rolls about the edge itself.

use super::sight::{Found, Sight};
use crate::surface::{area_normal, at_weights};
use glam::DVec3;

/// Triangles that meet at less than this cosine have a crease between them: 37 degrees.
const CREASE: f64 = 0.8;

/// Triangles that are gone over at most, and repetitions on each.
const TRIANGLES: usize = 12;
const REPETITIONS: usize = 8;

/// Below this a weight is 0: the point is on the edge.
const ON_EDGE: f64 = 1e-6;

/// A tip's place on the surface.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Standing {
    pub(crate) triangle: u32,
    pub(crate) weights: [f64; 3],
    /// Unit normal, through the tip.
    pub(crate) normal: DVec3,
}

/// The place of a tip's centre p [m, body], from the nearest point that was found.
///
/// # Real time
/// Costs the triangles around the place.
pub(crate) fn stand(sight: &mut Sight, found: &Found, p: DVec3, tip: f64) -> Standing {
    let nearest = Standing { triangle: found.triangle, weights: found.weights, normal: found.normal };
    let away = p - found.position;
    let distance = away.length();
    // Over an edge the tip rolls, if it is outside of one of its faces.
    let side = outer_side(sight, found, away);
    if distance > 0.3 * tip && side.is_some_and(|side| side > 0.0) {
        return Standing { normal: away / distance, ..nearest };
    }
    let mut triangle = found.triangle;
    let mut weights = found.weights;
    for _ in 0..TRIANGLES {
        let corners = sight.corners(triangle);
        let normals = corner_normals(sight, triangle);
        let mut normal = at_weights(normals, weights).normalize_or(found.normal);
        let mut next = weights;
        for _ in 0..REPETITIONS {
            let hit = hit(corners, p, normal);
            let moved = (0..3).map(|k| libm::fabs(hit[k] - next[k])).fold(0.0, f64::max);
            next = hit;
            // Normals are interpolated within the triangle only.
            let inside = clamp(next);
            normal = at_weights(normals, inside).normalize_or(found.normal);
            if moved < 1e-12 {
                break;
            }
        }
        // Leave over the edge that is farthest behind.
        let least = (0..3).min_by(|&a, &b| next[a].total_cmp(&next[b])).unwrap_or_default();
        let inside = clamp(next);
        let standing = Standing { triangle, weights: inside, normal };
        if next[least] > -1e-9 {
            return standing;
        }
        let body = sight.body;
        let ends = body.recording.surface.triangles[triangle as usize];
        let (a, b) = (ends[(least + 1) % 3], ends[(least + 2) % 3]);
        let Some(over) = body.across(triangle, a, b) else { return standing };
        if face_normal(sight, over).dot(face_normal(sight, triangle)) < CREASE {
            return standing;
        }
        let from = body.recording.surface.triangles[over as usize];
        let share = |node: u32| ends.iter().zip(inside).filter(|(n, _)| **n == node).map(|(_, w)| w).sum();
        (triangle, weights) = (over, from.map(share));
    }
    nearest
}

/// For a found point on an edge or a corner with a crease: how far a direction leads out of the face that it leads out
/// of most. None elsewhere.
fn outer_side(sight: &mut Sight, found: &Found, away: DVec3) -> Option<f64> {
    let body = sight.body;
    let corners = body.recording.surface.triangles[found.triangle as usize];
    let mut on = corners.iter().zip(found.weights).filter(|(_, w)| *w >= ON_EDGE).map(|(node, _)| *node);
    let (mut crease, mut most) = (false, away.dot(found.normal));
    let mut look = |sight: &mut Sight, triangle: u32| {
        let normal = face_normal(sight, triangle);
        crease |= normal.dot(found.normal) < CREASE;
        most = most.max(away.dot(normal));
    };
    match (on.next(), on.next(), on.next()) {
        (Some(a), Some(b), None) => match body.across(found.triangle, a, b) {
            Some(over) => look(sight, over),
            None => return Some(most),
        },
        (Some(corner), None, None) => body.around(corner as usize).iter().for_each(|&t| look(sight, t)),
        _ => {}
    }
    crease.then_some(most)
}

fn face_normal(sight: &mut Sight, triangle: u32) -> DVec3 {
    area_normal(sight.corners(triangle)).normalize_or_zero()
}

/// The smooth normal at each corner of a triangle, on its side of creases.
fn corner_normals(sight: &mut Sight, triangle: u32) -> [DVec3; 3] {
    let own = face_normal(sight, triangle);
    let body = sight.body;
    body.recording.surface.triangles[triangle as usize].map(|node| {
        let mut sum = DVec3::ZERO;
        for &other in body.around(node as usize) {
            let normal = face_normal(sight, other);
            if normal.dot(own) >= CREASE {
                sum += normal;
            }
        }
        sum.normalize_or(own)
    })
}

/// Weights of the point of a triangle's plane that p comes to along a direction.
fn hit([a, b, c]: [DVec3; 3], p: DVec3, direction: DVec3) -> [f64; 3] {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let volume = ab.cross(ac).dot(direction);
    if libm::fabs(volume) < f64::MIN_POSITIVE {
        return [1.0 / 3.0; 3];
    }
    let v = ap.cross(ac).dot(direction) / volume;
    let w = ab.cross(ap).dot(direction) / volume;
    [1.0 - v - w, v, w]
}

fn clamp(weights: [f64; 3]) -> [f64; 3] {
    let positive = weights.map(|w| w.max(0.0));
    let sum: f64 = positive.iter().sum();
    positive.map(|w| w / sum)
}
