//! The discrete passivity test of ways of sampling: whether a port generates energy.
//!
//! The work at a port in a step is f[t]·(u[t] − u[t−1]). With u = Σ R[s]·f[t−s] it is never negative in sum exactly if
//!
//! ```text
//! Re Y(e^{iωh}) ≥ 0 for all ω,    Y(z) = (1 − z⁻¹)·Σ_s R[s]·z⁻ˢ
//! ```
//!
//! Where Re Y is negative the discrete port generates energy; its least value is given as a share of the largest.
//!
//! Equations: docs/theory.md (C54).

use crate::chapter::{Chapter, csv};
use crate::chart::{Axis, AxisName, Chart, ReferenceLine, Scale, Series, Style};
use crate::error::ReproduceError;
use crate::findings::Finding;
use crate::page::{Section, code, figure, paragraph, table};
use crate::progress::StageProgress;
use crate::statements::Statement;
use crate::verdict::quantity;
use glam::DVec3;
use palpate::{Damping, OscillatorState, SampledOscillator};
use palpate_fem::reference::LoadedMode;
use palpate_fem::{RecordedBody, SilentProgress};
use std::f64::consts::TAU;

/// The paper's step, and its window of 1 s.
const STEP_S: f64 = 2e-3;
const WINDOW: usize = 500;

/// Samples after which a mode that decays with α/2 = 1/s has lost all but 1e-9 of its amplitude.
const LONG: usize = 10_000;

/// Krylov blocks for what 200 modes leave out, as in the certificate.
const BLOCKS: usize = 18;

/// A way of making a table's samples from the response of a port.
struct Recipe {
    name: &'static str,
    /// Angle φ by which the samples lag [rad]; none of what has another reason.
    lag: Option<f64>,
    samples: Vec<f64>,
}

/// One port as a sum of modes: (ω², share of a unit force, damping ratio).
#[derive(Clone)]
struct Port(Vec<(f64, f64, f64)>);

impl Port {
    /// Displacement every `step` [s] after a unit force held for the first `held` of them.
    fn response(&self, step: f64, held: usize, samples: usize) -> Vec<f64> {
        let mut sum = vec![0.0; samples];
        for &(square, gain, zeta) in &self.0 {
            let oscillator = SampledOscillator::new(square.sqrt(), zeta, step);
            let mut state = OscillatorState::default();
            for (s, value) in sum.iter_mut().enumerate() {
                state = oscillator.advance(state, if s < held { 1.0 } else { 0.0 });
                *value += gain * state.q;
            }
        }
        sum
    }

    /// The impulse response [m/(N·s)] at times h, 2h, …
    fn impulse_response(&self, samples: usize) -> Vec<f64> {
        let mut sum = vec![0.0; samples];
        for &(square, gain, zeta) in &self.0 {
            let free = SampledOscillator::new(square.sqrt(), zeta, STEP_S);
            let mut state = OscillatorState { q: 0.0, v: 1.0 };
            for value in &mut sum {
                state = free.advance(state, 0.0);
                *value += gain * state.q;
            }
        }
        sum
    }
}

/// The port of one node and direction: the kept modes and what stands for the others.
fn port(body: &RecordedBody, node: usize, axis: usize, damping: Damping) -> Result<Port, ReproduceError> {
    let failed = |e: &dyn std::fmt::Display| ReproduceError::Measurement(format!("passivity: {e}"));
    let unreduced = body.unreduced();
    let truncated = unreduced
        .truncated_response(&[node], STEP_S, BLOCKS, &mut SilentProgress)
        .and_then(|response| response.modes(0, BLOCKS))
        .map_err(|e| failed(&e))?;
    let modes = unreduced.kept_modes();
    let kept = modes.squared_frequencies().iter().enumerate();
    let kept = kept.map(|(i, &square)| (square, modes.shape(i)[3 * node + axis]));
    let others = truncated.iter().map(|LoadedMode { square, gain }| (*square, gain[axis]));
    let mode = |(square, gain): (f64, f64)| (square, gain * gain, damping.ratio(square.sqrt()));
    Ok(Port(kept.chain(others).map(mode).collect()))
}

/// Fine enough for resonances of a width of 0.3 Hz; every tenth value is written.
const RESOLUTION_HZ: f64 = 0.02;
const WRITTEN: usize = 10;

