//! Figure 5(a): the cube falls on a floor and bounces.

use crate::bodies::damped_cube;
use crate::chapter::{Chapter, csv};
use crate::chart::{Axis, AxisName, Chart, ReferenceLine, Scale, Series, Style};
use crate::error::ReproduceError;
use crate::findings::Finding;
use crate::image_series::{ImageRenderer, ImageSeries};
use crate::log_steps::{LoggedStep, logged_steps, unaccounted_energy};
use crate::options::Options;
use crate::page::{Section, code, figure, paragraph};
use crate::processes::{number, report, start};
use crate::progress::StageProgress;
use palpate::{Damping, State, step};
use palpate_export::write_atomically;
use palpate_scene::{RunMode, WithoutRemarks, read_scene};
use palpate_verify::{UNREDUCED_REBOUND_M, UnreducedFallRow, unreduced_fall};
use palpate_viewer::CameraView;

/// The scene; the paper's step, no friction as in the solution with all modes.
const SCENE: &str = "step = 0.002\ngravity = [0.0, -9.81, 0.0]\n\n[[object]]\nname = \"cube\"\nrecording = \"falling.palp\"\n\
                     position = [0.0, 0.1, 0.0]\n\n[[plane]]\nname = \"floor\"\npoint = [0.0, 0.0, 0.0]\nnormal = [0.0, 1.0, 0.0]\n\
                     friction = 0.0\n";
const SCENE_NAME: &str = "fall.toml";
const LOG_NAME: &str = "figure5a.mcap";

const STEP_S: f64 = 2e-3;
const G: f64 = 9.81;
/// Height of the fall, and of the cube's centre when it stands undeformed [m].
const DROP_M: f64 = 0.05;
const HALF_M: f64 = 0.05;

/// The damping of the solution with all modes: less than that of the other chapters, and the paper tells none.
const DAMPING: Damping = Damping::Rayleigh { alpha: 0.0, beta: 1e-4 };

const SECONDS: f64 = 5.0;
/// Largest deviation of the floor's force from its mean, as a share of it, of a cube that lies still.
const STILL: f64 = 0.1;

/// Time for which the deviation is looked at [s].
const STILL_S: f64 = 0.2;
/// Time that the curves show [s].
const DRAWN_S: f64 = 1.0;
/// Height above the floor at which a jump begins [m].
const JUMP_M: f64 = 1e-3;

const CAMERA: CameraView = CameraView { from: [0.14, 0.15, 0.40], to: [0.0, 0.068, 0.0] };

/// The instants that tell the story, as places in the steps of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Story {
    /// The first force of the floor.
    touch: usize,
    /// The lowest of the first contact.
    deepest: usize,
    /// The last force of the floor before the top.
    leaves: usize,
    /// The highest between first and second contact.
    top: usize,
    /// The lowest of the second contact.
    second: usize,
}

/// Height of the centre above that of the cube standing undeformed [m].
fn height(logged: &LoggedStep) -> f64 {
    logged.centre.y - HALF_M
}

impl Story {
    fn find(steps: &[LoggedStep]) -> Option<Self> {
        let after = |from: usize, is: &dyn Fn(&LoggedStep) -> bool| {
            steps[from..].iter().position(is).map(|found| from + found)
        };
        let lowest = |from: usize, to: usize| {
            (from..to).min_by(|&a, &b| height(&steps[a]).total_cmp(&height(&steps[b])))
        };
        let touch = after(0, &|logged| logged.support.y > 0.0)?;
        let up = after(touch + 1, &|logged| height(logged) > JUMP_M)?;
        let deepest = lowest(touch, up)?;
        let down = after(up, &|logged| height(logged) < 0.0)?;
        let top = (up..down).max_by(|&a, &b| height(&steps[a]).total_cmp(&height(&steps[b])))?;
        let leaves = (deepest..top).rev().find(|&at| steps[at].support.y > 0.0)?;
        let up_again = after(down, &|logged| height(logged) > JUMP_M).unwrap_or(steps.len());
        Some(Self { touch, deepest, leaves, top, second: lowest(down, up_again)? })
    }

