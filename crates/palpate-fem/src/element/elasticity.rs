//! Material constants, and the stiffness block of two shape functions.

use glam::{DMat3, DVec3};

/// Material constants of an element.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Elasticity {
    /// Lamé's first parameter λ [Pa].
    pub lambda: f64,
    /// Shear modulus μ [Pa].
    pub mu: f64,
    /// Density ρ [kg/m³].
    pub density: f64,
}

/// Stiffness blocks and mass entries of one element, both triangles.
#[derive(Debug, Clone, Default)]
pub(crate) struct ElementMatrices {
    /// Stiffness K_ij [N/m] at i·nodes + j.
    pub stiffness: Vec<DMat3>,
    /// Consistent mass M_ij [kg] at i·nodes + j.
    pub mass: Vec<f64>,
}

/// 3×3 stiffness block per volume [Pa/m²] of two constant gradients: λ·a bᵀ + μ·b aᵀ + μ·(a·b)·1.
pub(super) fn stiffness_block(a: DVec3, b: DVec3, lambda: f64, mu: f64) -> DMat3 {
    let outer = |a: DVec3, b: DVec3| DMat3::from_cols(a * b.x, a * b.y, a * b.z);
    outer(a, b) * lambda + outer(b, a) * mu + DMat3::from_diagonal(DVec3::splat(mu * a.dot(b)))
}
