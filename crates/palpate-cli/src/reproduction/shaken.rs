//! Figure 5(b) from its log: one period as pictures, the forces on both hands, the ledger.

use super::logged::{Snapshot, missing, moments};
use super::series::{Artist, Series as Pictures};
use super::shake::{LOG_NAME, SHAKES_HZ, SIDES};
use super::{DataFile, Desk, csv};
use crate::Failure;
use crate::progress::Bars;
use crate::report::chart::{Axis, Chart, Series, Style};
use crate::report::{Scale, figure as charted};
use palpate::EnergyLedger;
use palpate_fem::progress::Progress;
use palpate_viewer::CameraView;

/// Periods in the curves, and pictures of the last of them.
const PERIODS: f64 = 3.0;
const PICTURES: usize = 8;

/// The devices leave before the run ends; what is shown ends so long before [s].
const LEAVING_S: f64 = 1.5;

const CAMERA: CameraView = CameraView { from: [0.09, 0.11, 0.33], to: [0.0, -0.008, 0.0] };

/// What the chapter takes from here.
pub struct Figure {
    /// Pictures and curves.
    pub html: String,
    /// For the table at the top.
    pub found: String,
    /// The numbers.
    pub data: DataFile,
}

/// How far the hands have gone to the right, in the mean [m].
fn sway(moment: &Snapshot) -> f64 {
    let hands = moment.hands.iter().zip(SIDES);
    hands.map(|((place, _), (_, side))| place.x - side).sum::<f64>() / moment.hands.len().max(1) as f64
}

/// Where a period of the shaking begins, on the way to the right through the middle: the last one that is whole before a
/// time [s].
fn last_period(moments: &[Snapshot], before_s: f64) -> Option<usize> {
    let period_s = 1.0 / SHAKES_HZ;
    (1..moments.len())
        .rev()
        .filter(|&at| moments[at].time_s + period_s <= before_s)
        .find(|&at| sway(&moments[at - 1]) < 0.0 && sway(&moments[at]) >= 0.0)
}

/// Steps since the start over one period, and what is to be seen.
fn instants(moments: &[Snapshot], begin: usize) -> Vec<(u64, String)> {
    let of = |k: usize| {
        let after_s = k as f64 / PICTURES as f64 / SHAKES_HZ;
        let from = &moments[begin..];
        let at = from.partition_point(|moment| moment.time_s < moments[begin].time_s + after_s - 1e-9);
        let moment = &from[at.min(from.len() - 1)];
        let ms = 1e3 * (moment.time_s - moments[begin].time_s);
        let place = match (1e3 * sway(moment)).round() {
            0.0 => "in the middle".into(),
            mm if mm < 0.0 => format!("{:.0} mm to the left", -mm),
            mm => format!("{mm:.0} mm to the right"),
        };
        (moment.step, format!("{ms:.0} ms: {place}"))
    };
    (0..PICTURES).map(of).collect()
}

/// From the log in the folder of the report.
pub fn figure(desk: &Desk, artist: &Artist, progress: &mut Bars) -> Result<Figure, Failure> {
    let log = desk.output.join(LOG_NAME);
    let moments = moments(&log)?;
    let end = moments.last().map_or(0.0, |moment| moment.time_s) - LEAVING_S;
    let begin = last_period(&moments, end)
        .ok_or_else(|| Failure(format!("{}: nobody shakes the cube", log.display())))?;
    progress.begin("pictures of figure 5b", 1);
    let mut html = artist.series(&Pictures {
        log: &log,
        folder: &desk.output.join("figure5b"),
        camera: CAMERA,
        instants: &instants(&moments, begin),
        caption: "Figure 5(b), one period of the shaking from the log of the run at 1 kHz, the camera at rest; below each where the hands are. Colours tell how far the surface is from its \
                  place in the undeformed cube, arrows are the forces on the hands.",
    });
    progress.finish();
    let last = moments[begin].time_s + 1.0 / SHAKES_HZ;
    let first = last - PERIODS / SHAKES_HZ;
    let shown: Vec<&Snapshot> =
        moments.iter().filter(|moment| moment.time_s >= first && moment.time_s <= last).collect();
    let force = |moment: &Snapshot| moment.hands.iter().map(|(_, force)| force.length()).fold(0.0, f64::max);
    let most = shown.iter().map(|moment| force(moment)).fold(0.0, f64::max);
    let turned = shown.iter().map(|moment| moment.energy.stored()).fold(0.0, f64::max);
    // It begins at rest, without load and without gravity.
    let missing = missing(&moments, 0.0) / turned;
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
            moments.len()
        ),
    );
    let rows = moments.iter().map(|moment| {
        let mut row = vec![moment.time_s];
        moment.hands.iter().for_each(|(place, force)| row.extend([place.x, force.x]));
        let e = &moment.energy;
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
        notes: Vec::new(),
    }
}

fn curve(shown: &[&Snapshot], label: &str, style: Style, of: impl Fn(&Snapshot) -> f64) -> Series {
    let points = shown.iter().map(|moment| (moment.time_s, of(moment))).collect();
    Series { label: label.into(), points, style }
}

fn forces(shown: &[&Snapshot]) -> Chart {
    let hand =
        |at: usize| move |moment: &Snapshot| moment.hands.get(at).map_or(f64::NAN, |(_, force)| force.x);
    let series = vec![
        curve(shown, "left hand", Style::Line, hand(0)),
        curve(shown, "right hand", Style::Line, hand(1)),
        curve(shown, "way of the hands [4 cm]", Style::Dashed, |moment| 25.0 * sway(moment)),
    ];
    chart("Two hands shake the cube at 2 Hz", "force on the hand along x [N]", series)
}

fn energies(shown: &[&Snapshot]) -> Chart {
    let start = shown.first().map_or_else(EnergyLedger::default, |moment| moment.energy);
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
    fn shaken() -> Vec<Snapshot> {
        let moment = |step: u64| {
            let time_s = 1e-3 * step as f64;
            let x = 0.02 * (std::f64::consts::TAU * SHAKES_HZ * (time_s - 0.3)).sin();
            let hands = SIDES.map(|(_, side)| (DVec3::X * (side + x), DVec3::ZERO)).to_vec();
            Snapshot {
                step,
                time_s,
                centre: DVec3::ZERO,
                hands,
                support: DVec3::ZERO,
                energy: EnergyLedger::default(),
            }
        };
        (1..=4000).map(moment).collect()
    }

    #[test]
    fn the_last_whole_period_begins_on_the_way_through_the_middle() {
        let moments = shaken();
        let begin = last_period(&moments, 3.4).expect("it is shaken");
        assert!((moments[begin].time_s - 2.8).abs() <= 1.001e-3, "{}", moments[begin].time_s);
        assert_eq!(last_period(&moments, 0.2), None);
    }

    #[test]
    fn pictures_of_a_period_are_evenly_apart() {
        let moments = shaken();
        let begin = last_period(&moments, 3.4).expect("it is shaken");
        let instants = instants(&moments, begin);
        assert_eq!(instants.len(), PICTURES);
        assert!(instants.windows(2).all(|pair| matches!(pair[1].0 - pair[0].0, 62 | 63)), "{instants:?}");
        assert_eq!(instants[2].1, "125 ms: 20 mm to the right");
    }
}
