//! Surfaces, clean and broken.

use glam::DVec3;
use palpate_mesh::{SurfaceMesh, ball_mesh, box_mesh};
use std::f64::consts::TAU;

/// Ball of radius 0.05 m with 20·12² triangles.
pub fn ball() -> SurfaceMesh {
    SurfaceMesh::from_boundary(ball_mesh(0.05, 12).expect("a good ball")).expect("a sound ball")
}

/// Box of two triangles a side [m].
pub fn slab(size: [f64; 3]) -> SurfaceMesh {
    SurfaceMesh::from_boundary(box_mesh(size, [1; 3]).expect("a good box")).expect("a sound box")
}

/// Torus with bumps: 80 by 40 quadrilaterals, tube of 0.04 m about a circle of 0.1 m.
pub fn torus() -> SurfaceMesh {
    const AROUND: [u32; 2] = [80, 40];
    let [n, m] = AROUND;
    let mut mesh = SurfaceMesh::default();
    for (i, j) in (0..n).flat_map(|i| (0..m).map(move |j| (i, j))) {
        let (u, v) = (TAU * f64::from(i) / f64::from(n), TAU * f64::from(j) / f64::from(m));
        let radius = 0.04 * (1.0 + 0.1 * (5.0 * u).sin() * (3.0 * v).cos());
        let out = 0.1 + radius * v.cos();
        mesh.positions.push(DVec3::new(out * u.cos(), out * u.sin(), radius * v.sin()));
        let at = |i: u32, j: u32| (i % n) * m + j % m;
        mesh.triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
        mesh.triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
    }
    mesh
}

/// Adds another surface, moved.
pub fn add(mesh: &mut SurfaceMesh, other: &SurfaceMesh, by: DVec3) {
    let first = mesh.positions.len() as u32;
    mesh.positions.extend(other.positions.iter().map(|position| *position + by));
    mesh.triangles.extend(other.triangles.iter().map(|triangle| triangle.map(|node| node + first)));
}

/// The torus with five triangles missing, 40 turned, one that stands twice and one without area, each with vertices of its own.
pub fn broken_torus() -> SurfaceMesh {
    let whole = torus();
    let mut mesh = SurfaceMesh::default();
    let mut push = |triangle: [u32; 3]| {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(triangle.map(|node| whole.positions[node as usize]));
        mesh.triangles.push([first, first + 1, first + 2]);
    };
    for (number, &[a, b, c]) in whole.triangles.iter().enumerate() {
        match number {
            _ if number % 1280 == 7 => {}
            _ if number % 160 == 80 => push([a, c, b]),
            _ => push([a, b, c]),
        }
    }
    push(whole.triangles[0]);
    push([5, 6, 6]);
    mesh
}
