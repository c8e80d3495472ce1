//! The loop of an object, a coupling, a device and a hand: its unstable poles, the couplings at which one appears, margins.

use super::place::PlaceResponse;
use super::sampled::Sampled;
use crate::device::{Hand, Traits};
use num_complex::Complex64;
use palpate::Coupling;
use std::f64::consts::{PI, TAU};

/// What grows by e in more than this [s] counts as stable: the circle is that much wider than 1.
pub const SLOWEST_S: f64 = 1000.0;

/// Between samples the response changes by less than this share, and turns by less than this angle [rad].
const CHANGE: f64 = 0.3;
const TURN: f64 = 0.6;

/// Angles [rad] closer than this are one.
const CLOSEST: f64 = 1e-13;

/// Halvings after which a bisection on angles is at round-off.
const HALVINGS: usize = 60;

/// How a loop is sampled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoopTiming {
    /// Step of the scene and update of the device [s].
    pub step_s: f64,
    /// Updates from reading a position to pushing with the force that answers it; 1 for a device beside the scene.
    pub delay_updates: u32,
}

impl LoopTiming {
    /// With a link that adds a delay [s], there and back together, to the one update that any device has.
    pub fn new(step_s: f64, link_delay_s: f64) -> Self {
        Self { step_s, delay_updates: 1 + (link_delay_s / step_s - 1e-9).ceil().max(0.0) as u32 }
    }

    /// How old the position is that a force answers, in the mean over its hold [s]: (d + ½)·h.
    pub fn age_s(&self) -> f64 {
        (f64::from(self.delay_updates) + 0.5) * self.step_s
    }
}

/// By how much a coupling is stable.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Margins {
    /// Stiffness and damping together may be this many times as large, and as small, before it is unstable.
    pub gain: f64,
    /// See [`Self::gain`].
    pub least_gain: f64,
    /// Phase [rad] that the device's loop may lose.
    pub phase_rad: f64,
    /// Delay [s] that may come on top.
    pub delay_s: f64,
}

/// The loop at one frequency.
#[derive(Debug, Clone, Copy)]
struct Sample {
    /// θ [rad], between 0 and π.
    angle: f64,
    /// 1/z.
    w: Complex64,
    /// C and w^(1+d)·G [m/N].
    body: Complex64,
    device: Complex64,
}

/// A closed loop of everything but the coupling.
#[derive(Debug, Clone)]
pub struct ClosedLoop {
    timing: LoopTiming,
    body: Vec<(Sampled, f64)>,
    residual: f64,
    device: Sampled,
    /// 1/(device's and hand's mass) [1/kg].
    mobility: f64,
    samples: Vec<Sample>,
}

impl ClosedLoop {
    /// Of a place on an object and a device, in a hand or let go.
    pub fn new(place: &PlaceResponse, traits: Traits, hand: Option<Hand>, timing: LoopTiming) -> Self {
        let nobody = Hand { mass_kg: 0.0, stiffness_n_m: 0.0, damping_n_s_m: 0.0 };
        let hand = hand.unwrap_or(nobody);
        let mass = traits.mass_kg + hand.mass_kg;
        let damping = traits.damping_n_s_m + hand.damping_n_s_m;
        let mut closed = Self {
            timing,
            body: place.sampled(timing.step_s),
            residual: place.residual(),
            device: Sampled::mass(mass, hand.stiffness_n_m, damping, timing.step_s),
            mobility: 1.0 / mass,
            samples: Vec::new(),
        };
        closed.samples = closed.all_samples();
        closed
    }

    /// How it is sampled.
    pub fn timing(&self) -> LoopTiming {
        self.timing
    }

    /// Poles outside the circle, those above and below the real axis each; 0 if the coupling is stable.
    pub fn unstable_poles(&self, coupling: Coupling) -> u32 {
        let turned: f64 = self.samples.windows(2).map(|pair| self.turn(&pair[0], &pair[1], coupling)).sum();
        // Against the angle, since w goes backwards; half a circle stands for both halves.
        (-turned / PI).round().max(0.0) as u32
    }

