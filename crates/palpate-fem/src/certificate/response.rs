//! Response of one place: compliances, bandwidth, and the force of an imposed displacement without rigid motion.

use super::{EVENT, displacement, oscillator};
use crate::krylov::LoadedMode;
use glam::{DMat3, DVec3};
use palpate::{Damping, OscillatorState, SampledResidual};

/// Error of the dynamic compliance that ends the bandwidth, as a share of the static compliance.
const BANDWIDTH_TOLERANCE: f64 = 0.05;

/// Response of a place: kept modes, substitutes of the truncated modes, residual compliance [m/N].
pub(super) struct Response {
    pub kept: Vec<LoadedMode>,
    pub truncated: Vec<LoadedMode>,
    pub residual: DMat3,
}

/// Outer product a·aᵀ.
fn outer(a: DVec3) -> DMat3 {
    DMat3::from_cols(a * a.x, a * a.y, a * a.z)
}

/// Frobenius norm.
fn norm(m: DMat3) -> f64 {
    m.to_cols_array().iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// |a − b| / |b|.
pub(super) fn relative(a: DMat3, b: DMat3) -> f64 {
    norm(a - b) / norm(b)
}

/// √(Σ|a − b|² / Σ|b|²).
pub(super) fn relative_difference(a: &[DVec3], b: &[DVec3]) -> f64 {
    let difference: f64 = a.iter().zip(b).map(|(a, b)| (*a - *b).length_squared()).sum();
    (difference / b.iter().map(|b| b.length_squared()).sum::<f64>()).sqrt()
}

impl Response {
    /// Sum of γγᵀ over modes, weighted.
    fn sum(modes: &[LoadedMode], weight: impl Fn(&LoadedMode) -> f64) -> DMat3 {
        modes.iter().map(|mode| outer(mode.gain) * weight(mode)).fold(DMat3::ZERO, |a, b| a + b)
    }

    /// Static compliance of all modes [m/N].
    pub fn exact_static(&self) -> DMat3 {
        Self::sum(&self.kept, |m| 1.0 / m.square) + Self::sum(&self.truncated, |m| 1.0 / m.square)
    }

    /// Static compliance of the recording [m/N].
    pub fn modelled_static(&self) -> DMat3 {
        Self::sum(&self.kept, |m| 1.0 / m.square) + self.residual
    }

    /// Instantaneous compliance R[0] of all modes [m/N].
    pub fn instantaneous(&self, damping: Damping) -> DMat3 {
        let compliance =
            |m: &LoadedMode| oscillator(m.square, damping, EVENT.step_s).instantaneous_compliance();
        Self::sum(&self.kept, compliance) + Self::sum(&self.truncated, compliance)
    }

    /// Instantaneous compliance R[0] of the recording [m/N].
    pub fn modelled_instantaneous(&self, damping: Damping) -> DMat3 {
        Self::sum(&self.kept, |m| oscillator(m.square, damping, EVENT.step_s).instantaneous_compliance())
            + self.residual * self.sampled_residual(damping).share(0)
    }

    /// Relaxation time of the residual compliance [s].
    fn residual_relaxation_s(&self, damping: Damping) -> f64 {
        self.kept.last().map_or(0.0, |highest| damping.residual_relaxation_s(highest.square.sqrt()))
    }

    /// Residual compliance at the event's step.
    fn sampled_residual(&self, damping: Damping) -> SampledResidual {
        SampledResidual::new(self.residual_relaxation_s(damping), EVENT.step_s)
    }

    /// Frequency [Hz] up to which the truncated modes respond quasi-statically. The kept modes are equal in both models.
    pub fn bandwidth_hz(&self, damping: Damping) -> f64 {
        let allowed = BANDWIDTH_TOLERANCE * norm(self.exact_static());
        let first = self.kept.first().map_or(1.0, |m| m.square.sqrt());
        let last = std::f64::consts::PI / EVENT.step_s;
        let mut omega = 1e-3 * first;
        let mut within = 0.0;
        while omega < last.max(2.0 * first) {
            // Σ γγᵀ/(ωᵢ² − ω² + 2iζωᵢω): real and imaginary part.
            let parts = |m: &LoadedMode| {
                let (a, b) = (
                    m.square - omega * omega,
                    2.0 * damping.ratio(m.square.sqrt()) * m.square.sqrt() * omega,
                );
                (a / (a * a + b * b), -b / (a * a + b * b))
            };
            // S/(1 + iωτ).
            let relaxed = omega * self.residual_relaxation_s(damping);
            let residual = self.residual * (1.0 / (1.0 + relaxed * relaxed));
            let real = Self::sum(&self.truncated, |m| parts(m).0) - residual;
            let imaginary = Self::sum(&self.truncated, |m| parts(m).1) + residual * relaxed;
            if norm(real).hypot(norm(imaginary)) > allowed {
                return within;
            }
            within = omega / std::f64::consts::TAU;
            omega *= 1.01;
        }
        within
    }

    /// Forces [N] of the imposed displacement [`EVENT`] along each axis in turn, with all modes or as recorded.
    pub fn ramp_forces(&self, damping: Damping, all: bool) -> Vec<DVec3> {
        let steps = (EVENT.duration_s / EVENT.step_s).round() as usize;
        let axes = [DVec3::X, DVec3::Y, DVec3::Z];
        axes.into_iter().flat_map(|axis| self.ramp_force(damping, axis, steps, all)).collect()
    }

    /// Forces [N] of an imposed displacement of 1 m along one axis by equation (9), without rigid motion.
    fn ramp_force(&self, damping: Damping, axis: DVec3, steps: usize, all: bool) -> Vec<DVec3> {
        let modes = self.kept.iter().chain(self.truncated.iter().filter(|_| all));
        let mut modes: Vec<_> = modes
            .map(|m| (oscillator(m.square, damping, EVENT.step_s), m.gain, OscillatorState::default()))
            .collect();
        let compliance = if all { self.instantaneous(damping) } else { self.modelled_instantaneous(damping) };
        let inverse = compliance.inverse();
        let sampled = self.sampled_residual(damping);
        let residual = if all { DMat3::ZERO } else { self.residual };
        // Displacements by the relaxed force and by that of the last step.
        let [mut relaxed, mut held] = [DVec3::ZERO; 2];
        (1..=steps)
            .map(|step| {
                let target = axis * displacement(step as f64 * EVENT.step_s);
                let free: DVec3 =
                    modes.iter().map(|(map, gain, state)| *gain * map.advance(*state, 0.0).q).sum();
                let force = inverse * (target - free - relaxed * sampled.decay() + held * sampled.lead());
                held = residual * force;
                relaxed = relaxed * sampled.decay() + held * (1.0 - sampled.decay());
                for (map, gain, state) in &mut modes {
                    *state = map.advance(*state, gain.dot(force));
                }
                force
            })
            .collect()
    }
}
