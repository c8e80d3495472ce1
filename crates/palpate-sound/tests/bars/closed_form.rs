//! Samples of a run against the closed form of a force that begins and ends, for steps that samples fit into and for others.

use crate::studio::{Strike, Studio};
use palpate::Recording;
use palpate::glam::DVec3;
use palpate_sound::{Radiator, SoundParameters};
use palpate_testkit::{aluminium_bar, free_block};
use std::f64::consts::TAU;

/// Difference from the closed form, of its largest value: that of a body whose mode shapes turn by micrometres with it, and of samples in
/// single precision.
const SAME_SOUND: f64 = 2e-6;

/// Full scale [Pa] at which no sample of these tests reaches the limiter.
const QUIET: f64 = 1e4;

/// Pressure [Pa] of all modes of a body by a force on a node from 0 to `end` [s]: Σ w·φ·f·(s(t) − s(t − end)), with s the velocity after a step
/// of the modal force.
fn closed_form(
    body: &Recording,
    radiator: &Radiator,
    (node, force): (usize, DVec3),
    end: f64,
    t: f64,
) -> f64 {
    let mut sum = 0.0;
    for mode in 0..radiator.len() {
        let (omega, zeta) = (radiator.angular_frequencies[mode], radiator.damping_ratios[mode]);
        let damped = omega * (1.0 - zeta * zeta).sqrt();
        let velocity =
            |t: f64| if t > 0.0 { (-zeta * omega * t).exp() * (damped * t).sin() / damped } else { 0.0 };
        let shape = |axis: usize| body.modes.row(node, axis)[radiator.first + mode];
        let p = DVec3::new(shape(0), shape(1), shape(2)).dot(force);
        sum += radiator.weights[mode] * p * (velocity(t) - velocity(t - end));
    }
    sum
}

/// The high-pass of the output, as its differential equation sampled: docs/theory.md (C87).
fn high_passed(pressure: &[f64]) -> Vec<f64> {
    let r = (-TAU * 20.0 / 48e3_f64).exp();
    let (mut x, mut y) = (pressure[0], 0.0);
    let mut next = |input: f64| {
        y = 0.5 * (1.0 + r) * (input - x) + r * y;
        x = input;
        y
    };
    pressure.iter().map(|&input| next(input)).collect()
}

#[test]
fn samples_are_the_closed_form_of_the_modes_for_every_step() {
    let bar = aluminium_bar().expect("a bar");
    // A force along z of the block: its modes are those below 200 Hz, heavily damped ones among them.
    for (body, force) in [(bar, DVec3::Y * 1e-5), (free_block(), DVec3::Z * 1e-6)] {
        let node = (0..body.surface.positions.len())
            .max_by(|a, b| body.surface.positions[*a].x.total_cmp(&body.surface.positions[*b].x))
            .expect("a node");
        let at = body.surface.positions[node];
        for step_s in [1e-3, 0.3e-3, 1.0 / 48e3, 10e-3] {
            let parameters = SoundParameters { full_scale_pa: QUIET, ..SoundParameters::default() };
            let strike = Strike { at, force, duration_s: step_s * 3.0 };
            let mut studio = Studio::new(&body, step_s, &parameters, None);
            studio.run(&body, &strike, None, 0.12, |_| {});
            let radiator = Radiator::new(&body, &parameters);
            assert!(radiator.len() >= 3, "{}", radiator.len());
            let times = (0..studio.samples.len()).map(|at| at as f64 / 48e3);
            let pressure: Vec<f64> =
                times.map(|t| closed_form(&body, &radiator, (node, force), 3.0 * step_s, t)).collect();
            let expected = high_passed(&pressure);
            let largest = expected.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
            assert_eq!(studio.samples.len(), (0.12_f64 * 48e3).round() as usize);
            for (at, (sample, expected)) in studio.samples.iter().zip(&expected).enumerate() {
                let error = (f64::from(*sample) * QUIET - expected).abs();
                assert!(error < SAME_SOUND * largest, "step {step_s}, sample {at}: {error:e} of {largest:e}");
            }
        }
    }
}
