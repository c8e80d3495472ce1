//! Figure 5(b) from its log: one period as images, the forces on both hands in both forms of the response, the vibration after the stop, the ledger.

use super::forms::{SAMPLES, STEP_S};
use super::resonance::{Resonance, side_nodes};
use super::shake::{LOG_NAME, SHAKES_HZ, SIDES, SWAY_M};
use crate::bodies::table_in_memory;
use crate::chapter::{DataFile, csv};
use crate::chart::{Axis, Chart, Scale, Series, Style};
use crate::error::ReproduceError;
use crate::image_series::{ImageRenderer, ImageSeries};
use crate::log_steps::{LoggedStep, REPLAYS, stalls, unaccounted_energy};
use crate::options::Options;
use crate::page::{figure as charted, paragraph};
use crate::powers::power_of_ten;
use crate::progress::StageProgress;
use crate::verdict::{Verdict, quantity};
use palpate::{EnergyLedger, Model, ModelObject, ObjectStart, Pose, ResponseForm, State, Twist, step};
use palpate_fem::RecordedBody;
use palpate_scene::LogReplay;
use palpate_viewer::CameraView;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

/// Images of the last period of the shaking, and periods before the stop in the curves.
const PICTURES: usize = 8;
const PERIODS: f64 = 2.5;

/// Time after the stop in which the cube rings alone, and its begin, when what rings faster has decayed [s].
const RINGING_S: f64 = 2.6;
const SETTLED_S: f64 = 0.4;

/// Hands that stand still stay within this of their place [m].
const STILL_M: f64 = 1e-6;

const CAMERA: CameraView = CameraView { from: [0.20, 0.15, 0.34], to: [0.0, -0.008, 0.0] };

/// The figure as the chapter uses it.
pub struct Figure {
    /// Images and curves.
    pub html: String,
    /// Verdict and answer to the figure.
    pub found: (Verdict, String),
    /// Verdict and answer on the momentum.
    pub momentum: (Verdict, String),
    /// The numbers.
    pub data: Vec<DataFile>,
}

/// Mean displacement of the hands to the right [m].
fn sway(logged: &LoggedStep) -> f64 {
    let hands = logged.hands.iter().zip(SIDES);
    hands.map(|((place, _), (_, side))| place.x - side).sum::<f64>() / logged.hands.len().max(1) as f64
}

/// Force of the cube on both hands along the shaking [N].
fn pull(logged: &LoggedStep) -> f64 {
    logged.hands.iter().map(|(_, force)| force.x).sum()
}

/// First step from which the hands stand still on the right for a while.
fn stop(steps: &[LoggedStep]) -> Option<usize> {
    let while_steps = (SETTLED_S / STEP_S) as usize;
    let stands = |at: usize| {
        let place = sway(&steps[at]);
        place > 0.9 * SWAY_M
            && steps[at..at + while_steps].iter().all(|step| (sway(step) - place).abs() < STILL_M)
    };
    (0..steps.len().saturating_sub(while_steps)).find(|&at| stands(at))
}

/// Start of the last period of the shaking that is whole before a time [s]: an upward zero of the sway.
fn last_period(steps: &[LoggedStep], before_s: f64) -> Option<usize> {
    let period_s = 1.0 / SHAKES_HZ;
    (1..steps.len())
        .rev()
        .filter(|&at| steps[at].time_s + period_s <= before_s)
        .find(|&at| sway(&steps[at - 1]) < 0.0 && sway(&steps[at]) >= 0.0)
}