    /// Steps since the start, with captions.
    fn instants(&self, steps: &[LoggedStep]) -> Vec<(u64, String)> {
        let bends = (self.touch..=self.deepest)
            .find(|&at| height(&steps[at]) < 0.5 * height(&steps[self.deepest]))
            .unwrap_or(self.deepest);
        let of = |at: usize, what: &str| {
            let logged = &steps[at];
            (logged.step, format!("{:.3} s: {what}", logged.time_s))
        };
        vec![
            (0, "0 s: let go, 5 cm above the floor".into()),
            of(self.touch.saturating_sub(1), "just before contact"),
            of(bends, "the lower face lies, the rest falls on"),
            of(self.deepest, "deepest"),
            of((self.leaves + 1).min(self.top), "leaves the floor"),
            of(self.top, &format!("top of the rebound, {:.1} mm", 1e3 * height(&steps[self.top]))),
            of(self.second, "deepest of the second contact"),
            of(
                steps.len() - 1,
                if lies_still(steps) {
                    "lies still, sagging under its weight"
                } else {
                    "on the floor, still trembling"
                },
            ),
        ]
    }
}

fn lies_still(steps: &[LoggedStep]) -> bool {
    let late = &steps[steps.len().saturating_sub((STILL_S / STEP_S) as usize)..];
    let mean = late.iter().map(|logged| logged.support.y).sum::<f64>() / late.len() as f64;
    late.iter().all(|logged| (logged.support.y - mean).abs() <= STILL * mean)
}

/// Rebound [m] of the scene with contact samples at all nodes.
fn rebound_of_every_node(options: &Options) -> Result<f64, ReproduceError> {
    let scene = read_scene(&options.scenes().join(SCENE_NAME), RunMode::Reference)?;
    let mut state = State::new(&scene.model);
    let mut steps = Vec::new();
    for number in 1..=(0.5 / STEP_S) as u64 {
        let input = scene.input_at(number as f64 * STEP_S);
        let output = step(&scene.model, &mut state, &input);
        steps.push(LoggedStep::new(number, &input, output));
    }
    Ok(Story::find(&steps).map_or(f64::NAN, |story| height(&steps[story.top])))
}

