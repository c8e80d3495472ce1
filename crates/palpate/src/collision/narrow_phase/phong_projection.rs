//! Phong projection of a tip onto a facetted surface: the foot point whose interpolated normal passes through the tip.
//!
//! The nearest point of a facetted surface jumps from face to face where it is concave, and its normal where it is
//! convex. So normals are interpolated between the nodes, and the foot point x satisfies
//!
//! ```text
//! p = x + d·n(x)/|n(x)|,        n(x) = Σ wᵢ·nᵢ
//! ```
//!
//! (Kobbelt et al. 1998, Proc. SIGGRAPH, 105): it moves continuously with p. A nodal normal is the mean over the triangles
//! on its side of a crease; over a crease the tip rolls about the edge.
//!
//! Equations: docs/theory.md (C22).

use crate::collision::deformed_surface::{DeformedSurface, TriangleProjection};
use crate::collision::parameters::{COLLISION, MAX_ITERATIONS, ROUND_OFF};
use crate::surface::{area_normal, at_weights};
use glam::DVec3;

/// Foot point of a tip on the surface.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FootPoint {
    pub(crate) triangle: u32,
    pub(crate) weights: [f64; 3],
    /// Unit normal, through the tip.
    pub(crate) normal: DVec3,
}

/// Foot point of a tip with centre p [m, body], starting from the nearest point.
///
/// # Real time
/// Costs the triangles around the foot point.
pub(crate) fn phong_project(
    surface: &mut DeformedSurface,
    found: &TriangleProjection,
    p: DVec3,
    tip: f64,
) -> FootPoint {
    let nearest = FootPoint { triangle: found.triangle, weights: found.weights, normal: found.normal };
    let away = p - found.position;
    let distance = away.length();
    // Outside a crease the tip rolls about the edge.
    let side = crease_clearance(surface, found, away);
    if distance > 0.3 * tip && side.is_some_and(|side| side > 0.0) {
        return FootPoint { normal: away / distance, ..nearest };
    }
    let mut triangle = found.triangle;
    let mut weights = found.weights;
    for _ in 0..MAX_ITERATIONS {
        let corners = surface.corners(triangle);
        let normals = corner_normals(surface, triangle);
        let mut normal = at_weights(normals, weights).normalize_or(found.normal);
        let mut next = weights;
        for _ in 0..MAX_ITERATIONS {
            let hit = intersect_plane(corners, p, normal);
            let moved = (0..3).map(|k| libm::fabs(hit[k] - next[k])).fold(0.0, f64::max);
            next = hit;
            // Normals are interpolated within the triangle only.
            let inside = clamp(next);
            normal = at_weights(normals, inside).normalize_or(found.normal);
            if moved < ROUND_OFF {
                break;
            }
        }
        // Cross the edge that is violated most.
        let least = (0..3).min_by(|&a, &b| next[a].total_cmp(&next[b])).unwrap_or_default();
        let inside = clamp(next);
        let foot = FootPoint { triangle, weights: inside, normal };
        if next[least] > -ROUND_OFF {
            return foot;
        }
        let body = surface.body;
        let ends = body.recording.surface.triangles[triangle as usize];
        let (a, b) = (ends[(least + 1) % 3], ends[(least + 2) % 3]);
        let Some(over) = body.triangle_across(triangle, a, b) else { return foot };
        if face_normal(surface, over).dot(face_normal(surface, triangle)) < COLLISION.crease_cosine {
            return foot;
        }
        let from = body.recording.surface.triangles[over as usize];
        let share = |node: u32| ends.iter().zip(inside).filter(|(n, _)| **n == node).map(|(_, w)| w).sum();
        (triangle, weights) = (over, from.map(share));
    }
    nearest
}

/// Largest component of a direction along the normals around a point on a creased edge or corner; none elsewhere.
fn crease_clearance(surface: &mut DeformedSurface, found: &TriangleProjection, away: DVec3) -> Option<f64> {
    let body = surface.body;
    let corners = body.recording.surface.triangles[found.triangle as usize];
    let mut on = corners.iter().zip(found.weights).filter(|(_, w)| *w > ROUND_OFF).map(|(node, _)| *node);
    let (mut crease, mut most) = (false, away.dot(found.normal));
    let mut look = |surface: &mut DeformedSurface, triangle: u32| {
        let normal = face_normal(surface, triangle);
        crease |= normal.dot(found.normal) < COLLISION.crease_cosine;
        most = most.max(away.dot(normal));
    };
    match (on.next(), on.next(), on.next()) {
        (Some(a), Some(b), None) => match body.triangle_across(found.triangle, a, b) {
            Some(over) => look(surface, over),
            None => return Some(most),
        },
        (Some(corner), None, None) => {
            body.triangles_around(corner as usize).iter().for_each(|&t| look(surface, t))
        }
        _ => {}
    }
    crease.then_some(most)
}

fn face_normal(surface: &mut DeformedSurface, triangle: u32) -> DVec3 {
    area_normal(surface.corners(triangle)).normalize_or_zero()
}

/// Nodal normals of a triangle, each on the triangle's side of creases.
fn corner_normals(surface: &mut DeformedSurface, triangle: u32) -> [DVec3; 3] {
    let own = face_normal(surface, triangle);
    let body = surface.body;
    body.recording.surface.triangles[triangle as usize].map(|node| {
        let mut sum = DVec3::ZERO;
        for &other in body.triangles_around(node as usize) {
            let normal = face_normal(surface, other);
            if normal.dot(own) >= COLLISION.crease_cosine {
                sum += normal;
            }
        }
        sum.normalize_or(own)
    })
}

/// Barycentric weights of the intersection of the line through p along a direction with a triangle's plane.
fn intersect_plane([a, b, c]: [DVec3; 3], p: DVec3, direction: DVec3) -> [f64; 3] {
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
