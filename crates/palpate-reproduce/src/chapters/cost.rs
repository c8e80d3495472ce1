//! The cost of direct convolution, against section 2.5 of the paper.

use crate::bodies::{cube, table_in_memory};
use crate::chapter::{Chapter, csv};
use crate::chart::{Axis, Chart, Scale, Series, Style};
use crate::error::ReproduceError;
use crate::findings::Finding;
use crate::options::Effort;
use crate::page::{Section, figure, paragraph};
use crate::progress::StageProgress;
use glam::DVec3;
use palpate::{
    DeviceInput, DeviceMode, DeviceParameters, Grasp, Input, Model, ModelObject, ModelParameters,
    ObjectStart, Pose, Recording, ResponseForm, State, SurfacePoint, Twist, step,
};
use palpate_fem::{RecordedBody, SilentProgress};
use palpate_haptics::percentile_us;
use std::sync::Arc;
use std::time::Instant;

/// One measured configuration.
#[derive(Debug, Clone, Copy)]
struct Cost {
    /// Observed degrees of freedom n.
    pub observed: usize,
    /// Degrees of freedom in contact, n_c.
    pub contact: usize,
    /// Samples T.
    pub samples: usize,
    /// Time of a step [µs]: the force, with motion and everything.
    pub force_p50_us: f64,
    /// 99th percentile.
    pub force_p99_us: f64,
    /// Time for the displacement of the whole surface [µs], median.
    pub deformation_us: f64,
    /// Size of the columns in use [bytes], in double precision.
    pub table_bytes: usize,
}

const STEP_S: f64 = 1e-3;
const USUAL_SAMPLES: usize = 500;
const USUAL_POINTS: usize = 2;

/// Modes of the bodies: few, for the numbers in the table do not change its cost.
const MODES: usize = 60;

/// Surface nodes spread over the body, each as a point of one of its triangles.
fn points(recording: &Recording, count: usize) -> Vec<SurfacePoint> {
    let surface = &recording.surface;
    let nodes = surface.positions.len();
    let at_node = |node: usize| {
        let triangle = surface.triangles.iter().position(|t| t.contains(&(node as u32)))?;
        let weights = surface.triangles[triangle].map(|corner| f64::from(u8::from(corner as usize == node)));
        Some(SurfacePoint { triangle: triangle as u32, weights })
    };
    (0..count).filter_map(|k| at_node((2 * k + 1) * nodes / (2 * count))).collect()
}

/// Measures one configuration, with all devices in motion and a full history.
fn measure(body: &RecordedBody, held: usize, samples: usize, steps: usize) -> Result<Cost, ReproduceError> {
    let recording = Arc::new(body.recording.clone());
    let surface_nodes = body.surface_nodes();
    let held = points(&recording, held);
    let mut touchable: Vec<u32> = held
        .iter()
        .flat_map(|point| recording.surface.corners(point))
        .filter(|(_, weight)| *weight > 0.0)
        .map(|(node, _)| surface_nodes[node])
        .collect();
    touchable.sort_unstable();
    touchable.dedup();
    let table = table_in_memory(body, STEP_S, samples, touchable, |value| value)?;
    let table_bytes = 8 * table.touchable_dofs.len() * table.columns.column_length();
    let observed = table.observed_dofs.len();
    let start = ObjectStart { pose: Pose::IDENTITY, twist: Twist::ZERO };
    let object = ModelObject {
        response: ResponseForm::Fir(Arc::new(table)),
        ..ModelObject::new(recording.clone(), start)
    };
    let parameters = ModelParameters {
        devices: vec![DeviceParameters::default(); held.len()],
        ..ModelParameters::for_reference()
    };
    let model = Model::new(parameters, vec![object])?;
    let mut state = State::new(&model);
    let mut times = Vec::with_capacity(steps);
    for number in 0..samples + steps {
        let t = number as f64 * STEP_S;
        let sway = DVec3::new((12.0 * t).sin(), 0.5 * (5.0 * t).sin(), 0.3 * (7.0 * t).sin()) * 0.01;
        let device = |point: &SurfacePoint| DeviceInput {
            position: recording.surface.rest_position(point) * 0.99 + sway,
            mode: DeviceMode::Held(Grasp { object: 0, point: *point }),
        };
        let input = Input { devices: held.iter().map(device).collect(), ..Input::default() };
        let before = Instant::now();
        let status = step(&model, &mut state, &input).status;
        if number >= samples {
            times.push(before.elapsed().as_nanos().min(u128::from(u32::MAX)) as u32);
        }
        if status.unsolved_islands + status.rejected_inputs > 0 {
            return Err(ReproduceError::Measurement(format!(
                "the cost of a step can't be measured: {status:?}"
            )));
        }
    }
    times.sort_unstable();
    let mut shape = vec![DVec3::ZERO; recording.surface.positions.len()];
    let mut shapes: Vec<u32> = (0..11)
        .map(|_| {
            let before = Instant::now();
            state.surface_displacement(&model, 0, &mut shape);
            before.elapsed().as_nanos().min(u128::from(u32::MAX)) as u32
        })
        .collect();
    shapes.sort_unstable();
    Ok(Cost {
        observed,
        contact: 3 * held.len(),
        samples,
        force_p50_us: percentile_us(&times, 0.5),
        force_p99_us: percentile_us(&times, 0.99),
        deformation_us: percentile_us(&shapes, 0.5),
        table_bytes,
    })
}

