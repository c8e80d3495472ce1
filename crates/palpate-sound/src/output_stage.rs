//! Output stage: from pressure to samples without steps and overload.
//!
//! ```text
//! high-pass   y[n] = ½(1 + r)·(x[n] − x[n−1]) + r·y[n−1]        r = e^(−2π·20 Hz·T)
//! bridge      z[n] = y[n] + e·s^n        e: jump of y after a gap, s = e^(−T/2 ms)
//! limiter     (`limiter`)
//! ```
//!
//! The high-pass takes away what hands do below the range of hearing. The bridge makes gaps, in which steps are missing or a body falls
//! asleep, continuous.
//!
//! Equations: docs/theory.md (C87), (C88).

use crate::limiter::limit;
use crate::{AUDIBLE_HZ, SoundParameters};
use core::f64::consts::TAU;

/// Time constant of the bridge over a gap [s].
const BRIDGE_S: f64 = 2e-3;

/// Sizes below this are set to zero: denormal numbers cost 40 times as much.
const FLUSH_BELOW: f64 = 1e-30;

/// High-pass, bridge and limiter, with their state.
#[derive(Debug, Clone)]
pub(crate) struct OutputStage {
    scale: f64,
    pole: f64,
    bridge_decay: f64,
    last_input: f64,
    last_high_pass: f64,
    last_output: f64,
    offset: f64,
    is_after_gap: bool,
}

impl OutputStage {
    pub(crate) fn new(parameters: &SoundParameters) -> Self {
        let interval = 1.0 / parameters.sample_rate_hz;
        Self {
            scale: 1.0 / parameters.full_scale_pa,
            pole: libm::exp(-TAU * AUDIBLE_HZ[0] * interval),
            bridge_decay: libm::exp(-interval / BRIDGE_S),
            last_input: 0.0,
            last_high_pass: 0.0,
            last_output: 0.0,
            offset: 0.0,
            is_after_gap: true,
        }
    }

    /// Note that the next sample does not follow from the last one.
    pub(crate) fn note_gap(&mut self) {
        self.is_after_gap = true;
    }

    /// Sample of a pressure [Pa].
    pub(crate) fn sample(&mut self, pressure: f64) -> f32 {
        let input = pressure * self.scale;
        if self.is_after_gap {
            // The high-pass starts settled, as if its input had always been there; the bridge leads from the last output.
            (self.last_input, self.last_high_pass) = (input, 0.0);
            self.offset = self.last_output;
            self.is_after_gap = false;
        }
        let high_pass = 0.5 * (1.0 + self.pole) * (input - self.last_input) + self.pole * self.last_high_pass;
        (self.last_input, self.last_high_pass) = (input, flushed(high_pass));
        let output = self.last_high_pass + self.offset;
        self.offset = flushed(self.offset * self.bridge_decay);
        self.last_output = output;
        limit(output) as f32
    }
}

/// Number, or zero for one that is tiny or no number.
fn flushed(number: f64) -> f64 {
    if number.abs() > FLUSH_BELOW { number } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::vec::Vec;

    fn stage() -> OutputStage {
        OutputStage::new(&SoundParameters { full_scale_pa: 1.0, ..SoundParameters::default() })
    }

    fn tone(frequency: f64, at: u32) -> f64 {
        0.1 * libm::sin(TAU * frequency * f64::from(at) / 48e3)
    }

    #[test]
    fn tones_pass_and_slow_motion_does_not() {
        let largest = |frequency: f64| {
            let mut stage = stage();
            let samples = (0..96_000).map(|at| stage.sample(tone(frequency, at)).abs());
            samples.skip(48_000).fold(0.0, f32::max)
        };
        // |H| = f/√(f² + (20 Hz)²) of the first order.
        for (frequency, expected) in
            [(1.0, 0.04994), (20.0, core::f64::consts::FRAC_1_SQRT_2), (440.0, 0.99897), (4000.0, 1.0)]
        {
            let found = f64::from(largest(frequency)) / 0.1;
            assert!((found - expected).abs() < 3e-3, "{frequency} Hz: {found}");
        }
    }

    #[test]
    fn a_gap_makes_no_step() {
        let mut stage = stage();
        let mut samples: Vec<f32> = (0..1000).map(|at| stage.sample(tone(440.0, at))).collect();
        let steps = |samples: &[f32]| samples.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f32::max);
        let smooth = steps(&samples);
        stage.note_gap();
        // Another moment of the tone: a jump of up to 0.2.
        samples.extend((1054..2000).map(|at| stage.sample(tone(440.0, at))));
        assert!(steps(&samples) < 1.6 * smooth, "{} {smooth}", steps(&samples));
        assert!(smooth > 0.005 && (tone(440.0, 1054) - tone(440.0, 999)).abs() > 0.05);
    }

    #[test]
    fn silence_becomes_exact() {
        let mut stage = stage();
        (0..100).for_each(|at| {
            stage.sample(tone(440.0, at));
        });
        let last = (0..100_000).map(|_| stage.sample(0.0)).last();
        assert_eq!((last, stage.last_high_pass, stage.offset), (Some(0.0), 0.0, 0.0));
    }
}
