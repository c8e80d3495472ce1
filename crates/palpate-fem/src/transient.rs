//! The impulse response by time integration of the whole finite element system.
//!
//! M·ü + C·u̇ + K·u = f, C = αM + βK, is ẋ = A·x + b with x = (u, u̇). Over a step h with constant b,
//!
//! ```text
//! x⁺ = R(hA)·x + h·Q(hA)·b,   R(z) = Σ_k c_k·w^k ≈ e^z,   Q(z) = (R(z) − 1)/z = γ·Σ_k d_k·w^k,
//! w = 1/(1 − γz),             d_k = c_k + c_{k+1} + … + c_s,   k = 1 … s = 5
//! ```
//!
//! the rational approximation with a single pole, of order 5, A-stable, and R(∞) = 0: modes that are too fast for
//! the step are damped, so that the table's R[0] can be inverted (the average-acceleration rule never damps them).
//! A multiplication by w is a solve with one matrix, factored once, for many loads at a time:
//!
//! ```text
//! D·v' = M·v − γh·K·u,   u' = u + γh·v',   D = (1 + γhα)·M + (γhβ + γ²h²)·K
//! ```
//!
//! K·u is carried along, since K·v' follows from D·v'. The load of a free body is balanced first, so that it causes no
//! rigid motion. Reference: Hairer & Wanner, *Solving Ordinary Differential Equations II*, IV.6 (γ in table 6.4).

use crate::factor::{Factor, RowWorkspace};
use crate::solve_error::SolveError;
use crate::system::System;
use faer::Mat;

/// Pole parameter γ for which five stages give order 5.
const GAMMA: f64 = 0.278_053_841_136_452_3;

/// Number of stages, one solve each.
const STAGES: usize = 5;

/// Time integrator of one body at one step.
pub(crate) struct Transient<'a> {
    system: &'a System,
    factor: Factor,
    step_s: f64,
    /// Coefficient of M in D, 1 + γhα.
    mass_coefficient: f64,
    /// Coefficient of K in D, γhβ + γ²h² [s²].
    stiffness_coefficient: f64,
    /// Weights c_k of the stages of the free response.
    homogeneous: [f64; STAGES],
    /// Weights γ·h·d_k [s] of the stages of the forced response.
    forced: [f64; STAGES],
}

/// State of the integration: displacement u, velocity v, K·u and M·v, a row per load and a column per degree of freedom,
/// with the workspace of a step.
pub(crate) struct TransientState {
    displacement: Mat<f64>,
    velocity: Mat<f64>,
    elastic_force: Mat<f64>,
    momentum: Mat<f64>,
    /// Values of the present stage: K·u, M·v, right-hand side, v.
    stage_force: Mat<f64>,
    stage_momentum: Mat<f64>,
    right: Mat<f64>,
    solved: Mat<f64>,
    workspace: RowWorkspace,
}

impl<'a> Transient<'a> {
    /// Integrator with steps of `step_s` [s] and Rayleigh damping α [1/s], β [s].
    ///
    /// # Errors
    /// [`SolveError::NotPositiveDefinite`].
    pub fn new(system: &'a System, alpha: f64, beta: f64, step_s: f64) -> Result<Self, SolveError> {
        let g = GAMMA * step_s;
        let (mass_coefficient, stiffness_coefficient) = (1.0 + g * alpha, g * beta + g * g);
        let factor = system.shifted_factor(mass_coefficient / stiffness_coefficient)?;
        let homogeneous = coefficients();
        let forced = std::array::from_fn(|k| g * homogeneous[k..].iter().sum::<f64>());
        Ok(Self { system, factor, step_s, mass_coefficient, stiffness_coefficient, homogeneous, forced })
    }

    /// State after the first step from rest, under constant balanced loads [N].
    pub fn start(&self, loads: &Mat<f64>) -> TransientState {
        let mut state = TransientState::at_rest(loads.ncols(), loads.nrows());
        self.add_forced_response(&mut state, loads);
        state
    }

