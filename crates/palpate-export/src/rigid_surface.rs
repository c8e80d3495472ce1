//! Triangulated surfaces of rigid shapes: planes, obstacles, tips of devices.

use glam::{DQuat, DVec3};
use palpate::{Model, Pose, Shape, State};
use std::f64::consts::{PI, TAU};

/// Triangulated surface.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct RigidSurface {
    /// Nodes [m, obstacle frame].
    pub positions: Vec<DVec3>,
    /// Counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Outward unit normal per node of a smooth surface; none where faces are flat.
    pub normals: Option<Vec<DVec3>>,
}

/// Bounding sphere of the objects and bounded obstacles of a scene [m, world].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoundingSphere {
    /// Centre.
    pub centre: DVec3,
    /// Radius.
    pub radius: f64,
}

/// Vertices per ring, and rings from a pole to the equator.
const AROUND: u32 = 32;
const RINGS: u32 = 8;

/// Half the side of the square that shows a plane, in radii of the bounding sphere: objects move.
const PLANE: f64 = 2.0;

impl BoundingSphere {
    /// Bounds at the start.
    pub fn of(model: &Model, state: &State) -> Self {
        let objects = model.recordings().zip(&state.output().objects);
        let objects = objects.map(|(recording, o)| (o.pose.position, recording.surface.radius()));
        let obstacles = model.parameters().obstacles.iter();
        let obstacles = obstacles.map(|obstacle| (obstacle.pose.position, obstacle.shape.radius()));
        let obstacles = obstacles.filter(|(_, radius)| radius.is_finite());
        let balls: Vec<(DVec3, f64)> = objects.chain(obstacles).collect();
        let (low, high) =
            balls.iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), (centre, radius)| {
                (low.min(*centre - *radius), high.max(*centre + *radius))
            });
        let centre = 0.5 * (low + high);
        let radius = balls.iter().map(|(c, radius)| (*c - centre).length() + radius).fold(0.0, f64::max);
        Self { centre, radius }
    }
}

/// Surface of an obstacle in its own frame; of a plane a square near the scene.
pub fn obstacle_surface(shape: &Shape, start: Pose, bounds: BoundingSphere) -> RigidSurface {
    match shape {
        Shape::Plane { normal } => {
            let centre = start.orientation.conjugate() * (bounds.centre - start.position);
            square(*normal, centre, PLANE * bounds.radius)
        }
        Shape::Sphere { radius } => capsule(*radius, 0.0),
        Shape::Box { half_extents } => cuboid(*half_extents),
        Shape::Capsule { radius, half_length } => capsule(*radius, *half_length),
        Shape::Mesh(mesh) => {
            let surface = mesh.surface();
            RigidSurface {
                positions: surface.positions.clone(),
                triangles: surface.triangles.clone(),
                normals: None,
            }
        }
    }
}

/// Sphere about the origin.
pub fn ball(radius: f64) -> RigidSurface {
    capsule(radius, 0.0)
}

/// Square in the plane through the origin, about the projection of `centre`.
fn square(normal: DVec3, centre: DVec3, half: f64) -> RigidSurface {
    let centre = centre - normal * normal.dot(centre);
    let (a, b) = normal.any_orthonormal_pair();
    // Makes (a, b, normal) right-handed.
    let b = b * a.cross(b).dot(normal).signum();
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    RigidSurface {
        positions: corners.map(|(x, y)| centre + half * (x * a + y * b)).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        normals: None,
    }
}

fn cuboid(half: DVec3) -> RigidSurface {
    let mut surface = RigidSurface::default();
    for turn in [
        DQuat::IDENTITY,
        DQuat::from_rotation_y(0.5 * PI),
        DQuat::from_rotation_y(PI),
        DQuat::from_rotation_y(-0.5 * PI),
        DQuat::from_rotation_x(0.5 * PI),
        DQuat::from_rotation_x(-0.5 * PI),
    ] {
        // Rounding removes the error of the rotation from corners ±1.
        let first = surface.positions.len() as u32;
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        surface.positions.extend(corners.map(|(x, y)| (turn * DVec3::new(x, y, 1.0)).round() * half));
        surface.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    }
    surface
}

