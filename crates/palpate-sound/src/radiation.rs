//! Radiation of modes, simplified: each as a breathing sphere with the surface and the mean square velocity of the body.
//!
//! A mode with coordinate velocity q̇ moves the surface S along its normal n with φ·n·q̇. With the density ρ and the speed of sound c of air,
//! its radiated power is W = ρ·c·S·σ·⟨v²⟩, v² the mean square of φ·n over the surface times q̇², σ the radiation efficiency. Spread evenly over a
//! sphere of radius r this is the pressure
//!
//! ```text
//! p = w·q̇        w = ρ·c·(a/r)·√(σ·⟨(φ·n)²⟩)        σ = (k·a)²/(1 + (k·a)²)        a = √(S/4π), k = ω/c
//! ```
//!
//! w [Pa/(m·√kg/s)], ω [rad/s] of the mode. σ is exact for a breathing sphere. Bodies that bend push air from one side to the other, which
//! radiates less at low frequencies; directions, reflections, and the sound of rigid motion are left out.
//!
//! Equations: docs/theory.md (C86). Fahy, Gardonio, Sound and Structural Vibration, 2007, chapter 3.

use crate::{AUDIBLE_HZ, SoundParameters};
use alloc::vec;
use alloc::vec::Vec;
use core::f64::consts::{PI, TAU};
use palpate::Recording;

/// Density [kg/m³] and speed of sound [m/s] of air at 20 °C.
const AIR_DENSITY: f64 = 1.204;
const SPEED_OF_SOUND: f64 = 343.2;

/// Audible modes of a body, with the pressure that each radiates.
#[derive(Debug, Clone, PartialEq)]
pub struct Radiator {
    /// Index of the first audible mode in the recording.
    pub first: usize,
    /// Angular frequencies [rad/s], ascending.
    pub angular_frequencies: Vec<f64>,
    /// Damping ratios [1].
    pub damping_ratios: Vec<f64>,
    /// Weights w: pressure at the listener per modal velocity [Pa/(m·√kg/s)].
    pub weights: Vec<f64>,
}

impl Radiator {
    /// Modes of a recording in the range of hearing, below half of the sample rate.
    pub fn new(recording: &Recording, parameters: &SoundParameters) -> Self {
        let modes = &recording.modes;
        let [low, high] = AUDIBLE_HZ;
        let high = high.min(0.5 * parameters.sample_rate_hz);
        let first = modes.angular_frequencies.partition_point(|omega| *omega < TAU * low);
        let end = modes.angular_frequencies.partition_point(|omega| *omega <= TAU * high);
        let angular_frequencies = modes.angular_frequencies[first..end].to_vec();
        let (area, squares) = normal_squares(recording, first..end);
        let radius = libm::sqrt(area / (4.0 * PI));
        let weight = |(omega, square): (&f64, &f64)| {
            let ka = omega / SPEED_OF_SOUND * radius;
            let efficiency = ka * ka / (1.0 + ka * ka);
            AIR_DENSITY * SPEED_OF_SOUND * (radius / parameters.distance_m) * libm::sqrt(efficiency * square)
        };
        let weights = angular_frequencies.iter().zip(&squares).map(weight).collect();
        let damping_ratios = modes.damping_ratios[first..end].to_vec();
        Self { first, angular_frequencies, damping_ratios, weights }
    }

    /// Number of audible modes.
    pub fn len(&self) -> usize {
        self.weights.len()
    }

    /// Whether no mode is audible.
    pub fn is_empty(&self) -> bool {
        self.weights.is_empty()
    }

    /// Keep the lowest modes.
    pub(crate) fn truncate(&mut self, modes: usize) {
        self.angular_frequencies.truncate(modes);
        self.damping_ratios.truncate(modes);
        self.weights.truncate(modes);
    }
}

/// Surface area [m²], and the mean over it of the squared normal component of each mode shape [1/kg]: exact for shapes that are linear on
/// each triangle.
fn normal_squares(recording: &Recording, range: core::ops::Range<usize>) -> (f64, Vec<f64>) {
    let (surface, modes) = (&recording.surface, &recording.modes);
    let mut squares = vec![0.0; range.len()];
    let mut corners = [const { Vec::new() }; 3];
    let mut area = 0.0;
    for triangle in &surface.triangles {
        let [a, b, c] = triangle.map(|node| surface.positions[node as usize]);
        let twice = (b - a).cross(c - a);
        let length = twice.length();
        if length == 0.0 {
            continue;
        }
        let (normal, own_area) = (twice / length, 0.5 * length);
        for (values, node) in corners.iter_mut().zip(triangle) {
            let [x, y, z] = [0, 1, 2].map(|axis| &modes.row(*node as usize, axis)[range.clone()]);
            values.clear();
            let along = x.iter().zip(y).zip(z).map(|((x, y), z)| normal.x * x + normal.y * y + normal.z * z);
            values.extend(along);
        }
        // ∫f² over a triangle of area A with corner values f is A/12·(Σf² + (Σf)²).
        let [of_a, of_b, of_c] = &corners;
        for (square, ((a, b), c)) in squares.iter_mut().zip(of_a.iter().zip(of_b).zip(of_c)) {
            let sum = a + b + c;
            *square += own_area / 12.0 * (a * a + b * b + c * c + sum * sum);
        }
        area += own_area;
    }
    squares.iter_mut().for_each(|square| *square /= area.max(f64::MIN_POSITIVE));
    (area, squares)
}
