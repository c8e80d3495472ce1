//! Material constants, and the stiffness block of two shape functions.

use crate::material::{lame_constants, voigt};
use glam::{DMat3, DVec3};
use palpate::Material;

/// Material constants of an element.
#[derive(Debug, Clone)]
pub(crate) struct Elasticity {
    /// Elastic law.
    pub law: Law,
    /// Density ρ [kg/m³].
    pub density: f64,
}

/// Elastic law.
#[derive(Debug, Clone)]
pub(crate) enum Law {
    /// Isotropic.
    Isotropic {
        /// Lamé's first parameter λ [Pa].
        lambda: f64,
        /// Shear modulus μ [Pa].
        mu: f64,
    },
    /// Anisotropic: the matrices C_p·r· [Pa] with the entries C_pqrs, at 3q + s.
    Anisotropic(Box<[DMat3; 9]>),
}

impl Elasticity {
    /// Constants of a material.
    pub fn new(material: &Material) -> Self {
        let law = match &material.stiffness_pa {
            None => {
                let (lambda, mu) = lame_constants(material);
                Law::Isotropic { lambda, mu }
            }
            Some(stiffness) => Law::Anisotropic(Box::new(std::array::from_fn(|at| {
                let (q, s) = (at / 3, at % 3);
                let entry = |p: usize, r: usize| stiffness[voigt(p, q)][voigt(r, s)];
                let column = |r: usize| DVec3::new(entry(0, r), entry(1, r), entry(2, r));
                DMat3::from_cols(column(0), column(1), column(2))
            }))),
        };
        Self { law, density: material.density_kg_m3 }
    }

    /// 3×3 stiffness block per volume [Pa/m²] of two gradients: Σ_qs a_q·C_pqrs·b_s, which is λ·a bᵀ + μ·b aᵀ + μ·(a·b)·1 for an
    /// isotropic law.
    pub fn block(&self, a: DVec3, b: DVec3) -> DMat3 {
        match &self.law {
            Law::Isotropic { lambda, mu } => {
                let outer = |a: DVec3, b: DVec3| DMat3::from_cols(a * b.x, a * b.y, a * b.z);
                outer(a, b) * *lambda + outer(b, a) * *mu + DMat3::from_diagonal(DVec3::splat(mu * a.dot(b)))
            }
            Law::Anisotropic(matrices) => {
                let (a, b) = (a.to_array(), b.to_array());
                (0..9).fold(DMat3::ZERO, |sum, at| sum + matrices[at] * (a[at / 3] * b[at % 3]))
            }
        }
    }
}

/// Stiffness blocks and mass entries of one element, both triangles.
#[derive(Debug, Clone, Default)]
pub(crate) struct ElementMatrices {
    /// Stiffness K_ij [N/m] at i·nodes + j.
    pub stiffness: Vec<DMat3>,
    /// Consistent mass M_ij [kg] at i·nodes + j.
    pub mass: Vec<f64>,
}

#[cfg(test)]
pub(super) mod tests {
    use super::{Elasticity, Law};

    pub const LAMBDA: f64 = 3.0;
    pub const MU: f64 = 0.7;

    /// Material of the tests of elements.
    pub const RUBBER: Elasticity =
        Elasticity { law: Law::Isotropic { lambda: LAMBDA, mu: MU }, density: 2.0 };
}
