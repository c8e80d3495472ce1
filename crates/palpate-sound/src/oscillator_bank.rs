//! Oscillators of one body between two steps, at the audio instants.
//!
//! Over a step the modal force p is held, so that the velocity v = q̇ of a mode obeys v̈ + 2ζω·v̇ + ω²·v = 0. Samples of it, T apart, obey
//!
//! ```text
//! v[n+1] = τ·v[n] − d·v[n−1]        τ = trace, d = determinant = e^(−2ζωT) of the map of one sample
//! ```
//!
//! for every damping. The first two samples of each step come from the runtime's state (q, v) and p, so that round-off does not add up from
//! step to step.
//!
//! Equations: docs/theory.md (C85).

use crate::radiation::Radiator;
use alloc::vec::Vec;
use palpate::{OscillatorState, SampledOscillator};

/// Modes that are computed side by side.
const LANES: usize = 8;

/// Samples of a step, one number per lane.
pub(crate) type LaneSums = Vec<[f64; LANES]>;

/// Offsets [s] that count as equal: a thousandth of what a sample of 192 kHz differs by.
const SAME_OFFSET_S: f64 = 5e-9;

/// Audible modes of one body.
#[derive(Debug, Clone)]
pub(crate) struct OscillatorBank {
    radiator: Radiator,
    /// Maps from a sample to the next.
    to_next: Vec<SampledOscillator>,
    /// Traces and determinants of the maps, by groups of modes.
    recurrences: Vec<[[f64; LANES]; 2]>,
    /// Maps from the start of a step to its first sample, for an offset [s].
    to_first: Vec<SampledOscillator>,
    offset_s: f64,
    /// States at the end of the last step.
    pub(crate) states: Vec<OscillatorState>,
}

impl OscillatorBank {
    pub(crate) fn new(radiator: Radiator, sample_interval_s: f64) -> Self {
        let modes = || radiator.angular_frequencies.iter().zip(&radiator.damping_ratios);
        let to_next: Vec<_> =
            modes().map(|(&omega, &zeta)| SampledOscillator::new(omega, zeta, sample_interval_s)).collect();
        let mut recurrences = alloc::vec![[[0.0; LANES]; 2]; to_next.len().div_ceil(LANES)];
        for (at, (map, (omega, zeta))) in to_next.iter().zip(modes()).enumerate() {
            let [q, v] = [OscillatorState { q: 1.0, v: 0.0 }, OscillatorState { q: 0.0, v: 1.0 }];
            let [traces, determinants] = &mut recurrences[at / LANES];
            traces[at % LANES] = map.advance(q, 0.0).q + map.advance(v, 0.0).v;
            determinants[at % LANES] = libm::exp(-2.0 * zeta * omega * sample_interval_s);
        }
        let states = alloc::vec![OscillatorState::default(); to_next.len()];
        let to_first = to_next.clone();
        Self { radiator, to_next, recurrences, to_first, offset_s: sample_interval_s, states }
    }

    /// Audible modes.
    pub(crate) fn radiator(&self) -> &Radiator {
        &self.radiator
    }

    /// Set the offset of the first sample from the start of the step [s].
    fn set_offset(&mut self, offset_s: f64) {
        if (offset_s - self.offset_s).abs() < SAME_OFFSET_S {
            return;
        }
        let Radiator { angular_frequencies, damping_ratios, .. } = &self.radiator;
        let modes = angular_frequencies.iter().zip(damping_ratios);
        for (map, (&omega, &zeta)) in self.to_first.iter_mut().zip(modes) {
            *map = SampledOscillator::new(omega, zeta, offset_s);
        }
        self.offset_s = offset_s;
    }

    /// Add the pressure [Pa] of a step to its samples, from the states at its start and the forces p [N/√kg] that it holds; the first sample
    /// comes `offset_s` [s] after the start.
    pub(crate) fn add_step(&mut self, forces: &[f64], offset_s: f64, samples: &mut LaneSums) {
        if samples.is_empty() {
            return;
        }
        let starts_with_step = offset_s < SAME_OFFSET_S;
        if !starts_with_step {
            self.set_offset(offset_s);
        }
        for (group, [traces, determinants]) in self.recurrences.iter().enumerate() {
            let (mut now, mut next) = ([0.0; LANES], [0.0; LANES]);
            let modes = LANES * group..(LANES * (group + 1)).min(self.states.len());
            for (lane, mode) in modes.enumerate() {
                let (state, p, w) = (self.states[mode], forces[mode], self.radiator.weights[mode]);
                let first = if starts_with_step { state } else { self.to_first[mode].advance(state, p) };
                now[lane] = w * first.v;
                next[lane] = w * self.to_next[mode].advance(first, p).v;
            }
            for sums in samples.iter_mut() {
                for lane in 0..LANES {
                    sums[lane] += now[lane];
                    let after = traces[lane] * next[lane] - determinants[lane] * now[lane];
                    (now[lane], next[lane]) = (next[lane], after);
                }
            }
        }
    }
}
