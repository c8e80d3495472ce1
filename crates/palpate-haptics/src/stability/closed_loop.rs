//! Closed loop of object, coupling, device and hand: unstable poles, critical couplings, stability margins.

use super::discrete_oscillator::DiscreteOscillator;
use super::point_response::PointResponse;
use crate::device::{DeviceSpec, Hand};
use num_complex::Complex64;
use palpate::{Coupling, SampledResidual};
use std::f64::consts::{PI, TAU};

/// Slowest growth that counts as unstable: by a factor e in this time [s]. The circle is wider than 1 accordingly.
pub const SLOWEST_GROWTH_S: f64 = 1000.0;

/// Largest relative change of the response between neighbouring samples.
const MAX_CHANGE: f64 = 0.3;

/// Largest angle by which 1 + K·H may turn between neighbouring samples [rad].
const MAX_TURN: f64 = 0.6;

/// Smallest distance between samples [rad].
const MIN_SPACING: f64 = 1e-13;

/// Bisection steps on angles, to round-off.
const BISECTIONS: usize = 60;

/// Timing of a sampled loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoopTiming {
    /// Step of the scene and update of the device [s].
    pub step_s: f64,
    /// Delay d [updates] from reading a position to commanding its force; 1 for a local device.
    pub delay_updates: u32,
}

impl LoopTiming {
    /// Timing with a link that adds a round-trip delay [s] to the one update of a local device.
    pub fn new(step_s: f64, link_delay_s: f64) -> Self {
        Self { step_s, delay_updates: 1 + (link_delay_s / step_s - 1e-9).ceil().max(0.0) as u32 }
    }

    /// Mean age of the position behind a held force [s]: (d + ½)·h.
    pub fn age_s(&self) -> f64 {
        (f64::from(self.delay_updates) + 0.5) * self.step_s
    }
}

/// Stability margins of a coupling.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Margins {
    /// Gain margin: factor by which stiffness and damping together may grow.
    pub gain: f64,
    /// Lower gain margin: factor to which stiffness and damping together may shrink.
    pub min_gain: f64,
    /// Phase margin of the device's loop [rad].
    pub phase_rad: f64,
    /// Delay margin [s].
    pub delay_s: f64,
}

/// Frequency response at one angle.
#[derive(Debug, Clone, Copy)]
struct Sample {
    /// Angle θ, between 0 and π [rad].
    angle: f64,
    /// w = 1/z.
    w: Complex64,
    /// C [m/N].
    body: Complex64,
    /// w^(1+d)·G [m/N].
    device: Complex64,
}

/// Closed loop without its coupling.
#[derive(Debug, Clone)]
pub struct ClosedLoop {
    timing: LoopTiming,
    body: Vec<(DiscreteOscillator, f64)>,
    /// Residual compliance [m/N], and how it is sampled.
    residual: f64,
    sampled_residual: SampledResidual,
    device: DiscreteOscillator,
    /// Mobility of device and hand, 1/mass [1/kg].
    mobility: f64,
    samples: Vec<Sample>,
}

impl ClosedLoop {
    /// Loop of a point of an object and a device, in a hand or without one.
    pub fn new(point: &PointResponse, device: DeviceSpec, hand: Option<Hand>, timing: LoopTiming) -> Self {
        let no_hand = Hand { mass_kg: 0.0, stiffness_n_m: 0.0, damping_n_s_m: 0.0 };
        let hand = hand.unwrap_or(no_hand);
        let mass = device.mass_kg + hand.mass_kg;
        let damping = device.damping_n_s_m + hand.damping_n_s_m;
        let mut closed = Self {
            timing,
            body: point.discrete_oscillators(timing.step_s),
            residual: point.residual(),
            sampled_residual: point.sampled_residual(timing.step_s),
            device: DiscreteOscillator::mass(mass, hand.stiffness_n_m, damping, timing.step_s),
            mobility: 1.0 / mass,
            samples: Vec::new(),
        };
        closed.samples = closed.all_samples();
        closed
    }

    /// Timing.
    pub fn timing(&self) -> LoopTiming {
        self.timing
    }

    /// Number of closed-loop poles outside the circle, 0 if the coupling is stable (Nyquist).
    pub fn unstable_poles(&self, coupling: Coupling) -> u32 {
        let turned: f64 = self.samples.windows(2).map(|pair| self.turn(&pair[0], &pair[1], coupling)).sum();
        // The sign: w runs against the angle. π instead of 2π: the upper half of the circle stands for both halves.
        (-turned / PI).round().max(0.0) as u32
    }

    /// Whether a coupling is stable.
    pub fn is_stable(&self, coupling: Coupling) -> bool {
        self.unstable_poles(coupling) == 0
    }

    /// Ranges of damping [N·s/m] up to `max` that are stable with a stiffness [N/m].
    pub fn stable_damping(&self, stiffness: f64, max: f64) -> Vec<[f64; 2]> {
        let base = Coupling { stiffness, damping: 0.0 };
        self.stable_ranges(base, Coupling { stiffness: 0.0, damping: 1.0 }, max)
    }