    /// Whether nothing grows.
    pub fn is_stable(&self, coupling: Coupling) -> bool {
        self.unstable_poles(coupling) == 0
    }

    /// The dampings [N·s/m] up to `most` with which a stiffness [N/m] is stable, as ranges.
    pub fn stable_damping(&self, stiffness: f64, most: f64) -> Vec<[f64; 2]> {
        let base = Coupling { stiffness, damping: 0.0 };
        self.stable_ranges(base, Coupling { stiffness: 0.0, damping: 1.0 }, most)
    }

    /// The stiffnesses [N/m] up to `most` that are stable with a damping [N·s/m], as ranges.
    pub fn stable_stiffness(&self, damping: f64, most: f64) -> Vec<[f64; 2]> {
        let base = Coupling { stiffness: 0.0, damping };
        self.stable_ranges(base, Coupling { stiffness: 1.0, damping: 0.0 }, most)
    }

    /// By how much a coupling is stable; none if it is not.
    pub fn margins(&self, coupling: Coupling) -> Option<Margins> {
        const MOST: f64 = 1e6;
        let none = Coupling { stiffness: 0.0, damping: 0.0 };
        let ranges = self.stable_ranges(none, coupling, MOST);
        let [least_gain, gain] = ranges.into_iter().find(|[low, high]| *low <= 1.0 && *high >= 1.0)?;
        let [phase_rad, delay_s] = self.lag_margins(coupling);
        Some(Margins { gain, least_gain, phase_rad, delay_s })
    }

    /// Delay [s] that may come on top of a stable coupling.
    pub fn delay_margin_s(&self, coupling: Coupling) -> f64 {
        self.lag_margins(coupling)[1]
    }

    /// Phase [rad] and delay [s] that the device's loop may lose.
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

    /// The damping [N·s/m] that a device needs so that a coupling is passive with any hand.
    pub fn damping_for_passivity(&self, coupling: Coupling) -> f64 {
        // Below, 1 − cos θ is round-off; what is limited there is so at this angle too.
        const LOWEST: f64 = 1e-3;
        let Self { timing: LoopTiming { step_s, delay_updates }, .. } = self;
        let needed = |sample: &Sample| {
            let w = sample.w / sample.w.norm();
            let felt = 1.0 / (sample.body + 1.0 / gain(coupling, w, *step_s));
            let work = (1.0 - w) * w.powu(*delay_updates) * felt;
            0.5 * step_s * work.re / (1.0 - sample.angle.cos())
        };
        self.samples.iter().filter(|sample| sample.angle > LOWEST).map(needed).fold(0.0, f64::max)
    }

    /// The largest of `base` + g·`along` for which the loop is stable, as ranges of g from 0 to `most`.
    fn stable_ranges(&self, base: Coupling, along: Coupling, most: f64) -> Vec<[f64; 2]> {
        let mut bounds = vec![0.0];
        bounds.extend(self.critical(base, along, most));
        bounds.push(most);
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

    /// The g between 0 and `most`, ascending, at which `base` + g·`along` has a pole on the circle: 1 + (K + g·K′)·H = 0.
    fn critical(&self, base: Coupling, along: Coupling, most: f64) -> Vec<f64> {
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
            if (a.im > 0.0) != (b.im > 0.0) && a.re.max(b.re) > 0.0 && a.re.min(b.re) < most {
                found.push(value(&self.bisect(pair[0], pair[1], |sample| value(sample).im)).re);
            }
        }
        found.retain(|g| (0.0..most).contains(g) && *g > 0.0);
        found.sort_unstable_by(f64::total_cmp);
        found
    }

