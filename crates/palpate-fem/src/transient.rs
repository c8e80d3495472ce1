//! The impulse response by time integration of the whole finite element system.
//!
//! M·ü + C·u̇ + K·u = f, C = αM + βK, is ẋ = A·x + b with x = (u, u̇). Over a step h with b held,
//!
//! ```text
//! x⁺ = R(hA)·x + h·Q(hA)·b,   R(z) = Σ_k c_k·w^k ≈ e^z,   Q(z) = (R(z) − 1)/z = γ·Σ_k d_k·w^k,
//! w = 1/(1 − γz),             d_k = c_k + c_{k+1} + … + c_s,   k = 1 … s = 5
//! ```
//!
//! the rational approximation with a single pole, of order 5, A-stable, and R(∞) = 0: what is too fast for
//! the step dies out, so that the table's R[0] can be inverted (the average-acceleration rule rings for ever).
//! Multiplying by w solves with one matrix, factored once, for many loads at a time:
//!
//! ```text
//! D·v' = M·v − γh·K·u,   u' = u + γh·v',   D = (1 + γhα)·M + (γhβ + γ²h²)·K
//! ```
//!
//! K·u is carried along, since D·v' tells K·v'. A free body's load is balanced first, so that the rigid motion
//! stays out. Reference: Hairer & Wanner, *Solving Ordinary Differential Equations II*, IV.6 (γ in table 6.4).

use crate::factor::{Factor, FactorError};
use crate::system::System;
use faer::Mat;

/// γ for which five stages give order 5.
const GAMMA: f64 = 0.278_053_841_136_452_3;

/// Stages, each one solve.
const STAGES: usize = 5;

/// Integrator of one body at one step.
pub struct Transient<'a> {
    system: &'a System,
    factor: Factor,
    step_s: f64,
    /// 1 + γhα and γhβ + γ²h².
    mass_share: f64,
    stiffness_share: f64,
    /// c_k and γ·d_k, k = 1 … s.
    homogeneous: [f64; STAGES],
    held: [f64; STAGES],
}

/// Displacement u, velocity v, and K·u, M·v, a column per load.
pub struct Motion {
    /// u [m].
    pub displacement: Mat<f64>,
    velocity: Mat<f64>,
    elastic_force: Mat<f64>,
    momentum: Mat<f64>,
}

impl<'a> Transient<'a> {
    /// Prepare steps of `step_s` [s] with Rayleigh damping α [1/s], β [s].
    ///
    /// # Errors
    /// When the factor fails.
    pub fn new(system: &'a System, alpha: f64, beta: f64, step_s: f64) -> Result<Self, FactorError> {
        let g = GAMMA * step_s;
        let (mass_share, stiffness_share) = (1.0 + g * alpha, g * beta + g * g);
        let factor = system.shifted_factor(mass_share / stiffness_share)?;
        let homogeneous = coefficients();
        let held = std::array::from_fn(|k| GAMMA * homogeneous[k..].iter().sum::<f64>());
        Ok(Self { system, factor, step_s, mass_share, stiffness_share, homogeneous, held })
    }

    /// The motion after a step from rest in which `loads` [N], balanced already, are held.
    pub fn push(&self, loads: &Mat<f64>) -> Motion {
        // b = (0, M⁻¹·f): its first multiplication by w solves D·v' = f.
        let (n, columns) = (loads.nrows(), loads.ncols());
        let mut sum = Motion::at_rest(n, columns);
        let mut stage = Motion::at_rest(n, columns);
        stage.momentum = loads.clone();
        for coefficient in self.held {
            self.multiply(&mut stage);
            sum.add(coefficient * self.step_s, &stage);
        }
        sum
    }

    /// The motion one step later, with `loads` held on.
    pub fn push_on(&self, motion: &mut Motion, loads: &Mat<f64>) {
        self.advance(motion);
        motion.add(1.0, &self.push(loads));
    }

