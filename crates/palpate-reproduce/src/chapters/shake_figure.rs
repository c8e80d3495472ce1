//! Figure 5(b) from its log: one period as pictures, the forces on both hands, the ledger.

use super::shake::{LOG_NAME, SHAKES_HZ, SIDES};
use crate::chapter::{DataFile, csv};
use crate::chart::{Axis, Chart, Scale, Series, Style};
use crate::error::ReproduceError;
use crate::image_series::{ImageRenderer, ImageSeries};
use crate::log_steps::{LoggedStep, logged_steps, unaccounted_energy};
use crate::options::Options;
use crate::page::figure as charted;
use crate::progress::StageProgress;
use palpate::EnergyLedger;
use palpate_viewer::CameraView;

/// Periods in the curves, and pictures of the last of them.
const PERIODS: f64 = 3.0;
const PICTURES: usize = 8;

/// The devices leave before the run ends; what is shown ends so long before [s].
const LEAVING_S: f64 = 1.5;

const CAMERA: CameraView = CameraView { from: [0.09, 0.11, 0.33], to: [0.0, -0.008, 0.0] };

/// The figure as the chapter uses it.
pub struct Figure {
    /// Pictures and curves.
    pub html: String,
    /// For the table at the top.
    pub found: String,
    /// The numbers.
    pub data: DataFile,
}

/// Mean displacement of the hands to the right [m].
fn sway(logged: &LoggedStep) -> f64 {
    let hands = logged.hands.iter().zip(SIDES);
    hands.map(|((place, _), (_, side))| place.x - side).sum::<f64>() / logged.hands.len().max(1) as f64
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

/// The figure from the log in the folder of the report.
pub fn figure(
    options: &Options,
    renderer: &ImageRenderer,
    progress: &mut dyn StageProgress,
) -> Result<Figure, ReproduceError> {
    let log = options.output.join(LOG_NAME);
    let steps = logged_steps(&log)?;
    let end = steps.last().map_or(0.0, |logged| logged.time_s) - LEAVING_S;
    let begin = last_period(&steps, end)
        .ok_or_else(|| ReproduceError::Measurement(format!("{}: nobody shakes the cube", log.display())))?;
    progress.begin("pictures of figure 5b", 1);
    let mut html = renderer.images(&ImageSeries {
        log: &log,
        folder: &options.output.join("figure5b"),
        camera: CAMERA,
        instants: &instants(&steps, begin),
        caption: "Figure 5(b), one period of the shaking from the log of the run at 1 kHz, the camera at rest; below each where the hands are. Colours tell how far the surface is from its \
                  place in the undeformed cube, arrows are the forces on the hands.",
    }, progress);
    progress.finish();
    let last = steps[begin].time_s + 1.0 / SHAKES_HZ;
    let first = last - PERIODS / SHAKES_HZ;
    let shown: Vec<&LoggedStep> =
        steps.iter().filter(|logged| logged.time_s >= first && logged.time_s <= last).collect();
    let force =
        |logged: &LoggedStep| logged.hands.iter().map(|(_, force)| force.length()).fold(0.0, f64::max);
    let most = shown.iter().map(|logged| force(logged)).fold(0.0, f64::max);
    let turned = shown.iter().map(|logged| logged.energy.stored()).fold(0.0, f64::max);
    // It begins at rest, without load and without gravity.
    let missing = unaccounted_energy(&steps, 0.0) / turned;
    html += &charted(
        &forces(&shown).svg(),
        "Forces on the hands along the way of the shaking, and the way itself, from the same log. The hands share the \
         cube's inertia: where their curves are one, they push alike.",
    );
    html += &charted(
        &energies(&shown).svg(),
        &format!(
            "What the hands have put in since the left edge goes to and fro with the cube's energy; what it loses to damping stays. What is \
             missing over all {} steps is {missing:.0e} of the largest stored energy.",
            steps.len()
        ),
    );
    let rows = steps.iter().map(|logged| {
        let mut row = vec![logged.time_s];
        logged.hands.iter().for_each(|(place, force)| row.extend([place.x, force.x]));
        let e = &logged.energy;
        row.extend([e.kinetic, e.elastic + e.residual, e.input, e.lost(), e.defect]);
        row
    });
    let data = csv(
        "figure5b.csv",
        "t,left.x,left.fx,right.x,right.fx,kinetic_j,elastic_j,input_j,lost_j,defect_j",
        rows,
    );
    let found =
        format!("force on a hand {most:.2} N at most while it is shaken; no energy missing to {missing:.0e}");
    Ok(Figure { html, found, data })
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

fn forces(shown: &[&LoggedStep]) -> Chart {
    let hand =
        |at: usize| move |logged: &LoggedStep| logged.hands.get(at).map_or(f64::NAN, |(_, force)| force.x);
    let series = vec![
        curve(shown, "left hand", Style::Line, hand(0)),
        curve(shown, "right hand", Style::Line, hand(1)),
        curve(shown, "way of the hands [4 cm]", Style::Dashed, |logged| 25.0 * sway(logged)),
    ];
    chart("Two hands shake the cube at 2 Hz", "force on the hand along x [N]", series)
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
    use glam::DVec3;

    /// Four seconds of a shake at 1 kHz that begins at 0.3 s.
    fn shaken() -> Vec<LoggedStep> {
        let logged = |step: u64| {
            let time_s = 1e-3 * step as f64;
            let x = 0.02 * (std::f64::consts::TAU * SHAKES_HZ * (time_s - 0.3)).sin();
            let hands = SIDES.map(|(_, side)| (DVec3::X * (side + x), DVec3::ZERO)).to_vec();
            LoggedStep {
                step,
                time_s,
                centre: DVec3::ZERO,
                hands,
                support: DVec3::ZERO,
                energy: EnergyLedger::default(),
            }
        };
        (1..=4000).map(logged).collect()
    }

    #[test]
    fn the_last_whole_period_begins_on_the_way_through_the_middle() {
        let steps = shaken();
        let begin = last_period(&steps, 3.4).expect("it is shaken");
        assert!((steps[begin].time_s - 2.8).abs() <= 1.001e-3, "{}", steps[begin].time_s);
        assert_eq!(last_period(&steps, 0.2), None);
    }

    #[test]
    fn pictures_of_a_period_are_evenly_apart() {
        let steps = shaken();
        let begin = last_period(&steps, 3.4).expect("it is shaken");
        let instants = instants(&steps, begin);
        assert_eq!(instants.len(), PICTURES);
        assert!(instants.windows(2).all(|pair| matches!(pair[1].0 - pair[0].0, 62 | 63)), "{instants:?}");
        assert_eq!(instants[2].1, "125 ms: 20 mm to the right");
    }
}
