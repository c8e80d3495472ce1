//! Damped oscillators under a force that is held over each step, sampled exactly.
//!
//! q̈ + 2ζω·q̇ + ω²·q = p, with p [N/√kg] constant over a step h, has the solution
//!
//! ```text
//! q⁺ = a11·q + a12·v + b·p        a12: displacement after a unit impulse
//! v⁺ = a21·q + a22·v + a12·p      b = (1 − a11)/ω²: displacement after a unit force held for h
//! ```
//!
//! q [m·√kg], v = q̇, ω [rad/s], ζ [1]. Under-, over- and critically damped modes are the same
//! formula with cos/sin, cosh/sinh or their common limit. With D = E − AᵀEA, the loss of
//! ½v² + ½ω²(q − p/ω²)² over the step, the energy taken by damping is a quadratic form
//! of the state, never negative.
//!
//! Equations: docs/theory.md (C5), (C6).

/// State of one mode.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct OscillatorState {
    /// Modal coordinate [m·√kg].
    pub q: f64,
    /// Modal velocity [m·√kg/s].
    pub v: f64,
}

/// Exact one-step map of one mode under a held force.
///
/// ```
/// use palpate::{OscillatorState, SampledOscillator};
///
/// // A mode of 10 Hz without damping, pushed from rest by 1 N/√kg for 1 ms.
/// let omega = 10.0 * std::f64::consts::TAU;
/// let mode = SampledOscillator::new(omega, 0.0, 1e-3);
/// let pushed = mode.advance(OscillatorState::default(), 1.0);
/// assert!((pushed.q - (1.0 - (omega * 1e-3_f64).cos()) / omega.powi(2)).abs() < 1e-18);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampledOscillator {
    a11: f64,
    a12: f64,
    a21: f64,
    a22: f64,
    pub(super) b: f64,
    /// Loss form: (d11·q̂ + 2·d12·v)·q̂ + d22·v², q̂ = q − p/ω².
    d11: f64,
    d12: f64,
    d22: f64,
    /// ω² [rad²/s²].
    stiffness: f64,
}

/// Upper limit of |ωd·h| for the series of sin(ωd·h)/ωd: its next term, the
/// sixth power over 5040, is then below half an ulp.
const SERIES_BELOW: f64 = 1e-2;

impl SampledOscillator {
    /// Map for a step [s] of a mode with ω > 0 [rad/s] and ζ ≥ 0 [1].
    pub fn new(angular_frequency: f64, damping_ratio: f64, step_s: f64) -> Self {
        let (omega, zeta, h) = (angular_frequency, damping_ratio, step_s);
        let sigma = zeta * omega;
        // ωd² = ω²(1 − ζ²), negative when overdamped.
        let square = omega * omega * (1.0 - zeta) * (1.0 + zeta);
        let decay = libm::exp(-sigma * h);
        // c = e^(−σh)·cos ωd·h, s = e^(−σh)·sin(ωd·h)/ωd, gain = 1 − a11.
        let (c, s, gain);
        if libm::fabs(square) * h * h < SERIES_BELOW * SERIES_BELOW {
            let x = square * h * h;
            let one_minus_cosine = x / 2.0 * (1.0 - x / 12.0 * (1.0 - x / 30.0));
            c = decay * (1.0 - one_minus_cosine);
            s = decay * h * (1.0 - x / 6.0 * (1.0 - x / 20.0 * (1.0 - x / 42.0)));
            gain = -libm::expm1(-sigma * h) + decay * one_minus_cosine - sigma * s;
        } else if square > 0.0 {
            let damped = libm::sqrt(square);
            let half_sine = libm::sin(0.5 * damped * h);
            c = decay * libm::cos(damped * h);
            s = decay * libm::sin(damped * h) / damped;
            // 1 − cos x = 2 sin²(x/2), without cancellation.
            gain = -libm::expm1(-sigma * h) + 2.0 * decay * half_sine * half_sine - sigma * s;
        } else {
            // Rates −r_slow and −r_fast of the two decaying exponentials; their product is ω².
            let split = libm::sqrt(-square);
            let fast = sigma + split;
            let slow = omega * omega / fast;
            let (e_slow, e_fast) = (libm::exp(-slow * h), libm::exp(-fast * h));
            c = 0.5 * (e_slow + e_fast);
            s = (e_slow - e_fast) / (2.0 * split);
            gain = (slow * libm::expm1(-fast * h) - fast * libm::expm1(-slow * h)) / (2.0 * split);
        }
        let stiffness = omega * omega;
        let (a11, a12, a21, a22) = (c + sigma * s, s, -stiffness * s, c - sigma * s);
        let (mut d11, mut d12, mut d22) = (0.0, 0.0, 0.0);
        if zeta > 0.0 {
            d11 = 0.5 * (stiffness * (1.0 - a11 * a11) - a21 * a21);
            d12 = -0.5 * (stiffness * a11 * a12 + a21 * a22);
            d22 = 0.5 * (1.0 - stiffness * a12 * a12 - a22 * a22);
        }
        Self { a11, a12, a21, a22, b: gain / stiffness, d11, d12, d22, stiffness }
    }

