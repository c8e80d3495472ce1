//! Element matrices of linear tetrahedra, and of quadratic ones with straight or curved edges.
//!
//! With barycentric coordinates λ_a and their constant gradients ∇λ_a, shape functions N_i:
//!
//! ```text
//! K_ij = ∫ λ·∇N_i ∇N_jᵀ + μ·∇N_j ∇N_iᵀ + μ·(∇N_i·∇N_j)·1 dV     3×3 blocks [N/m]
//! M_ij = ∫ ρ·N_i·N_j dV                                        times the unit matrix [kg]
//! ```
//!
//! With straight edges all integrals are exact: ∫ λ0^a λ1^b λ2^c λ3^d dV = 6V·a!b!c!d!/(a+b+c+d+3)!; curved ones are integrated numerically (`curved`).
//! Reference: Zienkiewicz, Taylor & Zhu, *The Finite Element Method*, chapters 4 and 6.

mod curved;
mod elasticity;
mod order;
mod quadrature;
mod tet10;
mod tet4;

pub(crate) use elasticity::{Elasticity, ElementMatrices};
pub use order::ElementOrder;
pub(crate) use order::ShapeFunction;
pub(crate) use quadrature::triangle as triangle_rule;
pub(crate) use tet10::EDGES;
