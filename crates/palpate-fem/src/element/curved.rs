//! The quadratic tetrahedron with curved edges, by its isoparametric mapping.
//!
//! Integrals are taken at 64 points ([`super::quadrature`]), exact to degree 7: the mass, two quadratic functions times a cubic determinant,
//! is exact. The stiffness has the determinant below a fraction and is exact for straight edges only.
//!
//! Reference: Zienkiewicz, Taylor & Zhu, *The Finite Element Method*, 5.

use super::ShapeFunction;
use super::elasticity::{Elasticity, ElementMatrices};
use super::quadrature::{self, Point};
use super::tet10::{QuadraticForm, shape_functions};
use glam::{DMat3, DVec3};
use palpate_mesh::QuadraticTet;

/// Value of each shape function, and its derivatives by the four barycentric coordinates.
pub(super) fn shapes(forms: &[QuadraticForm; 10], at: [f64; 4]) -> [ShapeFunction; 10] {
    forms.map(|form| {
        let half = form.map(|row| row.iter().zip(at).map(|(q, l)| q * l).sum::<f64>());
        (half.iter().zip(at).map(|(h, l)| h * l).sum(), half.map(|h| 2.0 * h))
    })
}

/// Stiffness [N/m] and consistent mass [kg].
pub(super) fn matrices(tet: &QuadraticTet, elasticity: &Elasticity) -> ElementMatrices {
    let forms = shape_functions();
    let (mut stiffness, mut mass) = ([[DMat3::ZERO; 10]; 10], [[0.0; 10]; 10]);
    for Point { at, weight } in quadrature::tetrahedron() {
        let jacobian = tet.jacobian(*at);
        let volume = weight * jacobian.determinant();
        // ∇λ1, ∇λ2, ∇λ3 are the rows of the inverse.
        let rows = jacobian.inverse().transpose();
        let gradients = [-(rows.x_axis + rows.y_axis + rows.z_axis), rows.x_axis, rows.y_axis, rows.z_axis];
        let shapes = shapes(&forms, *at);
        let slopes = shapes.map(|(_, by)| by.iter().zip(gradients).map(|(d, g)| g * *d).sum::<DVec3>());
        for i in 0..10 {
            for j in 0..=i {
                stiffness[i][j] += elasticity.block(slopes[i], slopes[j]) * volume;
                mass[i][j] += elasticity.density * volume * shapes[i].0 * shapes[j].0;
            }
        }
    }
    let mut matrices = ElementMatrices::default();
    for (i, j) in (0..10).flat_map(|i| (0..10).map(move |j| (i, j))) {
        matrices.stiffness.push(if j <= i { stiffness[i][j] } else { stiffness[j][i].transpose() });
        matrices.mass.push(mass[i.max(j)][i.min(j)]);
    }
    matrices
}

#[cfg(test)]
mod tests {
    use super::super::{ElementOrder, elasticity::tests::RUBBER};
    use super::*;
    use palpate_mesh::{Mesh, MidEdgeNode};

    /// One tetrahedron with middles moved by a share of its edges.
    fn element(share: f64) -> (Mesh, QuadraticTet) {
        let nodes = vec![
            DVec3::new(0.1, 0.0, 0.2),
            DVec3::new(1.3, 0.1, 0.0),
            DVec3::new(0.2, 0.9, 0.1),
            DVec3::new(0.0, 0.3, 1.4),
        ];
        let mut mesh = Mesh { nodes, tets: vec![[0, 1, 2, 3]], tet_regions: vec![0], ..Mesh::default() };
        mesh.add_mid_edge_nodes();
        for (k, &MidEdgeNode { node, .. }) in mesh.mid_edge_nodes.iter().enumerate() {
            let turn = f64::from(k as u32);
            mesh.nodes[node as usize] += share * DVec3::new(turn.sin(), turn.cos(), (2.0 * turn).sin());
        }
        mesh.check_curved().expect("no fold");
        let tet = mesh.quadratic_tet(&mesh.tets[0]);
        (mesh, tet)
    }

    fn energy(k: &[DMat3], u: &[DVec3]) -> f64 {
        (0..100).map(|at| 0.5 * u[at / 10].dot(k[at] * u[at % 10])).sum()
    }

    #[test]
    fn straight_elements_have_the_matrices_of_the_exact_formula() {
        let (_, tet) = element(0.0);
        let exact = ElementOrder::Quadratic.matrices(&tet.0, &RUBBER);
        let found = matrices(&tet, &RUBBER);
        let scale =
            exact.stiffness.iter().flat_map(|k| k.to_cols_array()).fold(0.0, |a: f64, b| a.max(b.abs()));
        for (a, b) in exact.stiffness.iter().zip(&found.stiffness) {
            assert!((*a - *b).to_cols_array().iter().all(|d| d.abs() < 1e-13 * scale));
        }
        for (a, b) in exact.mass.iter().zip(&found.mass) {
            assert!((a - b).abs() < 1e-15, "{a} {b}");
        }
    }

    #[test]
    fn curved_elements_pass_the_patch_test_and_weigh_their_volume() {
        let (_, tet) = element(0.08);
        assert!(!tet.is_straight());
        let ElementMatrices { stiffness, mass } = ElementOrder::Quadratic.matrices(&tet.0, &RUBBER);
        let spin = DVec3::new(0.3, -0.4, 0.9);
        let rigid = tet.0.map(|x| DVec3::new(1.0, 2.0, 3.0) + spin.cross(x));
        assert!(energy(&stiffness, &rigid).abs() < 1e-13);
        // Uniform strain ε: V·(λ/2·(tr ε)² + μ·ε:ε), with the volume by the Bernstein coefficients.
        let strain = DMat3::from_cols_array_2d(&[[0.1, 0.2, -0.1], [0.2, -0.3, 0.4], [-0.1, 0.4, 0.5]]);
        let squares: f64 = strain.to_cols_array().iter().map(|e| e * e).sum();
        let exact = tet.volume() * (0.5 * 3.0 * 0.3_f64.powi(2) + 0.7 * squares);
        let stored = energy(&stiffness, &tet.0.map(|x| strain * x));
        assert!((stored / exact - 1.0).abs() < 1e-13, "{stored} {exact}");
        let total: f64 = mass.iter().sum();
        assert!((total / (2.0 * tet.volume()) - 1.0).abs() < 1e-14);
    }
}
