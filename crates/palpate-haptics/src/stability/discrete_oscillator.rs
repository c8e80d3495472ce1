//! Mass on a spring and a damper under a zero-order hold, as a transfer function.
//!
//! ```text
//! g(z) = e₁ᵀ·(1 − w·A)⁻¹·B = [(1 − a22·w)·b1 + a12·w·b2] / (1 − (a11 + a22)·w + (a11·a22 − a12·a21)·w²)        w = 1/z
//! ```
//!
//! (q, v)⁺ = A·(q, v) + B·p is the exact map over a step with the force p held. g [m/N] is the displacement at the **end** of the step
//! per force, R[0] + R[1]·w + R[2]·w² + …, for a mass of 1 kg.

use num_complex::Complex64;
use palpate::{OscillatorState, SampledOscillator};

/// Exact one-step map of an oscillator with a mass of 1 kg.
#[derive(Debug, Clone, Copy)]
pub(super) struct DiscreteOscillator {
    a: [[f64; 2]; 2],
    b: [f64; 2],
}

impl DiscreteOscillator {
    /// Oscillator with angular frequency ω > 0 [rad/s], damping ratio ζ [1] and step [s].
    pub(super) fn oscillator(angular_frequency: f64, damping_ratio: f64, step_s: f64) -> Self {
        let map = SampledOscillator::new(angular_frequency, damping_ratio, step_s);
        let moved = |q: f64, v: f64, p: f64| {
            let next = map.advance(OscillatorState { q, v }, p);
            [next.q, next.v]
        };
        let (from_q, from_v) = (moved(1.0, 0.0, 0.0), moved(0.0, 1.0, 0.0));
        Self { a: [[from_q[0], from_v[0]], [from_q[1], from_v[1]]], b: moved(0.0, 0.0, 1.0) }
    }

    /// Free mass with damping per mass r ≥ 0 [1/s] and step [s].
    pub(super) fn free(rate: f64, step_s: f64) -> Self {
        let (h, x) = (step_s, rate * step_s);
        // Displacement per velocity, a = (1 − e^(−rh))/r, and per force, (h − a)/r; by their series where the differences cancel.
        let (per_velocity, per_force) = if x < 1e-4 {
            (h * (1.0 - x / 2.0 + x * x / 6.0), h * h * (0.5 - x / 6.0 + x * x / 24.0))
        } else {
            let per_velocity = -(-x).exp_m1() / rate;
            (per_velocity, (h - per_velocity) / rate)
        };
        Self { a: [[1.0, per_velocity], [0.0, (-x).exp()]], b: [per_force, per_velocity] }
    }

    /// Mass [kg] on a spring [N/m] and a damper [N·s/m]; its response is that of the mass, times the mass.
    pub(super) fn mass(mass_kg: f64, stiffness_n_m: f64, damping_n_s_m: f64, step_s: f64) -> Self {
        if stiffness_n_m > 0.0 {
            let omega = (stiffness_n_m / mass_kg).sqrt();
            Self::oscillator(omega, 0.5 * damping_n_s_m / (mass_kg * omega), step_s)
        } else {
            Self::free(damping_n_s_m / mass_kg, step_s)
        }
    }

    /// R[0] [m/N]: displacement at the end of a step with a unit force.
    pub(super) fn instantaneous_compliance(&self) -> f64 {
        self.b[0]
    }

    /// Transfer function g at w = 1/z.
    pub(super) fn response(&self, w: Complex64) -> Complex64 {
        let Self { a: [[_, a12], [_, a22]], b: [b1, b2] } = *self;
        let [trace, determinant] = self.invariants();
        ((1.0 - w * a22) * b1 + w * (a12 * b2)) / (1.0 - w * trace + w * w * determinant)
    }

    /// Poles: angle on the unit circle, between 0 and π [rad], and distance from it.
    pub(super) fn poles(&self) -> [(f64, f64); 2] {
        let [trace, determinant] = self.invariants();
        let square = 0.25 * trace * trace - determinant;
        if square < 0.0 {
            let angle = (-square).sqrt().atan2(0.5 * trace);
            return [(angle, (1.0 - determinant.sqrt()).abs()); 2];
        }
        [1.0, -1.0].map(|sign| {
            let pole = 0.5 * trace + sign * square.sqrt();
            (if pole < 0.0 { std::f64::consts::PI } else { 0.0 }, (1.0 - pole.abs()).abs())
        })
    }

    /// Trace and determinant of A.
    fn invariants(&self) -> [f64; 2] {
        let [[a11, a12], [a21, a22]] = self.a;
        [a11 + a22, a11 * a22 - a12 * a21]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sum Σ R[s]·wˢ, term by term.
    fn summed(map: &DiscreteOscillator, w: Complex64, terms: u32) -> Complex64 {
        let (mut state, mut sum, mut power) = ([0.0; 2], Complex64::ZERO, Complex64::ONE);
        for step in 0..terms {
            let p = if step == 0 { 1.0 } else { 0.0 };
            let row = |i: usize| map.a[i][0] * state[0] + map.a[i][1] * state[1] + map.b[i] * p;
            state = [row(0), row(1)];
            sum += power * state[0];
            power *= w;
        }
        sum
    }

    #[test]
    fn the_transfer_function_is_the_sum_of_the_impulse_response() {
        let h = 1e-3;
        let maps = [
            DiscreteOscillator::oscillator(300.0, 0.02, h),
            DiscreteOscillator::oscillator(5000.0, 1.7, h),
            DiscreteOscillator::free(0.0, h),
            DiscreteOscillator::free(40.0, h),
        ];
        for map in maps {
            let w = Complex64::from_polar(0.9, -1.1);
            let (closed, sum) = (map.response(w), summed(&map, w, 400));
            assert!((closed - sum).norm() < 1e-13 * sum.norm(), "{closed} {sum}");
        }
    }

    #[test]
    fn a_weak_spring_and_a_weak_damper_are_none() {
        let (h, w) = (1e-3, Complex64::from_polar(0.99, -0.3));
        let free = DiscreteOscillator::mass(0.05, 0.0, 0.0, h).response(w);
        let expected = (1.0 + w) / ((1.0 - w) * (1.0 - w)) * (0.5 * h * h);
        assert!((free - expected).norm() < 1e-12 * free.norm());
        for (stiffness, damping) in [(1e-9, 0.0), (0.0, 1e-9), (0.0, 5.1e-3)] {
            let near = DiscreteOscillator::mass(0.05, stiffness, damping, h).response(w);
            let allowed = if damping > 1e-6 { 1e-3 } else { 1e-6 };
            assert!((near - free).norm() < allowed * free.norm(), "{stiffness} {damping}: {near} {free}");
        }
    }
}