    /// Ranges of stiffness [N/m] up to `max` that are stable with a damping [N·s/m].
    pub fn stable_stiffness(&self, damping: f64, max: f64) -> Vec<[f64; 2]> {
        let base = Coupling { stiffness: 0.0, damping };
        self.stable_ranges(base, Coupling { stiffness: 1.0, damping: 0.0 }, max)
    }

    /// Stability margins of a coupling; `None` if it is unstable.
    pub fn margins(&self, coupling: Coupling) -> Option<Margins> {
        const MAX_GAIN: f64 = 1e6;
        let none = Coupling { stiffness: 0.0, damping: 0.0 };
        let ranges = self.stable_ranges(none, coupling, MAX_GAIN);
        let [min_gain, gain] = ranges.into_iter().find(|[low, high]| *low <= 1.0 && *high >= 1.0)?;
        let [phase_rad, delay_s] = self.lag_margins(coupling);
        Some(Margins { gain, min_gain, phase_rad, delay_s })
    }

    /// Delay margin of a stable coupling [s].
    pub fn delay_margin_s(&self, coupling: Coupling) -> f64 {
        self.lag_margins(coupling)[1]
    }

    /// Phase margin [rad] and delay margin [s] of the device's loop.
    fn lag_margins(&self, coupling: Coupling) -> [f64; 2] {
        let (mut phase_rad, mut delay_s) = (PI, f64::INFINITY);
        let size = |sample: &Sample| self.loop_gain(sample, coupling).norm() - 1.0;
        for pair in self.samples.windows(2) {
            if (size(&pair[0]) > 0.0) == (size(&pair[1]) > 0.0) {
                continue;
            }
            let crossing = self.bisect(pair[0], pair[1], size);
            let phase = (-self.loop_gain(&crossing, coupling)).arg().rem_euclid(TAU);
            phase_rad = phase_rad.min(phase);
            delay_s = delay_s.min(phase / crossing.angle * self.timing.step_s);
        }
        [phase_rad, delay_s]
    }

    /// Damping of the device [N·s/m] with which a coupling is passive with any hand (Colgate & Schenkel).
    pub fn damping_for_passivity(&self, coupling: Coupling) -> f64 {
        // Below this angle 1 − cos θ is round-off, and the requirement has its low-frequency limit.
        const MIN_ANGLE: f64 = 1e-3;
        let Self { timing: LoopTiming { step_s, delay_updates }, .. } = self;
        let needed = |sample: &Sample| {
            let w = sample.w / sample.w.norm();
            let felt = 1.0 / (sample.body + 1.0 / gain(coupling, w, *step_s));
            let work = (1.0 - w) * w.powu(*delay_updates) * felt;
            0.5 * step_s * work.re / (1.0 - sample.angle.cos())
        };
        self.samples.iter().filter(|sample| sample.angle > MIN_ANGLE).map(needed).fold(0.0, f64::max)
    }

    /// Ranges of g from 0 to `max` in which the coupling `base` + g·`along` is stable.
    fn stable_ranges(&self, base: Coupling, along: Coupling, max: f64) -> Vec<[f64; 2]> {
        let mut bounds = vec![0.0];
        bounds.extend(self.critical(base, along, max));
        bounds.push(max);
        let mut ranges: Vec<[f64; 2]> = Vec::new();
        for pair in bounds.windows(2).filter(|pair| pair[1] - pair[0] > 1e-9 * pair[1]) {
            let middle = if pair[0] > 0.0 { (pair[0] * pair[1]).sqrt() } else { 0.5 * pair[1] };
            let coupling = Coupling {
                stiffness: base.stiffness + middle * along.stiffness,
                damping: base.damping + middle * along.damping,
            };
            match ranges.last_mut() {
                _ if !self.is_stable(coupling) => {}
                Some(last) if pair[0] - last[1] <= 1e-9 * last[1] => last[1] = pair[1],
                _ => ranges.push([pair[0], pair[1]]),
            }
        }
        ranges
    }

    /// Critical g between 0 and `max`, ascending: `base` + g·`along` has a pole on the circle, 1 + (K + g·K′)·H = 0.
    fn critical(&self, base: Coupling, along: Coupling, max: f64) -> Vec<f64> {
        let step_s = self.timing.step_s;
        let value = |sample: &Sample| -> Complex64 {
            let response = sample.body + sample.device;
            let [fixed, moving] = [base, along].map(|c| gain(c, sample.w, step_s));
            -(1.0 + response * fixed) / (response * moving)
        };
        let ends = [self.samples.first(), self.samples.last()].into_iter().flatten();
        let mut found: Vec<f64> = ends.map(|sample| value(sample).re).collect();
        for pair in self.samples.windows(2) {
            let (a, b) = (value(&pair[0]), value(&pair[1]));
            if (a.im > 0.0) != (b.im > 0.0) && a.re.max(b.re) > 0.0 && a.re.min(b.re) < max {
                found.push(value(&self.bisect(pair[0], pair[1], |sample| value(sample).im)).re);
            }
        }
        found.retain(|g| (0.0..max).contains(g) && *g > 0.0);
        found.sort_unstable_by(f64::total_cmp);
        found
    }

