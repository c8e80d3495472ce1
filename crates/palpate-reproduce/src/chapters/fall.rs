//! Figure 5(a): the cube falls on a floor and bounces.

use super::fall_story::{HALF_M, STEP_S, Story, height};
use super::forms::{Form, paper_cycle, record_table};
use crate::bodies::damped_cube;
use crate::chapter::{Chapter, csv};
use crate::chart::{Axis, AxisName, Chart, ReferenceLine, Scale, Series, Style};
use crate::error::ReproduceError;
use crate::findings::Finding;
use crate::image_series::{ImageRenderer, ImageSeries};
use crate::log_steps::{
    LoggedStep, cycle_times_us, logged_steps, longest_again_us, stalls, unaccounted_energy,
};
use crate::options::Options;
use crate::page::{Section, code, figure, paragraph, table};
use crate::powers::power_of_ten;
use crate::processes::{number, report, start};
use crate::progress::StageProgress;
use crate::statements::Statement;
use crate::verdict::quantity;
use palpate::{Damping, State, step};
use palpate_export::write_atomically;
use palpate_fem::RecordedBody;
use palpate_scene::{RunMode, WithoutRemarks, read_scene};
use palpate_verify::{UNREDUCED_REBOUND_M, UnreducedFallRow, unreduced_fall};
use palpate_viewer::CameraView;
use serde_json::Value;

/// A run of the fall: form of the response, and cells along a side of the cube.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Fall {
    form: Form,
    cells: u32,
}

/// Cells of a cube whose face has few enough nodes for its table to keep up.
const FEW_CELLS: u32 = 4;

/// The runs: the figure's first, and the same on the table; with few cells too.
fn falls(cells: u32) -> Vec<Fall> {
    let mut falls = vec![Fall { form: Form::Modal, cells }, Fall { form: Form::Table, cells }];
    if cells > FEW_CELLS {
        falls.push(Fall { form: Form::Table, cells: FEW_CELLS });
    }
    falls
}

impl Fall {
    /// Name of its recording and table, without ending.
    fn recording(self) -> String {
        format!("falling-{}", self.cells)
    }

    fn scene_name(self) -> String {
        format!("fall-{}-{}.toml", self.form.word(), self.cells)
    }

    /// Name of its log; the figure's is that of the modal form.
    fn log_name(self) -> String {
        match self.form {
            Form::Modal => LOG_NAME.into(),
            Form::Table => self.scene_name().replace(".toml", ".mcap"),
        }
    }

    /// Nodes of a face, all of which touch the floor.
    fn nodes(self) -> u32 {
        (self.cells + 1) * (self.cells + 1)
    }

    fn name(self) -> String {
        format!("{}, {:.0} Hz, {} nodes of a face", self.form.name(), 1.0 / STEP_S, self.nodes())
    }

    /// Simulated time of the run [s]: less on a table, whose steps may be late.
    fn seconds(self) -> f64 {
        match self.form {
            Form::Modal => SECONDS,
            Form::Table => TABLE_SECONDS,
        }
    }

    /// The scene; the paper's step, no friction as in the solution with all modes.
    fn scene(self) -> String {
        let object = self.form.object(&self.recording());
        format!(
            "step = 0.002\ngravity = [0.0, -9.81, 0.0]\n{object}position = [0.0, 0.1, 0.0]\n\n[[plane]]\nname = \"floor\"\npoint = [0.0, 0.0, 0.0]\nnormal = [0.0, 1.0, 0.0]\n\
             friction = 0.0\n"
        )
    }
}
const LOG_NAME: &str = "figure5a.mcap";

const G: f64 = 9.81;
/// Height of the fall [m].
const DROP_M: f64 = 0.05;

/// The damping of the solution with all modes: less than that of the other chapters, and the paper tells none.
const DAMPING: Damping = Damping::Rayleigh { alpha: 0.0, beta: 1e-4 };
/// Damping as `palpate record` takes it.
const DAMPING_ARGUMENT: &str = "0,1e-4";

