//! The quadratic tetrahedron with straight edges, integrated exactly.
//!
//! N_a = λ_a(2λ_a − 1) at corners, N_ab = 4λ_aλ_b at mid-edges. Both are sums of products
//! λ_aλ_b, since λ_a = λ_a·Σλ, so every N is a quadratic form Σ Q_ab λ_aλ_b, and
//! ∇N = 2Σ Q_ab λ_a ∇λ_b is linear in λ.

use super::elasticity::{Elasticity, ElementMatrices};
use super::tet4::gradients;
use glam::{DMat3, DVec3};

/// Corner pairs of the six mid-edge nodes, in their order.
pub(crate) const EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]];

/// Symmetric matrix Q of a quadratic form in the barycentric coordinates.
pub(super) type QuadraticForm = [[f64; 4]; 4];

/// Symmetric matrix Q of each shape function.
pub(super) fn shape_functions() -> [QuadraticForm; 10] {
    let mut forms = [[[0.0; 4]; 4]; 10];
    for (a, form) in forms[..4].iter_mut().enumerate() {
        // 2λ_a² − λ_a·Σ_b λ_b.
        for other in form.iter_mut() {
            other[a] -= 0.5;
        }
        form[a].iter_mut().for_each(|entry| *entry -= 0.5);
        form[a][a] += 2.0;
    }
    for (form, [a, b]) in forms[4..].iter_mut().zip(EDGES) {
        form[a][b] = 2.0;
        form[b][a] = 2.0;
    }
    forms
}

/// ∫ λ_a λ_b dV / V = (1 + δ_ab)/20.
fn pair_integral(a: usize, b: usize) -> f64 {
    if a == b { 0.1 } else { 0.05 }
}

/// ∫ λ_a λ_b λ_c λ_d dV / V = 6·Π(multiplicities!)/7!.
fn quadruple_integral(indices: [usize; 4]) -> f64 {
    let mut counts = [0_u32; 4];
    indices.iter().for_each(|&i| counts[i] += 1);
    let factorial = |n: u32| f64::from((1..=n).product::<u32>());
    6.0 * counts.iter().map(|&n| factorial(n)).product::<f64>() / 5040.0
}

/// ∫ N_i N_j dV / V, equal for every element.
fn mass_coefficients() -> [[f64; 10]; 10] {
    let forms = shape_functions();
    let mut coefficients = [[0.0; 10]; 10];
    for (i, row) in coefficients.iter_mut().enumerate() {
        for (j, coefficient) in row.iter_mut().enumerate() {
            for at in 0..256 {
                let [a, b, c, d] = [at & 3, (at >> 2) & 3, (at >> 4) & 3, at >> 6];
                *coefficient += forms[i][a][b] * forms[j][c][d] * quadruple_integral([a, b, c, d]);
            }
        }
    }
    coefficients
}

/// Stiffness [N/m] and consistent mass [kg].
pub(super) fn matrices(corners: [DVec3; 4], elasticity: &Elasticity) -> ElementMatrices {
    static COEFFICIENTS: std::sync::LazyLock<[[f64; 10]; 10]> = std::sync::LazyLock::new(mass_coefficients);
    let (gradients, volume) = gradients(corners);
    let density = elasticity.density;

    // ∇N_i = Σ_a λ_a·gradient_coefficients[i][a].
    let gradient_coefficients = shape_functions()
        .map(|form| form.map(|row| row.iter().zip(gradients).map(|(q, g)| g * (2.0 * q)).sum::<DVec3>()));
    let mut matrices = ElementMatrices::default();
    for (i, j) in (0..10).flat_map(|i| (0..10).map(move |j| (i, j))) {
        let mut stiffness = DMat3::ZERO;
        for a in 0..4 {
            // The block is bilinear: integrate one side first.
            let weighted: DVec3 = (0..4).map(|b| gradient_coefficients[j][b] * pair_integral(a, b)).sum();
            stiffness += elasticity.block(gradient_coefficients[i][a], weighted);
        }
        matrices.stiffness.push(stiffness * volume);
        matrices.mass.push(density * volume * COEFFICIENTS[i][j]);
    }
    matrices
}