    /// Advances the state by a step under constant balanced loads [N].
    pub fn advance_loaded(&self, state: &mut TransientState, loads: &Mat<f64>) {
        self.advance(state);
        self.add_forced_response(state, loads);
    }

    /// Adds the response to loads that are constant over the step.
    fn add_forced_response(&self, state: &mut TransientState, loads: &Mat<f64>) {
        // b = (0, M⁻¹·f): its first multiplication by w solves D·v' = f.
        state.stage_force.fill(0.0);
        state.stage_momentum.copy_from(loads.transpose());
        self.stages(state, self.forced);
    }

    /// Advances the state by a step without load.
    pub fn advance(&self, state: &mut TransientState) {
        // Σ_k c_k·x_k with x_k = w·x_{k−1}, where u_k = u_{k−1} + γh·v_k and Σ_k c_k = 1: u is kept in the sum.
        state.stage_force.copy_from(&state.elastic_force);
        state.stage_momentum.copy_from(&state.momentum);
        state.velocity.fill(0.0);
        state.momentum.fill(0.0);
        self.stages(state, self.homogeneous);
    }

    /// Adds Σ_k c_k·w^k of the stage's values to the state; the initial displacement of the stage is in the state already.
    fn stages(&self, state: &mut TransientState, coefficients: [f64; STAGES]) {
        let g = GAMMA * self.step_s;
        let (shift, scale) = (self.mass_coefficient / self.stiffness_coefficient, self.stiffness_coefficient);
        for (k, &c) in coefficients.iter().enumerate() {
            // Coefficient of v_k in Σ c·u.
            let d = g * coefficients[k..].iter().sum::<f64>();
            let TransientState {
                displacement,
                velocity,
                elastic_force,
                momentum,
                stage_force,
                stage_momentum,
                right,
                solved,
                workspace,
            } = state;
            for_each([right, solved], [stage_momentum, stage_force], |to, [mv, ku]| {
                to[0] = (mv - g * ku) / scale;
                to[1] = to[0];
            });
            self.factor.solve_rows(solved.as_mut(), workspace);
            self.system.assembly.mass_times_rows(solved, stage_momentum);
            for_each(
                [displacement, velocity, elastic_force, momentum, stage_force],
                [solved, stage_momentum, right],
                |to, [v, mv, r]| {
                    // K·v = right − shift·M·v.
                    let kv = r - shift * mv;
                    to[0] += d * v;
                    to[1] += c * v;
                    to[2] += d * kv;
                    to[3] += c * mv;
                    to[4] += g * kv;
                },
            );
        }
    }
}

impl TransientState {
    /// Displacements u [m], a column per load.
    pub fn displacement(&self) -> Mat<f64> {
        self.displacement.transpose().to_owned()
    }

    fn at_rest(loads: usize, dofs: usize) -> Self {
        let zero = || Mat::zeros(loads, dofs);
        Self {
            displacement: zero(),
            velocity: zero(),
            elastic_force: zero(),
            momentum: zero(),
            stage_force: zero(),
            stage_momentum: zero(),
            right: zero(),
            solved: zero(),
            workspace: RowWorkspace::default(),
        }
    }
}

/// Updates entries of some matrices from those of others of the same shape, in one pass.
fn for_each<const N: usize, const M: usize>(
    to: [&mut Mat<f64>; N],
    from: [&Mat<f64>; M],
    change: impl Fn(&mut [f64; N], [f64; M]),
) {
    let (rows, columns) = (from[0].nrows(), from[0].ncols());
    let mut to = to;
    for j in 0..columns {
        let mut targets = to.each_mut().map(|matrix| matrix.col_as_slice_mut(j));
        let sources = from.map(|matrix| matrix.col_as_slice(j));
        for i in 0..rows {
            let mut values = std::array::from_fn(|k| targets[k][i]);
            change(&mut values, std::array::from_fn(|k| sources[k][i]));
            targets.iter_mut().zip(values).for_each(|(target, value)| target[i] = value);
        }
    }
}

