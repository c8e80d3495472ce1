//! The quadratic tetrahedron with straight edges, integrated exactly.
//!
//! N_a = λ_a(2λ_a − 1) at corners, N_ab = 4λ_aλ_b at mid-edges. Both are sums of products
//! λ_aλ_b, since λ_a = λ_a·Σλ, so every N is a quadratic form Σ Q_ab λ_aλ_b, and
//! ∇N = 2Σ Q_ab λ_a ∇λ_b is linear in λ.

use super::{EDGES, Elasticity, ElementMatrices, block, gradients};
use glam::{DMat3, DVec3};

type FrameFormat = [[f64; 4]; 4];

/// Symmetric Q of each shape function.
fn forms() -> [FrameFormat; 10] {
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
fn pair(a: usize, b: usize) -> f64 {
    if a == b { 0.1 } else { 0.05 }
}

/// ∫ λ_a λ_b λ_c λ_d dV / V = 6·Π(multiplicities!)/7!.
fn quadruple(indices: [usize; 4]) -> f64 {
    let mut counts = [0_u32; 4];
    indices.iter().for_each(|&i| counts[i] += 1);
    let factorial = |n: u32| f64::from((1..=n).product::<u32>());
    6.0 * counts.iter().map(|&n| factorial(n)).product::<f64>() / 5040.0
}

/// ∫ N_i N_j dV / V, the same for every element.
fn mass_shares() -> [[f64; 10]; 10] {
    let forms = forms();
    let mut shares = [[0.0; 10]; 10];
    for (i, row) in shares.iter_mut().enumerate() {
        for (j, share) in row.iter_mut().enumerate() {
            for at in 0..256 {
                let [a, b, c, d] = [at & 3, (at >> 2) & 3, (at >> 4) & 3, at >> 6];
                *share += forms[i][a][b] * forms[j][c][d] * quadruple([a, b, c, d]);
            }
        }
    }
    shares
}

pub(super) fn matrices(corners: [DVec3; 4], elasticity: Elasticity) -> ElementMatrices {
    static SHARES: std::sync::LazyLock<[[f64; 10]; 10]> = std::sync::LazyLock::new(mass_shares);
    let (gradients, volume) = gradients(corners);
    let Elasticity { lambda, mu, density } = elasticity;

    // ∇N_i = Σ_a λ_a·slopes[i][a].
    let slopes = forms()
        .map(|form| form.map(|row| row.iter().zip(gradients).map(|(q, g)| g * (2.0 * q)).sum::<DVec3>()));
    let mut matrices = ElementMatrices::default();
    for (i, j) in (0..10).flat_map(|i| (0..10).map(move |j| (i, j))) {
        let mut stiffness = DMat3::ZERO;
        for a in 0..4 {
            // The block is bilinear: weigh one side first.
            let weighted: DVec3 = (0..4).map(|b| slopes[j][b] * pair(a, b)).sum();
            stiffness += block(slopes[i][a], weighted, lambda, mu);
        }
        matrices.stiffness.push(stiffness * volume);
        matrices.mass.push(density * volume * SHARES[i][j]);
    }
    matrices
}