    /// Modal coordinate at the end of a step per unit of held modal force [s²]. Times the mode shape [1/√kg] at two points it
    /// is the mode's part of R[0] [m/N].
    pub fn instantaneous_compliance(&self) -> f64 {
        self.b
    }

    /// State after a step with held modal force p [N/√kg].
    pub fn advance(&self, state: OscillatorState, p: f64) -> OscillatorState {
        OscillatorState {
            q: self.a11 * state.q + self.a12 * state.v + self.b * p,
            v: self.a21 * state.q + self.a22 * state.v + self.a12 * p,
        }
    }

    /// Energy [J] dissipated in a step from `state` under held modal force p [N/√kg].
    pub fn dissipation(&self, state: OscillatorState, p: f64) -> f64 {
        let shifted = state.q - p / self.stiffness;
        (self.d11 * shifted + 2.0 * self.d12 * state.v) * shifted + self.d22 * state.v * state.v
    }

    /// Kinetic and elastic energy [J] of a state.
    pub fn energy(&self, state: OscillatorState) -> (f64, f64) {
        (0.5 * state.v * state.v, 0.5 * self.stiffness * state.q * state.q)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reference solution: fourth-order Runge-Kutta with 40,000 steps.
    fn integrated(omega: f64, zeta: f64, h: f64, start: OscillatorState, p: f64) -> (OscillatorState, f64) {
        let n = 40_000;
        let dt = h / f64::from(n);
        let rate = |s: [f64; 3]| {
            [s[1], p - 2.0 * zeta * omega * s[1] - omega * omega * s[0], 2.0 * zeta * omega * s[1] * s[1]]
        };
        let add = |s: [f64; 3], k: [f64; 3], f: f64| [s[0] + f * k[0], s[1] + f * k[1], s[2] + f * k[2]];
        let mut s = [start.q, start.v, 0.0];
        for _ in 0..n {
            let k1 = rate(s);
            let k2 = rate(add(s, k1, dt / 2.0));
            let k3 = rate(add(s, k2, dt / 2.0));
            let k4 = rate(add(s, k3, dt));
            for i in 0..3 {
                s[i] += dt / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
            }
        }
        (OscillatorState { q: s[0], v: s[1] }, s[2])
    }

    const CASES: [(f64, f64); 8] = [
        (73.0, 0.0),
        (73.0, 0.01),
        (900.0, 0.3),
        (900.0, 0.999_999),
        (900.0, 1.0),
        (900.0, 1.000_001),
        (900.0, 4.0),
        (1.0e4, 1.5),
    ];

    #[test]
    fn one_step_is_the_integrated_equation_of_motion_for_every_damping() {
        let start = OscillatorState { q: 0.01, v: -3.0 };
        for (omega, zeta) in CASES {
            let map = SampledOscillator::new(omega, zeta, 1e-3);
            let (p, scale) = (2000.0, 0.01);
            let (expected, lost) = integrated(omega, zeta, 1e-3, start, p);
            let got = map.advance(start, p);
            assert!((got.q - expected.q).abs() < 1e-11 * scale, "{omega} {zeta}: {got:?} {expected:?}");
            assert!((got.v - expected.v).abs() < 1e-11 * scale * omega, "{omega} {zeta}");
            let energy = 0.5 * 9.0 + 0.5 * (omega * scale).powi(2);
            let dissipated = map.dissipation(start, p);
            assert!((dissipated - lost).abs() < 1e-10 * energy, "{omega} {zeta}: {dissipated} {lost}");
        }
    }

    #[test]
    fn work_of_a_held_force_is_stored_or_dissipated() {
        for (omega, zeta) in CASES {
            let map = SampledOscillator::new(omega, zeta, 1e-3);
            let mut state = OscillatorState { q: 1e-3, v: 1.0 };
            for step in 0..200 {
                let p = if step % 3 == 0 { 500.0 } else { -200.0 };
                let next = map.advance(state, p);
                let (k0, e0) = map.energy(state);
                let (k1, e1) = map.energy(next);
                let balance = p * (next.q - state.q) - (k1 + e1 - k0 - e0) - map.dissipation(state, p);
                // A dozen roundings of terms of this size.
                let size = k0 + e0 + k1 + e1 + (p * next.q).abs() + (p / omega).powi(2);
                assert!(balance.abs() < 12.0 * f64::EPSILON * size, "{omega} {zeta} {step}: {balance}");
                assert!(map.dissipation(state, p) >= -4.0 * f64::EPSILON * size);
                state = next;
            }
        }
    }

    #[test]
    fn instantaneous_compliance_keeps_its_digits_for_slow_modes() {
        // ωh = 1e-6: 1 − cos would keep four digits. The series in ωh is exact here.
        let (omega, h) = (1e-3, 1e-3);
        let map = SampledOscillator::new(omega, 0.0, h);
        let x = omega * h * omega * h;
        let expected = h * h / 2.0 * (1.0 - x / 12.0);
        assert!((map.instantaneous_compliance() / expected - 1.0).abs() < 4.0 * f64::EPSILON);
    }
}
