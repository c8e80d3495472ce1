//! Triangles: nearest points, normals and barycentric interpolation.
//!
//! Equations: docs/theory.md (C21).

use glam::DVec3;

/// Barycentric weights of the point of triangle (a, b, c) nearest to p, by the regions of
/// corners, edges and face (Ericson, *Real-Time Collision Detection*, 5.1.5).
pub(crate) fn nearest_on_triangle([a, b, c]: [DVec3; 3], p: DVec3) -> [f64; 3] {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return [1.0, 0.0, 0.0];
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return [0.0, 1.0, 0.0];
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        let t = d1 / (d1 - d3);
        return [1.0 - t, t, 0.0];
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return [0.0, 0.0, 1.0];
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        let t = d2 / (d2 - d6);
        return [1.0 - t, 0.0, t];
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        let t = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return [0.0, 1.0 - t, t];
    }
    let (v, w) = (vb / (va + vb + vc), vc / (va + vb + vc));
    [1.0 - v - w, v, w]
}

/// Distance between the segment from p to q and a triangle [m]: none where they intersect, else between ends and triangle or segment and
/// edges (Ericson, *Real-Time Collision Detection*, 5.1.10).
pub(crate) fn segment_distance(corners: [DVec3; 3], [p, q]: [DVec3; 2]) -> f64 {
    let normal = area_normal(corners);
    let heights = [p, q].map(|end| (end - corners[0]).dot(normal));
    let to_end = |end: DVec3| (at_weights(corners, nearest_on_triangle(corners, end)) - end).length();
    if heights[0] * heights[1] < 0.0 {
        let through = p.lerp(q, heights[0] / (heights[0] - heights[1]));
        let [a, b, c] = corners.map(|corner| corner - through);
        if [a.cross(b), b.cross(c), c.cross(a)].iter().all(|part| part.dot(normal) >= 0.0) {
            return 0.0;
        }
    }
    let edges = [0, 1, 2].map(|k| between_segments([p, q], [corners[k], corners[(k + 1) % 3]]));
    edges.into_iter().fold(to_end(p).min(to_end(q)), f64::min)
}

/// Distance between two segments [m] (Ericson, 5.1.9).
fn between_segments([p, q]: [DVec3; 2], [a, b]: [DVec3; 2]) -> f64 {
    let (first, second, apart) = (q - p, b - a, p - a);
    let (length, other) = (first.length_squared(), second.length_squared());
    let (mixed, along) = (first.dot(second), first.dot(apart));
    // The nearest point of the first segment's line, then of the second segment, then of the first again.
    let area = length * other - mixed * mixed;
    let start = if area > 0.0 { (mixed * second.dot(apart) - along * other) / area } else { 0.0 };
    let share =
        |product: f64, square: f64| if square > 0.0 { (product / square).clamp(0.0, 1.0) } else { 0.0 };
    let on_second = share(second.dot(apart) + mixed * start.clamp(0.0, 1.0), other);
    let on_first = share(mixed * on_second - along, length);
    (apart + first * on_first - second * on_second).length()
}

/// Normal with twice the area as length [m²], on the side from which the corners are counter-clockwise.
pub(crate) fn area_normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}

/// Point with barycentric weights [m].
pub(crate) fn at_weights(corners: [DVec3; 3], weights: [f64; 3]) -> DVec3 {
    corners[0] * weights[0] + corners[1] * weights[1] + corners[2] * weights[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distance_from_a_segment_is_the_least_of_its_points() {
        const SAMPLES: u32 = 20_000;
        let mut intersecting = 0;
        for case in 0..300 {
            let value = |k: u32| libm::sin(12.9 * f64::from(case) + 7.3 * f64::from(k) + 1.0);
            let point = |k: u32| DVec3::new(value(3 * k), value(3 * k + 1), value(3 * k + 2));
            let (corners, p, q) = ([point(0), point(1), point(2)], point(3), point(4));
            let sampled = (0..=SAMPLES).map(|at| {
                let x = p.lerp(q, f64::from(at) / f64::from(SAMPLES));
                (at_weights(corners, nearest_on_triangle(corners, x)) - x).length()
            });
            let least = sampled.fold(f64::INFINITY, f64::min);
            let distance = segment_distance(corners, [p, q]);
            intersecting += usize::from(distance == 0.0);
            let spacing = (q - p).length() / f64::from(SAMPLES);
            assert!(distance <= least + 1e-15 && distance > least - spacing, "{case}: {distance} {least}");
        }
        assert!(intersecting > 20, "{intersecting}");
    }
}