/// Slope of a line through points on logarithmic axes: the power that y grows with.
fn power(points: &[(f64, f64)]) -> f64 {
    let logs: Vec<(f64, f64)> = points.iter().map(|(x, y)| (x.ln(), y.ln())).collect();
    let n = logs.len() as f64;
    let mean = |of: fn(&(f64, f64)) -> f64| logs.iter().map(of).sum::<f64>() / n;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let (mut above, mut below) = (0.0, 0.0);
    for (a, b) in logs {
        above += (a - x) * (b - y);
        below += (a - x) * (a - x);
    }
    above / below
}

/// The curves of the report.
pub fn chapter(effort: Effort, progress: &mut dyn StageProgress) -> Result<Chapter, ReproduceError> {
    let cells = [4, 6, 8, 12, 16];
    let (contacts, windows) = ([1, 2, 4, 8, 16], [125, 250, 500, 1000, 2000]);
    progress.begin("cost of direct convolution", (cells.len() + contacts.len() + windows.len()) as u64);
    let mut all = Vec::new();
    let mut over = |body: &RecordedBody, points: usize, samples: usize| -> Result<Cost, ReproduceError> {
        let cost = measure(body, points, samples, effort.steps)?;
        progress.advance(1);
        all.push(cost);
        Ok(cost)
    };
    let mut by_nodes = Vec::new();
    for cells in cells {
        by_nodes.push(over(&cube(cells, MODES, &mut SilentProgress)?, USUAL_POINTS, USUAL_SAMPLES)?);
    }
    let usual = cube(8, MODES, &mut SilentProgress)?;
    let by_contacts = contacts.map(|points| over(&usual, points, USUAL_SAMPLES));
    let by_samples = windows.map(|samples| over(&usual, USUAL_POINTS, samples));
    let by_contacts: Vec<Cost> = by_contacts.into_iter().collect::<Result<_, _>>()?;
    let by_samples: Vec<Cost> = by_samples.into_iter().collect::<Result<_, _>>()?;
    progress.finish();

    let line = |label: &str, points: Vec<(f64, f64)>| Series {
        label: format!("{label} (power {:.2})", power(&points)),
        points,
        style: Style::LineAndMarkers,
    };
    let of = |costs: &[Cost], x: fn(&Cost) -> usize, y: fn(&Cost) -> f64| -> Vec<(f64, f64)> {
        costs.iter().map(|cost| (x(cost) as f64, y(cost))).collect()
    };
    let force: fn(&Cost) -> f64 = |cost| cost.force_p50_us;
    let deformation: fn(&Cost) -> f64 = |cost| cost.deformation_us;
    let chart = |title: &str, x: &str, series: Vec<Series>| {
        Chart {
            title: title.into(),
            x: Axis { label: x.into(), scale: Scale::Log },
            y: Axis { label: "time [µs]".into(), scale: Scale::Log },
            series,
            reference_lines: Vec::new(),
        }
        .svg()
    };
    let observed: fn(&Cost) -> usize = |cost| cost.observed;
    let contact: fn(&Cost) -> usize = |cost| cost.contact;
    let samples: fn(&Cost) -> usize = |cost| cost.samples;
    let history: fn(&Cost) -> usize = |cost| cost.contact * cost.samples;
    let html = figure(
        &chart(
            "Against the observed degrees of freedom n",
            "n",
            vec![
                line("force", of(&by_nodes, observed, force)),
                line("deformation", of(&by_nodes, observed, deformation)),
            ],
        ),
        "Two nodes held (n_c = 6), T = 500. The paper: force independent of n, deformation O(n).",
    ) + &figure(
        &chart(
            "Force against contacts and window",
            "n_c, or T/100",
            vec![
                line("against n_c, T = 500", of(&by_contacts, contact, force)),
                line(
                    "against T/100, n_c = 6",
                    of(&by_samples, samples, force).into_iter().map(|(x, y)| (x / 100.0, y)).collect(),
                ),
            ],
        ),
        "The paper: O(n_c²·T) for ũ, and O(n_c³) for the solution.",
    ) + &figure(
        &chart(
            "Deformation against n_c·T",
            "n_c·T",
            vec![
                line("n_c grows, T = 500", of(&by_contacts, history, deformation)),
                line("T grows, n_c = 6", of(&by_samples, history, deformation)),
            ],
        ),
        "The paper: O(n·n_c·T).",
    ) + &paragraph(&format!(
        "Median step times over {} steps with a full history, cubes of linear elements, one thread; a step holds the fixed cost of \
         about a microsecond for motion and energies as well, so powers at the small end are below the paper's. The table is \
         n·n_touch·T numbers: {:.1} MB for the six columns in use with n = {} and T = 500 in double precision; the history adds \
         {:.0} kB per point in contact. The numbers are in cost.csv.",
        effort.steps,
        by_nodes[3].table_bytes as f64 / 1e6,
        by_nodes[3].observed,
        // Forces, written twice, and the copied series with two sources.
        (2 * 24 * USUAL_SAMPLES + 2 * 72 * USUAL_SAMPLES) as f64 / 1e3
    ));
    let rows = all.into_iter().map(|cost| {
        vec![
            cost.observed as f64,
            cost.contact as f64,
            cost.samples as f64,
            cost.force_p50_us,
            cost.force_p99_us,
            cost.deformation_us,
            cost.table_bytes as f64,
        ]
    });
    let data = csv(
        "cost.csv",
        "observed_dofs,contact_dofs,samples,force_p50_us,force_p99_us,deformation_p50_us,table_bytes",
        rows,
    );
    let finding = |what: &str, paper: &str, ours: String| Finding {
        what: what.into(),
        place: "section 2.5",
        paper: paper.into(),
        ours,
        section: "cost",
    };
    // Times and no powers: what else the machine does bends a curve, and the table has no room to tell.
    let ends = |costs: &[Cost], name: &str, x: fn(&Cost) -> usize, y: fn(&Cost) -> f64| {
        let at = |cost: &Cost| format!("{:.1} µs at {name} = {}", y(cost), x(cost));
        let (first, last) = (costs.first().map(at), costs.last().map(at));
        format!("{}, {}", first.unwrap_or_default(), last.unwrap_or_default())
    };
    let findings = vec![
        finding(
            "a force, as the observed degrees of freedom n grow",
            "does not depend on n",
            ends(&by_nodes, "n", observed, force),
        ),
        finding("a force, as the window T grows", "O(n_c²·T)", ends(&by_samples, "T", samples, force)),
        finding("the deformation, as n grows", "O(n·n_c·T)", ends(&by_nodes, "n", observed, deformation)),
        finding(
            "the deformation, as the window T grows",
            "O(n·n_c·T)",
            ends(&by_samples, "T", samples, deformation),
        ),
    ];
    let section =
        Section { id: "cost".into(), heading: "Cost (section 2.5 of the paper)".into(), body: html };
    Ok(Chapter { section, data: vec![data], findings })
}