    /// Where a function of the angle changes its sign between two samples.
    fn bisect(&self, mut a: Sample, mut b: Sample, value: impl Fn(&Sample) -> f64) -> Sample {
        let above = value(&a) > 0.0;
        for _ in 0..HALVINGS {
            if b.angle - a.angle < CLOSEST {
                break;
            }
            let middle = self.sample(0.5 * (a.angle + b.angle));
            *(if (value(&middle) > 0.0) == above { &mut a } else { &mut b }) = middle;
        }
        b
    }

    /// By how much 1 + K·H turns between two samples [rad].
    fn turn(&self, a: &Sample, b: &Sample, coupling: Coupling) -> f64 {
        let value = |sample: &Sample| -> Complex64 {
            1.0 + (sample.body + sample.device) * gain(coupling, sample.w, self.timing.step_s)
        };
        let turned = (value(b) / value(a)).arg();
        if turned.abs() < TURN || b.angle - a.angle < CLOSEST {
            return turned;
        }
        let middle = self.sample(0.5 * (a.angle + b.angle));
        self.turn(a, &middle, coupling) + self.turn(&middle, b, coupling)
    }

    /// The loop as the device sees it, w^(1+d)·G/(C + 1/K).
    fn loop_gain(&self, sample: &Sample, coupling: Coupling) -> Complex64 {
        sample.device / (sample.body + 1.0 / gain(coupling, sample.w, self.timing.step_s))
    }

    fn sample(&self, angle: f64) -> Sample {
        let LoopTiming { step_s, delay_updates } = self.timing;
        let w = Complex64::from_polar(1.0 / (1.0 + step_s / SLOWEST_S), -angle);
        let elastic: Complex64 = self.body.iter().map(|(map, gain)| map.response(w) * *gain).sum();
        let device = self.device.response(w) * self.mobility * w.powu(1 + delay_updates);
        Sample { angle, w, body: elastic + self.residual, device }
    }

    /// Samples dense enough that nothing is missed between two of them: around every pole at distances that double,
    /// and then wherever the response changes much.
    fn all_samples(&self) -> Vec<Sample> {
        const EVEN: u32 = 256;
        let circle = self.timing.step_s / SLOWEST_S;
        let mut angles: Vec<f64> = (0..=EVEN).map(|k| PI * f64::from(k) / f64::from(EVEN)).collect();
        for (angle, distance) in
            self.body.iter().map(|(map, _)| map).chain([&self.device]).flat_map(Sampled::poles)
        {
            let mut away = 0.25 * (distance + circle);
            angles.push(angle);
            while away < PI / f64::from(EVEN) {
                angles.extend([angle - away, angle + away]);
                away *= 2.0;
            }
        }
        angles.retain(|angle| (0.0..=PI).contains(angle));
        angles.sort_unstable_by(f64::total_cmp);
        angles.dedup_by(|b, a| *b - *a < CLOSEST);
        let coarse: Vec<Sample> = angles.into_iter().map(|angle| self.sample(angle)).collect();
        let mut samples = Vec::with_capacity(2 * coarse.len());
        for pair in coarse.windows(2) {
            samples.push(pair[0]);
            self.refine(pair[0], pair[1], &mut samples);
        }
        samples.extend(coarse.last());
        samples
    }

    /// Samples between two that are too different.
    fn refine(&self, a: Sample, b: Sample, samples: &mut Vec<Sample>) {
        let differ = |x: Complex64, y: Complex64| (x - y).norm() > CHANGE * x.norm().min(y.norm());
        let [all_a, all_b] = [a, b].map(|sample| sample.body + sample.device);
        if !differ(all_a, all_b) && !differ(a.device, b.device) || b.angle - a.angle < CLOSEST {
            return;
        }
        let middle = self.sample(0.5 * (a.angle + b.angle));
        self.refine(a, middle, samples);
        samples.push(middle);
        self.refine(middle, b, samples);
    }
}

/// K = k + b·(1 − w)/h [N/m].
fn gain(coupling: Coupling, w: Complex64, step_s: f64) -> Complex64 {
    coupling.stiffness + (1.0 - w) * (coupling.damping / step_s)
}
