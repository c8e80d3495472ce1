//! Pose and velocity of rigid frames.
//!
//! The rotation of one step is the Cayley map of a vector v (rotation axis times twice the
//! tangent of half the angle), cay(v) = (I − v̂/2)⁻¹ (I + v̂/2). As a quaternion it is (1, v/2)
//! normalised, and for every vector a it satisfies, exactly,
//! cay(v)·a − a = v × (cay(v)·a + a)/2. The energy balance of a turning body follows from this identity.
//!
//! Equations: docs/theory.md (C9), (C10), (C11), (C12).

use glam::{DAffine3, DMat3, DQuat, DVec3};

/// Placement of a body frame in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Origin of the body frame, the centre of mass [m, world].
    pub position: DVec3,
    /// Rotation from body to world, a unit quaternion.
    pub orientation: DQuat,
}

impl Pose {
    /// Body frame equal to the world frame.
    pub const IDENTITY: Self = Self { position: DVec3::ZERO, orientation: DQuat::IDENTITY };

    /// World position [m, world] of a body point [m, body].
    pub fn world_from_body(&self, point_in_body: DVec3) -> DVec3 {
        self.position + self.orientation * point_in_body
    }

    /// Body position [m, body] of a world point [m, world].
    pub fn body_from_world(&self, point_in_world: DVec3) -> DVec3 {
        self.orientation.inverse() * (point_in_world - self.position)
    }

    /// Affine map from this frame to another: for many points cheaper than over the world frame.
    pub(crate) fn relative_to(&self, other: &Self) -> DAffine3 {
        let rotation = DMat3::from_quat(other.orientation.inverse() * self.orientation);
        DAffine3::from_mat3_translation(rotation, other.body_from_world(self.position))
    }

    /// Upper bound of the motion of a point at the end of an arm [m] between this pose and another [m].
    pub(crate) fn motion_bound(&self, to: &Self, arm: f64) -> f64 {
        (to.position - self.position).length() + self.orientation.angle_between(to.orientation) * arm
    }
}

/// Velocity of a body frame, in world axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Twist {
    /// Velocity of the centre of mass [m/s].
    pub linear: DVec3,
    /// Angular velocity [rad/s].
    pub angular: DVec3,
}

impl Twist {
    /// Twist of a body at rest.
    pub const ZERO: Self = Self { linear: DVec3::ZERO, angular: DVec3::ZERO };
}

/// Rotation cay(v), for v [rad], step times mean angular velocity: the unit quaternion along (1, v/2).
pub fn cayley(v: DVec3) -> DQuat {
    DQuat::from_xyzw(0.5 * v.x, 0.5 * v.y, 0.5 * v.z, 1.0).normalize()
}

/// Square of the Frobenius norm of a matrix.
pub(crate) fn frobenius_square(matrix: &DMat3) -> f64 {
    matrix.to_cols_array().iter().map(|x| x * x).sum()
}

/// Upper bound of the spectral norm of a matrix: √(‖M‖₁·‖M‖_∞), exact for a multiple of the identity.
pub(crate) fn spectral_bound(matrix: &DMat3) -> f64 {
    let [a, b, c] = [matrix.x_axis.abs(), matrix.y_axis.abs(), matrix.z_axis.abs()];
    let largest_column = a.element_sum().max(b.element_sum()).max(c.element_sum());
    libm::sqrt(largest_column * (a + b + c).max_element())
}

/// Cross-product matrix v̂, with v̂·a = v × a.
pub(crate) fn cross_matrix(v: DVec3) -> DMat3 {
    DMat3::from_cols(DVec3::new(0.0, v.z, -v.y), DVec3::new(-v.z, 0.0, v.x), DVec3::new(v.y, -v.x, 0.0))
}

/// Inertia [kg·m²] in world axes: R·I·Rᵀ.
pub fn inertia_in_world(inertia_in_body: DMat3, world_from_body: DMat3) -> DMat3 {
    world_from_body * inertia_in_body * world_from_body.transpose()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cayley_satisfies_its_midpoint_identity() {
        let v = DVec3::new(0.3, -1.1, 0.7);
        let a = DVec3::new(-0.2, 0.9, 0.4);
        let turned = cayley(v) * a;
        let difference = (turned - a) - v.cross(turned + a) * 0.5;
        assert!(difference.length() < 8.0 * f64::EPSILON, "{difference}");
    }

    #[test]
    fn cayley_turns_by_twice_the_arc_tangent_of_half_its_length() {
        let turned = cayley(DVec3::Z * 2.0) * DVec3::X;
        assert!((turned - DVec3::Y).length() < 4.0 * f64::EPSILON, "{turned}");
    }

    #[test]
    fn pose_maps_there_and_back() {
        let pose =
            Pose { position: DVec3::new(1.0, 2.0, 3.0), orientation: cayley(DVec3::new(0.1, 0.2, 0.3)) };
        let point = DVec3::new(-0.4, 0.5, 0.6);
        let back = pose.body_from_world(pose.world_from_body(point));
        assert!((back - point).length() < 1e-15);
    }
}
