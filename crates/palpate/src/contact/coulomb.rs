//! Law of one contact: Signorini and Coulomb, for the force that is held over a step.
//!
//! In axes (−n, t₁, t₂), with n the outward normal of the object, the other side moves relative to the object's
//! point by r = b − W·f: W [m/N] is the contact's own compliance, b [m] the relative motion without its force. r₀ is the
//! penetration at the end of the step, (r₁, r₂) the slip over it. The force f = (λ, f₁, f₂) [N] on the object obeys
//!
//! ```text
//! r₀ ≤ 0,  λ ≥ 0,  λ·r₀ = 0          |f_t| ≤ μ·λ,  f_t = μ·λ·r_t/|r_t| where r_t ≠ 0
//! ```
//!
//! The slip is that over the whole step, so the dissipation of friction, f_t·r_t [J], is never negative.
//!
//! Equations: docs/theory.md (C36), (C37), (C40).

use super::parameters::SOLVER;
use glam::{DMat3, DVec2, DVec3};

/// Upper limit of iterations for the direction of slip; Newton's method converges quadratically near the solution.
const MAX_ITERATIONS: usize = 30;

/// Turn [rad] whose square is round-off.
const SMALL_TURN: f64 = 3e-8;

/// Force that obeys the law [N], in the contact's axes. `before` is the warm start, `stiffness` the inverse of W.
///
/// # Real time
#[allow(non_snake_case)]
pub(crate) fn solve_contact(W: &DMat3, stiffness: &DMat3, b: DVec3, friction: f64, before: DVec3) -> DVec3 {
    if b.x <= 0.0 {
        return DVec3::ZERO;
    }
    if friction <= 0.0 {
        return DVec3::X * (b.x / W.x_axis.x);
    }
    // Stick.
    let stuck = *stiffness * b;
    let across = DVec2::new(stuck.y, stuck.z);
    if stuck.x >= 0.0 && across.length() <= friction * stuck.x {
        return stuck;
    }
    // Slip along d: λ = b₀ / (W₀₀ + μ·W₀ₜ·d), where d is the direction of r_t.
    let coupling = DVec2::new(W.y_axis.x, W.z_axis.x);
    let warm = DVec2::new(before.y, before.z);
    let mut direction = if warm.length() > 0.1 * friction * before.x { warm } else { across };
    direction = direction.normalize_or(DVec2::X);
    let step = 1.0 / (W.y_axis.y + W.z_axis.z);
    // Force at the cone in a direction, and the denominator of λ.
    let slipping = |direction: DVec2| {
        let denominator = W.x_axis.x + friction * coupling.dot(direction);
        // Below this denominator the contact jams; the remainder shows as residual.
        let lambda = b.x / denominator.max(SOLVER.jam * W.x_axis.x);
        let tangent = direction * (friction * lambda);
        (DVec3::new(lambda, tangent.x, tangent.y), denominator)
    };
    for _ in 0..MAX_ITERATIONS {
        let (force, denominator) = slipping(direction);
        let (lambda, tangent) = (force.x, DVec2::new(force.y, force.z));
        let moved = b - *W * force;
        let slip = DVec2::new(moved.y, moved.z);
        // Derivatives of force and slip by the turn of the direction.
        let aside = direction.perp();
        let lambda_turns = -lambda * friction * coupling.dot(aside) / denominator;
        let tangent_turns = (direction * lambda_turns + aside * lambda) * friction;
        let turns = *W * DVec3::new(lambda_turns, tangent_turns.x, tangent_turns.y);
        let slip_turns = -DVec2::new(turns.y, turns.z);
        let turn = -direction.perp_dot(slip) / (aside.perp_dot(slip) + direction.perp_dot(slip_turns));
        let newton = direction.dot(slip) > 0.0 && turn.abs() < SOLVER.max_turn;
        let next = if newton {
            (direction + aside * turn).normalize()
        } else {
            (tangent + slip * step).normalize_or(direction)
        };
        let turned = (next - direction).length();
        direction = next;
        // Newton's method leaves an error of the turn's square.
        if turned < if newton { SMALL_TURN } else { SMALL_TURN * SMALL_TURN } {
            break;
        }
    }
    slipping(direction).0
}

/// Two unit tangents of a unit normal, right-handed with it.
pub(crate) fn tangents(normal: DVec3) -> (DVec3, DVec3) {
    normal.any_orthonormal_pair()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn compliance() -> DMat3 {
        DMat3::from_cols_array_2d(&[[2.0, 0.3, -0.2], [0.3, 1.5, 0.1], [-0.2, 0.1, 1.2]])
    }

    #[test]
    fn force_and_movement_obey_the_law_in_every_case() {
        let w = compliance();
        let mut cases = [0; 3];
        for k in 0..2000 {
            let angle = |p: f64| libm::sin(p * f64::from(k) + p);
            let b = DVec3::new(angle(1.3), 0.6 * angle(2.1), 0.6 * angle(3.7));
            let friction = 0.2 + 0.5 * angle(0.7).abs();
            let f = solve_contact(&w, &w.inverse(), b, friction, DVec3::ZERO);
            let r = b - w * f;
            let (across, slip) = (DVec2::new(f.y, f.z), DVec2::new(r.y, r.z));
            assert!(f.x >= 0.0 && r.x <= 1e-12, "{f} {r}");
            assert!((f.x * r.x).abs() < 1e-12);
            if f.x == 0.0 {
                cases[0] += 1;
            } else if across.length() < friction * f.x * (1.0 - 1e-12) {
                assert!(slip.length() < 1e-12, "sticks: {slip}");
                cases[1] += 1;
            } else {
                assert!((across.length() - friction * f.x).abs() < 1e-12);
                let along = across.normalize().dot(slip);
                assert!(along >= -1e-12 && (slip.length() - along).abs() < 1e-9, "{slip} {across}");
                cases[2] += 1;
            }
        }
        assert!(cases.iter().all(|&count| count > 80), "{cases:?}");
    }
}
