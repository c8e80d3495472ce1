//! Bounding-volume tree of triangles: closest point, crossings of a segment, and the generalised winding number
//!
//! ```text
//! w(q) = 1/(4π)·Σ Ω_i(q)      Ω: signed solid angle of triangle i seen from q
//! ```
//!
//! which is 1 within a closed surface that faces outwards, 0 outside, and smooth across holes. A part of the tree that is farther away
//! than [`FAR`] of its radii counts as one dipole.
//!
//! References: Jacobson, Kavan, Sorkine-Hornung, Robust Inside-Outside Segmentation Using Generalized Winding Numbers (2013); Barill et
//! al., Fast Winding Numbers for Soups and Clouds (2018); van Oosterom & Strackee (1983) for Ω; Ericson, Real-Time Collision Detection
//! (2005), 5.1.5.

use glam::DVec3;
use std::f64::consts::TAU;

/// Triangles of a leaf.
const LEAF: usize = 4;

/// Distance in radii from which a part counts as a dipole: w is then right to about 0.03, and asked whether it is above 0.5.
const FAR: f64 = 2.0;

/// Tree over the triangles of a surface.
pub(super) struct SurfaceTree {
    /// Corners of the triangles [m].
    triangles: Vec<[DVec3; 3]>,
    /// Parts, each before its own: the first one directly behind it.
    parts: Vec<Part>,
}

struct Part {
    low: DVec3,
    high: DVec3,
    /// Sum of the area vectors [m²].
    area: DVec3,
    /// Centre of area [m], and distance of the farthest corner from it [m].
    centre: DVec3,
    radius: f64,
    /// Range of triangles.
    first: u32,
    end: u32,
    /// Number of the second child; 0 for a leaf.
    second: u32,
}

impl SurfaceTree {
    /// Tree over triangles, of which there must be one or more.
    pub fn new(mut triangles: Vec<[DVec3; 3]>) -> Self {
        let mut parts = Vec::new();
        let count = triangles.len();
        build(&mut triangles, 0, count, &mut parts);
        Self { triangles, parts }
    }

    /// Closest point of the surface [m], and its distance [m].
    pub fn closest(&self, point: DVec3) -> (DVec3, f64) {
        let mut best = (point, f64::INFINITY);
        let mut stack = vec![0];
        while let Some(at) = stack.pop() {
            let part: &Part = &self.parts[at];
            if part.distance_squared(point) >= best.1 {
                continue;
            }
            if part.second == 0 {
                for triangle in &self.triangles[part.first as usize..part.end as usize] {
                    let found = closest_on_triangle(point, triangle);
                    let distance = (found - point).length_squared();
                    if distance < best.1 {
                        best = (found, distance);
                    }
                }
                continue;
            }
            // The nearer child is looked at first.
            let (first, second) = (at + 1, part.second as usize);
            let is_first_near =
                self.parts[first].distance_squared(point) <= self.parts[second].distance_squared(point);
            stack.extend(if is_first_near { [second, first] } else { [first, second] });
        }
        (best.0, best.1.sqrt())
    }

    /// Shares of the segment from `from` to `to` at which it meets triangles, in no order.
    pub fn crossings(&self, from: DVec3, to: DVec3) -> Vec<f64> {
        let along = to - from;
        let mut found = Vec::new();
        let (low, high) = (from.min(to), from.max(to));
        let mut stack = vec![0];
        while let Some(at) = stack.pop() {
            let part: &Part = &self.parts[at];
            if part.low.cmpgt(high).any() || part.high.cmplt(low).any() {
                continue;
            }
            if part.second == 0 {
                let triangles = &self.triangles[part.first as usize..part.end as usize];
                found.extend(triangles.iter().filter_map(|triangle| crossing(from, along, triangle)));
            } else {
                stack.extend([part.second as usize, at + 1]);
            }
        }
        found
    }

    /// Generalised winding number of a point.
    pub fn winding_number(&self, point: DVec3) -> f64 {
        let mut solid_angle = 0.0;
        let mut stack = vec![0];
        while let Some(at) = stack.pop() {
            let part: &Part = &self.parts[at];
            let away = part.centre - point;
            let distance = away.length();
            if distance > FAR * part.radius {
                solid_angle += part.area.dot(away) / distance.powi(3);
            } else if part.second == 0 {
                let triangles = &self.triangles[part.first as usize..part.end as usize];
                solid_angle += triangles.iter().map(|triangle| solid_angle_of(point, triangle)).sum::<f64>();
            } else {
                stack.extend([part.second as usize, at + 1]);
            }
        }
        solid_angle / (2.0 * TAU)
    }

