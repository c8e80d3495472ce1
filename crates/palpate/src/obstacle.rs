//! Rigid obstacles: shapes with a signed distance [m].
//!
//! Equations: docs/theory.md (C17), (C18), (C24).

use crate::error::{Error, ModelError};
use crate::spatial::Pose;
use crate::surface::{
    Bands, Bounds, DeformationBound, RigidNodes, SphereTree, Surface, area_normal, at_weights,
    nearest_on_triangle,
};
use alloc::format;
use alloc::sync::Arc;
use alloc::vec;
use alloc::vec::Vec;
use glam::DVec3;

/// Rigid obstacle, fixed or moved by the step's input.
#[derive(Debug, Clone, PartialEq)]
pub struct Obstacle {
    /// Shape, in the obstacle's frame.
    pub shape: Shape,
    /// Placement at the start.
    pub pose: Pose,
    /// Coulomb's coefficient of friction against every object [1], not negative.
    pub friction: f64,
}

/// Shape of an obstacle.
///
/// A new one is met everywhere by the compiler, but in its scene keys (`palpate-scene/src/file/keys.rs`, read by `obstacles.rs`) and on
/// the page (`viewer/src/protocol/messages.ts`, `viewer/src/rendering/obstacle_mesh.ts`; VTU and glTF have their own triangles in
/// `palpate-export/src/rigid_surface.rs`). Surfaces meet its signed distance at nodes; where faces can lie deeper it is round
/// (the interiors of triangles meet it), where it can come in between nodes it has corners.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// Half-space through the origin, on the side opposite to the unit normal.
    Plane {
        /// Unit normal, out of the solid side.
        normal: DVec3,
    },
    /// Ball about the origin.
    Sphere {
        /// Radius [m].
        radius: f64,
    },
    /// Box about the origin.
    Box {
        /// Half the side lengths [m].
        half_extents: DVec3,
    },
    /// Points within a radius of a segment of the y axis about the origin.
    Capsule {
        /// Radius [m].
        radius: f64,
        /// Half the length of the segment [m].
        half_length: f64,
    },
    /// Closed triangle mesh.
    Mesh(Arc<ObstacleMesh>),
}

/// Closed triangle mesh that does not deform.
#[derive(Debug, Clone)]
pub struct ObstacleMesh {
    surface: Surface,
    tree: SphereTree,
    bounds: Bounds,
    /// Angle-weighted normals of the nodes.
    normals: Vec<DVec3>,
    /// One triangle of each node, which owns it.
    owners: Vec<u32>,
    /// Radius of the bounding sphere about the origin [m].
    radius: f64,
}

impl PartialEq for ObstacleMesh {
    fn eq(&self, other: &Self) -> bool {
        self.surface == other.surface
    }
}