/// Modes of the modal form, and of the closed form of the table.
const MODES: usize = 200;

const SECONDS: f64 = 5.0;
const TABLE_SECONDS: f64 = 2.0;
/// Time of the paper's cycle [ms].
const CYCLE_MS: f64 = 2.0;
/// Time that the curves show [s].
const DRAWN_S: f64 = 1.0;
const CAMERA: CameraView = CameraView { from: [0.14, 0.15, 0.40], to: [0.0, 0.068, 0.0] };

/// Rebound [m] of a scene, computed without a clock; NaN if the cube does not bounce.
fn rebound(options: &Options, fall: Fall, mode: RunMode) -> Result<f64, ReproduceError> {
    let scene = read_scene(&options.scenes().join(fall.scene_name()), mode)?;
    let mut state = State::new(&scene.model);
    let mut steps = Vec::new();
    for number in 1..=(0.5 / STEP_S) as u64 {
        let input = scene.input_at(number as f64 * STEP_S);
        let output = step(&scene.model, &mut state, &input);
        steps.push(LoggedStep::new(number, &input, output));
    }
    Ok(Story::find(&steps).map_or(f64::NAN, |story| height(&steps[story.top])))
}

/// A run in real time: its report, and times from deadlines to the ends of cycles [ms], sorted.
struct Ran {
    fall: Fall,
    report: Value,
    cycles_ms: Vec<f64>,
}

impl Ran {
    fn new(options: &Options, fall: Fall) -> Result<Self, ReproduceError> {
        let name = fall.scene_name();
        write_atomically(&options.scenes().join(&name), fall.scene().as_bytes())?;
        let (duration, log) = (fall.seconds().to_string(), format!("../{}", fall.log_name()));
        let run = ["run", &name, "--realtime", "--duration", &duration, "--log", &log];
        let report = report(start(&options.program, &options.scenes(), &run)?)?;
        let mut cycles_ms: Vec<f64> = cycle_times_us(&options.output.join(fall.log_name()))?;
        cycles_ms.iter_mut().for_each(|cycle| *cycle *= 1e-3);
        cycles_ms.sort_by(f64::total_cmp);
        Ok(Self { fall, report, cycles_ms })
    }

    /// Time [ms] that a share of the cycles stays within.
    fn cycle_ms(&self, share: f64) -> f64 {
        let at = (share * self.cycles_ms.len() as f64).ceil() as usize;
        self.cycles_ms.get(at.max(1) - 1).copied().unwrap_or(f64::NAN)
    }

    fn force(&self, key: &str) -> Result<f64, ReproduceError> {
        number(&self.report, &format!("/force_process/{key}"))
    }

    /// Row of the table; with its longest step when it is computed again [µs].
    fn row(&self, longest_us: Option<f64>) -> Result<Vec<String>, ReproduceError> {
        let deformation = |key: &str| number(&self.report, &format!("/deformation_process/{key}"));
        let ms = |key: &str| Ok::<f64, ReproduceError>(1e-3 * self.force(&format!("compute_us/{key}"))?);
        Ok(vec![
            self.fall.name(),
            format!("{:.3} / {:.3} / {:.3} ms", ms("p50")?, ms("p999")?, ms("max")?),
            [0.5, 0.99, 0.999].map(|share| format!("{:.2}", self.cycle_ms(share))).join(" / ") + " ms",
            format!("{} of {}", self.force("overruns")?, self.force("cycles")?),
            longest_us.map_or_else(|| "not measured".into(), |us| format!("{:.3} ms", 1e-3 * us)),
            format!(
                "{:.1} ms, {:.0} a second",
                1e-3 * deformation("compute_us/p50")?,
                deformation("cycles")? / number(&self.report, "/wall_s")?
            ),
        ])
    }

