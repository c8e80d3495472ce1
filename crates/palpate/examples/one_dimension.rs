//! The one-dimensional model, equations (1) to (4) of the paper, on a bar that is pushed at its end.
//!
//! The bar has length L, cross-section A, density ρ and wave speed c; its far end is fixed. After a unit impulse on
//! its near end (equation (1) with a delta function for f) that end stands displaced by
//!
//! ```text
//! r(t) = +1/Z for 0 < t < τ, −1/Z for τ < t < 2τ, and so on,    Z = ρ·c·A [N·s/m],  τ = 2L/c [s]
//! ```
//!
//! since the wave comes back from the fixed end upside down. With a force held for a step h, τ = N·h, the discrete
//! response of equation (2) is r[s] = ±h/Z, exactly. Now the end is moved at constant speed v, and equation (4) is
//! solved for the force. It must be Z·v until the wave comes back, and grow by 2·Z·v with every return.

/// The discrete impulse response of the bar's end [m/N].
struct Bar {
    r: Vec<f64>,
}

impl Bar {
    /// `returns_after` is N, the steps that the wave needs to come back; `samples` is T.
    fn new(impedance: f64, step_s: f64, returns_after: usize, samples: usize) -> Self {
        let sign = |s: usize| if (s / returns_after).is_multiple_of(2) { 1.0 } else { -1.0 };
        Self { r: (0..samples).map(|s| sign(s) * step_s / impedance).collect() }
    }

    /// Equation (5): ũ[t] = Σ_{s=1}^{T−1} r[s]·f[t−s], the displacement that past forces leave behind [m].
    fn free_displacement(&self, past_forces: &[f64]) -> f64 {
        self.r[1..].iter().zip(past_forces.iter().rev()).map(|(r, f)| r * f).sum()
    }

    /// Equation (4) solved for the force [N] that brings the end to `displacement` [m] in this step:
    /// u[t] = r[0]·f[t] + ũ[t].
    fn force(&self, displacement: f64, past_forces: &[f64]) -> f64 {
        (displacement - self.free_displacement(past_forces)) / self.r[0]
    }
}

/// Force at the end of every step while the end is moved at constant speed.
fn push(impedance: f64, speed: f64, step_s: f64, returns_after: usize, steps: usize) -> Vec<f64> {
    let bar = Bar::new(impedance, step_s, returns_after, steps);
    let mut forces = Vec::new();
    for t in 0..steps {
        let displacement = speed * step_s * (t + 1) as f64;
        forces.push(bar.force(displacement, &forces));
    }
    forces
}

fn main() {
    // A rubber bar: ρ = 1000 kg/m³, E = 1 MPa, 1 cm² and 10 cm long; c = √(E/ρ).
    let wave_speed = (1e6_f64 / 1000.0).sqrt();
    let impedance = 1000.0 * wave_speed * 1e-4;
    let round_trip = 2.0 * 0.1 / wave_speed;
    let forces = push(impedance, 0.1, round_trip / 50.0, 50, 200);
    println!("the wave returns every {:.2} ms", 1e3 * round_trip);
    for t in [0, 49, 50, 99, 100, 150] {
        println!("after {:5.2} ms: {:.4} N", 1e3 * (t + 1) as f64 * round_trip / 50.0, forces[t]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A few hundred additions.
    const ROUND_OFF: f64 = 1e-12;

    #[test]
    fn the_force_is_impedance_times_speed_and_grows_with_every_return_of_the_wave() {
        let (impedance, speed) = (3.0, 0.2);
        for returns_after in [1, 7, 50] {
            let forces = push(impedance, speed, 1e-3, returns_after, 6 * returns_after);
            for (t, force) in forces.iter().enumerate() {
                let expected = impedance * speed * (1 + 2 * (t / returns_after)) as f64;
                assert!(
                    (force / expected - 1.0).abs() < ROUND_OFF,
                    "{returns_after} {t}: {force} {expected}"
                );
            }
        }
    }

    #[test]
    fn the_force_puts_the_end_where_it_is_wanted() {
        let bar = Bar::new(3.0, 1e-3, 5, 40);
        let path: Vec<f64> = (0..60).map(|t| (0.3 * f64::from(t)).sin() * 1e-3).collect();
        let mut forces: Vec<f64> = Vec::new();
        for &wanted in &path {
            let force = bar.force(wanted, &forces);
            forces.push(force);
            // Equation (2) with the window T.
            let last = forces.len() - 1;
            let u: f64 = (0..bar.r.len().min(last + 1)).map(|s| bar.r[s] * forces[last - s]).sum();
            assert!((u - wanted).abs() < ROUND_OFF);
        }
    }
}