/// Re Y [m/(N·step)] at frequencies up to half the sampling rate: (Hz, Re Y).
fn admittance(samples: &[f64]) -> Vec<(f64, f64)> {
    let differences: Vec<f64> =
        samples.iter().enumerate().map(|(s, r)| r - if s > 0 { samples[s - 1] } else { 0.0 }).collect();
    // What stands after the last sample drops to zero.
    let last = -samples.last().copied().unwrap_or_default();
    let at = |hertz: f64| {
        // cos(ωh·s) by turning on.
        let (sin, cos) = (TAU * hertz * STEP_S).sin_cos();
        let (mut x, mut y, mut sum) = (1.0, 0.0, 0.0);
        for d in differences.iter().chain([&last]) {
            sum += d * x;
            (x, y) = (x * cos - y * sin, x * sin + y * cos);
        }
        (hertz, sum)
    };
    let finest = (0.5 / STEP_S / RESOLUTION_HZ).round() as usize;
    (1..=finest).map(|k| at(RESOLUTION_HZ * k as f64)).collect()
}

/// One mode of a frequency [Hz], unit gain.
fn single(hertz: f64, damping: Damping) -> Port {
    let omega = TAU * hertz;
    Port(vec![(omega * omega, 1.0, damping.ratio(omega))])
}