    /// Whether a point is inside.
    pub fn has_inside(&self, point: DVec3) -> bool {
        self.winding_number(point) > 0.5
    }
}

impl Part {
    fn distance_squared(&self, point: DVec3) -> f64 {
        (point - point.clamp(self.low, self.high)).length_squared()
    }
}

fn build(triangles: &mut [[DVec3; 3]], first: usize, end: usize, parts: &mut Vec<Part>) {
    let own = &mut triangles[first..end];
    let corners = || own.iter().flatten().copied();
    let low = corners().reduce(DVec3::min).unwrap_or_default();
    let high = corners().reduce(DVec3::max).unwrap_or_default();
    let areas = || own.iter().map(|[a, b, c]| (*b - *a).cross(*c - *a) * 0.5);
    let centroid = |triangle: &[DVec3; 3]| triangle.iter().sum::<DVec3>() / 3.0;
    let total: f64 = areas().map(DVec3::length).sum();
    let weighted: DVec3 = areas().zip(own.iter()).map(|(area, t)| centroid(t) * area.length()).sum();
    let centre = if total > 0.0 { weighted / total } else { (low + high) * 0.5 };
    let radius = corners().map(|corner| (corner - centre).length()).fold(0.0, f64::max);
    let area = areas().sum();
    let number = parts.len();
    parts.push(Part { low, high, area, centre, radius, first: first as u32, end: end as u32, second: 0 });
    if end - first <= LEAF {
        return;
    }
    let centres = || own.iter().map(centroid);
    let extent =
        centres().reduce(DVec3::max).unwrap_or_default() - centres().reduce(DVec3::min).unwrap_or_default();
    let axis = (0..3).max_by(|&a, &b| extent[a].total_cmp(&extent[b])).unwrap_or(0);
    let half = own.len() / 2;
    own.sort_by(|a, b| centroid(a)[axis].total_cmp(&centroid(b)[axis]));
    build(triangles, first, first + half, parts);
    parts[number].second = parts.len() as u32;
    build(triangles, first + half, end, parts);
}

/// Closest point of a triangle [m], by the region of its plane that the point is over.
fn closest_on_triangle(p: DVec3, &[a, b, c]: &[DVec3; 3]) -> DVec3 {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    a + (ab * vb + ac * vc) / (va + vb + vc)
}

/// Share of a segment at which it meets a triangle (Möller & Trumbore 1997).
fn crossing(from: DVec3, along: DVec3, &[a, b, c]: &[DVec3; 3]) -> Option<f64> {
    let (ab, ac) = (b - a, c - a);
    let h = along.cross(ac);
    let determinant = ab.dot(h);
    let s = from - a;
    let q = s.cross(ab);
    let (u, v) = (s.dot(h) / determinant, along.dot(q) / determinant);
    let t = ac.dot(q) / determinant;
    // Without a determinant they are not numbers.
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && (0.0..=1.0).contains(&t)).then_some(t)
}

/// Signed solid angle of a triangle [sr].
fn solid_angle_of(point: DVec3, triangle: &[DVec3; 3]) -> f64 {
    let [a, b, c] = triangle.map(|corner| corner - point);
    let [la, lb, lc] = [a, b, c].map(DVec3::length);
    let denominator = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    2.0 * a.dot(b.cross(c)).atan2(denominator)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::primitives::ball_mesh;
    use crate::surface_mesh::SurfaceMesh;

    #[test]
    fn distances_crossings_and_winding_numbers_of_a_ball_are_those_of_all_triangles() {
        let surface = SurfaceMesh::from_boundary(ball_mesh(1.0, 6).unwrap()).unwrap();
        let triangles = surface.corners();
        let tree = SurfaceTree::new(triangles.clone());
        for at in 0..200 {
            let k = f64::from(at);
            let point = DVec3::new((0.7 * k).sin(), (1.3 * k).cos(), (2.1 * k).sin()) * (0.2 + 0.008 * k);
            let distance = triangles.iter().map(|t| (closest_on_triangle(point, t) - point).length());
            assert_eq!(tree.closest(point).1, distance.fold(f64::INFINITY, f64::min));
            let exact = triangles.iter().map(|t| solid_angle_of(point, t)).sum::<f64>() / (2.0 * TAU);
            // As the dipoles are right.
            assert!((tree.winding_number(point) - exact).abs() < 0.05, "{exact} at {point}");
            let all = triangles.iter().filter(|t| crossing(DVec3::ZERO, point, t).is_some()).count();
            assert_eq!(tree.crossings(DVec3::ZERO, point).len(), all);
            assert_eq!(tree.has_inside(point), all == 0);
        }
    }
}