/// The run, its pictures and its curves.
pub fn chapter(
    options: &Options,
    renderer: &ImageRenderer,
    progress: &mut dyn StageProgress,
) -> Result<Chapter, ReproduceError> {
    let body = damped_cube(options.effort.cells, 200, DAMPING, &mut WithoutRemarks(progress))?;
    progress.begin("a fall, live (figure 5a)", 1);
    write_atomically(&options.scenes().join("falling.palp"), &body.recording.to_bytes()?)?;
    write_atomically(&options.scenes().join(SCENE_NAME), SCENE.as_bytes())?;
    let duration = SECONDS.to_string();
    let log = options.output.join(LOG_NAME);
    let log_from_there = format!("../{LOG_NAME}");
    let run = ["run", SCENE_NAME, "--realtime", "--duration", &duration, "--log", &log_from_there];
    let ran = report(start(&options.program, &options.scenes(), &run)?)?;
    let every_node_m = rebound_of_every_node(options)?;
    progress.finish();
    let steps = logged_steps(&log)?;
    let story = Story::find(&steps)
        .ok_or_else(|| ReproduceError::Measurement(format!("{}: the cube does not bounce", log.display())))?;
    progress.begin("pictures of figure 5a", 1);
    let pictures = renderer.images(&ImageSeries {
        log: &log,
        folder: &options.output.join("figure5a"),
        camera: CAMERA,
        instants: &story.instants(&steps),
        caption: "Figure 5(a), from the log of the run: colours tell how far the surface is from its place in the undeformed cube, \
                  arrows are the forces of the floor.",
    }, progress);
    progress.finish();

    let mass = body.recording.mass();
    let at_start = mass * G * (HALF_M + DROP_M);
    let missing = unaccounted_energy(&steps, at_start) / (mass * G * DROP_M);
    let rebound = height(&steps[story.top]);
    // A flat face that meets a floor at once is stopped within a step, whatever that is: the largest force of the first
    // steps grows with the rate.
    let blow = steps[story.touch..(story.touch + 2).min(steps.len())]
        .iter()
        .map(|m| m.support.y)
        .fold(0.0, f64::max);
    let push = steps[(story.touch + 2).min(story.leaves)..=story.leaves]
        .iter()
        .map(|m| m.support.y)
        .fold(0.0, f64::max);
    let is_papers = options.effort.cells == 12;
    let full = if is_papers {
        format!(", and with all 6585 modes of the mesh, not reduced, {:.1} mm", 1e3 * UNREDUCED_REBOUND_M)
    } else {
        String::new()
    };
    let mut html = paragraph(&format!(
        "The cube falls from {:.0} cm on a floor without friction, flat, and bounces: run in real time at the paper's 500 Hz, where its lower \
         face stands on few places (docs/contact.md), and logged. Its centre rises again by {:.1} mm of {:.0}; with every node of the face it \
         is {:.1} mm{full}. The damping is β = 10⁻⁴ s alone, that of the solution it is compared with; the paper tells none, and \
         shows pictures and no heights.",
        100.0 * DROP_M,
        1e3 * rebound,
        1e3 * DROP_M,
        1e3 * every_node_m,
    ));
    html += &pictures;
    html += &figure(
        &heights(&steps, is_papers).svg(),
        "Zero is the height of the centre when the cube stands undeformed. What it sinks below is deformation.",
    );
    html += &figure(
        &forces(&steps, is_papers, mass * G).svg(),
        &format!(
            "The flat face is stopped within one step, by {blow:.1} N here; that is a blow, and half as large at half the rate. What the rest of the cube \
             then pushes with is {push:.1} N at most, {:.1} times the weight.",
            push / (mass * G)
        ),
    );
    html += &figure(
        &energies(&steps, mass).svg(),
        &format!(
            "Nothing is missing: stored energy and losses add up to what the cube had at the start, to {missing:.0e} of the fall's energy over all {} steps.",
            steps.len()
        ),
    );
    html += &code(&format!(
        "palpate run scenes/{SCENE_NAME} --realtime --duration {SECONDS} --log {LOG_NAME}\npalpate serve {LOG_NAME}"
    ));
    let finding = |what: &str, paper: &str, ours: String| Finding {
        what: what.into(),
        place: "figure 5(a)",
        paper: paper.into(),
        ours,
        section: "fall",
    };
    let findings = vec![
        finding(
            "the cube falls on a floor and bounces",
            "pictures, no numbers",
            format!(
                "rebound {:.1} mm of {:.0}{}; the floor pushes with {push:.1} N after the blow; no energy missing to {missing:.0e}",
                1e3 * rebound,
                1e3 * DROP_M,
                if is_papers {
                    format!(" ({:.1} mm with all modes of the mesh)", 1e3 * UNREDUCED_REBOUND_M)
                } else {
                    String::new()
                },
            ),
        ),
        finding(
            "a step of the fall, in real time",
            "",
            format!(
                "{:.3} ms median, {:.3} ms in 99.9 %",
                1e-3 * number(&ran, "/force_process/compute_us/p50")?,
                1e-3 * number(&ran, "/force_process/compute_us/p999")?
            ),
        ),
    ];
    let rows = steps.iter().map(|m| {
        let e = &m.energy;
        vec![
            m.time_s,
            height(m),
            m.support.y,
            e.kinetic,
            e.elastic + e.residual,
            e.potential,
            e.lost(),
            e.defect,
        ]
    });
    let data =
        csv("figure5a.csv", "t,height_m,floor_n,kinetic_j,elastic_j,potential_j,lost_j,defect_j", rows);
    let section =
        Section { id: "fall".into(), heading: "Figure 5(a): the cube falls and bounces".into(), body: html };
    Ok(Chapter { section, data: vec![data], findings })
}

/// One curve over what is drawn.
fn curve(steps: &[LoggedStep], label: &str, of: impl Fn(&LoggedStep) -> f64) -> Series {
    let shown = steps.iter().take_while(|logged| logged.time_s <= DRAWN_S);
    Series {
        label: label.into(),
        points: shown.map(|logged| (logged.time_s, of(logged))).collect(),
        style: Style::Line,
    }
}