/// Frequency [Hz] up to which the integrator follows an oscillation to 1 % over 0.1 s, with steps of `step_s` [s].
pub(crate) fn resolved_frequency_hz(step_s: f64) -> f64 {
    let c = coefficients();
    let error = |y: f64| {
        let [re, im] = on_imaginary_axis(c, y);
        (re - y.cos()).hypot(im - y.sin())
    };
    let allowed = 0.01 * (step_s / 0.1).min(1.0);
    let (mut low, mut high) = (0.0, std::f64::consts::PI);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if error(middle) < allowed { low = middle } else { high = middle }
    }
    low / (std::f64::consts::TAU * step_s)
}

/// Amplification R(iy), real and imaginary part, with w = (1 + iγy)/(1 + γ²y²).
fn on_imaginary_axis(c: [f64; STAGES], y: f64) -> [f64; 2] {
    let size = 1.0 + (GAMMA * y).powi(2);
    let w = [1.0 / size, GAMMA * y / size];
    let (mut power, mut sum) = ([1.0, 0.0], [0.0, 0.0]);
    for c in c {
        power = [power[0] * w[0] - power[1] * w[1], power[0] * w[1] + power[1] * w[0]];
        sum = [sum[0] + c * power[0], sum[1] + c * power[1]];
    }
    sum
}

/// Coefficients c_k, for which Σ_k c_k·w^k agrees with e^z up to z⁴, and by the choice of γ up to z⁵.
fn coefficients() -> [f64; STAGES] {
    // The coefficient of zⁿ in w^k is γⁿ·C(k + n − 1, n).
    let mut rows = [[0.0; STAGES + 1]; STAGES];
    let mut factorial = 1.0;
    for (n, row) in rows.iter_mut().enumerate() {
        factorial *= n.max(1) as f64;
        for (k, entry) in row[..STAGES].iter_mut().enumerate() {
            *entry = binomial(k + n, n);
        }
        row[STAGES] = 1.0 / (factorial * GAMMA.powi(n as i32));
    }
    // Gaussian elimination; the matrix of binomials needs no pivoting.
    for i in 0..STAGES {
        let pivot = rows[i];
        for row in &mut rows[i + 1..] {
            let share = row[i] / pivot[i];
            row.iter_mut().zip(pivot).for_each(|(entry, above)| *entry -= share * above);
        }
    }
    let mut solution = [0.0; STAGES];
    for i in (0..STAGES).rev() {
        let known: f64 = (i + 1..STAGES).map(|k| rows[i][k] * solution[k]).sum();
        solution[i] = (rows[i][STAGES] - known) / rows[i][i];
    }
    solution
}

fn binomial(n: usize, k: usize) -> f64 {
    (0..k).map(|i| (n - i) as f64 / (i + 1) as f64).product()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn resolved_frequency_grows_with_the_power_five_sixths_of_the_step_rate() {
        // Errors per step grow with the sixth power of ωh, steps with 1/h: the sixth root of 2 less than double.
        let ratio = resolved_frequency_hz(0.5e-3) / resolved_frequency_hz(1e-3);
        assert!((ratio - 2.0_f64.powf(5.0 / 6.0)).abs() < 0.05, "{ratio}");
    }

    #[test]
    fn the_approximation_is_of_order_five_and_stable_on_the_imaginary_axis() {
        let c = coefficients();
        for n in 0..=STAGES {
            let got: f64 = (0..STAGES).map(|k| c[k] * GAMMA.powi(n as i32) * binomial(k + n, n)).sum();
            let factorial: f64 = (1..=n).map(|i| i as f64).product();
            assert!((got * factorial - 1.0).abs() < 1e-12, "z^{n}: {got}");
        }
        for y in (0..400).map(|i| 10_f64.powf(-2.0 + 0.0125 * f64::from(i))) {
            let [re, im] = on_imaginary_axis(c, y);
            assert!(re.hypot(im) < 1.0 + 1e-12, "y = {y}");
        }
    }
}