impl ObstacleMesh {
    /// Mesh of nodes [m] and triangles, counter-clockwise seen from outside.
    ///
    /// # Errors
    /// [`ModelError::ObstacleMesh`] when a triangle has no area or a node that does not exist, or the mesh is not closed.
    pub fn new(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Result<Self, Error> {
        let fail = |what| Err(ModelError::ObstacleMesh { what }.into());
        if triangles.is_empty() {
            return fail("an obstacle's mesh has no triangles".into());
        }
        if let Some(p) = positions.iter().position(|p| !p.is_finite()) {
            return fail(format!("node {p} of an obstacle's mesh is not finite"));
        }
        let mut edges = Vec::with_capacity(3 * triangles.len());
        let mut normals = vec![DVec3::ZERO; positions.len()];
        for (t, corners) in triangles.iter().enumerate() {
            if corners.iter().any(|&n| n as usize >= positions.len()) {
                return fail(format!("triangle {t} of an obstacle's mesh names a node that does not exist"));
            }
            let points = corners.map(|n| positions[n as usize]);
            let normal = area_normal(points).normalize_or_zero();
            if normal == DVec3::ZERO {
                return fail(format!("triangle {t} of an obstacle's mesh has no area"));
            }
            for k in 0..3 {
                let (a, b, c) = (points[k], points[(k + 1) % 3], points[(k + 2) % 3]);
                normals[corners[k] as usize] += normal * (b - a).angle_between(c - a);
                edges.push((corners[k], corners[(k + 1) % 3]));
            }
        }
        edges.sort_unstable();
        let open = edges.iter().find(|&&(a, b)| edges.binary_search(&(b, a)).is_err());
        if let Some((a, b)) = open {
            return fail(format!(
                "an obstacle's mesh is open at the edge between nodes {a} and {b}: it needs an inside and an outside"
            ));
        }
        let source_nodes = (0..positions.len() as u32).collect();
        let surface = Surface { positions, triangles, source_nodes };
        let tree = SphereTree::new(&surface.positions, &surface.triangles);
        let bounds = tree.bounds(&surface.triangles, |_, _| Bands::default(), |_| 0.0);
        let radius = surface.radius();
        let mut owners = vec![0; surface.positions.len()];
        for (t, corners) in surface.triangles.iter().enumerate() {
            corners.iter().for_each(|&node| owners[node as usize] = t as u32);
        }
        Ok(Self { surface, tree, bounds, normals, owners, radius })
    }

    /// Nodes and triangles.
    pub fn surface(&self) -> &Surface {
        &self.surface
    }

    /// Traverse the spheres (centre, radius) that `near` accepts; `found` takes triangles with their corners.
    fn traverse(&self, near: impl Fn(DVec3, f64) -> bool, mut found: impl FnMut(u32, [DVec3; 3])) {
        let position = |n: usize| self.surface.positions[n];
        self.tree.traverse(
            (&self.bounds, &DeformationBound::STILL),
            &mut RigidNodes(&self.surface),
            |_, _, centre, radius| near(centre, radius),
            |_, t| found(t, self.surface.triangles[t as usize].map(|n| position(n as usize))),
        );
    }

    fn corners(&self, near: impl Fn(DVec3, f64) -> bool, mut found: impl FnMut(usize, DVec3)) {
        self.traverse(&near, |t, points| {
            for (node, position) in self.surface.triangles[t as usize].into_iter().zip(points) {
                // One of a node's triangles owns it.
                if self.owners[node as usize] == t && near(position, 0.0) {
                    found(node as usize, position);
                }
            }
        });
    }

    fn signed_distance(&self, p: DVec3, max_distance: f64) -> Option<(f64, DVec3)> {
        if p.length() - max_distance > self.radius {
            return None;
        }
        // At any distance, since the sign counts: (least distance, nearest point, normal that decides the sign).
        let best = core::cell::Cell::new((f64::INFINITY, DVec3::ZERO, DVec3::ZERO));
        self.traverse(
            |centre, radius| (p - centre).length() - radius < best.get().0 + 1e-12,
            |t, points| {
                let weights = nearest_on_triangle(points, p);
                let nearest = at_weights(points, weights);
                let distance = (p - nearest).length();
                let (least, at, side) = best.get();
                let normal = match weights.iter().position(|w| *w > 1.0 - 1e-12) {
                    Some(corner) => self.normals[self.surface.triangles[t as usize][corner] as usize],
                    None => area_normal(points).normalize_or_zero(),
                };
                // Both triangles of an edge count for the sign.
                let same = (nearest - at).length() <= 1e-9 * (1.0 + distance) && side != DVec3::ZERO;
                if same {
                    best.set((least.min(distance), at, side + normal));
                } else if distance < least {
                    best.set((distance, nearest, normal));
                }
            },
        );
        let (distance, nearest, side) = best.get();
        let away = p - nearest;
        let outside = away.dot(side) >= 0.0;
        let gradient = if distance > 1e-9 { away / distance } else { side.normalize_or_zero() };
        Some(if outside { (distance, gradient) } else { (-distance, -gradient) })
    }
}

impl Shape {
    /// Signed distance [m] of a point in the shape's frame, negative inside, and its gradient [1].
    /// None for a mesh when bounds leave it open that an outside point is farther than `max_distance` [m].
    ///
    /// # Real time
    pub fn signed_distance(&self, p: DVec3, max_distance: f64) -> Option<(f64, DVec3)> {
        let from_core = |core: DVec3, radius: f64| {
            let away = p - core;
            let distance = away.length();
            (distance - radius, if distance > 0.0 { away / distance } else { DVec3::Y })
        };
        Some(match self {
            Self::Plane { normal } => (p.dot(*normal), *normal),
            Self::Sphere { radius } => from_core(DVec3::ZERO, *radius),
            Self::Capsule { radius, half_length } => {
                from_core(DVec3::Y * p.y.clamp(-half_length, *half_length), *radius)
            }
            Self::Box { half_extents } => {
                let excess = p.abs() - *half_extents;
                let sign =
                    DVec3::new(libm::copysign(1.0, p.x), libm::copysign(1.0, p.y), libm::copysign(1.0, p.z));
                let outside = excess.max(DVec3::ZERO);
                let distance = outside.length();
                if distance > 0.0 {
                    (distance, outside / distance * sign)
                } else {
                    let axis = if excess.x >= excess.y && excess.x >= excess.z {
                        DVec3::X
                    } else if excess.y >= excess.z {
                        DVec3::Y
                    } else {
                        DVec3::Z
                    };
                    (excess.dot(axis), axis * sign)
                }
            }
            Self::Mesh(mesh) => return mesh.signed_distance(p, max_distance),
        })
    }