fn chart(title: &str, y: &str, series: Vec<Series>, reference_lines: Vec<ReferenceLine>) -> Chart {
    Chart {
        title: title.into(),
        x: Axis { label: "time [s]".into(), scale: Scale::Linear },
        y: Axis { label: y.into(), scale: Scale::Linear },
        series,
        reference_lines,
    }
}

/// The unreduced solution as a curve: a column of it, scaled.
fn unreduced(of: impl Fn(UnreducedFallRow) -> f64) -> Series {
    Series {
        label: "all 6585 modes, every node".into(),
        points: unreduced_fall().into_iter().map(|row| (row.time_s, of(row))).collect(),
        style: Style::Dashed,
    }
}

fn heights(steps: &[LoggedStep], is_papers: bool) -> Chart {
    let mut series = vec![curve(steps, "palpate, in real time", |logged| 1e3 * height(logged))];
    let mut reference_lines = Vec::new();
    if is_papers {
        series.push(unreduced(|row| 1e3 * row.height_m));
        reference_lines.push(ReferenceLine {
            axis: AxisName::Y,
            value: 1e3 * UNREDUCED_REBOUND_M,
            label: format!("{:.1} mm", 1e3 * UNREDUCED_REBOUND_M),
        });
    }
    chart(
        "Height of the centre",
        "above that of the undeformed cube on the floor [mm]",
        series,
        reference_lines,
    )
}

fn forces(steps: &[LoggedStep], is_papers: bool, weight: f64) -> Chart {
    let mut series = vec![curve(steps, "palpate, in real time", |logged| logged.support.y)];
    if is_papers {
        series.push(unreduced(|row| row.force_n));
    }
    let reference_lines =
        vec![ReferenceLine { axis: AxisName::Y, value: weight, label: format!("weight: {weight:.2} N") }];
    chart("Force of the floor", "upward [N]", series, reference_lines)
}

fn energies(steps: &[LoggedStep], mass: f64) -> Chart {
    let standing = mass * G * HALF_M;
    let series = vec![
        curve(steps, "of height", |m| 1e3 * (m.energy.potential - standing)),
        curve(steps, "of motion", |m| 1e3 * m.energy.kinetic),
        curve(steps, "of deformation", |m| 1e3 * (m.energy.elastic + m.energy.residual)),
        curve(steps, "lost", |m| 1e3 * m.energy.lost()),
        Series {
            style: Style::Dashed,
            ..curve(steps, "sum", |m| 1e3 * (m.energy.stored() - standing + m.energy.lost()))
        },
    ];
    chart("Where the energy is", "energy [mJ]", series, Vec::new())
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;
    use palpate::EnergyLedger;

    /// A ball on a spring floor, in numbers.
    fn bounce() -> Vec<LoggedStep> {
        let heights = [50, 30, 0, -10, -5, 0, 10, 24, 12, 0, -6, -3, 4, 0];
        let logged = |(at, mm): (usize, i32)| LoggedStep {
            step: at as u64 + 1,
            time_s: 0.01 * (at + 1) as f64,
            centre: DVec3::Y * (HALF_M + 1e-3 * f64::from(mm)),
            hands: Vec::new(),
            support: DVec3::Y * f64::from(u8::from(mm < 0)),
            energy: EnergyLedger::default(),
        };
        heights.into_iter().enumerate().map(logged).collect()
    }

    #[test]
    fn the_story_of_a_bounce_goes_from_touch_to_second_contact() {
        let found = Story::find(&bounce()).expect("it bounces");
        assert_eq!(found, Story { touch: 3, deepest: 3, leaves: 4, top: 7, second: 10 });
        let instants = found.instants(&bounce());
        assert!(instants.is_sorted_by_key(|(step, _)| *step), "{instants:?}");
        assert!(instants[5].1.contains("24.0 mm"), "{instants:?}");
    }

    #[test]
    fn what_never_touches_has_no_story() {
        assert_eq!(Story::find(&bounce()[..3]), None);
    }
}
