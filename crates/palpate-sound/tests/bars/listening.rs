//! Amplitude of a tone, frequency of a partial, and clicks, in samples.

use std::f64::consts::TAU;

/// Amplitude of a tone [Hz] in samples at 48 kHz, by a Hann window.
pub fn amplitude(samples: &[f32], frequency: f64) -> f64 {
    let n = samples.len() as f64;
    let (mut re, mut im) = (0.0, 0.0);
    for (at, sample) in samples.iter().enumerate() {
        let window = 1.0 - (TAU * (at as f64 + 0.5) / n).cos();
        let (sin, cos) = (TAU * frequency / 48e3 * at as f64).sin_cos();
        re += f64::from(*sample) * window * cos;
        im += f64::from(*sample) * window * sin;
    }
    2.0 * (re * re + im * im).sqrt() / n
}

/// Frequency of the strongest tone within a distance of a frequency [Hz], on a grid of a twentieth of a hertz.
pub fn strongest_near(samples: &[f32], frequency: f64, within: f64) -> f64 {
    let steps = (within * 20.0) as i32;
    let candidates = (-steps..=steps).map(|at| frequency + f64::from(at) / 20.0);
    let (_, found) = candidates
        .map(|f| (amplitude(samples, f), f))
        .fold((0.0, 0.0), |best, next| if next.0 > best.0 { next } else { best });
    found
}

/// Largest size of a sample.
pub fn peak(samples: &[f32]) -> f32 {
    samples.iter().fold(0.0, |largest, sample| largest.max(sample.abs()))
}

/// Largest second difference of the samples: what a click is heard by.
pub fn largest_second_difference(samples: &[f32]) -> f32 {
    samples.windows(3).map(|w| (w[2] - 2.0 * w[1] + w[0]).abs()).fold(0.0, f32::max)
}