    /// Sample between two others at which a function of the angle changes its sign.
    fn bisect(&self, mut a: Sample, mut b: Sample, value: impl Fn(&Sample) -> f64) -> Sample {
        let above = value(&a) > 0.0;
        for _ in 0..BISECTIONS {
            if b.angle - a.angle < MIN_SPACING {
                break;
            }
            let middle = self.sample(0.5 * (a.angle + b.angle));
            *(if (value(&middle) > 0.0) == above { &mut a } else { &mut b }) = middle;
        }
        b
    }

    /// Angle by which 1 + K·H turns between two samples [rad].
    fn turn(&self, a: &Sample, b: &Sample, coupling: Coupling) -> f64 {
        let value = |sample: &Sample| -> Complex64 {
            1.0 + (sample.body + sample.device) * gain(coupling, sample.w, self.timing.step_s)
        };
        let turned = (value(b) / value(a)).arg();
        if turned.abs() < MAX_TURN || b.angle - a.angle < MIN_SPACING {
            return turned;
        }
        let middle = self.sample(0.5 * (a.angle + b.angle));
        self.turn(a, &middle, coupling) + self.turn(&middle, b, coupling)
    }

    /// Loop gain seen by the device, w^(1+d)·G/(C + 1/K).
    fn loop_gain(&self, sample: &Sample, coupling: Coupling) -> Complex64 {
        sample.device / (sample.body + 1.0 / gain(coupling, sample.w, self.timing.step_s))
    }

    /// Frequency response at an angle [rad].
    fn sample(&self, angle: f64) -> Sample {
        let LoopTiming { step_s, delay_updates } = self.timing;
        let w = Complex64::from_polar(1.0 / (1.0 + step_s / SLOWEST_GROWTH_S), -angle);
        let elastic: Complex64 = self.body.iter().map(|(map, gain)| map.response(w) * *gain).sum();
        let device = self.device.response(w) * self.mobility * w.powu(1 + delay_updates);
        let (decay, lead) = (self.sampled_residual.decay(), self.sampled_residual.lead());
        let residual = self.residual * ((1.0 - decay) / (1.0 - decay * w) + lead * (1.0 - w));
        Sample { angle, w, body: elastic + residual, device }
    }

    /// Samples from 0 to π, dense enough to resolve every resonance: around every pole at doubling distances, then refined wherever
    /// the response changes by more than [`MAX_CHANGE`].
    fn all_samples(&self) -> Vec<Sample> {
        const UNIFORM: u32 = 256;
        let circle = self.timing.step_s / SLOWEST_GROWTH_S;
        let mut angles: Vec<f64> = (0..=UNIFORM).map(|k| PI * f64::from(k) / f64::from(UNIFORM)).collect();
        for (angle, distance) in
            self.body.iter().map(|(map, _)| map).chain([&self.device]).flat_map(DiscreteOscillator::poles)
        {
            let mut away = 0.25 * (distance + circle);
            angles.push(angle);
            while away < PI / f64::from(UNIFORM) {
                angles.extend([angle - away, angle + away]);
                away *= 2.0;
            }
        }
        angles.retain(|angle| (0.0..=PI).contains(angle));
        angles.sort_unstable_by(f64::total_cmp);
        angles.dedup_by(|b, a| *b - *a < MIN_SPACING);
        let coarse: Vec<Sample> = angles.into_iter().map(|angle| self.sample(angle)).collect();
        let mut samples = Vec::with_capacity(2 * coarse.len());
        for pair in coarse.windows(2) {
            samples.push(pair[0]);
            self.refine(pair[0], pair[1], &mut samples);
        }
        samples.extend(coarse.last());
        samples
    }

    /// Adds samples between two that differ too much.
    fn refine(&self, a: Sample, b: Sample, samples: &mut Vec<Sample>) {
        let differ = |x: Complex64, y: Complex64| (x - y).norm() > MAX_CHANGE * x.norm().min(y.norm());
        let [all_a, all_b] = [a, b].map(|sample| sample.body + sample.device);
        if !differ(all_a, all_b) && !differ(a.device, b.device) || b.angle - a.angle < MIN_SPACING {
            return;
        }
        let middle = self.sample(0.5 * (a.angle + b.angle));
        self.refine(a, middle, samples);
        samples.push(middle);
        self.refine(middle, b, samples);
    }
}

/// Coupling K = k + b·(1 − w)/h [N/m].
fn gain(coupling: Coupling, w: Complex64, step_s: f64) -> Complex64 {
    coupling.stiffness + (1.0 - w) * (coupling.damping / step_s)
}