    /// Signed distance [m] to the face of a box that a surface point presses on, and the face's normal, where its nearest face is one
    /// that it cannot press on; `presses` tells by the outward normal of a face. The point may be beyond the rim of the face by an
    /// overhang [m]; depths [m] limit how deep it is, within the rim and beyond it. None where the nearest face counts, and for other
    /// shapes.
    ///
    /// # Real time
    pub(crate) fn pressed_face(
        &self,
        p: DVec3,
        presses: impl Fn(DVec3) -> bool,
        (depths, overhang): ([f64; 2], f64),
    ) -> Option<(f64, DVec3)> {
        let Self::Box { half_extents } = self else { return None };
        let excess = p.abs() - *half_extents;
        let sign = |axis: usize| DVec3::AXES[axis] * libm::copysign(1.0, p[axis]);
        let nearest = (0..3).filter(|&axis| excess[axis] >= excess.max_element().min(0.0));
        if nearest.map(sign).all(&presses) {
            return None;
        }
        let faces = (0..3).flat_map(|axis| {
            let near = sign(axis);
            [(axis, near, excess[axis]), (axis, -near, -libm::fabs(p[axis]) - half_extents[axis])]
        });
        let is_met = |&(axis, normal, distance): &(usize, DVec3, f64)| {
            let beyond = (excess * (DVec3::ONE - DVec3::AXES[axis])).max(DVec3::ZERO).length();
            distance > -depths[usize::from(beyond > 0.0)] && beyond <= overhang && presses(normal)
        };
        let best = faces.filter(is_met).max_by(|a, b| a.2.total_cmp(&b.2))?;
        Some((best.2, best.1))
    }

    /// Whether a face of an object can penetrate deeper than its corners ([`Self::deepest`]).
    pub(crate) fn is_round(&self) -> bool {
        match self {
            Self::Sphere { .. } | Self::Capsule { .. } => true,
            Self::Plane { .. } | Self::Box { .. } | Self::Mesh(_) => false,
        }
    }

    /// Whether the shape has corners ([`Self::corners`]).
    pub(crate) fn has_corners(&self) -> bool {
        match self {
            Self::Box { .. } | Self::Mesh(_) => true,
            Self::Plane { .. } | Self::Sphere { .. } | Self::Capsule { .. } => false,
        }
    }

    /// Barycentric weights of the deepest point of a triangle in a round shape; none for other shapes, which meet faces with
    /// their corners.
    ///
    /// # Real time
    pub(crate) fn deepest(&self, corners: [DVec3; 3]) -> Option<[f64; 3]> {
        // Nearest point of the core: a point, or a segment.
        let core = |p: DVec3| match self {
            Self::Sphere { .. } => Some(DVec3::ZERO),
            Self::Capsule { half_length, .. } => Some(DVec3::Y * p.y.clamp(-half_length, *half_length)),
            Self::Plane { .. } | Self::Box { .. } | Self::Mesh(_) => None,
        };
        let mut weights = [1.0 / 3.0; 3];
        for _ in 0..12 {
            weights = nearest_on_triangle(corners, core(at_weights(corners, weights))?);
            if matches!(self, Self::Sphere { .. }) {
                break;
            }
        }
        Some(weights)
    }

    /// Corners of the shape, in its frame, in bounding spheres (centre, radius) that `near` accepts; passed to `found` with
    /// their number and their outward normal: zero for a mesh, where that of a narrow tip is across what it touches when it lies on its side.
    ///
    /// # Real time
    pub(crate) fn corners(
        &self,
        near: impl Fn(DVec3, f64) -> bool,
        mut found: impl FnMut(usize, DVec3, DVec3),
    ) {
        match self {
            Self::Plane { .. } | Self::Sphere { .. } | Self::Capsule { .. } => {}
            Self::Box { half_extents } => {
                for k in 0..8 {
                    let side = |axis: usize| if k >> axis & 1 == 0 { -1.0 } else { 1.0 };
                    let sides = DVec3::new(side(0), side(1), side(2));
                    let corner = *half_extents * sides;
                    if near(corner, 0.0) {
                        found(k, corner, sides.normalize());
                    }
                }
            }
            Self::Mesh(mesh) => mesh.corners(near, |node, position| found(node, position, DVec3::ZERO)),
        }
    }

