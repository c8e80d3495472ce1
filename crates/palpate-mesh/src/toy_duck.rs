//! Generated mesh of a toy duck: a union of ellipsoids above a plane, filled with tetrahedra.
//!
//! ```text
//! inside:  y ≥ y₀  and, of one part at least,  |A⁻¹Rᵀ(x − m)| ≤ 1
//! ```
//!
//! m is the middle of a part, R its turn about z and A = diag(half axes) [m].

use crate::error::MeshError;
use crate::mesher::{MeshingParameters, tetrahedralise};
use crate::primitives::ball_mesh;
use crate::surface_mesh::SurfaceMesh;
use crate::volume_mesh::Mesh;
use glam::{DMat3, DVec3};
use std::ops::ControlFlow;

/// Toy duck, 13.5 cm long: beak along +x, upwards y, flat below.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Duck {
    /// Side of the cells [m].
    pub cell_size: f64,
}

impl Default for Duck {
    /// Two cells across the beak.
    fn default() -> Self {
        Self { cell_size: 0.0095 }
    }
}

/// Ellipsoid of the duck.
struct Part {
    /// Middle [m].
    middle: [f64; 3],
    /// Half axes [m].
    half_axes: [f64; 3],
    /// Turn about z, beak upwards [rad].
    pitch: f64,
}

impl Part {
    const fn new(middle: [f64; 3], half_axes: [f64; 3], pitch: f64) -> Self {
        Self { middle, half_axes, pitch }
    }

    /// Linear map of the unit ball, A and then R.
    fn map(&self) -> DMat3 {
        DMat3::from_rotation_z(self.pitch) * DMat3::from_diagonal(DVec3::from_array(self.half_axes))
    }
}

/// Body, neck, head, beak, tail and wings.
const PARTS: [Part; 7] = [
    Part::new([0.0, 0.036, 0.0], [0.05, 0.036, 0.041], 0.0),
    Part::new([0.02, 0.064, 0.0], [0.028, 0.026, 0.028], 0.0),
    Part::new([0.026, 0.092, 0.0], [0.0305, 0.029, 0.029], 0.0),
    Part::new([0.058, 0.087, 0.0], [0.019, 0.0095, 0.0185], 0.175),
    Part::new([-0.041, 0.05, 0.0], [0.022, 0.011, 0.019], -0.7),
    Part::new([-0.006, 0.043, 0.035], [0.032, 0.021, 0.013], -0.245),
    Part::new([-0.006, 0.043, -0.035], [0.032, 0.021, 0.013], -0.245),
];

/// Height of the flat underside [m].
const UNDERSIDE: f64 = 0.006;

/// Layers of the ball that each part is a map of.
const LAYERS: u32 = 8;

impl Duck {
    /// Mesh of one region.
    ///
    /// # Errors
    /// When the cells are too large for the duck, or no size.
    pub fn mesh(&self) -> Result<Mesh, MeshError> {
        let ball = SurfaceMesh::from_boundary(ball_mesh(1.0, LAYERS)?)?;
        let mut surface = SurfaceMesh::default();
        for part in &PARTS {
            let (map, middle) = (part.map(), DVec3::from_array(part.middle));
            let first = surface.positions.len() as u32;
            let placed = ball.positions.iter().map(|unit| {
                let point = middle + map * *unit;
                point.with_y(point.y.max(UNDERSIDE))
            });
            surface.positions.extend(placed);
            surface.triangles.extend(ball.triangles.iter().map(|corners| corners.map(|node| node + first)));
        }
        let meshing = MeshingParameters { cell_size: Some(self.cell_size), ..MeshingParameters::default() };
        let (mut mesh, _) = tetrahedralise(&surface, &meshing, &mut |_| ControlFlow::Continue(()))?;
        // Warnings of parts that overlap: they are meant to.
        mesh.warnings.clear();
        mesh.checked()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::faces::tet_volume;

    /// Volume of the union [m³] by points of a grid.
    fn volume_by_points() -> f64 {
        const SPACING: f64 = 5e-4;
        let maps: Vec<(DMat3, DVec3)> =
            PARTS.iter().map(|part| (part.map().inverse(), DVec3::from_array(part.middle))).collect();
        let (low, cells) = (DVec3::new(-0.07, UNDERSIDE, -0.06), [300, 240, 240]);
        let mut inside = 0_u32;
        for i in 0..cells[0] {
            for j in 0..cells[1] {
                for k in 0..cells[2] {
                    let at = low + SPACING * (DVec3::new(i.into(), j.into(), k.into()) + 0.5);
                    let hit = |(inverse, middle): &(DMat3, DVec3)| (*inverse * (at - *middle)).length() < 1.0;
                    inside += u32::from(maps.iter().any(hit));
                }
            }
        }
        f64::from(inside) * SPACING.powi(3)
    }

    #[test]
    fn the_duck_has_the_volume_of_its_parts_and_stands_on_its_underside() {
        let expected = volume_by_points();
        // A mesh of chords is smaller, by the square of the cells' size; the balls' facets miss 1 %.
        for (cell_size, missing) in [(0.0095, 0.05), (0.005, 0.025)] {
            let mesh = Duck { cell_size }.mesh().expect("a duck");
            assert!(mesh.warnings.is_empty(), "{:?}", mesh.warnings);
            let volume: f64 = mesh.tets.iter().map(|tet| tet_volume(&mesh.nodes, tet)).sum();
            let share = volume / expected;
            assert!((1.0 - missing..1.0).contains(&share), "{cell_size}: {share}");
            let moment: DVec3 = mesh
                .tets
                .iter()
                .map(|tet| {
                    let middle = tet.map(|node| mesh.nodes[node as usize]).into_iter().sum::<DVec3>() / 4.0;
                    middle * tet_volume(&mesh.nodes, tet)
                })
                .sum();
            let centre = moment / volume;
            assert!(centre.z.abs() < 0.02 * cell_size, "not symmetric: {centre}");
            // The centre of mass is above the underside, not beside it.
            let low = mesh.nodes.iter().filter(|node| node.y < UNDERSIDE + 0.1 * cell_size);
            let [back, front] = low.fold([f64::MAX, f64::MIN], |[a, b], node| [a.min(node.x), b.max(node.x)]);
            assert!(back + 0.01 < centre.x && centre.x < front - 0.01, "{back} {front} {centre}");
        }
    }

    #[test]
    fn impossible_cells_are_refused() {
        for cell_size in [0.0, -0.01, f64::NAN, 1.0] {
            assert!(Duck { cell_size }.mesh().is_err(), "{cell_size}");
        }
    }
}