/// The ways of sampling, each of the port that `of` gives for a frequency [Hz] at which a single mode shows it.
fn recipes(of: impl Fn(f64) -> Port, cut: &Port) -> Vec<Recipe> {
    let port = of(80.0);
    let halves = |port: &Port| -> Vec<f64> {
        let halves = port.response(0.5 * STEP_S, 2, 2 * LONG);
        halves.chunks_exact(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect()
    };
    // From time 0 on, where the impulse response is 0.
    let scaled =
        std::iter::once(0.0).chain(of(180.0).impulse_response(LONG - 1).into_iter().map(|r| STEP_S * r));
    let late = std::iter::once(0.0).chain(port.response(STEP_S, 1, LONG - 1));
    let recipe = |name, lag, samples| Recipe { name, lag, samples };
    let turn = |hertz: f64| TAU * hertz * STEP_S;
    vec![
        recipe("exact, end of step (palpate)", Some(0.0), port.response(STEP_S, 1, LONG)),
        recipe("mean of 1 ms and 2 ms (the paper), mode at 80 Hz", Some(0.25 * turn(80.0)), halves(&port)),
        recipe(
            "mean of 1 ms and 2 ms (the paper), mode at 240 Hz",
            Some(0.25 * turn(240.0)),
            halves(&of(240.0)),
        ),
        recipe("impulse response times the step, mode at 180 Hz", Some(0.5 * turn(180.0)), scaled.collect()),
        recipe("exact, one step late, mode at 80 Hz", Some(turn(80.0)), late.collect()),
        recipe("exact, cut off at 1 s, mode at 11.65 Hz", None, cut.response(STEP_S, 1, WINDOW)),
    ]
}

/// Result of a recipe: largest generation of energy as a share of the largest Re Y, and its frequency [Hz].
struct Tested {
    share: f64,
    hertz: f64,
    curve: Vec<(f64, f64)>,
}

fn test(samples: &[f64]) -> Tested {
    let admittance = admittance(samples);
    let largest = admittance.iter().fold(0.0_f64, |m, (_, re)| m.max(*re));
    let (hertz, least) = admittance.iter().copied().min_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or_default();
    let curve = admittance.iter().map(|&(hertz, re)| (hertz, 100.0 * re / largest)).collect();
    Tested { share: -100.0 * least / largest, hertz, curve }
}

impl Tested {
    fn text(&self) -> String {
        // A few thousand additions.
        if self.share < 1e-9 { "none".into() } else { format!("{:.1} % at {:.0} Hz", self.share, self.hertz) }
    }
}

/// The test over single modes, and over the middle of the top face.
pub fn chapter(body: &RecordedBody, progress: &mut dyn StageProgress) -> Result<Chapter, ReproduceError> {
    progress.begin("passivity", 1);
    let light = Damping::Rayleigh { alpha: 2.0, beta: 0.0 };
    let usual = Damping::Rayleigh { alpha: 2.0, beta: 2e-4 };
    let node = body.nearest_node(DVec3::new(0.0, 0.05, 0.0));
    let whole = port(body, node, 1, light)?;
    let of_modes = recipes(|hertz| single(hertz, light), &single(11.65, usual));
    let of_cube = recipes(|_| whole.clone(), &whole);
    progress.finish();
    let mut rows = Vec::new();
    let mut series = Vec::new();
    let mut curves = Vec::new();
    let (mut of_cube_text, mut of_cube_percent) = (Vec::new(), Vec::new());
    for (number, (mode, cube)) in of_modes.iter().zip(&of_cube).enumerate() {
        let (found, on_cube) = (test(&mode.samples), test(&cube.samples));
        let by_lag = mode.lag.map(|lag| 100.0 * (0.5 * lag).tan().powi(2));
        let by_lag = by_lag.map_or_else(
            || "—".into(),
            |share| if share > 0.0 { format!("{share:.1} %") } else { "none".into() },
        );
        rows.push(vec![mode.name.into(), found.text(), by_lag, on_cube.text()]);
        of_cube_text.push(on_cube.text());
        of_cube_percent.push(on_cube.share);
        // The mean at 240 Hz is the same recipe as the one at 80 Hz on the cube, and the cut hides the others.
        if [0, 1, 3, 4].contains(&number) {
            let name = mode.name.split(", mode").next().unwrap_or(mode.name);
            series.push(Series { label: name.into(), points: on_cube.curve.clone(), style: Style::Line });
        }
        curves.push(on_cube.curve);
    }
    let chart = Chart {
        title: "Real part of the admittance, middle of the top face".into(),
        x: Axis { label: "frequency [Hz]".into(), scale: Scale::Linear },
        y: Axis { label: "Re Y [% of its largest]".into(), scale: Scale::Linear },
        series,
        reference_lines: vec![ReferenceLine { axis: AxisName::Y, value: 0.0, label: "passive above".into() }],
    };
    let html = paragraph(
        "The work at a port in a step is the force held over it times the change of the displacement. With u = Σ R[s]·f[t−s] its sum is never \
         negative, the port gives no more energy than it was given, exactly if the real part of the admittance Y(z) = (1 − z⁻¹)·Σ R[s]·z⁻ˢ is not negative \
         at any frequency. The paper improves the accuracy of quick deformation by steps of 1 ms, averaged for every 2 ms; here is what that and \
         other ways of sampling do to the energy.",
    ) + &table(
        "Largest generation of energy by ways of sampling, as a share of the largest Re Y; step 2 ms",
        &["samples", "one mode", "tan²(φ/2)", "middle of the top face"],
        &rows,
    ) + &figure(
        &chart.svg(),
        "Where a curve is below zero the discrete port gives more energy than it was given.",
    ) + &paragraph(
        "The second column is one lightly damped mode (α = 2 1/s, β = 0; for the cut β = 2·10⁻⁴ s). Near its resonance Y is a circle that a lag of \
         angle φ turns, and the share is about tan²(φ/2), with φ = ωh/4 for the paper's mean, ωh/2 for the impulse response times the step, ωh for a step \
         of delay. The last column is the middle of the top face of the paper's cube, vertically, with all its modes (those beyond \
         the first 200 by a rational Krylov space), α = 2 1/s, β = 0. Shares depend on the port and the damping, signs do not: only exact \
         samples at the end of the step of a force that is held are passive, and only as long as they are not cut off while the body still moves.",
    ) + &code("palpate reproduce --only passivity");
    let rows = (0..curves[0].len()).step_by(WRITTEN).map(|k| {
        let mut row = vec![curves[0][k].0];
        row.extend(curves.iter().map(|points| points[k].1));
        row
    });
    let data = csv(
        "passivity.csv",
        "hz,exact_percent,mean_percent,mean_percent_2,impulse_times_step_percent,late_percent,cut_percent",
        rows,
    );
    let section = Section {
        id: "passivity".into(),
        heading: "Passivity of the samples (the paper's section 3.1)".into(),
        body: html,
    };
    let answer = format!(
        "the mean generates energy, {} of the largest Re Y on the cube; exact samples at the end of the step: {}",
        of_cube_text[1], of_cube_text[0]
    );
    let findings = vec![Finding::measured(
        Statement::Averaging,
        quantity("energy generated by the mean", of_cube_percent[1].max(0.0), "% of Re Y").at_most(1e-9),
        answer,
    )];
    Ok(Chapter { section, data: vec![data], findings })
}