/// Steps since the start over one period, with captions.
fn instants(steps: &[LoggedStep], begin: usize) -> Vec<(u64, String)> {
    let of = |k: usize| {
        let after_s = k as f64 / PICTURES as f64 / SHAKES_HZ;
        let from = &steps[begin..];
        let at = from.partition_point(|logged| logged.time_s < steps[begin].time_s + after_s - 1e-9);
        let logged = &from[at.min(from.len() - 1)];
        let ms = 1e3 * (logged.time_s - steps[begin].time_s);
        let place = match (1e3 * sway(logged)).round() {
            0.0 => "in the middle".into(),
            mm if mm < 0.0 => format!("{:.0} mm to the left", -mm),
            mm => format!("{mm:.0} mm to the right"),
        };
        (logged.step, format!("{ms:.0} ms: {place}"))
    };
    (0..PICTURES).map(of).collect()
}

/// A log computed on the paper's table.
pub struct OnTable {
    /// Force on the left hand along the shaking in each step [N].
    pub forces_n: Vec<f64>,
    /// Longest step [µs], of the least of [`REPLAYS`] times of each.
    pub longest_us: f64,
}

/// The steps of the log with the same motions of the hands, on the paper's table, touchable at some nodes.
pub fn on_table(log: &Path, body: &RecordedBody, nodes: &[u32]) -> Result<OnTable, ReproduceError> {
    let run = LogReplay::read(log)?;
    let table = table_in_memory(body, STEP_S, SAMPLES, nodes.to_vec(), |value| value)?;
    let start = ObjectStart { pose: Pose::IDENTITY, twist: Twist::ZERO };
    let recording = Arc::new(body.recording.clone());
    let object =
        ModelObject { response: ResponseForm::Fir(Arc::new(table)), ..ModelObject::new(recording, start) };
    let model = Model::new(run.scene.model.parameters().clone(), vec![object])?;
    let mut steps: Vec<(f64, f64)> = Vec::new();
    for _ in 0..REPLAYS {
        let mut state = State::new(&model);
        let mut at = 0;
        run.replay::<ReproduceError>(&mut run.initial_state()?, run.steps, |input, _, _| {
            let before = Instant::now();
            let hand = step(&model, &mut state, input).devices.first();
            let took_us = 1e6 * before.elapsed().as_secs_f64();
            if at == steps.len() {
                steps.push((hand.map_or(f64::NAN, |hand| hand.force_on_hand.x), took_us));
            }
            steps[at].1 = steps[at].1.min(took_us);
            at += 1;
            Ok(())
        })?;
    }
    let longest_us = steps.iter().map(|(_, us)| *us).fold(0.0, f64::max);
    Ok(OnTable { forces_n: steps.into_iter().map(|(force, _)| force).collect(), longest_us })
}

/// Largest difference between the momentum of the body and the impulse of the hands [N·s], and the largest momentum.
fn momentum(steps: &[LoggedStep], mass: f64) -> (f64, f64) {
    let (mut impulse, mut apart, mut largest) = (0.0, 0.0_f64, 0.0_f64);
    for logged in steps {
        impulse -= STEP_S * pull(logged);
        let carried = mass * logged.velocity.x;
        apart = apart.max((carried - impulse).abs());
        largest = largest.max(carried.abs());
    }
    (apart, largest)
}

