//! The linear tetrahedron: constant strain, M_ij = ρV(1 + δ_ij)/20.

use super::elasticity::{Elasticity, ElementMatrices};
use glam::{DMat3, DVec3};

/// Gradients of the barycentric coordinates [1/m] and the signed volume [m³].
pub(super) fn gradients([a, b, c, d]: [DVec3; 4]) -> ([DVec3; 4], f64) {
    let edges = DMat3::from_cols(b - a, c - a, d - a);
    let six_volumes = edges.determinant();
    // Rows of the inverse: (c−a)×(d−a)/6V, ...
    let g1 = edges.y_axis.cross(edges.z_axis) / six_volumes;
    let g2 = edges.z_axis.cross(edges.x_axis) / six_volumes;
    let g3 = edges.x_axis.cross(edges.y_axis) / six_volumes;
    ([-(g1 + g2 + g3), g1, g2, g3], six_volumes / 6.0)
}

/// Stiffness [N/m] and consistent mass [kg].
pub(super) fn matrices(corners: [DVec3; 4], elasticity: &Elasticity) -> ElementMatrices {
    let (gradients, volume) = gradients(corners);
    let density = elasticity.density;
    let mut matrices = ElementMatrices::default();
    for (i, j) in (0..4).flat_map(|i| (0..4).map(move |j| (i, j))) {
        matrices.stiffness.push(elasticity.block(gradients[i], gradients[j]) * volume);
        matrices.mass.push(density * volume / 20.0 * if i == j { 2.0 } else { 1.0 });
    }
    matrices
}