    /// Whether 99.9 % of the cycles end within the paper's, as a sentence.
    fn keeps_up(&self) -> Result<String, ReproduceError> {
        let cycle = self.cycle_ms(0.999);
        let verb = if cycle <= CYCLE_MS { "keeps up" } else { "does not keep up" };
        Ok(format!(
            "{} {verb}: 99.9 % of the cycles end within {cycle:.2} ms, of {CYCLE_MS} ms, and 99.9 % of the forces take {:.2} ms",
            self.fall.name(),
            1e-3 * self.force("compute_us/p999")?
        ))
    }
}

/// Records what a fall needs: its body, and its table, touchable on the face below.
fn record(options: &Options, fall: Fall, body: &RecordedBody) -> Result<(), ReproduceError> {
    let recording = fall.recording();
    write_atomically(&options.scenes().join(format!("{recording}.palp")), &body.recording.to_bytes()?)?;
    if fall.form == Form::Table {
        let is_below = |node: &u32| body.nodes()[*node as usize].y < -HALF_M + 1e-9;
        let nodes: Vec<u32> = body.surface_nodes().into_iter().filter(is_below).collect();
        record_table(options, (fall.cells, &recording), DAMPING_ARGUMENT, &nodes)?;
    }
    Ok(())
}

/// The run, its pictures and its curves.
pub fn chapter(
    options: &Options,
    renderer: &ImageRenderer,
    progress: &mut dyn StageProgress,
) -> Result<Chapter, ReproduceError> {
    let body = damped_cube(options.effort.cells, MODES, DAMPING, &mut WithoutRemarks(progress))?;
    let falls = falls(options.effort.cells);
    progress.begin("a fall, live (figure 5a)", falls.len() as u64);
    let log = options.output.join(LOG_NAME);
    let mut runs = Vec::new();
    for (at, &fall) in falls.iter().enumerate() {
        if fall.cells == options.effort.cells {
            record(options, fall, &body)?;
        } else {
            record(
                options,
                fall,
                &damped_cube(fall.cells, MODES, DAMPING, &mut WithoutRemarks(&mut *progress))?,
            )?;
        }
        runs.push(Ran::new(options, fall)?);
        progress.advance(at as u64 + 1);
    }
    let every_node_m = rebound(options, falls[0], RunMode::Reference)?;
    let on_table_m = rebound(options, falls[1], RunMode::RealTime)?;
    progress.finish();
    let steps = logged_steps(&log)?;
    let mut rows = vec![paper_cycle(6)];
    for ran in &runs {
        // A table is not in its log, so that its steps can't be computed again from it alone.
        rows.push(ran.row((ran.fall.form == Form::Modal).then(|| longest_again_us(&steps)))?);
    }
    let story = Story::find(&steps)
        .ok_or_else(|| ReproduceError::Measurement(format!("{}: the cube does not bounce", log.display())))?;
    progress.begin("pictures of figure 5a", 1);
    let pictures = renderer.images(&ImageSeries {
        log: &log,
        folder: &options.output.join("figure5a"),
        camera: CAMERA,
        instants: &story.instants(&steps),
        caption: "The paper's figure 5(a), drawn from the log of the run, true to scale: colours tell how far the surface is from its place in the undeformed cube, \
                  arrows are the forces of the floor.",
    }, progress);
    progress.finish();

    let mass = body.recording.mass();
    let at_start = mass * G * (HALF_M + DROP_M);
    let missing_share = unaccounted_energy(&steps, at_start) / (mass * G * DROP_M);
    let missing = power_of_ten(missing_share, 0);
    // Without a browser there are none.
    let drawn = match pictures.matches("class=\"image\"").count() {
        0 => f64::NAN,
        drawn => drawn as f64,
    };
    let rebound_m = height(&steps[story.top]);
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
        "The cube falls from {:.0} cm on a floor without friction, flat, and bounces: run in real time at the paper's 500 Hz with the deformation process beside it, in modal form, where its lower \
         face stands on few contact samples, each for the patch around it, and logged. Its centre rises again by {:.1} mm of {:.0}; with every node of the face as a contact it \
         is {:.1} mm{full}. The damping is β = 10⁻⁴ s alone, that of the solution it is compared with. The paper shows images and no heights.",
        100.0 * DROP_M,
        1e3 * rebound_m,
        1e3 * DROP_M,
        1e3 * every_node_m,
    ));
    let head = [
        "",
        "force: median / 99.9 % / most",
        "cycle: median / 99 % / 99.9 %",
        "late cycles",
        "longest step again",
        "deformation",
    ];
    html += &table(
        "The force process while the cube falls, bounces and lies; columns as in the table of the two devices",
        &head,
        &rows,
    );
    let all = runs.iter().map(Ran::keeps_up).collect::<Result<Vec<String>, _>>()?;
    html += &paragraph(&format!(
        "On R[s] all nodes of the face are loaded for a second after each contact, and each of them answers each: {} pairs, T = 500. {}. A cycle that is late delays the others; the steps are those of the \
         scene all the same. The rebound on R[s] is {:.1} mm, computed without a clock.",
        falls[1].nodes() * falls[1].nodes(),
        all[1..].join(". "),
        1e3 * on_table_m,
    ));
    html += &pictures;
    html += &figure(
        &heights(&steps, is_papers).svg(),
        "Height of the centre; zero is where it is when the cube stands undeformed, what it sinks below is deformation.",
    );
    html += &figure(
        &forces(&steps, is_papers, mass * G).svg(),
        &format!(
            "Force of the floor. The flat face is stopped within one step, by {blow:.1} N here; that is a blow, and half as large at half the rate. What the rest of the cube \
             then pushes with is {push:.1} N at most, {:.1} times the weight.",
            push / (mass * G)
        ),
    );
    html += &figure(
        &energies(&steps, mass).svg(),
        &format!(
            "Energy of the fall. Nothing is missing: stored energy and losses add up to what the cube had at the start, to {missing} of the fall's energy over all {} steps.",
            steps.len()
        ),
    );
    html += &code(&format!(
        "palpate run scenes/{} --realtime --duration {SECONDS} --log {LOG_NAME}\npalpate serve {LOG_NAME}\npalpate replay {LOG_NAME}",
        falls[0].scene_name()
    ));
    let all_modes = if is_papers {
        format!(" ({:.1} mm with all modes of the mesh)", 1e3 * UNREDUCED_REBOUND_M)
    } else {
        String::new()
    };
    let findings = vec![
        Finding::measured(
            Statement::PicturesFromLog,
            quantity("pictures", drawn, "").equals(story.instants(&steps).len() as f64),
            format!("so are these: the log of {} steps was computed again bit for bit for them", steps.len()),
        ),
        Finding::measured(
            Statement::Figure5a,
            quantity("energy missing", missing_share, "of the fall's")
                .at_most(1e-9)
                .and(
                    quantity(
                        "rebound on R[s], apart from the modal form's",
                        100.0 * (on_table_m / rebound_m - 1.0).abs(),
                        "%",
                    )
                    .at_most(5.0),
                )
                .and(quantity("cycle on R[s], 99.9 %", runs[1].cycle_ms(0.999), "ms").at_most(CYCLE_MS)),
            format!(
                "modal form: rebound {:.1} mm of {:.0}{all_modes}; the floor pushes with {push:.1} N after the blow; no energy missing to {missing}; on R[s] {:.1} mm. {}",
                1e3 * rebound_m,
                1e3 * DROP_M,
                1e3 * on_table_m,
                all.join("; "),
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
            m.lateness_us,
            m.compute_us,
            m.again_us,
        ]
    });
    let data = csv(
        "figure5a.csv",
        "t,height_m,floor_n,kinetic_j,elastic_j,potential_j,lost_j,defect_j,late_us,compute_us,again_us",
        rows,
    );
    let section = Section {
        id: "fall".into(),
        heading: "The cube falls and bounces (the paper's figure 5(a))".into(),
        body: html,
    };
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
    series
        .push(stalls(steps.iter().take_while(|logged| logged.time_s <= DRAWN_S), |logged| logged.support.y));
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