/// The figure from the log in the folder of the report.
pub fn figure(
    options: &Options,
    body: &RecordedBody,
    (steps, table): (&[LoggedStep], &OnTable),
    renderer: &ImageRenderer,
    progress: &mut dyn StageProgress,
) -> Result<Figure, ReproduceError> {
    let log = options.output.join(LOG_NAME);
    let nobody = |what: &str| ReproduceError::Measurement(format!("{}: {what}", log.display()));
    let stopped = stop(steps).ok_or_else(|| nobody("the hands do not stop on the right"))?;
    let begin = last_period(steps, steps[stopped].time_s).ok_or_else(|| nobody("nobody shakes the cube"))?;
    progress.begin("pictures of figure 5b", 1);
    let mut html = renderer.images(&ImageSeries {
        log: &log,
        folder: &options.output.join("figure5b"),
        camera: CAMERA,
        instants: &instants(steps, begin),
        caption: "The paper's figure 5(b): the last whole period of the shaking, drawn from the log of the run at 500 Hz, true to scale, the camera at rest; below each where the hands are. Colours tell how \
                  far the surface is from its place in the undeformed cube, arrows are the forces on the hands.",
    }, progress);
    progress.finish();
    let (first, last) = (steps[stopped].time_s - PERIODS / SHAKES_HZ, steps[stopped].time_s + RINGING_S);
    let is_shown = |logged: &LoggedStep| logged.time_s >= first && logged.time_s <= last;
    let shown: Vec<&LoggedStep> = steps.iter().filter(|logged| is_shown(logged)).collect();
    let force =
        |logged: &LoggedStep| logged.hands.iter().map(|(_, force)| force.length()).fold(0.0, f64::max);
    let most = shown.iter().map(|logged| force(logged)).fold(0.0, f64::max);
    let of_table: Vec<(f64, f64)> = steps
        .iter()
        .zip(&table.forces_n)
        .filter(|(logged, _)| is_shown(logged))
        .map(|(l, f)| (l.time_s, *f))
        .collect();
    let apart =
        shown.iter().zip(&of_table).map(|(l, (_, f))| (l.hands[0].1.x - f).abs()).fold(0.0, f64::max) / most;
    html += &charted(
        &forces(&shown, &of_table).svg(),
        &format!(
            "Forces on the hands along the way of the shaking, and the way itself. On R[s] the forces are computed by direct convolution from the same motions of the hands; they differ by \
             {:.1} % of the largest force at most, by what the response still does after its window of 1 s, e^(−αt/2) = 37 % of the slowest modes. Where the hands' curves are one, they \
             push alike. A stall is a step that began more than 0.2 ms late or took 0.2 ms longer than when it is computed again from the log.",
            100.0 * apart
        ),
    );
    let rung = ring(body, steps, stopped);
    html += &rung.html;
    let turned = shown.iter().map(|logged| logged.energy.stored()).fold(0.0, f64::max);
    // It begins at rest, without load and without gravity.
    let missing_share = unaccounted_energy(steps, 0.0) / turned;
    let missing = power_of_ten(missing_share, 0);
    html += &charted(
        &energies(&shown).svg(),
        &format!(
            "Energy of the same run. What the hands have put in since the left edge goes to and fro with the cube's energy; what it loses to damping stays. What is \
             missing over all {} steps is {missing} of the largest stored energy.",
            steps.len()
        ),
    );
    let rows = steps.iter().zip(&table.forces_n).map(|(logged, on_table)| {
        let mut row = vec![logged.time_s];
        logged.hands.iter().for_each(|(place, force)| row.extend([place.x, force.x]));
        let e = &logged.energy;
        row.extend([*on_table, e.kinetic, e.elastic + e.residual, e.input, e.lost(), e.defect]);
        row.extend([logged.lateness_us, logged.compute_us, logged.again_us]);
        row
    });
    let data = csv(
        "figure5b.csv",
        "t,left.x,left.fx,right.x,right.fx,left_on_table.fx,kinetic_j,elastic_j,input_j,lost_j,defect_j,late_us,compute_us,again_us",
        rows,
    );
    let (off, largest) = momentum(steps, body.recording.mass());
    let found = format!(
        "force on a hand {most:.2} N at most; R[s] and modal form {:.1} % apart at most; after the stop the cube rings at {:.2} Hz (computed {:.2} Hz); no energy missing to {missing}",
        100.0 * apart,
        rung.measured.hz,
        rung.computed.hz
    );
    let momentum = format!(
        "nothing is fixed in figures 5(a) and 5(b); the hands' impulse is the change of momentum to {} of the largest",
        power_of_ten(off / largest, 0)
    );
    let off_hz = 100.0 * (rung.measured.hz / rung.computed.hz - 1.0).abs();
    let as_computed = quantity("ringing, apart from the computed", off_hz, "%").at_most(1.0);
    let complete = quantity("energy missing", missing_share, "of the largest").at_most(1e-9);
    let conserved = quantity("momentum apart", off / largest, "of the largest").at_most(1e-9);
    Ok(Figure {
        html,
        found: (as_computed.and(complete), found),
        momentum: (conserved, momentum),
        data: vec![data],
    })
}