    /// Size of the shape [m]: upper limit of a relative motion in a step that cannot pass through it.
    pub(crate) fn size(&self) -> f64 {
        match self {
            Self::Plane { .. } => f64::INFINITY,
            Self::Sphere { radius } | Self::Capsule { radius, .. } => *radius,
            Self::Box { half_extents } => half_extents.min_element(),
            Self::Mesh(mesh) => 0.1 * mesh.radius,
        }
    }

    /// Radius of the bounding sphere about the origin [m].
    pub fn radius(&self) -> f64 {
        match self {
            Self::Plane { .. } => f64::INFINITY,
            Self::Sphere { radius } => *radius,
            Self::Capsule { radius, half_length } => radius + half_length,
            Self::Box { half_extents } => half_extents.length(),
            Self::Mesh(mesh) => mesh.radius,
        }
    }
}

impl Obstacle {
    /// Check the ranges of all numbers.
    pub(crate) fn check(&self, at: usize) -> Result<(), ModelError> {
        let fail = |what| Err(ModelError::Obstacle { obstacle: at, what });
        let positive = |x: f64| x > 0.0 && x < 1e18;
        let unit = |length: f64| libm::fabs(length - 1.0) < 1e-9;
        if !(0.0..1e6).contains(&self.friction) {
            return fail(format!("friction is {}, expected a number not below 0", self.friction));
        }
        let norm = self.pose.orientation.length();
        if !self.pose.position.is_finite() || !(0.99..=1.01).contains(&norm) {
            return fail("position must be finite and orientation a unit quaternion".into());
        }
        match &self.shape {
            Shape::Plane { normal } if !unit(normal.length()) => {
                fail(format!("normal has length {}, expected 1", normal.length()))
            }
            Shape::Sphere { radius } if !positive(*radius) => {
                fail(format!("radius is {radius} m, expected a positive number"))
            }
            Shape::Box { half_extents } if !half_extents.to_array().into_iter().all(positive) => {
                fail(format!("half extents are {half_extents} m, expected positive numbers"))
            }
            Shape::Capsule { radius, half_length } if !(positive(*radius) && positive(*half_length)) => {
                fail(format!("radius {radius} m and half length {half_length} m must be positive"))
            }
            Shape::Plane { .. }
            | Shape::Sphere { .. }
            | Shape::Box { .. }
            | Shape::Capsule { .. }
            | Shape::Mesh(_) => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube_mesh(half: f64) -> Shape {
        let corner = |k: u32| {
            DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2)) * 2.0 - DVec3::ONE
        };
        let positions = (0..8).map(|k| corner(k) * half).collect();
        let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        Shape::Mesh(Arc::new(ObstacleMesh::new(positions, triangles).expect("closed")))
    }

    #[test]
    fn a_box_and_its_mesh_have_the_same_distance() {
        let (solid, mesh) = (Shape::Box { half_extents: DVec3::splat(0.5) }, cube_mesh(0.5));
        for k in 0..500 {
            let wave = |p: f64| libm::sin(p * f64::from(k) + p);
            let p = DVec3::new(wave(1.3), wave(2.7), wave(0.9));
            let (a, toward) = solid.signed_distance(p, 9.0).expect("a box");
            let (b, other) = mesh.signed_distance(p, 9.0).expect("near");
            assert!((a - b).abs() < 1e-12, "{p}: {a} {b}");
            assert!(a < 0.0 || (toward - other).length() < 1e-9, "{p}: {toward} {other}");
        }
    }

    #[test]
    fn distance_grows_along_its_gradient() {
        let shapes = [
            Shape::Plane { normal: DVec3::new(0.6, 0.8, 0.0) },
            Shape::Sphere { radius: 0.3 },
            Shape::Capsule { radius: 0.2, half_length: 0.4 },
            Shape::Box { half_extents: DVec3::new(0.2, 0.5, 0.3) },
        ];
        for shape in shapes {
            for k in 0..100 {
                let wave = |p: f64| libm::sin(p * f64::from(k) + p);
                let p = DVec3::new(wave(1.1), wave(2.3), wave(0.7));
                let (a, direction) = shape.signed_distance(p, 9.0).expect("solid");
                let (b, _) = shape.signed_distance(p + direction * 1e-6, 9.0).expect("solid");
                assert!((b - a - 1e-6).abs() < 1e-11, "{shape:?} at {p}");
            }
        }
    }
}