/// Capsule about the y axis; a sphere for a half length of 0.
fn capsule(radius: f64, half_length: f64) -> RigidSurface {
    // Rings from top to bottom as (height of their sphere's centre, polar angle), without the poles.
    let mut rings: Vec<(f64, f64)> = Vec::new();
    let angle = |ring: u32| 0.5 * PI * f64::from(ring) / f64::from(RINGS);
    rings.extend((1..=RINGS).map(|ring| (half_length, angle(ring))));
    let below = if half_length > 0.0 { RINGS } else { RINGS + 1 };
    rings.extend((below..2 * RINGS).map(|ring| (-half_length, angle(ring))));

    let (mut positions, mut normals) = (Vec::new(), Vec::new());
    let mut add = |middle: f64, normal: DVec3| {
        positions.push(DVec3::Y * middle + radius * normal);
        normals.push(normal);
    };
    add(half_length, DVec3::Y);
    for &(middle, angle) in &rings {
        for step in 0..AROUND {
            let turn = TAU * f64::from(step) / f64::from(AROUND);
            let across = DVec3::new(turn.sin(), 0.0, turn.cos());
            add(middle, angle.cos() * DVec3::Y + angle.sin() * across);
        }
    }
    add(-half_length, DVec3::NEG_Y);

    let node = |ring: usize, step: u32| 1 + ring as u32 * AROUND + step % AROUND;
    let last = positions.len() as u32 - 1;
    let mut triangles = Vec::new();
    for step in 0..AROUND {
        triangles.push([0, node(0, step), node(0, step + 1)]);
        for ring in 0..rings.len() - 1 {
            let [a, b] = [node(ring, step), node(ring, step + 1)];
            let [c, d] = [node(ring + 1, step), node(ring + 1, step + 1)];
            triangles.extend([[a, c, d], [a, d, b]]);
        }
        let ring = rings.len() - 1;
        triangles.push([node(ring, step + 1), node(ring, step), last]);
    }
    RigidSurface { positions, triangles, normals: Some(normals) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    /// 6·volume by the divergence theorem: positive when triangles face outwards.
    fn volume(surface: &RigidSurface) -> f64 {
        let corner = |n: u32| surface.positions[n as usize];
        surface.triangles.iter().map(|[a, b, c]| corner(*a).dot(corner(*b).cross(corner(*c)))).sum::<f64>()
            / 6.0
    }

    fn is_closed(surface: &RigidSurface) -> bool {
        // By position: the faces of a box do not share nodes.
        let position = |n: u32| surface.positions[n as usize].to_array().map(|x| (1e9 * x).round() as i64);
        let edges: Vec<_> = surface
            .triangles
            .iter()
            .flat_map(|[a, b, c]| [(a, b), (b, c), (c, a)])
            .map(|(a, b)| (position(*a), position(*b)))
            .collect();
        let known: HashSet<_> = edges.iter().collect();
        known.len() == edges.len() && edges.iter().all(|(a, b)| known.contains(&(*b, *a)))
    }

    #[test]
    fn shapes_are_closed_and_have_their_volumes() {
        let ball = ball(0.02);
        let exact = 4.0 / 3.0 * PI * 0.02_f64.powi(3);
        // Chords of 32 corners: 1 - (2π/32)²/6 around, and as much again for the rings.
        assert!(
            is_closed(&ball) && (0.98..1.0).contains(&(volume(&ball) / exact)),
            "{}",
            volume(&ball) / exact
        );
        let rod = capsule(0.01, 0.05);
        let exact = PI * 1e-4 * 0.1 + 4.0 / 3.0 * PI * 1e-6;
        assert!(is_closed(&rod) && (0.98..1.0).contains(&(volume(&rod) / exact)));
        let half = DVec3::new(0.1, 0.2, 0.3);
        let block = cuboid(half);
        assert!(is_closed(&block) && (volume(&block) / (8.0 * 0.006) - 1.0).abs() < 1e-12);
        for surface in [ball, rod] {
            assert!(surface.normals.iter().flatten().all(|n| (n.length() - 1.0).abs() < 1e-12));
        }
    }

    #[test]
    fn a_plane_s_square_lies_on_it_under_the_scene_and_faces_its_normal() {
        for normal in [DVec3::Y, DVec3::NEG_Z, DVec3::new(1.0, 2.0, -3.0).normalize()] {
            let centre = DVec3::new(3.0, -1.0, 0.5);
            let square = square(normal, centre, 0.1);
            assert!(square.positions.iter().all(|p| p.dot(normal).abs() < 1e-12));
            let [a, b, c] = square.triangles[0].map(|n| square.positions[n as usize]);
            assert!(((b - a).cross(c - a).normalize() - normal).length() < 1e-12);
            let middle = square.positions.iter().sum::<DVec3>() / 4.0;
            assert!((middle - centre).cross(normal).length() < 1e-12);
        }
    }
}
