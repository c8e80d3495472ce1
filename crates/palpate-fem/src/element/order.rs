//! The element matrices by polynomial order.

use super::elasticity::{Elasticity, ElementMatrices};
use super::{curved, tet4, tet10};
use glam::DVec3;
use palpate_mesh::QuadraticTet;

/// Value of a shape function at a point, and its derivatives by the four barycentric coordinates [1].
pub(crate) type ShapeFunction = (f64, [f64; 4]);

/// Polynomial order of the tetrahedral elements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ElementOrder {
    /// Four nodes and constant strain. Locks for Poisson's ratios near 0.5.
    Linear,
    /// Ten nodes: corners, and one on each edge. Edges are straight where it is in the middle, or else curved (isoparametric).
    Quadratic,
}

impl ElementOrder {
    /// Number of nodes per element.
    pub(crate) fn nodes(self) -> usize {
        match self {
            Self::Linear => 4,
            Self::Quadratic => 10,
        }
    }

    /// Shape functions of the nodes at a point of the element.
    pub(crate) fn shapes(self, at: [f64; 4]) -> Vec<ShapeFunction> {
        match self {
            Self::Linear => (0..4).map(|a| (at[a], std::array::from_fn(|b| f64::from(a == b)))).collect(),
            Self::Quadratic => curved::shapes(&tet10::shape_functions(), at).to_vec(),
        }
    }

    /// Element matrices for the given nodes [m]: four corners, and six nodes on the edges for quadratic elements.
    pub(crate) fn matrices(self, nodes: &[DVec3], elasticity: &Elasticity) -> ElementMatrices {
        let corners = [nodes[0], nodes[1], nodes[2], nodes[3]];
        match (self, nodes.first_chunk()) {
            (Self::Quadratic, Some(&nodes)) => {
                let tet = QuadraticTet(nodes);
                if tet.is_straight() {
                    tet10::matrices(corners, elasticity)
                } else {
                    curved::matrices(&tet, elasticity)
                }
            }
            _ => tet4::matrices(corners, elasticity),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::EDGES;
    use crate::element::elasticity::tests::{LAMBDA, MU, RUBBER};
    use glam::DMat3;

    const CORNERS: [DVec3; 4] = [
        DVec3::new(0.1, 0.0, 0.2),
        DVec3::new(1.3, 0.1, 0.0),
        DVec3::new(0.2, 0.9, 0.1),
        DVec3::new(0.0, 0.3, 1.4),
    ];

    fn nodes(order: ElementOrder) -> Vec<DVec3> {
        let mut nodes = CORNERS.to_vec();
        if order == ElementOrder::Quadratic {
            nodes.extend(EDGES.map(|[a, b]| (CORNERS[a] + CORNERS[b]) * 0.5));
        }
        nodes
    }

    fn energy(order: ElementOrder, displacement: impl Fn(DVec3) -> DVec3) -> f64 {
        let nodes = nodes(order);
        let k = order.matrices(&nodes, &RUBBER).stiffness;
        let n = nodes.len();
        let u: Vec<_> = nodes.iter().map(|&x| displacement(x)).collect();
        (0..n * n).map(|at| 0.5 * u[at / n].dot(k[at] * u[at % n])).sum()
    }

    fn volume() -> f64 {
        let [a, b, c, d] = CORNERS;
        (b - a).cross(c - a).dot(d - a) / 6.0
    }

    #[test]
    fn rigid_motion_stores_no_energy() {
        let spin = DVec3::new(0.3, -0.4, 0.9);
        for order in [ElementOrder::Linear, ElementOrder::Quadratic] {
            let stored = energy(order, |x| DVec3::new(1.0, 2.0, 3.0) + spin.cross(x));
            assert!(stored.abs() < 1e-13, "{order:?}: {stored}");
        }
    }

    #[test]
    fn uniform_strain_stores_its_exact_energy() {
        let strain = DMat3::from_cols_array_2d(&[[0.1, 0.2, -0.1], [0.2, -0.3, 0.4], [-0.1, 0.4, 0.5]]);
        let trace = strain.x_axis.x + strain.y_axis.y + strain.z_axis.z;
        let squares: f64 = strain.to_cols_array().iter().map(|e| e * e).sum();
        let exact = volume() * (0.5 * LAMBDA * trace * trace + MU * squares);
        for order in [ElementOrder::Linear, ElementOrder::Quadratic] {
            let stored = energy(order, |x| strain * x);
            assert!((stored / exact - 1.0).abs() < 1e-13, "{order:?}: {stored} {exact}");
        }
    }

    #[test]
    fn quadratic_displacement_stores_its_exact_energy_in_quadratic_elements() {
        // u = (x², 0, 0): ∇u = 2x in xx alone, energy ½(λ + 2μ)·4x². ∫x² over a tetrahedron is
        // V/20·(Σx_i² + (Σx_i)²).
        let x: Vec<f64> = CORNERS.iter().map(|c| c.x).collect();
        let (sum, squares): (f64, f64) = (x.iter().sum(), x.iter().map(|x| x * x).sum());
        let exact = 2.0 * (LAMBDA + 2.0 * MU) * volume() / 20.0 * (squares + sum * sum);
        let stored = energy(ElementOrder::Quadratic, |x| DVec3::X * x.x * x.x);
        assert!((stored / exact - 1.0).abs() < 1e-13, "{stored} {exact}");
    }

    #[test]
    fn consistent_mass_integrates_products_of_its_own_functions() {
        // ∫ρ·x·y by the closed form for a tetrahedron, from M alone.
        let (x, y): (Vec<f64>, Vec<f64>) = CORNERS.iter().map(|c| (c.x, c.y)).unzip();
        let cross: f64 = x.iter().zip(&y).map(|(x, y)| x * y).sum();
        let exact =
            RUBBER.density * volume() / 20.0 * (cross + x.iter().sum::<f64>() * y.iter().sum::<f64>());
        for order in [ElementOrder::Linear, ElementOrder::Quadratic] {
            let nodes = nodes(order);
            let mass = order.matrices(&nodes, &RUBBER).mass;
            let n = nodes.len();
            let got: f64 = (0..n * n).map(|at| nodes[at / n].x * mass[at] * nodes[at % n].y).sum();
            assert!((got / exact - 1.0).abs() < 1e-13, "{order:?}: {got} {exact}");
            assert!((mass.iter().sum::<f64>() / (RUBBER.density * volume()) - 1.0).abs() < 1e-14);
        }
    }
}
