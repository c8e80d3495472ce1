//! Set of bodies: meshes of about 10 cm, each coarse and fine.

use crate::material::ElasticMaterial;
use glam::{DMat3, DVec3};
use palpate::Recording;
use palpate_fem::{ElementOrder, RecordError};
use palpate_mesh::{Mesh, ball_mesh, box_mesh};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Soft silicone, damped so that it comes to rest within a second.
pub const SOFT: ElasticMaterial =
    ElasticMaterial { young_pa: 3e4, poisson: 0.45, density_kg_m3: 1000.0, stiffness_damping_s: 2e-3 };

/// Number of modes: those of a recording by default.
const MODES: usize = 200;

/// Shape of a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BodyShape {
    /// Cube of 10 cm.
    Cube,
    /// Ball of 10 cm.
    Ball,
    /// Ring of round section.
    Torus,
    /// Liver-like blob, flat below.
    Blob,
    /// Plate of 12 × 12 × 0.8 cm.
    Sheet,
    /// Round rod of 16 cm.
    Rod,
    /// Rod bent to three quarters of a circle.
    Horseshoe,
}

/// Fineness of a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fineness {
    /// Some hundred nodes.
    Coarse,
    /// About a thousand nodes and more.
    Fine,
}

impl BodyShape {
    /// All shapes.
    pub const ALL: [Self; 7] =
        [Self::Cube, Self::Ball, Self::Torus, Self::Blob, Self::Sheet, Self::Rod, Self::Horseshoe];

    /// Mesh about its centre, with the axis of symmetry along y.
    ///
    /// # Errors
    /// As [`palpate_fem::mesh`].
    pub fn mesh(self, fineness: Fineness) -> Result<Mesh, RecordError> {
        let n = |coarse: u32, fine: u32| if fineness == Fineness::Coarse { coarse } else { fine };
        let mesh = match self {
            Self::Cube => box_mesh([0.1; 3], [n(4, 6); 3])?,
            Self::Ball => {
                // Facets are the harder case for contact. A fine ball with curved edges, punched on 48 contact samples, loses 3.5e-4 of its
                // weight times size where it rests, of 2e-4 allowed (docs/measured.md).
                let mut ball = ball_mesh(0.05, n(4, 6))?;
                ball.straighten();
                ball
            }
            Self::Blob => mapped(ball_mesh(0.05, n(4, 6))?, blob),
            Self::Sheet => box_mesh([0.12, 0.008, 0.12], [n(8, 12), 1, n(8, 12)])?,
            Self::Rod => mapped(box_mesh([0.16, 0.024, 0.024], [n(12, 20), n(2, 4), n(2, 4)])?, round(0.012)),
            Self::Horseshoe => {
                let bar = box_mesh([0.16, 0.024, 0.024], [n(12, 20), n(2, 4), n(2, 4)])?;
                mapped(bar, |p| bend(0.75 * TAU / 0.16, p))
            }
            Self::Torus => {
                let bar = box_mesh([1.0, 0.03, 0.03], [n(16, 24), n(2, 4), n(2, 4)])?;
                joined(mapped(mapped(bar, round(0.015)), |p| bend(TAU, p)))
            }
        };
        Ok(mesh)
    }

    /// Recording of the body.
    ///
    /// # Errors
    /// As [`palpate_fem::record`].
    pub fn recording(self, fineness: Fineness) -> Result<Arc<Recording>, RecordError> {
        SOFT.free_body(self.mesh(fineness)?, ElementOrder::Quadratic, MODES)
    }
}

fn mapped(mut mesh: Mesh, map: impl Fn(DVec3) -> DVec3) -> Mesh {
    mesh.nodes.iter_mut().for_each(|node| *node = map(*node));
    mesh
}

/// Ball to a liver-like blob: flat below, with a bulge.
fn blob(p: DVec3) -> DVec3 {
    let bulge = 1.0 + 0.25 * (p.x / 0.05 * 2.0).sin() * (p.z / 0.05 * 1.5 + 0.5).cos();
    DVec3::new(1.2 * p.x, 0.6 * p.y * bulge, 0.9 * p.z + 0.15 * p.x)
}

/// Square section of half width a in y and z to a disk.
fn round(a: f64) -> impl Fn(DVec3) -> DVec3 {
    move |p| {
        let (y, z) = (p.y / a, p.z / a);
        let (s, r) = (y.abs().max(z.abs()), y.hypot(z));
        let share = if r > 0.0 { s / r } else { 0.0 };
        // Between square and disk inside, the disk at the rim: no element degenerates.
        let share = 1.0 + (share - 1.0) * s;
        DVec3::new(p.x, a * y * share, a * z * share)
    }
}

/// Bar along x to an arc in the plane of x and z, with a radius of 3.4 cm about y.
fn bend(turn: f64, p: DVec3) -> DVec3 {
    const RADIUS: f64 = 0.034;
    DMat3::from_rotation_y(turn * p.x) * DVec3::new(0.0, p.y, RADIUS + p.z)
}

/// Mesh with nodes at one place joined.
fn joined(mesh: Mesh) -> Mesh {
    let mut kept: Vec<DVec3> = Vec::new();
    let mut number = Vec::with_capacity(mesh.nodes.len());
    for node in &mesh.nodes {
        let known = kept.iter().position(|other| (*other - *node).length() < 1e-9);
        number.push(known.unwrap_or_else(|| {
            kept.push(*node);
            kept.len() - 1
        }) as u32);
    }
    let tets = mesh.tets.iter().map(|tet| tet.map(|n| number[n as usize])).collect();
    Mesh { nodes: kept, tets, ..mesh }
}