/// The vibration after the hands have stopped.
struct Ringing {
    html: String,
    measured: Resonance,
    computed: Resonance,
}

fn ring(body: &RecordedBody, steps: &[LoggedStep], stopped: usize) -> Ringing {
    let in_time = |logged: &&LoggedStep, from: f64| {
        let after = logged.time_s - steps[stopped].time_s;
        after >= from && after <= RINGING_S
    };
    let settled: Vec<&LoggedStep> = steps.iter().filter(|logged| in_time(logged, SETTLED_S)).collect();
    let samples: Vec<f64> = settled.iter().map(|logged| pull(logged)).collect();
    let computed = Resonance::computed(body, side_nodes(body));
    let measured = Resonance::measured(&samples, STEP_S, computed.hz);
    let fitted = computed.fitted(&samples, STEP_S);
    let chart = Chart {
        title: "The cube on its two points, after the hands have stopped".into(),
        x: Axis { label: "time after the stop [s]".into(), scale: Scale::Linear },
        y: Axis { label: "force on both hands along x [N]".into(), scale: Scale::Linear },
        series: vec![
            Series {
                label: "the run".into(),
                points: steps
                    .iter()
                    .filter(|logged| in_time(logged, 0.0))
                    .map(|l| (l.time_s - steps[stopped].time_s, pull(l)))
                    .collect(),
                style: Style::Line,
            },
            Series {
                label: format!("computed: {:.2} Hz, decay {:.2}/s", computed.hz, computed.decay_per_s),
                points: settled
                    .iter()
                    .zip(&fitted)
                    .map(|(l, f)| (l.time_s - steps[stopped].time_s, *f))
                    .collect(),
                style: Style::Dashed,
            },
        ],
        reference_lines: Vec::new(),
    };
    let html = charted(
        &chart.svg(),
        "Vibration of the cube on the two points after the stop; the computed one has its amplitude and phase from the run, frequency and decay from the formula.",
    ) + &paragraph(&format!(
        "The cube's mass hangs on two elastic points, and rings on them: the run has {:.2} Hz and a decay of {:.2}/s. From the static solution of the finite elements alone, with \
         1/(mω²) = C₀ + ω²C₁, where C₀ is the compliance of both points in phase and C₁ = uᵀMu of that solution, it is {:.2} Hz with a decay of {:.2}/s. So little \
         is lost because the material is damped so little there; fingers would damp it, as they are no points. It is not excited by shaking that grows within several of \
         its periods, as hands do, and therefore not in the curves before the stop; at 2 Hz it raises the forces by 1/(1 − (2/{:.2})²) = {:.2}.",
        measured.hz,
        measured.decay_per_s,
        computed.hz,
        computed.decay_per_s,
        computed.hz,
        1.0 / (1.0 - (SHAKES_HZ / computed.hz).powi(2)),
    ));
    Ringing { html, measured, computed }
}

fn chart(title: &str, y: &str, series: Vec<Series>) -> Chart {
    Chart {
        title: title.into(),
        x: Axis { label: "time [s]".into(), scale: Scale::Linear },
        y: Axis { label: y.into(), scale: Scale::Linear },
        series,
        reference_lines: Vec::new(),
    }
}

fn curve(shown: &[&LoggedStep], label: &str, style: Style, of: impl Fn(&LoggedStep) -> f64) -> Series {
    let points = shown.iter().map(|logged| (logged.time_s, of(logged))).collect();
    Series { label: label.into(), points, style }
}

