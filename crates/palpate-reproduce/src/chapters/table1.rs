//! Figure 1 and table 1: the model, its size, and what recording a column costs.

use crate::bodies::surface_mesh;
use crate::chapter::{Chapter, csv};
use crate::error::ReproduceError;
use crate::findings::Finding;
use crate::machine::Machine;
use crate::options::Effort;
use crate::page::{Section, code, figure, paragraph, table};
use crate::progress::StageProgress;
use crate::statements::Statement;
use crate::surface_picture::{Frame, Picture, View};
use crate::verdict::{Verdict, quantity};
use palpate::Sampling;
use palpate_fem::RecordedBody;
use palpate_fem::table::{COLUMN_BLOCK, TableMethod, TableParameters, TableRecorder};
use std::time::Instant;

/// The paper's sampling: 500 samples in 1 s; a tenth of them is timed, since every sample costs the same.
const SAMPLES: usize = 500;
const TIMED: usize = 50;
const STEP_S: f64 = 2e-3;

/// The paper's time for a degree of freedom [s].
const PAPER_COLUMN_S: f64 = 92.8;

/// Table 1 with our figures beside the paper's.
pub fn chapter(
    body: &RecordedBody,
    effort: Effort,
    machine: &Machine,
    progress: &mut dyn StageProgress,
) -> Result<Chapter, ReproduceError> {
    let surface = body.surface_nodes();
    let ways = [
        ("closed form, 200 modes and residual", TableMethod::ClosedForm, Sampling::End),
        ("time integration, the paper's sampling", TableMethod::Transient { substeps: 1 }, Sampling::Mean),
        ("time integration, end of step", TableMethod::Transient { substeps: 1 }, Sampling::End),
    ];
    let (mut seconds, mut ranges) = (Vec::new(), Vec::new());
    for (_, method, sampling) in ways {
        let parameters = TableParameters {
            step_s: STEP_S,
            samples: TIMED,
            sampling,
            method,
            touchable_nodes: surface.clone(),
            observed_nodes: surface.clone(),
        };
        let recorder = TableRecorder::new(body, &parameters)?;
        let columns = effort.columns.min(3 * surface.len());
        progress.begin("timing a column", columns as u64);
        let counter = progress.counter();
        // In two halves, whose times tell what they are uncertain by.
        let (middle, counted) = (columns.div_ceil(2), |done| counter(done));
        let mut halves = Vec::new();
        for range in [0..middle, middle..columns].into_iter().filter(|range| !range.is_empty()) {
            let before = Instant::now();
            let made = recorder.columns(range, COLUMN_BLOCK, &counted);
            halves.push(before.elapsed().as_secs_f64() / made.len() as f64 * (SAMPLES / TIMED) as f64);
        }
        seconds.push(halves.iter().sum::<f64>() / halves.len() as f64);
        ranges.push(halves.iter().fold((f64::MAX, 0.0), |(l, h): (f64, f64), s| (l.min(*s), h.max(*s))));
    }
    progress.finish();

    let dofs = 3 * surface.len();
    let mebibytes = |bytes: usize| (SAMPLES * dofs * bytes) as f64 / 1_048_576.0;
    let count = |n: usize| n.to_string();
    let row = |what: &str, paper: &str, ours: String| vec![what.into(), paper.into(), ours];
    let mut rows = vec![
        row("free nodes on the surface", "866", count(surface.len())),
        row("surface triangles", "1728", count(body.surface_triangles().len())),
        row("entire nodes", "2197", count(body.nodes().len())),
        row("tetrahedral elements", "8640", count(body.element_count())),
        row("data per d.o.f., double precision [MB]", "9.9", format!("{:.1}", mebibytes(8))),
        row("data per d.o.f., single precision [MB]", "", format!("{:.1}", mebibytes(4))),
    ];
    for ((name, ..), (seconds, (low, high))) in ways.iter().zip(seconds.iter().zip(&ranges)) {
        let paper = if name.contains("paper") { "92.8" } else { "" };
        rows.push(row(
            &format!("computing a d.o.f. [s]: {name}"),
            paper,
            format!("{seconds:.3} ({low:.3}–{high:.3})"),
        ));
    }
    let hours = |seconds: f64| seconds * dofs as f64 / 3600.0;
    rows.push(row(
        "all d.o.f.s, the paper's sampling [h] (derived)",
        &format!("{:.0}", hours(PAPER_COLUMN_S)),
        format!("{:.2}", hours(seconds[1])),
    ));
    rows.push(row(
        "all d.o.f.s, double precision [GiB] (derived)",
        &format!("{:.1}", mebibytes(8) * dofs as f64 / 1024.0),
        format!("{:.1}", mebibytes(8) * dofs as f64 / 1024.0),
    ));
    let cores = machine.cores;
    let html = model_picture(body)
        + &table(
            "The paper's table 1: complexity of the model, and recording",
            &["", "paper", "palpate"],
            &rows,
        )
        + &paragraph(&format!(
            "Times are wall-clock time per column of {SAMPLES} samples of 2 ms (of which {TIMED} were timed, since each costs the same), the mean of {} columns with that of either half in brackets, on \
             {cores} cores of {}; the paper used four Itanium2 processors of 1.4 GHz. The paper's sampling integrates with steps of \
             1 ms and averages two; ours is an integrator of order 5 with five solves per step, the paper does not name its own. The paper's MB are 2²⁰ bytes.",
            effort.columns, machine.processor,
        ))
        + &paragraph(&format!(
            "Derived figures are arithmetic, not measurements. The paper states times and data per degree of freedom; for all {dofs} of the surface they are \
             {PAPER_COLUMN_S} s × {dofs} = {:.0} h, and {SAMPLES} samples × {dofs} × 8 bytes = {:.2} MiB per degree of freedom, × {dofs} = {:.1} GiB. Ours are the measured \
             time per column × {dofs}.",
            hours(PAPER_COLUMN_S),
            mebibytes(8),
            mebibytes(8) * dofs as f64 / 1024.0,
        ))
        + &code(
            "palpate record box:0.1x0.1x0.1/12x12x12 --order 1 \\\n    --young 2000 --poisson 0.49 --density 110 --rayleigh 2,2e-4 \\\n    \
             --dense cube.zarr --method transient --sampling mean \\\n    --step 0.002 --duration 1",
        );
    let section = Section {
        id: "recording".into(),
        heading: "The model and its recording (the paper's figure 1, table 1)".into(),
        body: html,
    };
    let size = format!(
        "{}, {}, {}, {}",
        surface.len(),
        body.surface_triangles().len(),
        body.nodes().len(),
        body.element_count()
    );
    let counts = [
        ("nodes of the surface", surface.len(), 866.0),
        ("triangles", body.surface_triangles().len(), 1728.0),
        ("nodes", body.nodes().len(), 2197.0),
        ("tetrahedra", body.element_count(), 8640.0),
    ];
    let [same_size, others @ ..] =
        counts.map(|(name, count, papers)| quantity(name, count as f64, "").equals(papers));
    let same_size = others.into_iter().fold(same_size, Verdict::and);
    let findings = vec![
        Finding::measured(
            Statement::Figure1,
            quantity("cells along a side", f64::from(effort.cells), "").equals(12.0),
            format!("drawn, {} cells along a side", effort.cells),
        ),
        Finding::measured(Statement::ModelSize, same_size, size),
        Finding::measured(
            Statement::ColumnTime,
            quantity("the paper's way", seconds[1], "s").at_most(PAPER_COLUMN_S),
            format!(
                "{:.3} s the paper's way, {:.4} s in closed form, on {cores} cores",
                seconds[1], seconds[0]
            ),
        ),
        Finding::measured(
            Statement::ColumnData,
            quantity("apart from 9.9 MB", (mebibytes(8) - 9.9).abs(), "MB").at_most(0.05),
            format!("{:.1} MB", mebibytes(8)),
        ),
        Finding::derived(
            Statement::WholeTable,
            quantity("whole table", hours(seconds[1]), "h").at_most(hours(PAPER_COLUMN_S)),
            format!(
                "{PAPER_COLUMN_S} s × {dofs} = {:.0} h; {:.2} MiB × {dofs} = {:.1} GiB. Ours: {:.3} s × {dofs} = {:.1} h the paper's way, {:.4} s × {dofs} = {:.0} s in closed form",
                hours(PAPER_COLUMN_S),
                mebibytes(8),
                mebibytes(8) * dofs as f64 / 1024.0,
                seconds[1],
                hours(seconds[1]),
                seconds[0],
                3600.0 * hours(seconds[0])
            ),
        ),
    ];
    let data = csv(
        "table1.csv",
        "closed_form_s_per_dof,transient_mean_s_per_dof,transient_end_s_per_dof",
        [seconds].into_iter(),
    );
    Ok(Chapter { section, data: vec![data], findings })
}

/// Figure 1: the surface with the edges of its triangles.
fn model_picture(body: &RecordedBody) -> String {
    let (positions, triangles) = surface_mesh(body);
    let view = View { azimuth_deg: 30.0, elevation_deg: 25.0 };
    let picture = Picture {
        // Not a number: grey.
        values: &vec![f64::NAN; positions.len()],
        range: (0.0, 1.0),
        view,
        frame: Frame::around(&positions, view),
        caption: "0.1 m × 0.1 m × 0.1 m".into(),
        positions: &positions,
        triangles: &triangles,
    };
    figure(
        &format!("<div class=\"mesh\">\n{}</div>\n", picture.svg()),
        "The paper's figure 1, the experimental model: each of the cells is split into five tetrahedra, alternately in two ways that mirror each other.",
    )
}
