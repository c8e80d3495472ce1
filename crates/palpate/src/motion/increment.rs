//! Rigid motion within a step in linear terms: what a change of force adds to the last exact evaluation.
//!
//! ```text
//! Δx = m⁻¹·c·h²·Δf        Δθ = I⁻¹·c·h²·(a × Δf)        c = ½ (zero-order hold) or 1 (the paper's update)
//! ```
//!
//! Equations: docs/theory.md (C13), (C33).

use glam::{DMat3, DVec3};

/// Linearised rigid motion of one object since the last exact evaluation of the step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct RigidIncrement {
    /// Displacement [m, world].
    pub(crate) displacement: DVec3,
    /// Rotation [rad, world].
    pub(crate) rotation: DVec3,
    /// Displacement per force, c·h²/m [m/N]; 0 where rigid motion does not count within the step.
    pub(crate) mobility: f64,
    /// Rotation per torque, c·h²·I⁻¹ [rad/(N·m), world].
    pub(crate) angular_mobility: DMat3,
}

impl Default for RigidIncrement {
    fn default() -> Self {
        Self {
            displacement: DVec3::ZERO,
            rotation: DVec3::ZERO,
            mobility: 0.0,
            angular_mobility: DMat3::ZERO,
        }
    }
}

impl RigidIncrement {
    /// Add a force [N, world] at the end of an arm [m, world].
    pub(crate) fn push(&mut self, force: DVec3, arm: DVec3) {
        self.displacement += force * self.mobility;
        self.rotation += self.angular_mobility * arm.cross(force);
    }

    /// Forget the increment: the motion was evaluated exactly.
    pub(crate) fn reset(&mut self) {
        (self.displacement, self.rotation) = (DVec3::ZERO, DVec3::ZERO);
    }
}