    /// The motion one step later, without load.
    pub fn advance(&self, motion: &mut Motion) {
        let mut sum = Motion::at_rest(motion.displacement.nrows(), motion.displacement.ncols());
        for coefficient in self.homogeneous {
            self.multiply(motion);
            sum.add(coefficient, motion);
        }
        *motion = sum;
    }

    /// x ← w·x.
    fn multiply(&self, x: &mut Motion) {
        let g = GAMMA * self.step_s;
        let Motion { displacement, velocity, elastic_force, momentum } = x;
        // The right-hand side over the stiffness's share, then the new velocity in its place.
        let mut right = std::mem::replace(momentum, Mat::zeros(0, 0));
        zip(&mut right, elastic_force, |r, e| (r - g * e) / self.stiffness_share);
        velocity.copy_from(&right);
        self.factor.solve(velocity.as_mut());
        *momentum = self.system.mass_times(velocity.as_ref());
        // K·v' = right − shift·M·v', K·u' = K·u + γh·K·v'.
        let shift = self.mass_share / self.stiffness_share;
        zip(&mut right, momentum, |r, m| r - shift * m);
        zip(elastic_force, &right, |e, r| e + g * r);
        zip(displacement, velocity, |u, v| u + g * v);
    }
}

impl Motion {
    fn at_rest(n: usize, columns: usize) -> Self {
        let zero = || Mat::zeros(n, columns);
        Self { displacement: zero(), velocity: zero(), elastic_force: zero(), momentum: zero() }
    }

    fn add(&mut self, scale: f64, other: &Self) {
        zip(&mut self.displacement, &other.displacement, |s, o| s + scale * o);
        zip(&mut self.velocity, &other.velocity, |s, o| s + scale * o);
        zip(&mut self.elastic_force, &other.elastic_force, |s, o| s + scale * o);
        zip(&mut self.momentum, &other.momentum, |s, o| s + scale * o);
    }
}

fn zip(a: &mut Mat<f64>, b: &Mat<f64>, combine: impl Fn(f64, f64) -> f64) {
    for j in 0..a.ncols() {
        let columns = (a.col_mut(j).try_as_col_major_mut(), b.col(j).try_as_col_major());
        if let (Some(a), Some(b)) = columns {
            a.as_slice_mut().iter_mut().zip(b.as_slice()).for_each(|(a, b)| *a = combine(*a, *b));
        }
    }
}

/// c_k: Σ_k c_k·w^k agrees with e^z up to z⁴, and by the choice of γ up to z⁵.
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
    // Gauss elimination; the matrix of binomials is well behaved without pivoting.
    for i in 0..STAGES {
        for j in i + 1..STAGES {
            let share = rows[j][i] / rows[i][i];
            for k in i..=STAGES {
                rows[j][k] -= share * rows[i][k];
            }
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
    fn the_approximation_is_of_order_five_and_stable_on_the_imaginary_axis() {
        let c = coefficients();
        for n in 0..=STAGES {
            let got: f64 = (0..STAGES).map(|k| c[k] * GAMMA.powi(n as i32) * binomial(k + n, n)).sum();
            let factorial: f64 = (1..=n).map(|i| i as f64).product();
            assert!((got * factorial - 1.0).abs() < 1e-12, "z^{n}: {got}");
        }
        // |R(iy)| ≤ 1 with complex arithmetic by hand: w = (1 + iγy)/(1 + γ²y²).
        for y in (0..400).map(|i| 10_f64.powf(-2.0 + 0.0125 * f64::from(i))) {
            let size = 1.0 + (GAMMA * y).powi(2);
            let w = [1.0 / size, GAMMA * y / size];
            let (mut power, mut sum) = ([1.0, 0.0], [0.0, 0.0]);
            for c in c {
                power = [power[0] * w[0] - power[1] * w[1], power[0] * w[1] + power[1] * w[0]];
                sum = [sum[0] + c * power[0], sum[1] + c * power[1]];
            }
            assert!(sum[0].hypot(sum[1]) < 1.0 + 1e-12, "y = {y}");
        }
    }
}