fn forces(shown: &[&LoggedStep], of_table: &[(f64, f64)]) -> Chart {
    let hand =
        |at: usize| move |logged: &LoggedStep| logged.hands.get(at).map_or(f64::NAN, |(_, force)| force.x);
    let series = vec![
        curve(shown, "left hand, modal form", Style::Line, hand(0)),
        curve(shown, "right hand, modal form", Style::Line, hand(1)),
        Series { label: "left hand, R[s]".into(), points: of_table.to_vec(), style: Style::Dashed },
        curve(shown, "way of the hands [10 cm]", Style::Dashed, |logged| 10.0 * sway(logged)),
        stalls(shown.iter().copied(), hand(0)),
    ];
    chart("Two hands shake the cube at 2 Hz, and stop", "force on the hand along x [N]", series)
}

fn energies(shown: &[&LoggedStep]) -> Chart {
    let start = shown.first().map_or_else(EnergyLedger::default, |logged| logged.energy);
    let series = vec![
        curve(shown, "of motion", Style::Line, |m| 1e3 * m.energy.kinetic),
        curve(shown, "of deformation", Style::Line, |m| 1e3 * (m.energy.elastic + m.energy.residual)),
        curve(shown, "put in by the hands", Style::Line, |m| 1e3 * (m.energy.input - start.input)),
        curve(shown, "lost to damping", Style::Line, |m| 1e3 * (m.energy.lost() - start.lost())),
    ];
    chart("Where the energy is", "energy [mJ]", series)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log_steps::tests::at_rest;
    use glam::DVec3;

    /// Hands that shake from 0.3 s to the right turn at 2.925 s, at 500 Hz, and stay.
    fn shaken() -> Vec<LoggedStep> {
        let logged = |step: u64| {
            let time_s = STEP_S * step as f64;
            let x = SWAY_M * (std::f64::consts::TAU * SHAKES_HZ * (time_s.min(2.925) - 0.3)).sin();
            let hands = SIDES.map(|(_, side)| (DVec3::X * (side + x), DVec3::X)).to_vec();
            LoggedStep { hands, ..at_rest(step, time_s) }
        };
        (1..=2000).map(logged).collect()
    }

    #[test]
    fn hands_stop_where_they_stand_still_on_the_right() {
        let steps = shaken();
        let stopped = stop(&steps).expect("they stop");
        // Within what they move by in the last steps.
        assert!((steps[stopped].time_s - 2.925).abs() < 5e-3, "{}", steps[stopped].time_s);
        assert_eq!(stop(&steps[..1400]), None);
    }

    #[test]
    fn the_last_whole_period_begins_on_the_way_through_the_middle() {
        let steps = shaken();
        let begin = last_period(&steps, 2.925).expect("it is shaken");
        assert!((steps[begin].time_s - 2.3).abs() <= 2.001e-3, "{}", steps[begin].time_s);
        assert_eq!(last_period(&steps, 0.2), None);
    }

    #[test]
    fn pictures_of_a_period_are_evenly_apart() {
        let steps = shaken();
        let begin = last_period(&steps, 2.925).expect("it is shaken");
        let instants = instants(&steps, begin);
        assert_eq!(instants.len(), PICTURES);
        assert!(instants.windows(2).all(|pair| matches!(pair[1].0 - pair[0].0, 31 | 32)), "{instants:?}");
        assert!(instants[2].1.ends_with("50 mm to the right"), "{instants:?}");
    }

    #[test]
    fn impulse_and_momentum_are_the_same_if_the_velocity_is_that_of_the_forces() {
        // Two hands that feel 1 N each: the body gets −2 N.
        let moving = |(at, step): (usize, LoggedStep)| LoggedStep {
            velocity: DVec3::NEG_X * (2.0 * STEP_S * (at + 1) as f64),
            ..step
        };
        let steps: Vec<LoggedStep> = shaken().into_iter().enumerate().map(moving).collect();
        let (apart, largest) = momentum(&steps, 1.0);
        assert!(apart < 1e-12 && (largest - 8.0).abs() < 1e-12, "{apart} of {largest}");
        assert!(momentum(&steps, 2.0).0 > 7.0);
    }
}
